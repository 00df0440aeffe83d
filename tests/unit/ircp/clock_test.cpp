// Clocks of programs: followed over exchanges, over a bus, and applied.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <limits>

#include "exemplar/base/rng.hpp"
#include "exemplar/ircp/clock_estimator.hpp"
#include "exemplar/ircp/clock_watch.hpp"
#include "exemplar/ircp/memory_bus.hpp"
#include "support/eventually.hpp"

namespace exemplar::ircp {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'000'000'000;

Stamp At(double seconds) { return Stamp::FromNanoseconds(kStart) + FromSeconds(seconds); }

/// Exchanges with a clock of known offset over a network of random delay.
class Network {
 public:
  explicit Network(std::uint64_t seed) : rng_(seed) {}

  /// Each way takes `least_s` and an exponential time of `mean_s` more.
  ClockExchange Exchange(double at_s, const std::function<double(double)>& offset_s,
                         double least_s = 1e-4, double mean_s = 2e-4) {
    const auto way = [&] { return least_s - mean_s * std::log(1 - rng_.Uniform()); };
    const double there = at_s + way();
    const double back = there + 50e-6;
    return {.sent = At(at_s),
            .their_received = At(there + offset_s(there)),
            .their_sent = At(back + offset_s(back)),
            .received = At(back + way())};
  }

