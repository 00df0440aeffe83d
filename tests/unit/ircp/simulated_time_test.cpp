#include "exemplar/ircp/simulated_time.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "exemplar/ircp/memory_bus.hpp"
#include "support/eventually.hpp"

namespace exemplar::ircp {
namespace {

using std::chrono::milliseconds;
using testing::Eventually;

constexpr auto kTakenAll = [](const std::string&) -> std::uint64_t { return 0; };

class SimulatedTime : public ::testing::Test {
 protected:
  std::unique_ptr<TimeLeader> MakeLeader(const TimeLeaderOptions& options = {}) {
    auto leader = TimeLeader::Create(bus_, real_, "simulator", options);
    EXPECT_TRUE(leader.ok());
    return std::move(*leader);
  }
  std::unique_ptr<NetworkClock> MakeClock(const std::string& program = "executor",
                                          const NetworkClockOptions& options = {}) {
    auto clock = NetworkClock::Create(bus_, program, options);
    EXPECT_TRUE(clock.ok());
    return std::move(*clock);
  }
  bool Lead(TimeLeader& leader, Duration time) {
    return leader.Lead(time, Stamp() + std::chrono::hours(1) + time, {}, kTakenAll,
                       stop_.get_token());
  }

  SystemClock real_;
  MemoryBus bus_{real_};
  std::stop_source stop_;
};

TEST_F(SimulatedTime, IsWhatTheLeaderSays) {
  const auto clock = MakeClock();
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  EXPECT_EQ(clock->Steady(), Duration(0));
  ASSERT_TRUE(Lead(*leader, milliseconds(0)));
  EXPECT_TRUE(clock->WaitForLeader({}));
  ASSERT_TRUE(Lead(*leader, milliseconds(30)));
  EXPECT_EQ(clock->Steady(), milliseconds(30));
  EXPECT_EQ(clock->Now(), Stamp() + std::chrono::hours(1) + milliseconds(30));
}

TEST_F(SimulatedTime, MovesOnWhenEveryLoopOfEveryFollowerHasDoneItsWork) {
  constexpr int kBeats = 300;
  const auto first = MakeClock("first");
  const auto second = MakeClock("second");
  const auto leader = MakeLeader({.in_step_with = {"first", "second"}});
  std::atomic<int> fast{0};
  std::atomic<int> slow{0};
  std::atomic<int> other{0};
  const auto loop = [](const NetworkClock& clock, Duration period, std::atomic<int>& count) {
    return std::jthread([&clock, period, &count](const std::stop_token& stop) {
      for (Duration next = period; clock.SleepUntil(next, stop); next += period) {
        std::this_thread::yield();
        ++count;
      }
    });
  };
  const std::jthread threads[] = {loop(*first, milliseconds(1), fast),
                                  loop(*first, milliseconds(3), slow),
                                  loop(*second, milliseconds(2), other)};
  ASSERT_TRUE(Eventually([&] { return first->asleep() == 2 && second->asleep() == 1; }));
  for (int beat = 0; beat <= kBeats; ++beat) {
    ASSERT_TRUE(Lead(*leader, milliseconds(beat)));
    ASSERT_EQ(fast, beat);
    ASSERT_EQ(slow, beat / 3);
    ASSERT_EQ(other, beat / 2);
  }
}

TEST_F(SimulatedTime, DoesNotWaitForAThreadThatHasLeftItsLoop) {
  const auto clock = MakeClock("executor", {.patience = milliseconds(1)});
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::thread([&] { EXPECT_TRUE(clock->SleepUntil(milliseconds(0), {})); }).join();
  EXPECT_TRUE(Lead(*leader, milliseconds(1)));
  EXPECT_TRUE(Lead(*leader, milliseconds(2)));
}

TEST_F(SimulatedTime, DoesNotWaitForAThreadWhoseSleepWasStopped) {
  const auto clock = MakeClock("executor", {.patience = std::chrono::hours(1)});
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  stop_.request_stop();
  std::thread([&] {
    EXPECT_TRUE(clock->SleepUntil(milliseconds(0), {}));
    EXPECT_FALSE(clock->SleepUntil(Duration::max(), stop_.get_token()));
  }).join();
  EXPECT_TRUE(leader->Lead(milliseconds(1), Stamp(), {}, kTakenAll, {}));
}

TEST_F(SimulatedTime, WaitsForAFollowerThatComesLater) {
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::atomic<bool> moved{false};
  const std::jthread leading([&] {
    EXPECT_TRUE(Lead(*leader, milliseconds(5)));
    moved = true;
  });
  EXPECT_FALSE(moved);
  const auto clock = MakeClock();
  EXPECT_TRUE(Eventually([&] { return moved.load(); }));
}

TEST_F(SimulatedTime, WaitsForCommandsOnTheirWay) {
  const auto clock = MakeClock();
  clock->SetCommandsSent([] { return std::uint64_t{3}; });
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::atomic<std::uint64_t> taken{2};
  std::atomic<int> asked{0};
  std::atomic<bool> moved{false};
  const std::jthread leading([&] {
    const auto count = [&](const std::string& program) {
      EXPECT_EQ(program, "executor");
      ++asked;
      return taken.load();
    };
    EXPECT_TRUE(leader->Lead(milliseconds(1), Stamp(), {}, count, {}));
    moved = true;
  });
  ASSERT_TRUE(Eventually([&] { return asked > 0; }));
  EXPECT_FALSE(moved);
  taken = 3;
  leader->Recheck();
  EXPECT_TRUE(Eventually([&] { return moved.load(); }));
}

TEST_F(SimulatedTime, ComesWhenWhatWasSentBeforeIsTakenIn) {
  const auto clock = MakeClock();
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  ASSERT_TRUE(Lead(*leader, milliseconds(0)));
  std::atomic<std::uint64_t> states{0};
  std::atomic<int> asked{0};
  clock->SetInputsTaken([&](const SentInputs& sent) {
    EXPECT_EQ(sent.objects, 9u);
    ++asked;
    return states >= sent.joint_states;
  });
  std::atomic<bool> reached{false};
  const std::jthread leading([&] {
    EXPECT_TRUE(leader->Lead(milliseconds(8), Stamp(), {.joint_states = 2, .objects = 9}, kTakenAll,
                             stop_.get_token()));
    reached = true;
  });
  ASSERT_TRUE(Eventually([&] { return asked > 0; }));
  states = 1;
  const int before = asked;
  clock->Recheck();
  ASSERT_TRUE(Eventually([&] { return asked > before; }));
  EXPECT_EQ(clock->Steady(), Duration(0));
  EXPECT_FALSE(reached);
  states = 2;
  clock->Recheck();
  ASSERT_TRUE(Eventually([&] { return reached.load(); }));
  EXPECT_EQ(clock->Steady(), milliseconds(8));
  clock->SetInputsTaken(nullptr);
}

TEST_F(SimulatedTime, WaitsForAProgramUntilItIsComplete) {
  const auto clock = MakeClock("executor", {.answers_at_once = false});
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::atomic<bool> reached{false};
  const std::jthread leading([&] {
    EXPECT_TRUE(Lead(*leader, milliseconds(3)));
    reached = true;
  });
  EXPECT_TRUE(clock->WaitForLeader({}));
  EXPECT_FALSE(reached);
  clock->SetInputsTaken([](const SentInputs&) { return true; });
  EXPECT_TRUE(Eventually([&] { return reached.load(); }));
  clock->SetInputsTaken(nullptr);
}

TEST_F(SimulatedTime, IsNotHeldUpByASampleThatNeverComes) {
  const auto clock = MakeClock("executor", {.input_patience = milliseconds(1)});
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  ASSERT_TRUE(Lead(*leader, milliseconds(0)));
  clock->SetInputsTaken([](const SentInputs&) { return false; });
  EXPECT_TRUE(Lead(*leader, milliseconds(1)));
  EXPECT_EQ(clock->Steady(), milliseconds(1));
  clock->SetInputsTaken(nullptr);
}

TEST_F(SimulatedTime, GoesOnWithoutAFollowerThatFellSilentAndNamesIt) {
  const auto leader = MakeLeader({.in_step_with = {"executor"}, .patience = Duration(0)});
  {
    const auto clock = MakeClock();
    ASSERT_TRUE(Lead(*leader, milliseconds(1)));
    EXPECT_TRUE(leader->TakeLost().empty());
  }
  ASSERT_TRUE(Lead(*leader, milliseconds(2)));
  EXPECT_EQ(leader->TakeLost(), std::vector<std::string>{"executor"});
  EXPECT_TRUE(Lead(*leader, milliseconds(3)));
  EXPECT_TRUE(leader->TakeLost().empty());
}

TEST_F(SimulatedTime, NeverGoesBackWhenAnotherLeaderBegins) {
  const auto clock = MakeClock();
  ASSERT_TRUE(Lead(*MakeLeader({.in_step_with = {"executor"}}), milliseconds(700)));
  const Duration before = clock->Steady();
  const auto again = MakeLeader({.in_step_with = {"executor"}});
  ASSERT_TRUE(Lead(*again, milliseconds(0)));
  EXPECT_EQ(clock->Steady(), before);
  ASSERT_TRUE(Lead(*again, milliseconds(10)));
  EXPECT_EQ(clock->Steady(), before + milliseconds(10));
}

TEST_F(SimulatedTime, EndsSleepAndLeadershipWhenAsked) {
  const auto clock = MakeClock();
  const auto leader = MakeLeader({.in_step_with = {"nobody"}});
  stop_.request_stop();
  EXPECT_FALSE(clock->SleepUntil(milliseconds(1), stop_.get_token()));
  EXPECT_FALSE(clock->WaitForLeader(stop_.get_token()));
  EXPECT_FALSE(Lead(*leader, milliseconds(1)));
}

}  // namespace
}  // namespace exemplar::ircp
