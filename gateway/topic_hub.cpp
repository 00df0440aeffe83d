#include "gateway/topic_hub.hpp"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <utility>

#include "gateway/publisher.hpp"
#include "gateway/sample_queue.hpp"
#include "gateway/topic_tally.hpp"

namespace exemplar::gateway {
namespace {

/// Of a transient local topic, the last sample is kept of at most this many writers.
constexpr std::size_t kMostKept = 64;
constexpr const char* kStatusType = "exemplar::ircp::v1::Status";

/// `pattern` with * for any text. Goes back to the last star only: the time is bounded by the
/// product of the lengths.
bool Matches(std::string_view text, std::string_view pattern) {
  std::size_t t = 0;
  std::size_t p = 0;
  std::size_t star = std::string_view::npos;
  std::size_t star_text = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      star_text = t;
    } else if (p < pattern.size() && pattern[p] == text[t]) {
      ++p;
      ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++star_text;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

using QueuePtr = std::shared_ptr<SampleQueue>;  ///< shared by a subscription and its topics
using Queues = std::vector<QueuePtr>;

struct TopicEntry {
  ircp::RawTopic topic;
  TopicTally tally;
  /// Who gets its samples; replaced as a whole, so that a delivery needs no copy.
  std::shared_ptr<const Queues> queues = std::make_shared<const Queues>();
  std::map<std::string, SamplePtr> kept;  ///< by writer, of a transient local topic
};

class Hub final : public TopicHub {
 public:
  Hub(ircp::RawOutlet& outlet, const Clock& clock, TopicHubOptions options)
      : clock_(clock), options_(std::move(options)), publisher_(outlet, clock, options_) {}
  ~Hub() override { tap_.reset(); }

  Status Start(ircp::RawBus& bus) {
    auto tap =
        bus.MakeTap({.wanted =
                         [this](const ircp::RawTopic& topic) {
                           Discover(topic);
                           return true;
                         },
                     .on_sample = [this](ircp::RawSample&& sample) { Add(std::move(sample)); },
                     .observer = true});
    if (!tap) return tap.error();
    tap_ = std::move(*tap);
    return {};
  }

  std::vector<api::TopicInfo> topics() const override {
    std::vector<api::TopicInfo> all;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [name, entry] : topics_) all.push_back(Describe(entry));
    }
    for (api::TopicInfo& info : all) info.writers = tap_->matched_writers(info.topic);
    return all;
  }

  std::optional<api::TopicInfo> Find(const std::string& topic) const override {
    std::optional<api::TopicInfo> info;
    {
      const std::lock_guard lock(mutex_);
      const auto found = topics_.find(topic);
      if (found == topics_.end()) return std::nullopt;
      info = Describe(found->second);
    }
    info->writers = tap_->matched_writers(topic);
    return info;
  }

  std::uint64_t revision() const override { return revision_.load(); }

  std::shared_ptr<void> OnTopic(std::function<void(const api::TopicInfo&)> on_topic) override {
    auto listener = std::make_shared<Listener>();
    listener->on_topic = std::move(on_topic);
    const std::lock_guard lock(mutex_);
    listeners_.push_back(listener);
    // Whoever drops the handle waits for a call that is under way.
    return std::shared_ptr<void>(listener.get(), [listener](void*) {
      const std::lock_guard ended(listener->mutex);
      listener->on_topic = nullptr;
    });
  }

  Result<std::unique_ptr<Subscription>> Subscribe(SubscriptionOptions options) override {
    auto queue = std::make_shared<SampleQueue>(std::move(options));
    const std::lock_guard lock(mutex_);
    if (queues_.size() >= options_.max_subscriptions) {
      return Error{ErrorCode::kResourceExhausted,
                   "there are " + std::to_string(queues_.size()) +
                       " subscriptions, the most that this gateway takes"};
    }
    queues_.push_back(queue);
    for (auto& [name, entry] : topics_) {
      if (!MatchesTopic(name, queue->options().topics)) continue;
      Join(entry, queue);
      if (!queue->options().last) continue;
      for (const auto& [writer, sample] : entry.kept) queue->Push(sample, clock_.Steady());
    }
    return std::unique_ptr<Subscription>(std::make_unique<Held>(*this, std::move(queue)));
  }

  Status Publish(const api::TopicPublication& publication) override {
    std::optional<ircp::RawTopic> discovered;
    {
      const std::lock_guard lock(mutex_);
      const auto found = topics_.find(publication.topic);
      if (found != topics_.end()) discovered = found->second.topic;
    }
    Status published = publisher_.Publish(publication, discovered ? &*discovered : nullptr);
    ++(published.ok() ? published_ : refused_);
    return published;
  }

  Figures figures() const override {
    Figures figures;
    figures.received = received_.load();
    figures.delivered = delivered_.load();
    figures.published = published_.load();
    figures.refused = refused_.load();
    const std::lock_guard lock(mutex_);
    figures.missed = missed_by_gone_;
    for (const QueuePtr& queue : queues_) figures.missed += queue->missed();
    figures.subscriptions = static_cast<int>(queues_.size());
    return figures;
  }

 private:
  struct Listener {
    std::recursive_mutex mutex;  ///< held during the call, which may end it
    std::function<void(const api::TopicInfo&)> on_topic;
  };

  class Held final : public Subscription {
   public:
    Held(Hub& hub, QueuePtr queue) : hub_(hub), queue_(std::move(queue)) {}
    ~Held() override { hub_.End(queue_); }
    std::size_t Take(std::vector<SamplePtr>& samples, std::size_t most) override {
      return queue_->Take(samples, most);
    }
    std::size_t WaitAndTake(std::vector<SamplePtr>& samples, std::size_t most,
                            std::stop_token stop) override {
      return queue_->WaitAndTake(samples, most, stop);
    }
    std::uint64_t missed() const override { return queue_->missed(); }

