#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "exemplar/ircp/simulated_time.hpp"
#include "sent_counts.hpp"
#include "step_mail.hpp"

namespace exemplar::ircp {
namespace {

using RealTime = std::chrono::steady_clock;
constexpr std::size_t kThreadsExpected = 32;
/// The leader says its time again and again, so it hears of a new program at once.
constexpr Duration kLeaderPatience = std::chrono::seconds(2);

/// A thread that has slept by this clock.
struct Sleeper {
  enum class State { kElsewhere, kAsleep, kAwake };
  std::thread::id thread;
  State state = State::kElsewhere;
  Duration deadline{0};
  RealTime::time_point woken = {};
};

/// What the leader said.
struct Saying {
  std::uint64_t number = 0;
  Duration time{0};
  Stamp stamp;
  std::vector<TopicCount> sent;
};

class Follower final : public NetworkClock {
 public:
  explicit Follower(const NetworkClockOptions& options)
      : options_(options), is_complete_(options.is_complete) {
    sleepers_.reserve(kThreadsExpected);
  }

  ~Follower() override {
    reader_.reset();
    replier_ = {};
    if (writer_ && has_time_) Answer("left", told_, mail_.Sent());
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
    return Sleep(steady, stop, std::nullopt);
  }

  bool SleepUntilWithin(Duration steady, Duration limit) const override {
    return Sleep(steady, {}, RealTime::now() + limit);
  }

