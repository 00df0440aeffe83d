// The robots of deploy/models.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "exemplar/demonstration/csv.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "robots.hpp"

namespace exemplar::kinematics {
namespace {

using ::testing::ElementsAre;

RobotDescription ReadModel(const std::string& robot) {
  Result<RobotDescription> description = ReadRobotDescription(testing::ModelFolder(robot));
  EXPECT_TRUE(description.ok()) << (description.ok() ? "" : description.error().message);
  return *std::move(description);
}

TEST(Models, RestWithTheFingerPointingDownOverTheTable) {
  for (const char* robot : {"arm7", "leonardo", "ur5e_like"}) {
    const RobotDescription description = ReadModel(robot);
    const geometry::Pose tool = description.chain.ToolPose(description.home);
    EXPECT_LT((tool.rotation * Eigen::Vector3d::UnitZ()).z(), -0.75) << robot;
    EXPECT_GT(tool.translation.z(), 0.08) << robot;
    EXPECT_GT(tool.translation.x(), 0.3) << robot;
    EXPECT_EQ(description.touch_links.size(), 1U) << robot;
  }
}

TEST(Models, EveryMovingLinkHasAMass) {
  for (const char* robot : {"arm7", "leonardo", "ur5e_like"}) {
    const RobotModel model = ReadModel(robot).model;
    for (const Joint& joint : model.joints) {
      if (joint.type == JointType::kFixed) continue;
      const Link& link = model.links[joint.child_link];
      ASSERT_TRUE(link.inertial) << robot << " " << link.name;
      EXPECT_GT(link.inertial->mass_kg, 0) << robot << " " << link.name;
      EXPECT_GT(link.inertial->inertia_kg_m2.diagonal().minCoeff(), 0) << robot << " " << link.name;
    }
  }
}

TEST(Models, LeonardoHasTheNineJointsOfTable1InOrder) {
  EXPECT_THAT(
      ReadModel("leonardo").chain.joint_names(),
      ElementsAre("torso_rotation", "hip_front_back", "hip_side_side", "right_shoulder_in_out",
                  "right_shoulder_forward_backward", "right_upper_arm_rotation",
                  "right_elbow_in_out", "right_forearm_rotation", "right_wrist_in_out"));
}

TEST(Models, LeonardosJointsTurnTheWayTheirNamesSay) {
  const RobotDescription robot = ReadModel("leonardo");
  Eigen::VectorXd hanging = Eigen::VectorXd::Zero(9);
  const auto moved = [&](int joint, const Eigen::VectorXd& from) {
    Eigen::VectorXd q = from;
    q[joint] += 0.3;
    return Eigen::Vector3d(robot.chain.ToolPose(q).translation -
                           robot.chain.ToolPose(from).translation);
  };
  EXPECT_GT(moved(0, hanging).x(), 0.02) << "the torso turns left, the right hand comes forward";
  EXPECT_LT(moved(3, hanging).y(), -0.1) << "the arm goes out to the right";
  EXPECT_GT(moved(4, hanging).x(), 0.1) << "the arm goes forward";
  EXPECT_GT(moved(6, hanging).x(), 0.05) << "the elbow bends forward";
  EXPECT_GT(moved(8, hanging).y(), 0.02) << "the hand bends inward";
  Eigen::VectorXd bent = hanging;
  bent[6] = 1.5;
  EXPECT_GT(moved(5, bent).y(), 0.05) << "the upper arm turns the forearm inward";
  const geometry::Pose tool = robot.chain.ToolPose(hanging);
  EXPECT_NEAR(tool.translation.z(), 0.05 + 0.46 - 0.29 - 0.255 - 0.18, 1e-12);
}

TEST(Models, Ur5eLikeHasThePublishedDimensions) {
  const std::filesystem::path file = testing::DataFolder() / "robots/ur5e.urdf";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no data in " << file;
  const RobotModel real = *ReadUrdf(file);
  const Chain theirs = testing::ChainOf(real, "base_link", "tool0");
  const RobotModel model = ReadModel("ur5e_like").model;
  const Chain ours = testing::ChainOf(model, "base_link", "tool0");
  Rng rng(1);
  for (int round = 0; round < 100; ++round) {
    const Eigen::VectorXd q = testing::RandomPosture(ours, rng);
    const geometry::Pose a = ours.ToolPose(q);
    const geometry::Pose b = theirs.ToolPose(q);
    EXPECT_LT((a.translation - b.translation).norm(), 1e-6);
    EXPECT_LT(geometry::AngleBetween(a.rotation, b.rotation), 1e-6);
  }
}

/// Follows a path of tool poses from home, each frame from the one before; the largest joint step.
double FollowedWithStep(const RobotDescription& robot, const std::vector<geometry::Pose>& path,
                        const std::string& name) {
  Eigen::VectorXd q = robot.home;
  double largest = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    IkOptions options;
    options.preferred = robot.home;
    if (i > 0) options.max_restarts = 0;
    const Result<IkSolution> solution = SolveIk(robot.chain, path[i], q, options);
    if (!solution) {
      ADD_FAILURE() << name << " sample " << i << ": " << solution.error().message;
      return largest;
    }
    if (i > 0) largest = std::max(largest, (solution->q - q).cwiseAbs().maxCoeff());
    q = solution->q;
  }
  return largest;
}

TEST(Models, Arm7FollowsEveryTrialOfThePeople) {
  if (!std::filesystem::is_directory(testing::DataFolder() / "rail_pressing")) {
    GTEST_SKIP() << "no data in " << testing::DataFolder();
  }
  const RobotDescription robot = ReadModel("arm7");
  for (const char* task : {"rail_pressing", "rail_pushing"}) {
    for (const auto& entry : std::filesystem::directory_iterator(testing::DataFolder() / task)) {
      std::ostringstream text;
      text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      const Result<demonstration::Trial> trial =
          demonstration::ReadCsv(text.str(), entry.path().string());
      ASSERT_TRUE(trial.ok()) << trial.error().message;
      const std::string name = entry.path().filename().string();
      EXPECT_LT(FollowedWithStep(robot, trial->end_effectors.at(0).base_T_frame, name), 0.1)
          << name;
    }
  }
}

TEST(Models, Arm7CoversItsWorkspace) {
  // What the people's trials need, drawn rather than read: down-pointing tools over the table.
  const RobotDescription robot = ReadModel("arm7");
  Rng rng(3);
  for (int round = 0; round < 300; ++round) {
    const double radius = rng.Uniform(0.36, 0.85);
    const double azimuth = rng.Uniform(-0.6, 0.6);
    geometry::Pose goal;
    goal.translation = {radius * std::cos(azimuth), radius * std::sin(azimuth),
                        rng.Uniform(0.03, 0.45)};
    if (goal.translation.norm() > 0.89) continue;
    goal.rotation = Eigen::AngleAxisd(rng.Uniform(-2.5, -0.2), Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(M_PI + rng.Uniform(-0.3, 0.3), Eigen::Vector3d::UnitX());
    const Result<IkSolution> solution = SolveIk(robot.chain, goal, robot.home);
    EXPECT_TRUE(solution.ok()) << solution.error().message;
  }
}

}  // namespace
}  // namespace exemplar::kinematics