   private:
    Hub& hub_;
    const QueuePtr queue_;
  };

  void Discover(const ircp::RawTopic& topic) {
    std::vector<std::shared_ptr<Listener>> listeners;
    api::TopicInfo info;
    {
      const std::lock_guard lock(mutex_);
      const auto [found, is_new] = topics_.try_emplace(topic.topic);
      TopicEntry& entry = found->second;
      if (!is_new && (topic.schema.empty() || !entry.topic.schema.empty())) return;
      entry.topic = topic;
      entry.tally.SetType(topic);
      if (is_new) {
        for (const QueuePtr& queue : queues_) {
          if (MatchesTopic(topic.topic, queue->options().topics)) Join(entry, queue);
        }
      }
      ++revision_;
      info = Describe(entry);
      std::erase_if(listeners_, [](const auto& weak) { return weak.expired(); });
      for (const auto& weak : listeners_) {
        if (auto listener = weak.lock()) listeners.push_back(std::move(listener));
      }
    }
    for (const auto& listener : listeners) {
      const std::lock_guard told(listener->mutex);
      if (listener->on_topic) listener->on_topic(info);
    }
  }

  void Add(ircp::RawSample&& arrived) {
    const Duration now = clock_.Steady();
    const auto sample = std::make_shared<const ircp::RawSample>(std::move(arrived));
    std::shared_ptr<const Queues> queues;
    bool is_status = false;
    {
      const std::lock_guard lock(mutex_);
      const auto found = topics_.find(sample->topic);
      if (found == topics_.end()) return;
      TopicEntry& entry = found->second;
      is_status = entry.topic.type == kStatusType;
      entry.tally.Add(*sample, now);
      if (!sample->valid) return;
      if (entry.topic.transient_local) {
        if (entry.kept.size() >= kMostKept && entry.kept.count(sample->writer) == 0) {
          entry.kept.clear();
        }
        entry.kept[sample->writer] = sample;
      }
      queues = entry.queues;
    }
    received_.fetch_add(1, std::memory_order_relaxed);
    if (is_status) CountAnnounced(*sample, now);
    for (const QueuePtr& queue : *queues) {
      if (queue->Push(sample, now)) delivered_.fetch_add(1, std::memory_order_relaxed);
    }
  }

  void CountAnnounced(const ircp::RawSample& sample, Duration now) {
    if (!options_.decode_status) return;
    const Result<ircp::StatusSample> status = options_.decode_status(sample.cdr);
    if (!status) return;
    const std::lock_guard lock(mutex_);
    for (const ircp::TopicCount& count : status->sent) {
      const auto found = topics_.find(count.topic);
      if (found == topics_.end()) continue;
      found->second.tally.AddAnnounced(sample.writer, count.source, count.sent, now);
    }
  }

  void End(const QueuePtr& queue) {
    {
      const std::lock_guard lock(mutex_);
      missed_by_gone_ += queue->missed();
      std::erase(queues_, queue);
      for (auto& [name, entry] : topics_) {
        if (std::find(entry.queues->begin(), entry.queues->end(), queue) == entry.queues->end()) {
          continue;
        }
        Queues left = *entry.queues;
        std::erase(left, queue);
        entry.queues = std::make_shared<const Queues>(std::move(left));
      }
    }
    queue->Close();
  }

  static void Join(TopicEntry& entry, const QueuePtr& queue) {
    Queues all = *entry.queues;
    all.push_back(queue);
    entry.queues = std::make_shared<const Queues>(std::move(all));
  }

  api::TopicInfo Describe(const TopicEntry& entry) const {
    api::TopicInfo info;
    info.topic = entry.topic.topic;
    info.type = entry.topic.type;
    info.schema = entry.topic.schema;
    info.keyed = entry.topic.keyed;
    info.reliable = entry.topic.reliable;
    info.transient_local = entry.topic.transient_local;
    info.subscriptions = static_cast<int>(entry.queues->size());
    info.may_publish = publisher_.MayPublish(entry.topic.topic);
    entry.tally.Describe(info, clock_.Steady());
    return info;
  }

  const Clock& clock_;
  const TopicHubOptions options_;
  Publisher publisher_;
  std::atomic<std::uint64_t> revision_{0};
  std::atomic<std::uint64_t> received_{0};
  std::atomic<std::uint64_t> delivered_{0};
  std::atomic<std::uint64_t> published_{0};
  std::atomic<std::uint64_t> refused_{0};

  mutable std::mutex mutex_;  ///< guards the four below
  std::map<std::string, TopicEntry> topics_;
  Queues queues_;
  std::vector<std::weak_ptr<Listener>> listeners_;
  std::uint64_t missed_by_gone_ = 0;

  std::unique_ptr<ircp::RawTap> tap_;  ///< calls us: made last, ends first
};

}  // namespace

bool MatchesTopic(const std::string& topic, const std::vector<std::string>& patterns) {
  return patterns.empty() ||
         std::any_of(patterns.begin(), patterns.end(),
                     [&](const auto& pattern) { return Matches(topic, pattern); });
}

Result<std::unique_ptr<TopicHub>> TopicHub::Create(ircp::RawBus& bus, ircp::RawOutlet& outlet,
                                                   const Clock& clock, TopicHubOptions options) {
  auto hub = std::make_unique<Hub>(outlet, clock, std::move(options));
  if (const Status started = hub->Start(bus); !started) return started.error();
  return std::unique_ptr<TopicHub>(std::move(hub));
}

}  // namespace exemplar::gateway
