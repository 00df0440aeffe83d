// Teleoperation as a mode of the executor, on a network within the process and with time that moves
// by hand.

#include <gtest/gtest.h>

#include <future>
#include <string>
#include <vector>

#include "robot_rig.hpp"

namespace exemplar::executor::test {
namespace {

using std::chrono::milliseconds;

class TeleoperationTest : public RobotRig {
 protected:
  TeleoperationTest() : suit_joints_(robot_.home) {
    suit_writer_ = *bus_.MakeWriter<ircp::SuitSample>("suit");
    status_reader_ = *bus_.MakeReaderOn<ircp::StatusSample>(
        ircp::StatusTopic("executor"),
        [this](const ircp::StatusSample& status, const ircp::Reception&) {
          const std::lock_guard lock(mutex_);
          const std::string said = status.state + ": " + status.detail;
          if (said_.empty() || said_.back() != said) said_.push_back(said);
          heard_.notify_all();
        });
  }

  /// On a thread of its own; what it says and that it is over come to Await.
  std::future<Result<api::TeleoperationResult>> Ask(const api::TeleoperationRequest& request) {
    return std::async(std::launch::async, [this, request] {
      Result<api::TeleoperationResult> result = executor_->Teleoperate(
          request,
          [this](const api::TeleoperationFeedback& now) {
            const std::lock_guard lock(mutex_);
            told_ = now;
            heard_.notify_all();
          },
          stop_.get_token());
      const std::lock_guard lock(mutex_);
      over_ = true;
      heard_.notify_all();
      return result;
    });
  }

  /// Teleoperation on a thread of its own; returns once it is on, or refused.
  void On(const api::TeleoperationRequest& request = {}) {
    {
      const std::lock_guard lock(mutex_);
      over_ = false;
      told_.reset();
    }
    teleoperation_ = Ask(request);
    Await([this] { return told_ || over_; });
  }

  void SaySafety(bool emergency = false, bool reset = false) {
    ircp::SafetySample sample;
    sample.dead_man_held = held_;
    sample.emergency_stop = emergency;
    sample.reset = reset;
    ASSERT_TRUE(safety_writer_->Write(sample).ok());
  }

  /// A period: everybody says what there is to say, the robot is where it was commanded to be.
  void Cycle() {
    std::uint64_t before = 0;
    {
      const std::lock_guard lock(mutex_);
      before = commands_;
    }
    clock_.Advance(milliseconds(8));
    if (safety_speaks_ && ++cycle_ % 6 == 0) SaySafety();
    if (suit_speaks_) {
      ircp::SuitSample sample;
      sample.names = robot_.chain.joint_names();
      sample.positions.assign(suit_joints_.begin(), suit_joints_.end());
      ASSERT_TRUE(suit_writer_->Write(sample).ok());
      Await([&] { return commands_ > before || over_; });
    } else {
      // The next sample is waited for before a step is made without one.
      clock_.Advance(milliseconds(8));
      Await([&] { return commands_ > before || over_; });
    }
    {
      const std::lock_guard lock(mutex_);
      if (commanded_.size() > 0) measured_ = commanded_;
      measured_[0] += cycle_ % 2 == 0 ? 1e-7 : -1e-7;
    }
    if (speaks_) PublishState();
  }
  void Cycles(int count) {
    for (int i = 0; i < count && !over(); ++i) Cycle();
  }

  bool Said(const std::string& part) {
    const std::lock_guard lock(mutex_);
    return std::any_of(said_.begin(), said_.end(), [&](const std::string& said) {
      return said.find(part) != std::string::npos;
    });
  }
  /// Goes on until the executor said so.
  void CyclesUntilSaid(const std::string& part) {
    for (int i = 0; i < 500 && !over() && !Said(part); ++i) Cycle();
    Await([&] {
      return std::any_of(said_.begin(), said_.end(), [&](const std::string& said) {
        return said.find(part) != std::string::npos;
      });
    });
  }

  void Press() {
    held_ = false;
    SaySafety();
    Cycles(2);
    held_ = true;
    SaySafety();
  }
  void Follow() {
    Press();
    CyclesUntilSaid("teleoperating: following");
  }

  Result<api::TeleoperationResult> End() {
    for (int i = 0; i < 500 && !over(); ++i) Cycle();
    EXPECT_TRUE(over());
    return teleoperation_.get();
  }

