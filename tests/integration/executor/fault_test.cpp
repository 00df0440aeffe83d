// Faults put into the rig: each ends in a hold on the path, and says what it was.

#include "eventually.hpp"
#include "robot_rig.hpp"

namespace exemplar::executor {
namespace {

using test::kTarget;

class FaultTest : public test::RobotRig {
 protected:
  explicit FaultTest(const ExecutorOptions& options = {}) : RobotRig(options) {}

  /// Runs on to the end, which is a protective stop for the reason named, at rest.
  void ExpectHold(const std::string& reason) {
    const Result<api::ExecutionResult> result = Finish();
    ASSERT_TRUE(result.ok()) << result.error().message;
    EXPECT_EQ(result->state, "protective_stop");
    EXPECT_NE(result->detail.find(reason), std::string::npos) << result->detail;
    EXPECT_EQ(speed(), 0);
    EXPECT_FALSE(executor_->Plan(Press()).ok());
    EXPECT_TRUE(executor_->Reset().ok());
  }

  void Push(bool emergency, bool reset = false) {
    ircp::SafetySample sample;
    sample.emergency_stop = emergency;
    sample.reset = reset;
    ASSERT_TRUE(safety_writer_->Write(sample).ok());
  }

  void ExpectLatched() {
    EXPECT_TRUE(testing::Eventually([this] { return state() == "emergency_stop"; })) << state();
    EXPECT_FALSE(executor_->Resume().ok());
    (void)executor_->Stop();
    EXPECT_EQ(state(), "emergency_stop");
    PublishState();
    EXPECT_FALSE(executor_->Plan(Press()).ok());
    Push(false, true);
    EXPECT_TRUE(testing::Eventually([this] { return state() == "idle"; })) << state();
    PublishState();
  }
};

TEST_F(FaultTest, HoldsWithinTheStatedTimeOfTheRobotsSilence) {
  Begin(Press());
  Steps(100);
  speaks_ = false;
  const std::uint64_t before = commands_;
  ExpectHold("joint state is 0.2");
  // Patience, the longest stop, and the time in which the robot arrives.
  EXPECT_LE(0.008 * static_cast<double>(commands_ - before), 0.25 + 0.5 + kSettle_s + 0.05);
}

TEST_F(FaultTest, HoldsWhenTheStateIsFrozen) {
  Begin(Press());
  Steps(60);
  follows_ = false;
  frozen_ = true;
  ExpectHold("frozen");
}

TEST_F(FaultTest, HoldsWhenTheStateJumps) {
  Begin(Press());
  Steps(60);
  lag_rad_ = 0.2;
  ExpectHold("its state jumps");
}

TEST_F(FaultTest, HoldsWhenStatesComeLate) {
  Begin(Press());
  Steps(60);
  state_delay_ = std::chrono::milliseconds(400);
  ExpectHold("later than before");
}

TEST_F(FaultTest, HoldsWhenTheRobotActsOnOldCommands) {
  command_lag_ = 1;
  Begin(Press());
  Steps(60);
  EXPECT_EQ(state(), "executing");
  command_lag_ = 50;  // 0.4 s
  ExpectHold("acts on commands that are");
}

TEST_F(FaultTest, HoldsWhenTheRobotReportsAJointNoMore) {
  Begin(Press());
  Steps(60);
  speaks_ = false;
  ircp::JointStateSample sample;
  sample.names = {"joint1"};
  sample.positions = {0.1};
  ASSERT_TRUE(state_writer_->Write(sample).ok());
  ExpectHold("no position of joint \"joint2\"");
}

TEST_F(FaultTest, HoldsBeforeAnObstacleThatAppearsAhead) {
  Begin(Press());
  Steps(50);
  See(kTarget + Eigen::Vector3d(0, 0, 0.12), "block");
  const Result<api::ExecutionResult> result = Finish();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->state, "protective_stop");
  EXPECT_NE(result->detail.find("\"block\""), std::string::npos) << result->detail;
  EXPECT_GT(result->clearance_m, 0);
}

TEST_F(FaultTest, GoesOnWhenAnObjectMovesOutOfTheWay) {
  Begin(Press());
  Steps(50);
  See({-0.6, 0.4, 0.1}, "block");
  EXPECT_EQ(Finish()->state, "done");
}

TEST_F(FaultTest, FinishesThoughTheLearningServiceIsGone) {
  Begin(Press());
  Steps(60);
  skills_.error = Unavailable("127.0.0.1:50051 does not answer");
  EXPECT_EQ(Finish()->state, "done");
}

TEST_F(FaultTest, LetsOneClientMoveTheRobotAndTellsTheOtherWho) {
  api::ExecuteRequest first = Press();
  first.client = "anna-7";
  Begin(first);
  Steps(60);
  const Result<api::ExecutionResult> second = executor_->Execute(Press(), {}, {});
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("belongs to an execution of \"press\" (anna-7)"),
            std::string::npos)
      << second.error().message;
  EXPECT_EQ(Finish()->state, "done");
}

