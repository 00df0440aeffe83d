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

  void SetInputsTaken(std::function<bool(const SentInputs&)> inputs_taken) override {
    {
      const std::lock_guard lock(asking_mutex_);
      inputs_taken_ = std::move(inputs_taken);
      is_complete_ = true;
    }
    Recheck();
  }

  void Recheck() override {
    {
      const std::lock_guard lock(mutex_);
      ++rechecks_;
    }
    settled_.notify_all();
  }

  int asleep() const override {
    const std::lock_guard lock(mutex_);
    return static_cast<int>(std::count_if(
        sleepers_.begin(), sleepers_.end(),
        [](const Sleeper& sleeper) { return sleeper.state == Sleeper::State::kAsleep; }));
  }

  bool WaitForLeader(std::stop_token stop) const override {
    std::unique_lock lock(mutex_);
    return moved_.wait(lock, stop, [this] { return has_time_; });
  }

 private:
  std::size_t IndexOfThisThread() const {
    const std::thread::id me = std::this_thread::get_id();
    const auto it = std::find_if(sleepers_.begin(), sleepers_.end(),
                                 [&](const Sleeper& sleeper) { return sleeper.thread == me; });
    if (it == sleepers_.end()) sleepers_.push_back({.thread = me});
    return static_cast<std::size_t>(it - sleepers_.begin());
  }

  /// On a thread of the network: only hands over.
  void Take(const ClockSample& sample, const Reception& from) {
    if (sample.second.nanoseconds() < 0 || sample.third.nanoseconds() < 0) return;
    {
      const std::lock_guard lock(mutex_);
      if (leader_ != from.writer) {
        leader_ = from.writer;
        leader_name_ = sample.header.source;
        offset_ = steady_ - Duration(sample.first.nanoseconds());
      }
      told_ = Duration(sample.first.nanoseconds());
      told_stamp_ = sample.header.stamp;
      told_sent_ = {static_cast<std::uint64_t>(sample.second.nanoseconds()),
                    static_cast<std::uint64_t>(sample.third.nanoseconds())};
      is_asked_ = true;
      ++rechecks_;
    }
    settled_.notify_all();
  }

  void Reply(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (settled_.wait(lock, stop, [this] { return is_asked_; })) {
      is_asked_ = false;
      const Duration told = told_;
      const Stamp stamp = told_stamp_;
      if (!WaitForInputs(lock, told_sent_, stop)) return;
      if (told != told_) continue;  // another leader, meanwhile
      MoveOn(told, stamp);
      if (!WaitForSleepers(lock, stop)) return;
      ClockSample reply;
      reply.mode = "reached";
      reply.peer = leader_name_;
      reply.first = Stamp::FromNanoseconds(told.count());
      lock.unlock();
      bool answers = options_.answers_at_once;
      {
        const std::lock_guard asking(asking_mutex_);
        answers = answers || is_complete_;
        const std::uint64_t sent = commands_sent_ ? commands_sent_() : 0;
        reply.third = Stamp::FromNanoseconds(static_cast<std::int64_t>(sent));
      }
      // The leader asks again, for one that is lost as well.
      if (answers) (void)writer_->Write(std::move(reply));
      lock.lock();
    }
  }

  /// Mutex held.
  void MoveOn(Duration told, Stamp stamp) {
    if (told + offset_ >= steady_) {
      steady_ = told + offset_;
      now_ = stamp;
    }
    has_time_ = true;
    for (Sleeper& sleeper : sleepers_) {
      if (sleeper.state != Sleeper::State::kAsleep || sleeper.deadline > steady_) continue;
      sleeper.state = Sleeper::State::kAwake;
      sleeper.woken = RealTime::now();
    }
    moved_.notify_all();
  }

  bool WaitForInputs(std::unique_lock<std::mutex>& lock, SentInputs sent,
                     const std::stop_token& stop) {
    const RealTime::time_point patient = RealTime::now() + options_.input_patience;
    while (!stop.stop_requested()) {
      const std::uint64_t asked = rechecks_;
      lock.unlock();
      bool taken = true;
      {
        const std::lock_guard asking(asking_mutex_);
        if (inputs_taken_) taken = inputs_taken_(sent);
      }
      lock.lock();
      if (taken || RealTime::now() >= patient) return true;
      settled_.wait_until(lock, stop, patient, [&] { return rechecks_ != asked; });
    }
    return false;
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
  bool has_time_ = false;
  Duration told_{0};  ///< what the leader said last
  Stamp told_stamp_;
  SentInputs told_sent_;
  bool is_asked_ = false;
  std::uint64_t rechecks_ = 0;
  std::mutex asking_mutex_;  ///< nobody is asked who has been forgotten
  std::function<std::uint64_t()> commands_sent_;
  std::function<bool(const SentInputs&)> inputs_taken_;
  bool is_complete_ = false;  ///< SetInputsTaken was called
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
