#include "eventually.hpp"
#include "robot_rig.hpp"

namespace exemplar::executor {
namespace {

using test::kTarget;
using ExecutorTest = test::RobotRig;

bool Mentions(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(ExecutorTest, PressesAndReportsWhatWasMeasured) {
  lag_rad_ = 0.004;
  Begin(Press());
  Steps(250);
  touch_n_ = 5;
  Steps(10);
  touch_n_ = 0;
  const Result<api::ExecutionResult> result = Finish();
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->state, "done");
  EXPECT_EQ(state(), "done");
  // One cycle behind and a little off besides.
  EXPECT_GT(result->tracking_error_rad, 0.004);
  EXPECT_LT(result->tracking_error_rad, 0.05);
  EXPECT_GE(result->plan.clearance_m, 2e-3);
  EXPECT_GT(result->clearance_m, 0);
  ASSERT_TRUE(result->contact_error_m.has_value());
  EXPECT_LT(*result->contact_error_m, 0.01);
  EXPECT_EQ(result->touch_max_n, 5);
  ASSERT_TRUE(result->touch_onset_s.has_value());
  EXPECT_NEAR(*result->touch_onset_s, 250 * 0.008, 0.05);
  EXPECT_EQ(result->commands_sent, commands_);
  EXPECT_GT(result->base_T_tool.size(), 100U);
  ASSERT_EQ(result->objects.size(), 1U);
  EXPECT_EQ(result->objects[0].base_T_object.translation, kTarget);
  ASSERT_GE(feedback_.size(), 2U);
  EXPECT_EQ(feedback_.front().state, "planning");
  EXPECT_EQ(feedback_.back().state, "executing");
}

TEST_F(ExecutorTest, AsksTheSkillFromWhereTheRobotStands) {
  Begin(Press());
  ASSERT_TRUE(Finish().ok());
  ASSERT_TRUE(skills_.last_query.has_value());
  EXPECT_EQ(skills_.last_query->joint_start_names, robot_.chain.joint_names());
  EXPECT_LT((*skills_.last_query->joint_start - robot_.home).norm(), 1e-12);
  EXPECT_LT(
      (skills_.last_query->start->translation - robot_.chain.ToolPose(robot_.home).translation)
          .norm(),
      1e-12);
}

TEST_F(ExecutorTest, GoesToTheStartThatIsAskedFor) {
  api::ExecuteRequest request = Press();
  geometry::Pose start = robot_.chain.ToolPose(robot_.home);
  start.translation += Eigen::Vector3d(-0.1, 0.15, 0.05);
  request.start = start;
  Begin(request);
  const Result<api::ExecutionResult> result = Finish();
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(skills_.last_query->start->translation, start.translation);
  EXPECT_FALSE(skills_.last_query->joint_start.has_value());
  double nearest = 1;
  for (const geometry::Pose& tool : result->base_T_tool) {
    nearest = std::min(nearest, (tool.translation - start.translation).norm());
  }
  EXPECT_LT(nearest, 0.01);
}

TEST_F(ExecutorTest, PlansWithoutMoving) {
  const Result<api::PlanSummary> plan = executor_->Plan(Press());
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_GT(plan->duration_s, 2);
  EXPECT_EQ(plan->frames, 181);
  EXPECT_FALSE(plan->clearance_between.empty());
  EXPECT_EQ(state(), "ready");
  EXPECT_EQ(commands_, 0U);
}

TEST_F(ExecutorTest, UsesTheObjectWhereItWasSeenLast) {
  See({0.5, 0.1, 0.04});
  See({0.58, -0.1, 0.04});
  api::ExecuteRequest request = Press();
  request.objects.clear();
  ASSERT_TRUE(executor_->Plan(request).ok());
  EXPECT_EQ(skills_.last_query->objects[0].base_T_object.translation,
            Eigen::Vector3d(0.58, -0.1, 0.04));
}

TEST_F(ExecutorTest, RefusesAnObjectThatWasNotSeenLately) {
  api::ExecuteRequest request = Press();
  request.objects.clear();
  Result<api::PlanSummary> plan = executor_->Plan(request);
  ASSERT_FALSE(plan.ok());
  EXPECT_TRUE(Mentions(plan.error().message, "\"target\" was not seen")) << plan.error().message;
  See({0.58, -0.1, 0.04});
  clock_.Advance(std::chrono::seconds(5));
  PublishState();
  plan = executor_->Plan(request);
  ASSERT_FALSE(plan.ok());
  EXPECT_TRUE(Mentions(plan.error().message, "5.0 s ago")) << plan.error().message;
  EXPECT_EQ(state(), "idle");
}

TEST_F(ExecutorTest, RefusesASecondExecutionAndSaysWhoHoldsTheRobot) {
  Begin(Press());
  Steps(30);
  const Result<api::PlanSummary> second = executor_->Plan(Press());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_TRUE(Mentions(second.error().message, "an execution of \"press\""))
      << second.error().message;
  EXPECT_EQ(Finish()->state, "done");
}

TEST_F(ExecutorTest, RestsWhilePausedAndEndsAfterResuming) {
  Begin(Press());
  Steps(100);
  EXPECT_GT(speed(), 0);
  ASSERT_TRUE(executor_->Pause().ok());
  Steps(60);
  EXPECT_EQ(state(), "paused");
  EXPECT_EQ(speed(), 0);
  const Eigen::VectorXd rest = commanded_;
  Steps(200);
  EXPECT_EQ(commanded_, rest);
  ASSERT_TRUE(executor_->Resume().ok());
  EXPECT_EQ(Finish()->state, "done");
}

TEST_F(ExecutorTest, EndsAbortedWhenCancelled) {
  Begin(Press());
  Steps(100);
  ASSERT_TRUE(executor_->Cancel().ok());
  const Result<api::ExecutionResult> result = Finish();
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->state, "aborted");
  EXPECT_EQ(speed(), 0);
  // Nothing to reset: the next one may begin.
  EXPECT_TRUE(executor_->Plan(Press()).ok());
}

TEST_F(ExecutorTest, EndsAbortedWhenTheCallerGoes) {
  Begin(Press());
  Steps(60);
  stop_.request_stop();
  EXPECT_EQ(Finish()->state, "aborted");
}

TEST_F(ExecutorTest, NeedsAResetAfterAStop) {
  Begin(Press());
  Steps(100);
  ASSERT_TRUE(executor_->Stop().ok());
  EXPECT_EQ(Finish()->state, "protective_stop");
  const Result<api::PlanSummary> refused = executor_->Plan(Press());
  ASSERT_FALSE(refused.ok());
  EXPECT_TRUE(Mentions(refused.error().message, "reset first")) << refused.error().message;
  ASSERT_TRUE(executor_->Reset().ok());
  EXPECT_TRUE(executor_->Plan(Press()).ok());
}

TEST_F(ExecutorTest, LatchesAnEmergencyStopFromTheNetwork) {
  Begin(Press());
  Steps(100);
  ircp::SafetySample pressed;
  pressed.emergency_stop = true;
  ASSERT_TRUE(safety_writer_->Write(pressed).ok());
  const Result<api::ExecutionResult> result = Finish();
  EXPECT_EQ(result->state, "emergency_stop");
  EXPECT_TRUE(Mentions(result->detail, "panel")) << result->detail;
  EXPECT_FALSE(executor_->Stop().ok() && state() != "emergency_stop");
  EXPECT_FALSE(executor_->Plan(Press()).ok());
  ircp::SafetySample reset;
  reset.reset = true;
  ASSERT_TRUE(safety_writer_->Write(reset).ok());
  EXPECT_TRUE(testing::Eventually([this] { return state() == "idle"; }));
}

TEST_F(ExecutorTest, StopsWhenTheRobotFallsSilent) {
  Begin(Press());
  Steps(100);
  speaks_ = false;
  const Result<api::ExecutionResult> result = Finish();
  EXPECT_EQ(result->state, "protective_stop");
  EXPECT_TRUE(Mentions(result->detail, "joint state")) << result->detail;
  EXPECT_EQ(speed(), 0);
}

TEST_F(ExecutorTest, StopsWhenTheRobotDoesNotFollow) {
  Begin(Press());
  Steps(60);
  follows_ = false;
  const Result<api::ExecutionResult> result = Finish();
  EXPECT_EQ(result->state, "protective_stop");
  EXPECT_TRUE(Mentions(result->detail, "away from where it should be")) << result->detail;
}

TEST_F(ExecutorTest, StopsWhenTheTouchIsTooStrong) {
  Begin(Press());
  Steps(100);
  touch_n_ = 150;
  const Result<api::ExecutionResult> result = Finish();
  EXPECT_EQ(result->state, "protective_stop");
  EXPECT_TRUE(Mentions(result->detail, "150.0 N")) << result->detail;
}

TEST_F(ExecutorTest, RunsTheSamePathMoreSlowly) {
  ASSERT_TRUE(executor_->SetSpeed(0.5).ok());
  Begin(Press());
  const Result<api::ExecutionResult> slow = Finish();
  ASSERT_TRUE(slow.ok());
  const auto expected = static_cast<double>(slow->plan.duration_s / 0.5 / 0.008);
  EXPECT_NEAR(static_cast<double>(slow->commands_sent), expected, 0.1 * expected);
  EXPECT_FALSE(executor_->SetSpeed(0).ok());
  EXPECT_FALSE(executor_->SetSpeed(1.5).ok());
  EXPECT_EQ(executor_->GetStatus()->speed, 0.5);
}

TEST_F(ExecutorTest, RefusesWithoutAFreshJointState) {
  clock_.Advance(std::chrono::seconds(1));
  const Result<api::PlanSummary> plan = executor_->Plan(Press());
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, ErrorCode::kUnavailable);
  EXPECT_TRUE(Mentions(plan.error().message, "1.00 s old")) << plan.error().message;
  EXPECT_EQ(state(), "idle");
}