  Eigen::VectorXd suit_joints_;
  std::unique_ptr<ircp::Writer<ircp::SuitSample>> suit_writer_;
  std::unique_ptr<ircp::Reader> status_reader_;
  std::future<Result<api::TeleoperationResult>> teleoperation_;
  bool held_ = false;
  bool suit_speaks_ = true;
  bool safety_speaks_ = true;
  int cycle_ = 0;
  std::optional<api::TeleoperationFeedback> told_;
  std::vector<std::string> said_;
};

TEST_F(TeleoperationTest, TheRobotFollowsTheSuitAndEveryTransitionIsPublished) {
  On();
  EXPECT_EQ(state(), "teleoperating");
  Follow();
  for (int i = 0; i < 100; ++i) {
    suit_joints_[1] += 0.004;
    Cycle();
  }
  Cycles(30);
  EXPECT_NEAR(measured_[1], suit_joints_[1], 5e-3);
  EXPECT_NEAR(measured_[3], robot_.home[3], 1e-3);
  ASSERT_TRUE(executor_->EndTeleoperation().ok());
  const auto result = End();
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->state, "done");
  EXPECT_GT(result->following_s, 0.8);
  EXPECT_GE(result->suit_samples, 100U);
  EXPECT_GE(result->commands_sent, 100U);
  EXPECT_EQ(result->holds, 0U);
  EXPECT_LT(result->tracking_error_rad, 0.1);
  ASSERT_TRUE(result->clearance_m);
  for (const char* part : {"teleoperating: holding", "teleoperating: approaching",
                           "teleoperating: following: 7 of 7 joints", "done: "}) {
    EXPECT_TRUE(Said(part)) << part;
  }
}

TEST_F(TeleoperationTest, TheRobotBelongsToOneAtATime) {
  On();
  const auto planned = executor_->Plan(RobotRig::Press());
  ASSERT_FALSE(planned.ok());
  EXPECT_NE(planned.error().message.find("belongs to an operator"), std::string::npos)
      << planned.error().message;
  const auto second = executor_->Teleoperate({}, {}, {});
  ASSERT_FALSE(second.ok());
  EXPECT_FALSE(executor_->Pause().ok());
  ASSERT_TRUE(executor_->EndTeleoperation().ok());
  EXPECT_TRUE(End().ok());

  Begin(RobotRig::Press());
  Steps(20);
  const auto meanwhile = executor_->Teleoperate({}, {}, {});
  ASSERT_FALSE(meanwhile.ok());
  EXPECT_NE(meanwhile.error().message.find("an execution of \"press\""), std::string::npos)
      << meanwhile.error().message;
  EXPECT_FALSE(executor_->EndTeleoperation().ok());
  ASSERT_TRUE(executor_->Cancel().ok());
  EXPECT_TRUE(Finish().ok());
}

TEST_F(TeleoperationTest, BeginsOnceTheRobotRestsAfterACancel) {
  Begin(RobotRig::Press());
  Steps(60);
  ASSERT_TRUE(executor_->Cancel().ok());
  auto asked = Ask({});
  EXPECT_EQ(Finish()->state, "aborted");
  {
    const std::lock_guard lock(mutex_);
    over_ = false;
  }
  Await([this] { return told_.has_value(); });
  EXPECT_EQ(state(), "teleoperating");
  stop_.request_stop();
  Cycles(500);
  const auto result = asked.get();
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->state, "aborted");
}

TEST_F(TeleoperationTest, MakesRoomForAPlanOnceTheRobotRests) {
  On();
  Follow();
  ASSERT_TRUE(executor_->EndTeleoperation().ok());
  auto plan = std::async(std::launch::async, [this] { return executor_->Plan(RobotRig::Press()); });
  EXPECT_EQ(End()->state, "done");
  const auto planned = plan.get();
  EXPECT_TRUE(planned.ok()) << planned.error().message;
}

TEST_F(TeleoperationTest, HoldsWhenTheDeadManIsReleasedOrSilentOrTheSuitIs) {
  On();
  Follow();
  held_ = false;
  SaySafety();
  CyclesUntilSaid("holding: the dead-man was released");
  Cycles(40);
  const Eigen::VectorXd held = measured_;
  suit_joints_[1] += 0.3;
  Cycles(20);
  EXPECT_LT((measured_ - held).cwiseAbs().maxCoeff(), 1e-5);

  said_.clear();
  Follow();
  safety_speaks_ = false;
  CyclesUntilSaid("holding: nothing came from the dead-man");
  safety_speaks_ = true;

  said_.clear();
  Follow();
  suit_speaks_ = false;
  CyclesUntilSaid("holding: nothing usable came on ircp/suit");
  suit_speaks_ = true;
  ASSERT_TRUE(executor_->EndTeleoperation().ok());
  const auto result = End();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->holds, 3U);
}

TEST_F(TeleoperationTest, AnEmergencyStopEndsItAndIsLatched) {
  On();
  Follow();
  SaySafety(true);
  const auto result = End();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->state, "emergency_stop");
  held_ = false;
  const auto again = executor_->Teleoperate({}, {}, {});
  ASSERT_FALSE(again.ok());
  EXPECT_NE(again.error().message.find("reset first"), std::string::npos) << again.error().message;
  SaySafety(false, true);
  On();
  EXPECT_EQ(state(), "teleoperating");
  ASSERT_TRUE(executor_->EndTeleoperation().ok());
  EXPECT_EQ(End()->state, "done");
}

TEST_F(TeleoperationTest, AProtectiveStopFollowsWhenTheRobotFallsSilent) {
  On();
  Follow();
  speaks_ = false;
  const auto result = End();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->state, "protective_stop");
  EXPECT_NE(result->detail.find("joint state"), std::string::npos) << result->detail;
}

TEST_F(TeleoperationTest, AProtectiveStopFollowsWhenTheTouchIsTooStrong) {
  On();
  Follow();
  touch_n_ = 200;
  const auto result = End();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->state, "protective_stop");
  EXPECT_NE(result->detail.find("touch"), std::string::npos) << result->detail;
}

TEST_F(TeleoperationTest, EndsWhenItsCallerGoesAway) {
  On();
  Follow();
  stop_.request_stop();
  const auto result = End();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->state, "aborted");
}

TEST_F(TeleoperationTest, ComesToRestWhenTheExecutorShutsDown) {
  On();
  Follow();
  suit_joints_[1] += 0.2;
  Cycles(10);
  std::future<void> down = std::async(std::launch::async, [this] { executor_->Shutdown(); });
  const auto result = End();
  down.get();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->state, "protective_stop");
  EXPECT_LT(speed(), 1e-3);
}

TEST_F(TeleoperationTest, RefusesToTouchWhatIsNotThereAndOffersTheNearest) {
  api::TeleoperationRequest request;
  request.touch = {"targt"};
  const auto refused = executor_->Teleoperate(request, {}, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kNotFound);
  EXPECT_NE(refused.error().message.find("did you mean \"target\""), std::string::npos);
  EXPECT_EQ(state(), "idle");
}

}  // namespace
}  // namespace exemplar::executor::test
