#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/ircp/simulated_time.hpp"
#include "sent_counts.hpp"

namespace exemplar::ircp {
namespace {

/// Between two sayings of the same time: a follower that came later has not heard the first.
constexpr Duration kAgain = std::chrono::milliseconds(100);
/// Who does not say which one it answers.
constexpr std::uint64_t kAnySaying = std::numeric_limits<std::uint64_t>::max();

class Leader final : public TimeLeader {
 public:
  Leader(const Clock& clock, const TimeLeaderOptions& options)
      : clock_(clock), patience_(options.patience) {}

  Status Expect(const std::string& entry) {
    const std::size_t at = entry.find('@');
    const std::optional<double> from_s =
        at == std::string::npos ? 0 : ParseDouble(std::string_view(entry).substr(at + 1));
    if (at == 0 || entry.empty() || !from_s || !(*from_s >= 0)) {
      return InvalidArgument("\"" + entry + "\" is neither NAME nor NAME@SECONDS", "in-step-with");
    }
    followers_[entry.substr(0, at)].expected_from = FromSeconds(*from_s);
    return {};
  }

  Status Start(Bus& bus, const std::string& program) {
    auto writer = bus.MakeWriter<ClockSample>(program);
    if (!writer.ok()) return writer.error();
    writer_ = std::move(*writer);
    auto reader = bus.MakeReader<ClockSample>([this](const ClockSample& sample, const Reception&) {
      if (sample.mode == "reached" || sample.mode == "here" || sample.mode == "left") {
        Take(sample);
      }
    });
    if (!reader.ok()) return reader.error();
    reader_ = std::move(*reader);
    return {};
  }

  bool Lead(Duration time, Stamp stamp, const std::vector<TopicCount>& sent,
            const HasCome& has_come, std::stop_token stop) override {
    const Duration begin = clock_.Steady();
    std::vector<TopicCount> before = SentBefore(time);
    while (!stop.stop_requested()) {
      ClockSample sample;
      sample.header.stamp = stamp;
      sample.mode = "sim";
      sample.first = Stamp::FromNanoseconds(time.count());
      const auto number = [&](const char* topic, const char* source) {
        return Stamp::FromNanoseconds(static_cast<std::int64_t>(CountOf(sent, topic, source)));
      };
      sample.second = number(JointStateSample::kTopic, kRobotSource);
      sample.third = number(ObjectSample::kTopic, kTrackerSource);
      std::vector<TopicCount> counts = sent;
      counts.insert(counts.end(), before.begin(), before.end());
      sample.peer = CountsToText(counts);
      (void)writer_->Write(std::move(sample));  // said again below
      std::unique_lock lock(mutex_);
      const bool reached = changed_.wait_for(
          lock, stop, kAgain, [&] { return news_ || EverybodyReached(time, has_come); });
      if (reached && !std::exchange(news_, false)) return true;
      lock.unlock();
      before = SentBefore(time);
      lock.lock();
      if (clock_.Steady() - begin < patience_) continue;
      for (auto& [name, follower] : followers_) {
        if (!follower.in_step || HasReached(follower, time, has_come)) continue;
        follower.in_step = false;
        lost_.push_back(name);
      }
    }
    return false;
  }

  void AskAnew() override {
    const std::lock_guard lock(mutex_);
    oldest_saying_ = writer_->sent() + 1;
  }

  void Recheck() override {
    { const std::lock_guard lock(mutex_); }
    changed_.notify_all();
  }

  std::vector<std::string> TakeLost() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(lost_, {});
  }

 private:
  struct Follower {
    Duration expected_from{0};
    bool was_heard = false;  ///< until then it is waited for without end
    bool in_step = false;
    Duration reached{-1};
    std::uint64_t answered = 0;  ///< the saying's number
    std::vector<TopicCount> sent;
    std::vector<TopicCount> sent_before;  ///< when the time that is being led began
    std::vector<TopicCount> baseline;     ///< as it joined: nobody waits for what was sent before
  };

  bool HasReached(const Follower& follower, Duration time, const HasCome& has_come) const {
    if (follower.reached < time || follower.answered < oldest_saying_) return false;
    return std::all_of(follower.sent.begin(), follower.sent.end(), [&](const TopicCount& count) {
      return count.sent <= CountOf(follower.baseline, count.topic, count.source) || has_come(count);
    });
  }

  bool EverybodyReached(Duration time, const HasCome& has_come) const {
    for (const auto& [name, follower] : followers_) {
      if (follower.was_heard ? !follower.in_step : time < follower.expected_from) continue;
      if (!HasReached(follower, time, has_come)) return false;
    }
    return true;
  }

  /// What everybody had sent when `time` was first said, so that a saying that comes again says the
  /// same; of who has joined since, what it had sent then.
  std::vector<TopicCount> SentBefore(Duration time) {
    const std::lock_guard lock(mutex_);
    std::vector<TopicCount> counts;
    for (auto& [name, follower] : followers_) {
      if (time > led_) follower.sent_before = follower.sent;
      counts.insert(counts.end(), follower.sent_before.begin(), follower.sent_before.end());
    }
    led_ = time;
    return counts;
  }

  /// On a thread of the network.
  void Take(const ClockSample& reply) {
    const bool is_here = reply.mode == "here";
    {
      const std::lock_guard lock(mutex_);
      const auto it = followers_.find(reply.header.source);
      if (it == followers_.end()) return;
      Follower& follower = it->second;
      std::vector<TopicCount> sent = CountsFromText(reply.peer);
      news_ = news_ || (is_here && (!follower.in_step || sent.size() != follower.sent.size()));
      follower.sent = std::move(sent);
      if (is_here || !follower.was_heard) {
        follower.baseline = follower.sent;
        follower.sent_before = follower.sent;
      }
      follower.was_heard = true;
      follower.in_step = reply.mode != "left";
      follower.reached =
          reply.mode == "reached" ? Duration(reply.first.nanoseconds()) : Duration(-1);
      const std::int64_t number = reply.second.nanoseconds();
      follower.answered = number > 0 ? static_cast<std::uint64_t>(number) : kAnySaying;
    }
    changed_.notify_all();
  }

  const Clock& clock_;
  const Duration patience_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, Follower> followers_;  ///< by program
  std::vector<std::string> lost_;
  Duration led_{-1};
  std::uint64_t oldest_saying_ = 0;  ///< answers to those before it do not count
  bool news_ = false;  ///< somebody has joined, and is to hear at once that it is waited for
  std::unique_ptr<Writer<ClockSample>> writer_;
  std::unique_ptr<Reader> reader_;
};

}  // namespace

Result<std::unique_ptr<TimeLeader>> TimeLeader::Create(Bus& bus, const Clock& clock,
                                                       const std::string& program,
                                                       const TimeLeaderOptions& options) {
  auto leader = std::make_unique<Leader>(clock, options);
  for (const std::string& entry : options.in_step_with) {
    if (Status expected = leader->Expect(entry); !expected.ok()) return expected.error();
  }
  if (Status started = leader->Start(bus, program); !started.ok()) return started.error();
  return std::unique_ptr<TimeLeader>(std::move(leader));
}

}  // namespace exemplar::ircp
