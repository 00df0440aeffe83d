#include "executor/state_machine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

namespace exemplar::executor {
namespace {

using S = State;
using E = Event;

/// Every pair that is taken; all others are refused.
const std::map<std::pair<State, Event>, State>& Taken() {
  static const std::map<std::pair<State, Event>, State> taken = [] {
    std::map<std::pair<State, Event>, State> table = {
        {{S::kIdle, E::kPlan}, S::kPlanning},
        {{S::kIdle, E::kReset}, S::kIdle},
        {{S::kPlanning, E::kPlanned}, S::kReady},
        {{S::kPlanning, E::kRefused}, S::kIdle},
        {{S::kPlanning, E::kCancel}, S::kAborted},
        {{S::kReady, E::kPlan}, S::kPlanning},
        {{S::kReady, E::kStart}, S::kExecuting},
        {{S::kReady, E::kCancel}, S::kIdle},
        {{S::kReady, E::kReset}, S::kIdle},
        {{S::kExecuting, E::kPause}, S::kPaused},
        {{S::kExecuting, E::kResume}, S::kExecuting},
        {{S::kExecuting, E::kCancel}, S::kAborted},
        {{S::kExecuting, E::kFault}, S::kProtectiveStop},
        {{S::kExecuting, E::kFinish}, S::kDone},
        {{S::kExecuting, E::kMiss}, S::kAborted},
        {{S::kPaused, E::kPause}, S::kPaused},
        {{S::kPaused, E::kResume}, S::kExecuting},
        {{S::kPaused, E::kCancel}, S::kAborted},
        {{S::kPaused, E::kFault}, S::kProtectiveStop},
        {{S::kPaused, E::kFinish}, S::kDone},
        {{S::kPaused, E::kMiss}, S::kAborted},
        {{S::kProtectiveStop, E::kReset}, S::kIdle},
        {{S::kEmergencyStop, E::kReset}, S::kIdle},
        {{S::kDone, E::kPlan}, S::kPlanning},
        {{S::kDone, E::kReset}, S::kIdle},
        {{S::kAborted, E::kPlan}, S::kPlanning},
        {{S::kAborted, E::kReset}, S::kIdle},
        {{S::kIdle, E::kTeleoperate}, S::kTeleoperating},
        {{S::kReady, E::kTeleoperate}, S::kTeleoperating},
        {{S::kDone, E::kTeleoperate}, S::kTeleoperating},
        {{S::kAborted, E::kTeleoperate}, S::kTeleoperating},
        {{S::kTeleoperating, E::kLeave}, S::kDone},
        {{S::kTeleoperating, E::kCancel}, S::kAborted},
        {{S::kTeleoperating, E::kFault}, S::kProtectiveStop},
    };
    for (const State state : kAllStates) {
      table[{state, E::kEmergency}] = S::kEmergencyStop;
      table[{state, E::kStop}] =
          state == S::kEmergencyStop ? S::kEmergencyStop : S::kProtectiveStop;
    }
    return table;
  }();
  return taken;
}

class EveryPair : public ::testing::TestWithParam<std::pair<State, Event>> {};

TEST_P(EveryPair, IsTakenOrRefusedAsTheTableSays) {
  const auto [state, event] = GetParam();
  const auto expected = Taken().find(GetParam());
  const std::optional<State> next = Next(state, event);
  if (expected == Taken().end()) {
    EXPECT_FALSE(next.has_value()) << "leads to " << ToString(*next);
  } else {
    ASSERT_TRUE(next.has_value());
    EXPECT_EQ(ToString(*next), ToString(expected->second));
  }
}

std::vector<std::pair<State, Event>> AllPairs() {
  std::vector<std::pair<State, Event>> pairs;
  for (const State state : kAllStates) {
    for (const Event event : kAllEvents) pairs.emplace_back(state, event);
  }
  return pairs;
}

INSTANTIATE_TEST_SUITE_P(Executor, EveryPair, ::testing::ValuesIn(AllPairs()),
                         [](const auto& each) {
                           std::string name = std::string(ToString(each.param.first)) + "_" +
                                              std::string(ToString(each.param.second));
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(StateMachine, LeavesAnEmergencyByResetAlone) {
  for (const Event event : kAllEvents) {
    const std::optional<State> next = Next(State::kEmergencyStop, event);
    if (event == Event::kReset) continue;
    EXPECT_TRUE(!next || *next == State::kEmergencyStop) << ToString(event);
  }
}

TEST(StateMachine, NeverStartsAMotionThatWasNotPlanned) {
  for (const State state : kAllStates) {
    const std::optional<State> next = Next(state, Event::kStart);
    EXPECT_EQ(next.has_value(), state == State::kReady) << ToString(state);
  }
}

}  // namespace
}  // namespace exemplar::executor
