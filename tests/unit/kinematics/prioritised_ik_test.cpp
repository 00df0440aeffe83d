#include "exemplar/kinematics/prioritised_ik.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exemplar/kinematics/robot_description.hpp"
#include "robots.hpp"

namespace exemplar::kinematics {
namespace {

/// A torso that turns and leans, with two mirrored arms of four joints each.
std::string TwoArmedRobot() {
  std::string urdf = R"(<robot name="two arms"><link name="pelvis"/><link name="waist"/>
    <link name="chest"/>
    <joint name="turn" type="revolute"><parent link="pelvis"/><child link="waist"/>
      <origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/>
    </joint>
    <joint name="lean" type="revolute"><parent link="waist"/><child link="chest"/>
      <axis xyz="0 1 0"/><limit lower="-0.3" upper="1" velocity="1" effort="1"/></joint>)";
  const char* parts[] = {"yoke", "upper", "elbow", "fore"};
  const char* axes[] = {"0 1 0", "1 0 0", "0 0 1", "0 1 0"};
  for (const bool left : {true, false}) {
    const std::string side = left ? "left_" : "right_";
    std::string parent = "chest";
    for (int i = 0; i < 4; ++i) {
      const std::string link = side + parts[i];
      const std::string at = i == 0   ? (left ? "0 0.2 0.4" : "0 -0.2 0.4")
                             : i == 3 ? "0 0 -0.3"
                                      : "0 0 0";
      urdf += "<link name=\"" + link + "\"/><joint name=\"" + link +
              "_joint\" type=\"revolute\"><parent link=\"" + parent + "\"/><child link=\"" + link +
              "\"/><origin xyz=\"" + at + "\"/><axis xyz=\"" + axes[i] +
              "\"/><limit lower=\"-2.2\" upper=\"2.2\" velocity=\"1\" effort=\"1\"/></joint>";
      parent = link;
    }
    urdf += "<link name=\"" + side + "hand\"/><joint name=\"" + side +
            "wrist\" type=\"fixed\"><parent link=\"" + parent + "\"/><child link=\"" + side +
            "hand\"/><origin xyz=\"0 0 -0.25\"/></joint>";
  }
  return urdf + "</robot>";
}

bool Within(const ChainGroup& group, const Eigen::VectorXd& q) {
  for (int j = 0; j < group.dof(); ++j) {
    const JointLimits& limits = group.limits()[static_cast<std::size_t>(j)];
    if (q[j] < limits.lower || q[j] > limits.upper) return false;
  }
  return true;
}

ChainGroup BothArms(const RobotModel& model) {
  std::vector<Chain> chains;
  chains.push_back(testing::ChainOf(model, "pelvis", "left_hand"));
  chains.push_back(testing::ChainOf(model, "pelvis", "right_hand"));
  return *ChainGroup::Create(std::move(chains));
}

Eigen::VectorXd Random(const ChainGroup& group, Rng& rng, double share) {
  Eigen::VectorXd q(group.dof());
  for (int j = 0; j < group.dof(); ++j) {
    const JointLimits& limits = group.limits()[static_cast<std::size_t>(j)];
    const double middle = 0.5 * (limits.lower + limits.upper);
    q[j] = middle + share * (rng.Uniform(limits.lower, limits.upper) - middle);
  }
  return q;
}

TEST(ChainGroup, HoldsSharedJointsOnce) {
  const ChainGroup group = BothArms(testing::Parse(TwoArmedRobot()));
  EXPECT_EQ(group.dof(), 10);
  EXPECT_EQ(group.joint_names()[0], "turn");
  EXPECT_EQ(group.indices(1)[0], 0);
  EXPECT_EQ(group.indices(1)[2], 6);
  EXPECT_FALSE(ChainGroup::Create({}).ok());
}

TEST(SolvePrioritised, BringsBothHandsWhereTheyBelongOverTheSharedTorso) {
  const ChainGroup group = BothArms(testing::Parse(TwoArmedRobot()));
  Rng rng(41);
  int met = 0;
  constexpr int kRounds = 40;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::VectorXd there = Random(group, rng, 0.8);
    ToolTask left{.chain = 0,
                  .base_T_tool = group.chains()[0].ToolPose(group.Of(0, there)),
                  .use_rotation = false};
    ToolTask right = left;
    right.chain = 1;
    right.base_T_tool = group.chains()[1].ToolPose(group.Of(1, there));
    const Result<PrioritisedSolution> solution = SolvePrioritised(
        group, std::vector<ToolTask>{left, right}, Eigen::VectorXd::Constant(10, 0.2));
    ASSERT_TRUE(solution.ok()) << solution.error().message;
    EXPECT_TRUE(Within(group, solution->q));
    met += solution->tasks_met == 2 ? 1 : 0;
    for (int arm = 0; arm < 2; ++arm) {
      const geometry::Pose at = group.chains()[arm].ToolPose(group.Of(arm, solution->q));
      const ToolTask& task = arm == 0 ? left : right;
      EXPECT_NEAR((at.translation - task.base_T_tool.translation).norm(),
                  solution->position_error_m[arm], 1e-12);
    }
  }
  EXPECT_GE(met, kRounds - 1);
}

