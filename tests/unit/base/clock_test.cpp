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

TEST(SystemClockTest, ARequestedStopIsSeenAtOnce) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(SystemClock().SleepFor(1h, stop.get_token()));
}

}  // namespace
}  // namespace exemplar
