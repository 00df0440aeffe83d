#include "capture_suit/dead_man.hpp"

#include <gtest/gtest.h>

#include "exemplar/ircp/memory_bus.hpp"
#include "exemplar/ircp/status_values.hpp"

namespace exemplar::capture_suit {
namespace {

using std::chrono::milliseconds;

/// An executor that says what the test wants, in a time that the test moves.
class DeadManTest : public ::testing::Test {
 protected:
  DeadManTest()
      : bus_(clock_),
        executor_(
            *bus_.MakeWriterOn<ircp::StatusSample>(ircp::StatusTopic("executor"), "executor")) {
    clock_.Advance(std::chrono::seconds(10));
  }

  /// `press`: the one that the robot moves by.
  void Say(const std::string& detail, std::optional<Stamp> press) {
    ircp::StatusSample status;
    status.program = "executor";
    status.state = "teleoperating";
    status.detail = detail;
    if (press) status.values[ircp::kAnsweredPress] = std::to_string(press->nanoseconds());
    ASSERT_TRUE(executor_->Write(status).ok());
  }
  void Begin() {
    dead_man_ = *DeadMan::Create(bus_, clock_);
    dead_man_->BeginToPress();
  }
  void GoOnAfter(Duration duration) {
    clock_.Advance(duration);
    dead_man_->GoOnPressing();
  }

  ManualClock clock_;
  ircp::MemoryBus bus_;
  std::unique_ptr<ircp::Writer<ircp::StatusSample>> executor_;
  std::unique_ptr<DeadMan> dead_man_;
};

TEST_F(DeadManTest, IsAnsweredByTheRobotThatFollowsItsOwnPress) {
  Begin();
  GoOnAfter(milliseconds(500));
  EXPECT_FALSE(dead_man_->followed());
  Say("approaching: slowly", clock_.Now());
  EXPECT_FALSE(dead_man_->followed());
  Say("following: 9 of 9", clock_.Now());
  EXPECT_TRUE(dead_man_->followed());
  Say("holding: the dead-man was released", std::nullopt);
  EXPECT_FALSE(dead_man_->followed());
}

TEST_F(DeadManTest, WhatWasSaidOfAnEarlierPressIsHistory) {
  const Stamp before = clock_.Now();
  Say("following: 9 of 9", before);
  Say("holding: the dead-man was released", std::nullopt);
  Begin();
  GoOnAfter(milliseconds(500));
  // The network may bring it only now.
  Say("following: 9 of 9", before);
  EXPECT_FALSE(dead_man_->followed());
  Say("holding: too far", std::nullopt);
  // Nobody answered this press: it is released, and pressed anew.
  GoOnAfter(milliseconds(2000));
  GoOnAfter(milliseconds(500));
  Say("following: 9 of 9", clock_.Now() - milliseconds(1));
  EXPECT_FALSE(dead_man_->followed());
  Say("following: 9 of 9", clock_.Now());
  EXPECT_TRUE(dead_man_->followed());
}

TEST_F(DeadManTest, IsNeverPressedAnewOnceItWasAnswered) {
  Begin();
  GoOnAfter(milliseconds(500));
  const Stamp press = clock_.Now();
  Say("approaching: slowly", press);
  Say("holding: the suit jumps", std::nullopt);
  for (int i = 0; i < 10; ++i) GoOnAfter(milliseconds(500));
  Say("following: 9 of 9", press);
  EXPECT_TRUE(dead_man_->followed()) << "it was released, or pressed again";
}

}  // namespace
}  // namespace exemplar::capture_suit