TEST_F(FaultTest, PlansOnceTheRobotRestsAfterACancel) {
  Begin(Press());
  Steps(60);
  ASSERT_TRUE(executor_->Cancel().ok());
  std::future<Result<api::PlanSummary>> plan =
      std::async(std::launch::async, [this] { return executor_->Plan(Press()); });
  EXPECT_EQ(Finish()->state, "aborted");
  const Result<api::PlanSummary> planned = plan.get();
  EXPECT_TRUE(planned.ok()) << planned.error().message;
}

TEST_F(FaultTest, BacksOffFromWhatItPressesWhereItWasStopped) {
  const auto height_m = [this] { return robot_.chain.ToolPose(measured_).translation.z(); };
  for (const bool stop : {true, false}) {
    SCOPED_TRACE(stop ? "stop" : "cancel");
    Begin(Press());
    for (int i = 0; i < 2000 && height_m() > kTarget.z() - 1e-3; ++i) Step();
    ASSERT_TRUE((stop ? executor_->Stop() : executor_->Cancel()).ok());
    EXPECT_EQ(Finish()->state, stop ? "protective_stop" : "aborted");
    ASSERT_LT(height_m(), kTarget.z());
    EXPECT_TRUE(executor_->Reset().ok());
    const double pressed_m = height_m();
    Begin(Press());
    for (int i = 0; i < 100; ++i) {
      Step();
      EXPECT_GT(height_m(), pressed_m - 3e-4);
    }
    EXPECT_GT(skills_.last_query->start->translation.z(), kTarget.z() + 0.02);
    const Result<api::ExecutionResult> result = Finish();
    ASSERT_TRUE(result.ok()) << result.error().message;
    EXPECT_EQ(result->state, "done") << result->detail;
    ASSERT_FALSE(result->plan.warnings.empty());
    EXPECT_NE(result->plan.warnings[0].find("it backs off from there first"), std::string::npos);
  }
}

class ImpatientTest : public FaultTest {
 protected:
  static ExecutorOptions Impatient() {
    ExecutorOptions options;
    options.rest_patience = Duration(0);
    return options;
  }
  ImpatientTest() : FaultTest(Impatient()) {}
};

TEST_F(ImpatientTest, SaysThatTheRobotStillSlowsDown) {
  Begin(Press());
  Steps(60);
  ASSERT_TRUE(executor_->Cancel().ok());
  const Result<api::PlanSummary> early = executor_->Plan(Press());
  ASSERT_FALSE(early.ok());
  EXPECT_EQ(early.error().message,
            "the robot is still slowing down after an execution of \"press\", which is aborted; "
            "ask again");
  EXPECT_EQ(Finish()->state, "aborted");
  EXPECT_TRUE(executor_->Plan(Press()).ok());
}

TEST_F(FaultTest, MovesOnWhileItsLogIsStuck) {
  Begin(Press());
  Steps(20);
  awaits_checks_ = false;  // it has not settled while its log is stuck
  log_.Shut(true);
  ASSERT_TRUE(executor_->Pause().ok());
  log_.AwaitWriter();
  ASSERT_TRUE(executor_->Resume().ok());
  Push(true);  // from the network, which must not wait either
  EXPECT_TRUE(testing::Eventually([this] { return state() == "emergency_stop"; }));
  Steps(30);
  EXPECT_EQ(speed(), 0);
  log_.Shut(false);
  awaits_checks_ = true;
  EXPECT_EQ(Finish()->state, "emergency_stop");
}

class HeldUpWatchTest : public FaultTest {
 protected:
  ExecutorOptions Held() {
    ExecutorOptions options;
    options.on_taken = [this, network = std::this_thread::get_id()] {
      if (std::this_thread::get_id() == network) return;  // the listener: the rig's own thread
      std::unique_lock lock(gate_mutex_);
      ++waiting_;
      gate_changed_.notify_all();
      gate_changed_.wait(lock, [this] { return !held_; });
      --waiting_;
    };
    return options;
  }
  HeldUpWatchTest() : FaultTest(Held()) {}

  void Hold(bool held) {
    const std::lock_guard lock(gate_mutex_);
    held_ = held;
    gate_changed_.notify_all();
  }

  std::mutex gate_mutex_;
  std::condition_variable gate_changed_;
  bool held_ = false;
  int waiting_ = 0;
};