TEST_F(ExecutorTest, SaysWhichJointTheRobotDoesNotReport) {
  ircp::JointStateSample sample;
  sample.names = {"joint1"};
  sample.positions = {0.1};
  ASSERT_TRUE(state_writer_->Write(sample).ok());
  clock_.Advance(std::chrono::seconds(1));
  const Result<api::PlanSummary> plan = executor_->Plan(Press());
  ASSERT_FALSE(plan.ok());
  EXPECT_TRUE(Mentions(plan.error().message, "no position of joint \"joint2\""))
      << plan.error().message;
}

TEST_F(ExecutorTest, ObeysCommandsFromTheNetworkAndPublishesEveryTransition) {
  std::mutex mutex;
  std::vector<std::string> states;
  std::map<std::string, bool> answers;
  std::uint64_t announced = 0;
  const auto statuses = *bus_.MakeReaderOn<ircp::StatusSample>(
      ircp::StatusTopic("executor"), [&](const ircp::StatusSample& sample, const ircp::Reception&) {
        const std::lock_guard lock(mutex);
        if (!sample.request_id.empty()) {
          answers[sample.request_id] = sample.ok;
        } else if (states.empty() || states.back() != sample.state) {
          states.push_back(sample.state);
        }
        for (const ircp::TopicCount& count : sample.sent) announced = count.sent;
      });
  const auto command_writer =
      *bus_.MakeWriterOn<ircp::CommandSample>(ircp::CommandTopic("executor"), "panel");
  const auto command = [&](const std::string& id, const std::string& action,
                           std::map<std::string, std::string> arguments = {}) {
    ircp::CommandSample sample;
    sample.program = "executor";
    sample.request_id = id;
    sample.action = action;
    sample.arguments = std::move(arguments);
    ASSERT_TRUE(command_writer->Write(sample).ok());
    ASSERT_TRUE(testing::Eventually([&] {
      const std::lock_guard lock(mutex);
      return answers.contains(id);
    }));
  };
  Begin(Press());
  Steps(80);
  command("1", "pause");
  EXPECT_EQ(state(), "paused");
  command("2", "speed", {{"factor", "0.8"}});
  command("3", "speed", {{"factor", "fast"}});
  command("4", "resume");
  command("5", "dance");
  Steps(50);
  EXPECT_EQ(Finish()->state, "done");
  EXPECT_EQ(answers, (std::map<std::string, bool>{
                         {"1", true}, {"2", true}, {"3", false}, {"4", true}, {"5", false}}));
  EXPECT_TRUE(testing::Eventually([&] {
    const std::lock_guard lock(mutex);
    return !states.empty() && states.back() == "done";
  }));
  const std::vector<std::string> expected = {"idle",   "planning",  "ready", "executing",
                                             "paused", "executing", "done"};
  const std::lock_guard lock(mutex);
  // In this order; the status that goes out every second may come in between.
  auto next = expected.begin();
  for (const std::string& published : states) {
    if (next != expected.end() && published == *next) ++next;
  }
  EXPECT_TRUE(next == expected.end())
      << "without \"" << *next << "\": " << ::testing::PrintToString(states);
  EXPECT_EQ(announced, commands_);
}