 private:
  Rng rng_;
};

TEST(ClockEstimatorTest, FindsOffsetAndDriftWithinTheUncertaintyItTells) {
  Rng rng(3);
  for (int round = 0; round < 50; ++round) {
    const double offset = 100 * (rng.Uniform() - 0.5);
    const double drift = 2e-4 * (rng.Uniform() - 0.5);
    const auto truth = [&](double t) { return offset + drift * t; };
    Network network(static_cast<std::uint64_t>(100 + round));
    ClockEstimator estimator;
    for (int i = 0; i < 90; ++i) {
      EXPECT_FALSE(estimator.Add(network.Exchange(i, truth)));
      const ClockRelation relation = *estimator.RelationAt(At(i));
      EXPECT_LE(std::abs(ToSeconds(relation.offset) - truth(i)), ToSeconds(relation.uncertainty));
    }
    const ClockRelation relation = *estimator.RelationAt(At(90));
    EXPECT_NEAR(relation.drift, drift, 3e-6);
    EXPECT_NEAR(ToSeconds(relation.offset), truth(90), 1e-4);
    EXPECT_LT(ToSeconds(relation.uncertainty), 5e-4);
    EXPECT_EQ(relation.exchanges, 90U);
    EXPECT_EQ(relation.epoch, 0);
  }
}

TEST(ClockEstimatorTest, IsNotMisledByExchangesThatWaitedOneWay) {
  Network network(1);
  Rng rng(2);
  ClockEstimator estimator;
  const auto truth = [](double) { return 2.5; };
  for (int i = 0; i < 60; ++i) {
    ClockExchange exchange = network.Exchange(i, truth);
    // A third of the answers is sent again, after a loss.
    if (rng.Uniform() < 0.3) exchange.received = exchange.received + FromSeconds(0.2);
    EXPECT_FALSE(estimator.Add(exchange));
  }
  const ClockRelation relation = *estimator.RelationAt(At(60));
  EXPECT_NEAR(ToSeconds(relation.offset), 2.5, 2e-4);
  EXPECT_NEAR(relation.drift, 0, 5e-6);
}

TEST(ClockEstimatorTest, NoticesAJumpAtTheNextExchangeAndStartsAnew) {
  Network network(4);
  ClockEstimator estimator;
  const auto truth = [](double t) { return t < 20 ? 1.0 : -3.0; };
  int jumps = 0;
  for (int i = 0; i < 40; ++i) {
    const std::optional<Duration> jump = estimator.Add(network.Exchange(i, truth));
    if (!jump) continue;
    ++jumps;
    EXPECT_EQ(i, 20);
    EXPECT_NEAR(ToSeconds(*jump), -4.0, 1e-2);
  }
  EXPECT_EQ(jumps, 1);
  const ClockRelation relation = *estimator.RelationAt(At(40));
  EXPECT_EQ(relation.epoch, 1);
  EXPECT_NEAR(ToSeconds(relation.offset), -3.0, 1e-3);
  EXPECT_NEAR(ToSeconds(relation.since - At(20)), 0, 0.1);
}

TEST(ClockEstimatorTest, LeavesOutWhatIsNoExchange) {
  Network network(5);
  const ClockExchange good = network.Exchange(1, [](double) { return 0.0; });
  ClockEstimator estimator;
  ClockExchange bad = good;
  bad.received = bad.sent - FromSeconds(1);
  EXPECT_FALSE(estimator.Add(bad));
  bad = good;
  bad.received = bad.sent + FromSeconds(5);
  EXPECT_FALSE(estimator.Add(bad));
  for (const std::int64_t ns :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    bad = good;
    bad.their_received = Stamp::FromNanoseconds(ns);
    EXPECT_FALSE(estimator.Add(bad));
  }
  EXPECT_EQ(estimator.exchanges(), 0U);
  EXPECT_FALSE(estimator.RelationAt(At(1)));
}

TEST(ClockRelationTest, ComesBackFromItsFields) {
  const ClockRelation relation{.participant = "01.0f",
                               .program = "capture_suit",
                               .observer = "02.0f",
                               .at = At(5),
                               .offset = Duration(-2'500'000'001),
                               .drift = -12.5e-6,
                               .uncertainty = Duration(1234),
                               .exchanges = 77,
                               .epoch = 2,
                               .since = At(3)};
  const Result<ClockRelation> back = ClockRelationFromFields(ToFields(relation));
  ASSERT_TRUE(back.ok());
  EXPECT_NEAR(back->drift, relation.drift, 1e-15);
  ClockRelation same = *back;
  same.drift = relation.drift;  // its decimal number was rounded
  EXPECT_EQ(ToFields(same), ToFields(relation));
  EXPECT_EQ(back->offset, relation.offset);
}

TEST(ClockRelationTest, NamesTheFieldAtFault) {
  for (const auto& [name, value] : ToFields({.at = At(0), .since = At(0)})) {
    auto fields = ToFields({.at = At(0), .since = At(0)});
    fields.erase(name);
    const Result<ClockRelation> read = ClockRelationFromFields(fields);
    ASSERT_FALSE(read.ok());
    EXPECT_NE(read.error().message.find(name), std::string::npos) << read.error().message;
  }
  for (const char* name : {"at_ns", "offset_ns", "drift_ppm", "since_ns"}) {
    auto fields = ToFields({.at = At(0), .since = At(0)});
    fields[name] = "-9223372036854775808";
    const Result<ClockRelation> read = ClockRelationFromFields(fields);
    ASSERT_FALSE(read.ok()) << name;
    EXPECT_NE(read.error().message.find(name), std::string::npos) << read.error().message;
  }
}

TEST(ClockTrackTest, LiesOnTheLinesBetweenRelationsAndJumpsWhereTheClockDid) {
  ClockTrack track;
  const auto relation = [](double at, double offset, int epoch, double since) {
    return ClockRelation{.at = At(at),
                         .offset = FromSeconds(offset),
                         .drift = 1e-3,
                         .uncertainty = FromSeconds(1e-4),
                         .epoch = epoch,
                         .since = At(since)};
  };
  track.Add(relation(30, 7.0, 1, 25));
  track.Add(relation(10, 1.0, 0, 0));
  track.Add(relation(20, 1.02, 0, 0));
  const auto offset = [&](double at) { return ToSeconds(track.OffsetAt(At(at))); };
  EXPECT_NEAR(offset(0), 0.99, 1e-9);   // along the first one's drift
  EXPECT_NEAR(offset(15), 1.01, 1e-9);  // between two
  EXPECT_NEAR(offset(24.9), 1.0249, 1e-9);
  EXPECT_NEAR(offset(25.1), 6.9951, 1e-9);  // after the jump
  EXPECT_NEAR(offset(40), 7.01, 1e-9);
  EXPECT_TRUE(track.Differs());
  for (const double at : {0.0, 12.0, 17.5, 24.0, 33.0}) {
    const Stamp theirs = At(at) + track.OffsetAt(At(at));
    EXPECT_NEAR(ToSeconds(track.ToObserver(theirs) - At(at)), 0, 1e-7) << at;
  }
}

TEST(ClockTrackTest, TakesClocksForTheSameThatCannotBeToldApart) {
  ClockTrack track;
  track.Add({.at = At(0), .offset = FromSeconds(5e-5), .uncertainty = FromSeconds(1e-4)});
  EXPECT_FALSE(track.Differs());
}

class QuietLog final : public Log {
 public:
  void Write(LogLevel, std::string_view event, Fields) override {
    if (event == "a clock has jumped") ++jumps;
  }
  std::atomic<int> jumps = 0;
};

/// A clock that is some time ahead of another.
class ShiftedClock final : public Clock {
 public:
  explicit ShiftedClock(const Clock& clock) : clock_(clock) {}
  Stamp Now() const override { return clock_.Now() + Duration(shift_ns_.load()); }
  Duration Steady() const override { return clock_.Steady(); }
  bool SleepUntil(Duration steady, std::stop_token stop) const override {
    return clock_.SleepUntil(steady, std::move(stop));
  }
  void Shift(Duration by) { shift_ns_ = by.count(); }

 private:
  const Clock& clock_;
  std::atomic<std::int64_t> shift_ns_ = 0;
};

TEST(ClockWatchTest, MeasuresTheClocksOfTheProgramsThatAnswerAndNoticesTheirJumps) {
  ManualClock clock;
  ShiftedClock ahead(clock);
  ahead.Shift(FromSeconds(2.5));
  QuietLog log;
  MemoryBus bus(clock);
  const auto suit = ClockResponder::Create(bus, ahead, "capture_suit");
  const auto watch = ClockWatch::Create(bus, clock, log, "recorder");
  ASSERT_TRUE(suit.ok() && watch.ok());
  const auto known = [&](std::uint64_t exchanges) {
    return testing::Eventually([&] {
      const auto relations = (*watch)->relations();
      if (!relations.empty() && relations[0].exchanges >= exchanges) return true;
      clock.Advance(std::chrono::milliseconds(10));
      return false;
    });
  };
  ASSERT_TRUE(known(5));
  ClockRelation relation = (*watch)->relations().at(0);
  EXPECT_EQ(relation.program, "capture_suit");
  EXPECT_FALSE(relation.participant.empty());
  EXPECT_FALSE(relation.observer.empty());
  EXPECT_LE(std::chrono::abs(relation.offset - FromSeconds(2.5)), relation.uncertainty);
  EXPECT_EQ((*watch)->jumps(), 0U);

  ahead.Shift(FromSeconds(-10));
  ASSERT_TRUE(known(relation.exchanges + 5));
  relation = (*watch)->relations().at(0);
  EXPECT_LE(std::chrono::abs(relation.offset - FromSeconds(-10)), relation.uncertainty);
  EXPECT_EQ((*watch)->jumps(), 1U);
  EXPECT_EQ(log.jumps, 1);
  const std::vector<ClockJump> jumps = (*watch)->TakeJumps();
  ASSERT_EQ(jumps.size(), 1U);
  EXPECT_EQ(jumps[0].program, "capture_suit");
  EXPECT_LE(std::chrono::abs(jumps[0].by - FromSeconds(-12.5)), std::chrono::seconds(2));
  EXPECT_TRUE((*watch)->TakeJumps().empty());
}

TEST(ClockWatchTest, CountsEveryJumpOfAClockAndTellsOfThemNowAndThen) {
  ManualClock clock;
  ShiftedClock ahead(clock);
  QuietLog log;
  MemoryBus bus(clock);
  const auto suit = ClockResponder::Create(bus, ahead, "capture_suit");
  const auto watch = ClockWatch::Create(bus, clock, log, "recorder");
  ASSERT_TRUE(suit.ok() && watch.ok());
  const auto until = [&](auto condition) {
    return testing::Eventually([&] {
      if (condition()) return true;
      clock.Advance(std::chrono::milliseconds(200));
      return false;
    });
  };
  ASSERT_TRUE(until([&] { return !(*watch)->relations().empty(); }));
  const Duration begin = clock.Steady();
  std::uint64_t shifts = 0;
  for (; shifts < 20 || clock.Steady() - begin < std::chrono::seconds(12); ++shifts) {
    ahead.Shift(std::chrono::hours(shifts + 1));
    ASSERT_TRUE(until([&] { return (*watch)->jumps() > shifts; }));
  }
  EXPECT_GE((*watch)->jumps(), shifts);  // one within an exchange may be seen in two steps
  EXPECT_GE(log.jumps, 2);
  EXPECT_LT(log.jumps, static_cast<int>(shifts));
}

TEST(ClockWatchTest, NoticesItsOwnClocksJump) {
  ManualClock clock;
  ShiftedClock own(clock);
  QuietLog log;
  MemoryBus bus(clock);
  const auto other = ClockResponder::Create(bus, clock, "simulator");
  const auto watch = ClockWatch::Create(bus, own, log, "recorder");
  ASSERT_TRUE(other.ok() && watch.ok());
  const auto until = [&](auto condition) {
    return testing::Eventually([&] {
      if (condition()) return true;
      clock.Advance(std::chrono::milliseconds(10));
      return false;
    });
  };
  ASSERT_TRUE(until([&] { return !(*watch)->relations().empty(); }));
  own.Shift(FromSeconds(3600));
  ASSERT_TRUE(until([&] { return (*watch)->jumps() > 0; }));
  EXPECT_EQ((*watch)->TakeJumps().at(0).by, FromSeconds(3600));
  ASSERT_TRUE(until([&] {
    const auto relations = (*watch)->relations();
    return !relations.empty() && relations[0].epoch > 0;
  }));
  const ClockRelation relation = (*watch)->relations().at(0);
  EXPECT_LE(std::chrono::abs(relation.offset - FromSeconds(-3600)), relation.uncertainty);
  EXPECT_EQ((*watch)->jumps(), 1U);
}

}  // namespace
}  // namespace exemplar::ircp