TEST_F(HeldUpWatchTest, TakesJointStatesThoughTheChecksOfTheLastOnesTakeLong) {
  Begin(Press());
  Steps(20);
  Hold(true);
  awaits_checks_ = false;
  Step();
  {
    std::unique_lock lock(gate_mutex_);
    gate_changed_.wait(lock, [this] { return waiting_ > 0; });
  }
  Steps(80);  // 0.64 s, in which the checks stand still
  EXPECT_EQ(executor_->GetStatus()->state_age_s, 0);
  EXPECT_EQ(state(), "executing");
  Hold(false);
  EXPECT_EQ(Finish()->state, "done");
}

TEST_F(FaultTest, RefusesToStartWhereTheRobotMovedWhileItWasPlanned) {
  skills_.on_query = [this] {
    measured_[2] += 0.2;
    PublishState();
  };
  Begin(Press());
  const Result<api::ExecutionResult> result = Finish();
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("\"joint3\" is 0.200 rad away"), std::string::npos)
      << result.error().message;
  EXPECT_EQ(commands_, 0U);
}

TEST_F(FaultTest, LatchesAnEmergencyInEveryState) {
  for (const char* before : {"idle", "emergency_stop"}) {
    SCOPED_TRACE(before);
    if (std::string(before) == "emergency_stop") Push(true);
    Push(true);
    ExpectLatched();
  }
  ASSERT_TRUE(executor_->Plan(Press()).ok());
  EXPECT_EQ(state(), "ready");
  Push(true);
  ExpectLatched();

  skills_.on_query = [this] {
    EXPECT_EQ(state(), "planning");
    Push(true);
    EXPECT_TRUE(testing::Eventually([this] { return state() == "emergency_stop"; }));
  };
  EXPECT_FALSE(executor_->Plan(Press()).ok());
  skills_.on_query = nullptr;
  ExpectLatched();

  const std::map<std::string, std::function<void()>> moving = {
      {"executing", [] {}},
      {"paused", [this] { ASSERT_TRUE(executor_->Pause().ok()); }},
      {"aborted", [this] { ASSERT_TRUE(executor_->Cancel().ok()); }},
      {"protective_stop", [this] { ASSERT_TRUE(executor_->Stop().ok()); }}};
  for (const auto& [name, enter] : moving) {
    SCOPED_TRACE(name);
    Begin(Press());
    Steps(60);
    enter();
    EXPECT_EQ(state(), name);
    Push(true);
    EXPECT_TRUE(testing::Eventually([this] { return state() == "emergency_stop"; })) << state();
    ASSERT_TRUE(Finish().ok());
    EXPECT_EQ(speed(), 0);
    ExpectLatched();
  }
  Begin(Press());
  EXPECT_EQ(Finish()->state, "done");
  Push(true);
  ExpectLatched();
}

class GoalTest : public FaultTest {
 protected:
  static ExecutorOptions Strict() {
    ExecutorOptions options;
    options.watch.goal.of_joint["joint2"] = 0.004;
    return options;
  }
  GoalTest() : FaultTest(Strict()) {}
};

TEST_F(GoalTest, SaysWhichJointDoesNotArrive) {
  lag_rad_ = 0.006;
  Begin(Press());
  ExpectHold("\"joint2\" is 0.006 rad away");
  lag_rad_ = 0.003;
  PublishState();
  Begin(Press());
  EXPECT_EQ(Finish()->state, "done");
}

class HeartbeatTest : public FaultTest {
 protected:
  static ExecutorOptions Asking() {
    ExecutorOptions options;
    options.safety_patience = std::chrono::milliseconds(200);
    return options;
  }
  HeartbeatTest() : FaultTest(Asking()) {}
};

TEST_F(HeartbeatTest, MovesOnlyWhileSomebodyWatches) {
  const Result<api::PlanSummary> refused = executor_->Plan(Press());
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("nothing was heard on ircp/safety"), std::string::npos);
  Push(false);
  Begin(Press());
  for (int i = 0; i < 60; ++i) {
    Push(false);
    Step();
  }
  EXPECT_EQ(state(), "executing");
  ExpectHold("the last sample on ircp/safety is 0.2");
}

class GuardedTest : public FaultTest {
 protected:
  static ExecutorOptions Guarded() {
    ExecutorOptions options;
    options.planner.guard.touch_n = 8;
    return options;
  }
  GuardedTest() : FaultTest(Guarded()) {}
};

TEST_F(GuardedTest, NamesAPressThatMeetsNoTouch) {
  Begin(Press());
  const Result<api::ExecutionResult> result = Finish();
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->state, "aborted");
  EXPECT_NE(result->detail.find("no touch: \"target\" was not felt within"), std::string::npos)
      << result->detail;
  // Nothing to reset, and lifted off.
  EXPECT_GT(robot_.chain.ToolPose(commanded_).translation.z(), kTarget.z() + 0.05);
  EXPECT_EQ(executor_->Plan(Press()).ok(), true);
}

}  // namespace
}  // namespace exemplar::executor