TEST_F(ExecutorTest, PassesOnWhatTheLearningServiceSays) {
  skills_.error = Unavailable("127.0.0.1:50051 does not answer");
  const Result<api::PlanSummary> plan = executor_->Plan(Press());
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(state(), "idle");
  skills_.error.reset();
  api::ExecuteRequest unknown = Press();
  unknown.skill = "juggle";
  EXPECT_EQ(executor_->Plan(unknown).error().code, ErrorCode::kNotFound);
}

TEST_F(ExecutorTest, RefusesATargetOutOfReachAndStaysIdle) {
  api::ExecuteRequest request = Press();
  request.objects[0].base_T_object.translation = {2, 0, 0};
  Begin(request);
  const Result<api::ExecutionResult> result = Finish();
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_EQ(commands_, 0U);
  EXPECT_EQ(state(), "idle");
}

TEST_F(ExecutorTest, RefusesNonsense) {
  api::ExecuteRequest request = Press();
  request.skill.clear();
  EXPECT_EQ(executor_->Plan(request).error().code, ErrorCode::kInvalidArgument);
  request = Press();
  request.speed = -1;
  EXPECT_EQ(executor_->Plan(request).error().field, "speed");
  EXPECT_FALSE(executor_->Pause().ok());
  EXPECT_FALSE(executor_->Resume().ok());
  EXPECT_FALSE(executor_->Cancel().ok());
}

