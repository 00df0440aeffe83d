#include "gateway/topic_server.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "exemplar/dynamic_data/json.hpp"

namespace exemplar::gateway {
namespace {

/// What one client was told of its topics.
class Described {
 public:
  Described(const TopicHub& hub, bool json) : hub_(hub), json_(json) {}

  /// Adds the sample, and its topic when it is new.
  void Add(const ircp::RawSample& sample, bool cdr, api::TopicBatch& batch) {
    const Topic& topic = Find(sample.topic, batch);
    api::TopicSample& out = batch.samples.emplace_back();
    out.topic = sample.topic;
    out.writer = sample.writer;
    out.sequence = sample.sequence;
    out.source_stamp = sample.source_stamp;
    out.received = sample.received;
    if (cdr) out.cdr = sample.cdr;
    if (!json_) return;
    if (topic.type == nullptr) {
      out.json_error = topic.why;
      return;
    }
    Result<std::string> json = dynamic_data::ToJson(*topic.type, sample.cdr);
    if (json) {
      out.json = std::move(*json);
    } else {
      out.json_error = json.error().message;
    }
  }

 private:
  struct Topic {
    std::shared_ptr<const dynamic_data::Type> type;  ///< shared by its members
    std::string why;
  };

  const Topic& Find(const std::string& name, api::TopicBatch& batch) {
    if (revision_ != hub_.revision()) {
      revision_ = hub_.revision();
      // A schema may have come for those that had none.
      std::erase_if(topics_, [](const auto& entry) { return entry.second.type == nullptr; });
    }
    const auto [found, is_new] = topics_.try_emplace(name);
    Topic& topic = found->second;
    if (!is_new) return topic;
    const std::optional<api::TopicInfo> info = hub_.Find(name);
    if (!info) return topic;
    batch.topics.push_back(*info);
    if (info->schema.empty()) {
      topic.why = "no writer of the topic brought its schema";
    } else if (auto type = dynamic_data::ParseType(info->schema, info->type)) {
      topic.type = std::move(*type);
    } else {
      topic.why = type.error().message;
    }
    return topic;
  }

  const TopicHub& hub_;
  const bool json_;
  std::uint64_t revision_ = 0;
  std::unordered_map<std::string, Topic> topics_;
};

/// One of those who are served, for as long as it lives.
struct Place {
  explicit Place(std::atomic<int>& the_count) : count(the_count), number(++count) {}
  ~Place() { --count; }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  std::atomic<int>& count;
  const int number;
};

}  // namespace

Result<std::vector<api::TopicInfo>> TopicServer::List(const std::vector<std::string>& topics) {
  std::vector<api::TopicInfo> all = hub_.topics();
  std::erase_if(all, [&](const auto& info) { return !MatchesTopic(info.topic, topics); });
  return all;
}

Status TopicServer::Subscribe(const api::TopicSubscription& request,
                              const std::function<bool(const api::TopicBatch&)>& on_batch,
                              std::stop_token stop) {
  const Place place(subscriptions_);
  if (place.number > options_.subscriptions) {
    return Error{ErrorCode::kResourceExhausted,
                 "there are " + std::to_string(options_.subscriptions) +
                     " subscriptions, the most that this gateway takes"};
  }
  const int queue = request.queue == 0 ? options_.queue : std::min(request.queue, options_.queue);
  Result<std::unique_ptr<Subscription>> subscription =
      hub_.Subscribe({.topics = request.topics,
                      .max_rate_hz = request.max_rate_hz,
                      .max_samples = static_cast<std::size_t>(queue),
                      .max_bytes = options_.queue_bytes,
                      .last = request.last});
  if (!subscription) return subscription.error();
  Described described(hub_, request.json);
  std::vector<SamplePtr> samples;
  api::TopicBatch batch;
  for (;;) {
    samples.clear();
    if ((*subscription)->WaitAndTake(samples, options_.batch, stop) == 0) return {};
    for (std::size_t i = 0; i < samples.size();) {
      batch.topics.clear();
      batch.samples.clear();
      std::size_t bytes = 0;
      for (; i < samples.size() && (bytes == 0 || bytes < options_.batch_bytes); ++i) {
        described.Add(*samples[i], request.cdr, batch);
        bytes += batch.samples.back().cdr.size() + batch.samples.back().json.size() + 1;
      }
      batch.missed = (*subscription)->missed();
      if (stop.stop_requested() || !on_batch(batch)) return {};
    }
  }
}

Status TopicServer::Publish(const api::TopicPublication& publication) {
  return hub_.Publish(publication);
}

}  // namespace exemplar::gateway
