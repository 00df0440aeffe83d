#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "exemplar/ircp/simulated_time.hpp"

namespace exemplar::ircp {
namespace {

using RealTime = std::chrono::steady_clock;
constexpr std::size_t kThreadsExpected = 32;

/// A thread that has slept by this clock.
struct Sleeper {
  enum class State { kElsewhere, kAsleep, kAwake };
  std::thread::id thread;
  State state = State::kElsewhere;
  Duration deadline{0};
  RealTime::time_point woken = {};
};

class Follower final : public NetworkClock {
 public:
  explicit Follower(const NetworkClockOptions& options) : options_(options) {
    sleepers_.reserve(kThreadsExpected);
  }

  ~Follower() override {
    reader_.reset();
    replier_ = {};
  }

  Status Start(Bus& bus, const std::string& program) {
    auto writer = bus.MakeWriter<ClockSample>(program);
    if (!writer.ok()) return writer.error();
    writer_ = std::move(*writer);
    replier_ = std::jthread([this](const std::stop_token& stop) { Reply(stop); });
    auto reader =
        bus.MakeReader<ClockSample>([this](const ClockSample& sample, const Reception& from) {
          if (sample.mode == "sim") Take(sample, from);
        });
    if (!reader.ok()) return reader.error();
    reader_ = std::move(*reader);
    return {};
  }

  Stamp Now() const override {
    const std::lock_guard lock(mutex_);
    return now_;
  }

  Duration Steady() const override {
    const std::lock_guard lock(mutex_);
    return steady_;
  }

  bool SleepUntil(Duration steady, std::stop_token stop) const override {
    std::unique_lock lock(mutex_);
    const std::size_t me = IndexOfThisThread();
    if (!stop.stop_requested() && steady > steady_) {
      sleepers_[me].deadline = steady;
      sleepers_[me].state = Sleeper::State::kAsleep;
      settled_.notify_all();
      moved_.wait(lock, stop, [&] { return steady_ >= steady; });
    }
    const bool reached = steady_ >= steady && !stop.stop_requested();
    sleepers_[me].state = reached ? Sleeper::State::kAwake : Sleeper::State::kElsewhere;
    sleepers_[me].woken = RealTime::now();
    if (!reached) settled_.notify_all();
    return reached;
  }

  void SetCommandsSent(std::function<std::uint64_t()> commands_sent) override {
    const std::lock_guard lock(asking_mutex_);
    commands_sent_ = std::move(commands_sent);
  }

  int asleep() const override {
    const std::lock_guard lock(mutex_);
    return static_cast<int>(std::count_if(
        sleepers_.begin(), sleepers_.end(),
        [](const Sleeper& sleeper) { return sleeper.state == Sleeper::State::kAsleep; }));
  }

  bool WaitForLeader(std::stop_token stop) const override {
    std::unique_lock lock(mutex_);
    return moved_.wait(lock, stop, [this] { return !leader_.empty(); });
  }

 private:
  std::size_t IndexOfThisThread() const {
    const std::thread::id me = std::this_thread::get_id();
    const auto it = std::find_if(sleepers_.begin(), sleepers_.end(),
                                 [&](const Sleeper& sleeper) { return sleeper.thread == me; });
    if (it == sleepers_.end()) sleepers_.push_back({.thread = me});
    return static_cast<std::size_t>(it - sleepers_.begin());
  }

  /// On a thread of the network.
  void Take(const ClockSample& sample, const Reception& from) {
    const Duration told(sample.first.nanoseconds());
    {
      const std::lock_guard lock(mutex_);
      if (leader_ != from.writer) {
        leader_ = from.writer;
        leader_name_ = sample.header.source;
        offset_ = steady_ - told;
      }
      if (told + offset_ >= steady_) {
        steady_ = told + offset_;
        now_ = sample.header.stamp;
      }
      for (Sleeper& sleeper : sleepers_) {
        if (sleeper.state != Sleeper::State::kAsleep || sleeper.deadline > steady_) continue;
        sleeper.state = Sleeper::State::kAwake;
        sleeper.woken = RealTime::now();
      }
      told_ = told;
      is_asked_ = true;
    }
    moved_.notify_all();
    settled_.notify_all();
  }

  void Reply(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (settled_.wait(lock, stop, [this] { return is_asked_; })) {
      if (!WaitForSleepers(lock, stop)) return;
      ClockSample reply;
      reply.mode = "reached";
      reply.peer = leader_name_;
      reply.first = Stamp::FromNanoseconds(told_.count());
      is_asked_ = false;
      lock.unlock();
      {
        const std::lock_guard asking(asking_mutex_);
        const std::uint64_t sent = commands_sent_ ? commands_sent_() : 0;
        reply.third = Stamp::FromNanoseconds(static_cast<std::int64_t>(sent));
      }
      (void)writer_->Write(std::move(reply));  // the leader asks again for one that is lost
      lock.lock();
    }
  }

  bool WaitForSleepers(std::unique_lock<std::mutex>& lock, const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const RealTime::time_point now = RealTime::now();
      RealTime::time_point until = RealTime::time_point::max();
      for (Sleeper& sleeper : sleepers_) {
        if (sleeper.state != Sleeper::State::kAwake) continue;
        const RealTime::time_point patient = sleeper.woken + options_.patience;
        if (patient <= now) {
          sleeper.state = Sleeper::State::kElsewhere;
        } else {
          until = std::min(until, patient);
        }
      }
      if (until == RealTime::time_point::max()) return true;
      settled_.wait_until(lock, stop, until, [this] {
        return std::none_of(sleepers_.begin(), sleepers_.end(), [](const Sleeper& sleeper) {
          return sleeper.state == Sleeper::State::kAwake;
        });
      });
    }
    return false;
  }

  const NetworkClockOptions options_;
  mutable std::mutex mutex_;
  mutable std::condition_variable_any moved_;    ///< time went on
  mutable std::condition_variable_any settled_;  ///< a thread sleeps again, or the leader asks
  mutable std::vector<Sleeper> sleepers_;        ///< one a thread that ever slept
  std::string leader_;                           ///< its writer; empty: none was heard yet
  std::string leader_name_;
  Duration offset_{0};  ///< steady time minus the leader's
  Duration steady_{0};
  Stamp now_;
  Duration told_{0};
  bool is_asked_ = false;
  std::mutex asking_mutex_;  ///< nobody is asked who has been forgotten
  std::function<std::uint64_t()> commands_sent_;
  std::unique_ptr<Writer<ClockSample>> writer_;
  std::jthread replier_;
  std::unique_ptr<Reader> reader_;
};

}  // namespace

Result<std::unique_ptr<NetworkClock>> NetworkClock::Create(Bus& bus, const std::string& program,
                                                           const NetworkClockOptions& options) {
  auto follower = std::make_unique<Follower>(options);
  if (Status started = follower->Start(bus, program); !started.ok()) return started.error();
  return std::unique_ptr<NetworkClock>(std::move(follower));
}

}  // namespace exemplar::ircp
