// The paper's fifth claim carried on to the joints (PAPER.md section 9): what is left of the exact
// contact after inverse kinematics, limits and timing. docs/claims.md lists all claims.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/learning/skill.hpp"
#include "exemplar/motion/plan.hpp"
#include "press.hpp"

namespace exemplar::motion {
namespace {

using demonstration::SkillMotion;
using Eigen::Vector3d;

/// From home to the button, a hold, and back, at exactly the button's place.
learning::NamedTrial PressTrial(const kinematics::RobotDescription& robot, const Vector3d& button,
                                double reach_s) {
  constexpr double kRate_hz = 60;
  constexpr double kRest_s = 0.3;
  constexpr double kHold_s = 0.6;
  const Result<kinematics::IkSolution> pressed =
      kinematics::SolveIk(robot.chain, geometry::Pose::FromTranslation(button), robot.home,
                          {.position_tolerance_m = 1e-9, .use_rotation = false});
  if (!pressed.ok()) throw std::runtime_error(pressed.error().message);
  const double end_s = 2 * (kRest_s + reach_s) + kHold_s;
  const auto samples = static_cast<Eigen::Index>(std::lround(end_s * kRate_hz)) + 1;
  learning::NamedTrial named;
  demonstration::Trial& trial = named.trial;
  Eigen::MatrixXd joints(samples, robot.chain.dof());
  Eigen::MatrixXd touch(samples, 1);
  std::vector<double> time_s;
  for (Eigen::Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / kRate_hz;
    const double there = test::MinimumJerk((t - kRest_s) / reach_s);
    const double back = test::MinimumJerk((t - kRest_s - reach_s - kHold_s) / reach_s);
    time_s.push_back(t);
    joints.row(k) = (robot.home + (there - back) * (pressed->q - robot.home)).transpose();
    touch(k, 0) = there == 1 && back == 0 ? 5 : 0;
  }
  trial.joints = {robot.chain.joint_names(), time_s, joints};
  trial.tactile = {{"finger"}, time_s, touch};
  trial.objects.push_back({.name = "button",
                           .time_s = time_s,
                           .base_T_frame = std::vector<geometry::Pose>(
                               time_s.size(), geometry::Pose::FromTranslation(button))});
  return named;
}

double ToolError(const kinematics::Chain& chain, const Eigen::VectorXd& q, const Vector3d& place) {
  return (chain.ToolPose(q).translation - place).norm();
}

TEST(Claims, ContactStaysExactAfterInverseKinematicsWhereJointwiseRbfFails) {
  const kinematics::RobotDescription robot = test::LoadRobot("leonardo");
  const auto tool = std::make_shared<kinematics::Chain>(robot.chain);
  const Vector3d rest = tool->ToolPose(robot.home).translation;
  std::vector<learning::NamedTrial> trials;
  for (const Vector3d& from_rest :
       {Vector3d(-.04, -.1, -.06), Vector3d(.1, -.08, -.1), Vector3d(.0, .1, -.12),
        Vector3d(.09, .11, -.05), Vector3d(.04, 0, -.08), Vector3d(-.02, .04, -.11)}) {
    const double reach_s = 1.2 + 0.1 * static_cast<double>(trials.size());
    trials.push_back(PressTrial(robot, rest + from_rest, reach_s));
    trials.back().id = "press-" + std::to_string(trials.size());
    trials.back().trial.source = trials.back().id + ".csv";
  }
  const Result<learning::LearnOptions> options =
      learning::LearnOptions::FromStrings({{"method", "paper"}});
  const Result<learning::Skill> skill = learning::LearnSkill(trials, *options, tool);
  ASSERT_TRUE(skill.ok()) << skill.error().message;
  const Result<collision::CollisionChecker> checker =
      collision::CollisionChecker::Create(robot.model, {});
  ASSERT_TRUE(checker.ok());
  double jointwise_m = 0;
  double blended_m = 0;
  double after_m = 0;
  for (const double x : {-.05, .04, .12}) {
    for (const double y : {-.14, 0., .14}) {
      const Vector3d button = rest + Vector3d(x, y, -.09);
      demonstration::SkillQuery query;
      query.objects.push_back({"button", geometry::Pose::FromTranslation(button)});
      const Result<SkillMotion> motion = Answer(*skill, query);
      ASSERT_TRUE(motion.ok());
      ASSERT_EQ(motion->contacts.size(), 1U);
      const int middle = (motion->contacts[0].first + motion->contacts[0].last) / 2;
      jointwise_m =
          std::max(jointwise_m, ToolError(*tool, motion->joints.row(middle).transpose(), button));
      blended_m = std::max(
          blended_m,
          (motion->base_T_tool[static_cast<std::size_t>(middle)].translation - button).norm());
      PlanOptions how;
      how.touch_links = robot.touch_links;
      how.comfortable = robot.home;
      const Result<PlannedMotion> plan =
          PlanMotion(*motion, robot.model, robot.chain, *checker, robot.home, how);
      ASSERT_TRUE(plan.ok()) << plan.error().message;
      ASSERT_EQ(plan->contacts.size(), 1U);
      Eigen::VectorXd q(tool->dof());
      Eigen::VectorXd velocity(tool->dof());
      Evaluate(plan->trajectory, (plan->contacts[0].begin_s + plan->contacts[0].end_s) / 2, q,
               velocity);
      after_m = std::max(after_m, ToolError(*tool, q, button));
    }
  }
  std::printf("worst over the map: joint-wise %.3f mm, blended %.6f mm, after IK %.6f mm\n",
              1e3 * jointwise_m, 1e3 * blended_m, 1e3 * after_m);
  EXPECT_GT(jointwise_m, 2e-3);
  EXPECT_LT(blended_m, 1e-6);
  EXPECT_LT(after_m, 1e-4);
}

}  // namespace
}  // namespace exemplar::motion