TEST(SolvePrioritised, GivesTheFirstTaskItsWayWhereTwoExcludeEachOther) {
  const ChainGroup group = BothArms(testing::Parse(TwoArmedRobot()));
  // The torso cannot lean both ways: hands far to the front and far to the back.
  const geometry::Pose front = geometry::Pose::FromTranslation({0.75, 0.2, 0.35});
  const geometry::Pose back = geometry::Pose::FromTranslation({-0.9, -0.2, 0.3});
  for (const int first : {0, 1}) {
    std::vector<ToolTask> tasks = {
        {.chain = 0, .base_T_tool = front, .use_rotation = false, .priority = first},
        {.chain = 1, .base_T_tool = back, .use_rotation = false, .priority = 1 - first}};
    const Eigen::VectorXd seed = Eigen::VectorXd::Constant(10, 0.1);
    const Result<PrioritisedSolution> both = SolvePrioritised(group, tasks, seed);
    ASSERT_TRUE(both.ok());
    const auto winner = static_cast<std::size_t>(first == 0 ? 0 : 1);
    // As near as it comes when it is alone, and the other stays away.
    const Result<PrioritisedSolution> alone =
        SolvePrioritised(group, std::vector<ToolTask>{tasks[winner]}, seed);
    ASSERT_TRUE(alone.ok());
    EXPECT_LT(both->position_error_m[winner], alone->position_error_m[0] + 2e-3) << first;
    EXPECT_GT(both->position_error_m[1 - winner], 0.02) << first;
  }
}

TEST(SolvePrioritised, MovesLeonardosElbowAsideWithoutMovingTheFinger) {
  const RobotDescription robot = *ReadRobotDescription(testing::ModelFolder("leonardo"));
  std::vector<Chain> chains;
  chains.push_back(testing::ChainOf(robot.model, "pelvis", "tool"));
  chains.push_back(testing::ChainOf(robot.model, "pelvis", "right_elbow"));
  const ChainGroup group = *ChainGroup::Create(std::move(chains));
  ASSERT_EQ(group.dof(), 9);
  const geometry::Pose tool = group.chains()[0].ToolPose(robot.home);
  geometry::Pose elbow = group.chains()[1].ToolPose(group.Of(1, robot.home));
  constexpr double kAside_m = 0.05;
  elbow.translation.y() -= kAside_m;
  const Result<PrioritisedSolution> solution = SolvePrioritised(
      group,
      std::vector<ToolTask>{
          {.chain = 0, .base_T_tool = tool, .use_rotation = false},
          {.chain = 1, .base_T_tool = elbow, .use_rotation = false, .priority = 1}},
      robot.home, {.max_restarts = 0});
  ASSERT_TRUE(solution.ok()) << solution.error().message;
  EXPECT_LE(solution->position_error_m[0], 1e-5);
  EXPECT_LT(solution->position_error_m[1], 0.5 * kAside_m) << "half of the way at least";
  EXPECT_TRUE(Within(group, solution->q));
}

TEST(SolvePrioritised, TendsToThePostureWithWhatTasksLeaveFree) {
  const ChainGroup group = BothArms(testing::Parse(TwoArmedRobot()));
  Rng rng(43);
  const Eigen::VectorXd there = Random(group, rng, 0.5);
  const std::vector<ToolTask> tasks = {
      {.chain = 0,
       .base_T_tool = group.chains()[0].ToolPose(group.Of(0, there)),
       .use_rotation = false}};
  PrioritisedOptions options;
  options.preferred = Random(group, rng, 0.5);
  const Result<PrioritisedSolution> drawn = SolvePrioritised(group, tasks, there, options);
  ASSERT_TRUE(drawn.ok());
  EXPECT_EQ(drawn->tasks_met, 1);
  // The right arm has no task: all of it goes.
  for (int j = 6; j < 10; ++j) EXPECT_NEAR(drawn->q[j], options.preferred[j], 0.02);
}

TEST(SolvePrioritised, RefusesTasksThatAreNone) {
  const ChainGroup group = BothArms(testing::Parse(TwoArmedRobot()));
  const Eigen::VectorXd seed = Eigen::VectorXd::Zero(10);
  std::vector<ToolTask> tasks = {{.chain = 2}};
  EXPECT_EQ(SolvePrioritised(group, tasks, seed).error().field, "tasks[0].chain");
  tasks[0].chain = 1;
  tasks[0].base_T_tool.translation.z() = std::nan("");
  EXPECT_EQ(SolvePrioritised(group, tasks, seed).error().field, "tasks[0].base_T_tool");
}

}  // namespace
}  // namespace exemplar::kinematics
