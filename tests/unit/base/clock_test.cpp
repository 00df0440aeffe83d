#include "exemplar/base/clock.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace exemplar {
namespace {

using namespace std::chrono_literals;  // NOLINT: literals only

TEST(ManualClockTest, MovesOnlyWhenTold) {
  ManualClock clock(Stamp::FromNanoseconds(1000));
  const Duration before = clock.Steady();
  clock.Advance(5ns);
  EXPECT_EQ(clock.Now(), Stamp::FromNanoseconds(1005));
  EXPECT_EQ(clock.Steady() - before, 5ns);
}

TEST(ManualClockTest, WakesASleeperWhenItsTimeHasCome) {
  ManualClock clock;
  std::atomic<bool> slept = false;
  std::jthread sleeper([&] { slept = clock.SleepUntil(10ms, {}); });
  clock.Advance(10ms);
  sleeper.join();
  EXPECT_TRUE(slept);
}

TEST(ManualClockTest, AStopEndsASleepEarly) {
  const ManualClock clock;
  std::stop_source stop;
  std::atomic<bool> slept = true;
  std::jthread sleeper([&] { slept = clock.SleepUntil(1h, stop.get_token()); });
  stop.request_stop();
  sleeper.join();
  EXPECT_FALSE(slept);
}

TEST(SystemClockTest, ATimeThatHasPassedNeedsNoSleep) {
  const SystemClock clock;
  EXPECT_TRUE(clock.SleepUntil(clock.Steady() - 1s, {}));
}

TEST(SystemClockTest, SleepsNoShorterThanAsked) {
  const SystemClock clock;
  std::stop_source stop;
  for (const std::stop_token& token : {std::stop_token(), stop.get_token()}) {
    const Duration until = clock.Steady() + 3ms;
    EXPECT_TRUE(clock.SleepUntil(until, token));
    EXPECT_GE(clock.Steady(), until);
  }
}

TEST(SystemClockTest, AStopEndsASleepFromAnotherThread) {
  const SystemClock clock;
  std::stop_source stop;
  std::atomic<bool> slept = true;
  std::jthread sleeper([&] { slept = clock.SleepFor(1h, stop.get_token()); });
  stop.request_stop();
  sleeper.join();
  EXPECT_FALSE(slept);
}

TEST(SystemClockTest, ARequestedStopIsSeenAtOnce) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(SystemClock().SleepFor(1h, stop.get_token()));
}

}  // namespace
}  // namespace exemplar