TEST_F(ExecutorTest, HoldsOnThePathWhenItIsShutDown) {
  Begin(Press());
  Steps(100);
  std::future<void> down = std::async(std::launch::async, [this] { executor_->Shutdown(); });
  const Result<api::ExecutionResult> result = Finish();
  down.get();
  EXPECT_EQ(result->state, "protective_stop");
  EXPECT_EQ(speed(), 0);
  EXPECT_EQ(executor_->Plan(Press()).error().code, ErrorCode::kUnavailable);
}

TEST_F(ExecutorTest, BeginsTheNextMotionWhereTheLastCommandLeftTheRobot) {
  lag_rad_ = 0.01;
  Begin(Press());
  ASSERT_TRUE(Finish().ok());
  const Eigen::VectorXd last = commanded_;
  ASSERT_TRUE(executor_->Plan(Press()).ok());
  EXPECT_LT((*skills_.last_query->joint_start - last).norm(), 1e-12);
  // Moved by hand meanwhile: from where it is measured.
  measured_[0] += 0.3;
  PublishState();
  ASSERT_TRUE(executor_->Plan(Press()).ok());
  EXPECT_LT((*skills_.last_query->joint_start - measured_).norm(), 1e-12);
}

}  // namespace
}  // namespace exemplar::executor
