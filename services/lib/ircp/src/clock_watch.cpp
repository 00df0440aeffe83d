#include "exemplar/ircp/clock_watch.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "exemplar/ircp/clock_estimator.hpp"

namespace exemplar::ircp {
namespace {

constexpr Duration kPeriod = std::chrono::seconds(1);
constexpr Duration kPeriodAtFirst = std::chrono::milliseconds(100);
constexpr std::size_t kEnoughToKnow = 8;
constexpr std::size_t kProbesKept = 32;
constexpr std::size_t kJumpsKept = 256;
constexpr std::size_t kMostClocks = 256;
constexpr Duration kSilence = std::chrono::minutes(1);
// Our two clocks are read one after the other; a pause between the two readings is no jump.
constexpr Duration kLongestReading = std::chrono::microseconds(200);
constexpr Duration kSmallestJump = std::chrono::milliseconds(5);
/// A clock that jumps again and again is told of no more often than this.
constexpr Duration kToldAgain = std::chrono::seconds(10);

class Watch final : public ClockWatch {
 public:
  Watch(const Clock& clock, Log& log) : clock_(clock), log_(log) {}

  ~Watch() override {
    asker_ = {};
    reader_.reset();
  }

  Status Start(Bus& bus, const std::string& source) {
    auto writer = bus.MakeWriter<ClockSample>(source);
    if (!writer.ok()) return writer.error();
    writer_ = std::move(*writer);
    auto reader =
        bus.MakeReader<ClockSample>([this](const ClockSample& sample, const Reception& from) {
          if (sample.mode == "echo") Take(sample, from);
        });
    if (!reader.ok()) return reader.error();
    reader_ = std::move(*reader);
    asker_ = std::jthread([this](const std::stop_token& stop) { Ask(stop); });
    return {};
  }

  std::vector<ClockRelation> relations() override {
    const std::lock_guard lock(mutex_);
    CheckOwnClock();
    const Stamp now = clock_.Now();
    const Duration steady = clock_.Steady();
    std::vector<ClockRelation> relations;
    for (const auto& [participant, other] : others_) {
      if (steady - other.last_heard > kSilence) continue;
      std::optional<ClockRelation> relation = other.estimator.RelationAt(now);
      if (!relation) continue;
      relation->participant = participant;
      relation->program = other.program;
      relation->observer = own_;
      relations.push_back(std::move(*relation));
    }
    return relations;
  }

  std::uint64_t jumps() const override {
    const std::lock_guard lock(mutex_);
    return jump_count_;
  }

  std::vector<ClockJump> TakeJumps() override {
    const std::lock_guard lock(mutex_);
    std::vector<ClockJump> taken(jumps_.begin(), jumps_.end());
    jumps_.clear();
    return taken;
  }

 private:
  struct Other {
    std::string program;
    ClockEstimator estimator;
    Duration last_heard{0};
  };

  void Ask(const std::stop_token& stop) {
    Duration period = kPeriodAtFirst;
    do {
      ClockSample probe;
      probe.mode = "probe";
      {
        const std::lock_guard lock(mutex_);
        CheckOwnClock();
        probe.first = clock_.Now();
        asked_.push_back(probe.first);
        if (asked_.size() > kProbesKept) asked_.pop_front();
        const bool learning = std::any_of(others_.begin(), others_.end(), [&](const auto& entry) {
          return entry.second.estimator.remembered() < kEnoughToKnow &&
                 clock_.Steady() - entry.second.last_heard < 2 * kPeriod;
        });
        period = learning ? kPeriodAtFirst : kPeriod;
      }
      (void)writer_->Write(std::move(probe));  // one that is lost is followed by the next
    } while (clock_.SleepFor(period, stop));
  }

  /// On a thread of the network.
  void Take(const ClockSample& echo, const Reception& from) {
    const Stamp received = clock_.Now();
    const std::lock_guard lock(mutex_);
    if (std::find(asked_.begin(), asked_.end(), echo.first) == asked_.end()) return;
    CheckOwnClock();
    if (own_.empty()) own_ = ParticipantOf(echo.peer);
    if (own_ != ParticipantOf(echo.peer)) return;  // another watch has asked at that very moment
    const std::string participant = ParticipantOf(from.writer);
    if (others_.count(participant) == 0 && others_.size() >= kMostClocks) return;
    Other& other = others_[participant];
    other.program = echo.header.source;
    other.last_heard = clock_.Steady();
    const std::optional<Duration> jump = other.estimator.Add({.sent = echo.first,
                                                              .their_received = echo.second,
                                                              .their_sent = echo.third,
                                                              .received = received});
    if (jump) Note({participant, other.program, received, *jump});
  }

  /// Precondition: mutex_ is held.
  void CheckOwnClock() {
    const Duration before = clock_.Steady();
    const Stamp now = clock_.Now();
    const Duration after = clock_.Steady();
    if (after - before > kLongestReading) return;
    const Duration apart = (now - Stamp()) - before;
    if (apart_ && std::chrono::abs(apart - *apart_) > kSmallestJump) {
      asked_.clear();
      for (auto& [participant, other] : others_) other.estimator.StartEpoch(now);
      Note({"", "", now, apart - *apart_});
    }
    apart_ = apart;
  }

  /// Precondition: mutex_ is held.
  void Note(ClockJump jump) {
    ++jump_count_;
    Tell(jump);
    jumps_.push_back(std::move(jump));
    if (jumps_.size() > kJumpsKept) jumps_.pop_front();
  }

  /// Precondition: mutex_ is held.
  void Tell(const ClockJump& jump) {
    const Duration now = clock_.Steady();
    const auto [told, is_first] = told_.try_emplace(jump.participant, now);
    if (!is_first && now - told->second < kToldAgain) return;
    told->second = now;
    log_.Warning("a clock has jumped",
                 {{"program", jump.participant.empty() ? std::string("our own") : jump.program},
                  {"by_s", ToSeconds(jump.by)},
                  {"jumps", jump_count_}});
    if (!is_first && !jump.participant.empty()) {
      log_.Info("a clock jumps again and again",
                {{"program", jump.program},
                 {"advice", "in simulated time start every program with --clock network"}});
    }
  }

  const Clock& clock_;
  Log& log_;
  mutable std::mutex mutex_;  ///< guards what follows, but writer_, reader_ and asker_
  std::string own_;           ///< our participant, as the answers name it
  std::deque<Stamp> asked_;
  std::map<std::string, Other> others_;  ///< by participant
  std::optional<Duration> apart_;        ///< our wall clock minus our steady one
  std::uint64_t jump_count_ = 0;
  std::deque<ClockJump> jumps_;
  std::map<std::string, Duration> told_;  ///< by participant: when its last jump was told of
  std::unique_ptr<Writer<ClockSample>> writer_;
  std::unique_ptr<Reader> reader_;
  std::jthread asker_;
};

}  // namespace

Result<std::unique_ptr<ClockWatch>> ClockWatch::Create(Bus& bus, const Clock& clock, Log& log,
                                                       const std::string& source) {
  auto watch = std::make_unique<Watch>(clock, log);
  if (Status started = watch->Start(bus, source); !started.ok()) return started.error();
  return std::unique_ptr<ClockWatch>(std::move(watch));
}

}  // namespace exemplar::ircp