  void SetSettled(std::function<bool()> is_settled) override {
    {
      const std::lock_guard lock(asking_mutex_);
      is_settled_ = std::move(is_settled);
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

  bool Begin(Caller caller, std::stop_token stop) override {
    std::unique_lock lock(mutex_);
    is_awaited_ = false;
    is_asked_ = is_asked_ || has_time_;  // says what the program sends
    settled_.notify_all();
    const bool is_awaited =
        moved_.wait_for(lock, stop, kLeaderPatience, [this] { return is_awaited_; });
    if (caller == Caller::kSleeps) {
      const std::size_t me = IndexOfThisThread();
      sleepers_[me].state = Sleeper::State::kAwake;
      sleepers_[me].woken = RealTime::now();
    }
    is_complete_ = true;
    is_asked_ = has_time_;
    settled_.notify_all();
    return is_awaited;
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

  void Hold() const override {
    const std::lock_guard lock(mutex_);
    ++holds_;
  }

  void Release() const override {
    {
      const std::lock_guard lock(mutex_);
      --holds_;
    }
    settled_.notify_all();
  }

  StepMail& mail() override { return mail_; }

 private:
  std::size_t IndexOfThisThread() const {
    const std::thread::id me = std::this_thread::get_id();
    const auto it = std::find_if(sleepers_.begin(), sleepers_.end(),
                                 [&](const Sleeper& sleeper) { return sleeper.thread == me; });
    if (it == sleepers_.end()) sleepers_.push_back({.thread = me});
    return static_cast<std::size_t>(it - sleepers_.begin());
  }

  bool Sleep(Duration steady, const std::stop_token& stop,
             std::optional<RealTime::time_point> limit) const {
    std::unique_lock lock(mutex_);
    const std::size_t me = IndexOfThisThread();
    const auto is_over = [&] { return begun_ >= steady; };
    if (!stop.stop_requested() && !is_over()) {
      sleepers_[me].deadline = steady;
      sleepers_[me].state = Sleeper::State::kAsleep;
      settled_.notify_all();
      if (limit) {
        moved_.wait_until(lock, stop, *limit, is_over);
      } else {
        moved_.wait(lock, stop, is_over);
      }
    }
    const bool reached = is_over() && !stop.stop_requested();
    sleepers_[me].state = reached || limit ? Sleeper::State::kAwake : Sleeper::State::kElsewhere;
    sleepers_[me].woken = RealTime::now();
    if (!reached) settled_.notify_all();
    return reached;
  }

  /// On a thread of the network: only hands over.
  void Take(const ClockSample& sample, const Reception& from) {
    if (sample.second.nanoseconds() < 0 || sample.third.nanoseconds() < 0) return;
    Saying saying{sample.header.seq, Duration(sample.first.nanoseconds()), sample.header.stamp,
                  CountsFromText(sample.peer)};
    if (sample.peer.empty()) {
      saying.sent = {{JointStateSample::kTopic, kRobotSource,
                      static_cast<std::uint64_t>(sample.second.nanoseconds())},
                     {ObjectSample::kTopic, kTrackerSource,
                      static_cast<std::uint64_t>(sample.third.nanoseconds())}};
    }
    {
      const std::lock_guard lock(mutex_);
      if (leader_ != from.writer) {
        leader_ = from.writer;
        offset_ = steady_ - saying.time;
      }
      // What was sent until the moment begins counts, and not what was said of it later.
      told_.number = saying.number;
      if (!is_asked_ || saying.time != told_.time) told_ = std::move(saying);
      is_asked_ = true;
      ++rechecks_;
    }
    settled_.notify_all();
  }

  void Reply(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (settled_.wait(lock, stop, [this] { return is_asked_; })) {
      is_asked_ = false;
      const Saying told = told_;
      const bool is_complete = is_complete_;
      lock.unlock();
      mail_.Learn(told.sent);
      const bool is_awaited = IsAwaited(told.sent);
      lock.lock();
      if (is_awaited != is_awaited_) {
        is_awaited_ = is_awaited;
        moved_.notify_all();
      }
      const bool goes_on = told.time + offset_ > steady_ || !has_time_;
      if (goes_on && is_complete && !WaitForMail(lock, told.sent, stop)) return;
      if (!goes_on) NoteMatched(lock, told.sent);
      if (told.time != told_.time) continue;  // another leader, meanwhile
      if (goes_on) {
        SetTime(told);
        if (!HandOver(lock, told, stop)) return;
      } else if (told.time + offset_ == steady_) {
        now_ = told.stamp;
        has_time_ = true;
      }
      MoveOn(lock);
      if (!is_complete) {
        lock.unlock();
        const std::vector<TopicCount> sent = mail_.Sent();
        lock.lock();
        // Complete meanwhile, it may have sent what belongs to this moment.
        if (is_complete_) continue;
        lock.unlock();
        Answer("here", told, sent);
        lock.lock();
        continue;
      }
      if (!WaitUntilSettled(lock, stop, true)) return;
      lock.unlock();
      // The leader asks again, for one that is lost as well.
      Answer("reached", told, mail_.Sent());
      lock.lock();
    }
  }

  void Answer(const char* mode, const Saying& told, const std::vector<TopicCount>& sent) {
    ClockSample reply;
    reply.mode = mode;
    reply.first = Stamp::FromNanoseconds(told.time.count());
    reply.second = Stamp::FromNanoseconds(static_cast<std::int64_t>(told.number));
    std::uint64_t commands = 0;
    for (const TopicCount& count : sent) {
      if (count.topic == JointCommandSample::kTopic) commands += count.sent;
    }
    reply.third = Stamp::FromNanoseconds(static_cast<std::int64_t>(commands));
    reply.peer = CountsToText(sent);
    (void)writer_->Write(std::move(reply));
  }

  /// Whether the leader knows of all that this program sends.
  bool IsAwaited(const std::vector<TopicCount>& counts) const {
    const std::vector<TopicCount> own = mail_.Sent();
    return !own.empty() && std::all_of(own.begin(), own.end(), [&](const TopicCount& mine) {
      return std::any_of(counts.begin(), counts.end(), [&](const TopicCount& count) {
        return count.topic == mine.topic && count.source == mine.source;
      });
    });
  }

  /// Mutex held.
  void SetTime(const Saying& told) {
    steady_ = std::max(steady_, told.time + offset_);
    now_ = told.stamp;
    has_time_ = true;
  }

  /// The moment has begun: wakes who has slept until then. Mutex held.
  void MoveOn(std::unique_lock<std::mutex>& lock) {
    begun_ = steady_;
    for (Sleeper& sleeper : sleepers_) {
      if (sleeper.state != Sleeper::State::kAsleep || sleeper.deadline > begun_) continue;
      sleeper.state = Sleeper::State::kAwake;
      sleeper.woken = RealTime::now();
    }
    moved_.notify_all();
    const Stamp now = now_;
    lock.unlock();
    mail_.Open(now);
    lock.lock();
  }

  /// While time stands others may come that we read from: what they send first is not missed.
  void NoteMatched(std::unique_lock<std::mutex>& lock, const std::vector<TopicCount>& sent) {
    lock.unlock();
    mail_.NoteMatched(sent);
    lock.lock();
  }

  bool WaitForMail(std::unique_lock<std::mutex>& lock, const std::vector<TopicCount>& sent,
                   const std::stop_token& stop) {
    const RealTime::time_point patient = RealTime::now() + options_.input_patience;
    while (!stop.stop_requested()) {
      const std::uint64_t asked = rechecks_;
      lock.unlock();
      const bool has_come = mail_.HasCome(sent);
      const bool is_late = !has_come && RealTime::now() >= patient;
      if (is_late) mail_.GiveUp(sent);
      lock.lock();
      if (has_come || is_late) return true;
      settled_.wait_until(lock, stop, patient, [&] { return rechecks_ != asked; });
    }
    return false;
  }

  /// What was sent before is taken in before anybody acts.
  bool HandOver(std::unique_lock<std::mutex>& lock, const Saying& told,
                const std::stop_token& stop) {
    lock.unlock();
    mail_.Close();
    mail_.DeliverUpTo(told.sent, [&] {
      std::unique_lock own(mutex_);
      (void)WaitUntilSettled(own, stop, false);
    });
    lock.lock();
    return WaitUntilSettled(lock, stop, false);
  }

  /// Until the program has done what follows from what it was given, and, `with_sleepers`, until
  /// everybody sleeps again and nobody holds the time. False: `stop` came first.
  bool WaitUntilSettled(std::unique_lock<std::mutex>& lock, const std::stop_token& stop,
                        bool with_sleepers) {
    const RealTime::time_point patient = RealTime::now() + options_.input_patience;
    while (!stop.stop_requested()) {
      if (with_sleepers && !WaitForSleepers(lock, stop)) return false;
      const std::uint64_t asked = rechecks_;
      lock.unlock();
      bool is_settled = true;
      {
        const std::lock_guard asking(asking_mutex_);
        if (is_settled_) is_settled = is_settled_();
      }
      lock.lock();
      if (!is_settled && RealTime::now() < patient) {
        settled_.wait_until(lock, stop, patient, [&] { return rechecks_ != asked; });
      } else if (!with_sleepers || IsQuiet()) {
        return true;
      }
    }
    return false;
  }

  bool IsQuiet() const {
    return holds_ == 0 &&
           std::none_of(sleepers_.begin(), sleepers_.end(), [](const Sleeper& sleeper) {
             return sleeper.state == Sleeper::State::kAwake;
           });
  }

  bool WaitForSleepers(std::unique_lock<std::mutex>& lock, const std::stop_token& stop) {
    while (!stop.stop_requested() && !IsQuiet()) {
      const bool was_held = holds_ > 0;
      if (was_held) settled_.wait(lock, stop, [this] { return holds_ == 0; });
      const RealTime::time_point now = RealTime::now();
      RealTime::time_point until = RealTime::time_point::max();
      for (Sleeper& sleeper : sleepers_) {
        if (sleeper.state != Sleeper::State::kAwake) continue;
        if (was_held) sleeper.woken = now;  // it may have waited for something else
        const RealTime::time_point patient = sleeper.woken + options_.patience;
        if (patient <= now) {
          sleeper.state = Sleeper::State::kElsewhere;
        } else {
          until = std::min(until, patient);
        }
      }
      if (until == RealTime::time_point::max()) continue;
      settled_.wait_until(lock, stop, until, [this] { return holds_ > 0 || IsQuiet(); });
    }
    return !stop.stop_requested();
  }

  const NetworkClockOptions options_;
  mutable std::mutex mutex_;
  mutable std::condition_variable_any moved_;    ///< time went on
  mutable std::condition_variable_any settled_;  ///< a thread sleeps again, or the leader asks
  mutable std::vector<Sleeper> sleepers_;        ///< one a thread that ever slept
  mutable int holds_ = 0;
  std::string leader_;  ///< its writer; empty: none was heard yet
  Duration offset_{0};  ///< steady time minus the leader's
  Duration steady_{0};
  Duration begun_{0};  ///< as steady_, once what was sent before has been handed over
  Stamp now_;
  bool has_time_ = false;
  Saying told_;  ///< what the leader said last
  bool is_asked_ = false;
  bool is_complete_ = false;
  bool is_awaited_ = false;  ///< the leader waits for this program
  std::uint64_t rechecks_ = 0;
  std::mutex asking_mutex_;  ///< nobody is asked who has been forgotten
  std::function<bool()> is_settled_;
  StepMail mail_;
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

const Clock& RealTimeOf(const Clock& clock) {
  static const SystemClock machine;
  return dynamic_cast<const NetworkClock*>(&clock) != nullptr ? machine : clock;
}

TimeHold::TimeHold(const Clock& clock) : clock_(dynamic_cast<const NetworkClock*>(&clock)) {
  if (clock_ != nullptr) clock_->Hold();
}

TimeHold::~TimeHold() {
  if (clock_ != nullptr) clock_->Release();
}

Stamp LeaderClock::Now() const {
  const std::int64_t now_ns = now_ns_.load();
  return now_ns == kNotSet ? real_.Now() : Stamp::FromNanoseconds(now_ns);
}

}  // namespace exemplar::ircp
