// What pose inverse kinematics leaves free, and what it makes of it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "exemplar/kinematics/inertia.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/kinematics/posture_cost.hpp"
#include "robots.hpp"

namespace exemplar::kinematics {
namespace {

constexpr double kFree = std::numeric_limits<double>::infinity();

void ExpectGradientIsTheDerivative(const Chain& chain, const PostureCost& cost,
                                   const Eigen::VectorXd& q, const std::string& name) {
  constexpr double kStep = 1e-6;
  const int n = chain.dof();
  Eigen::VectorXd gradient(n), curvature(n), unused(n);
  const double value = EvaluatePostureCost(chain, cost, q, gradient, curvature);
  EXPECT_TRUE(std::isfinite(value));
  EXPECT_GT(curvature.minCoeff(), 0);
  for (int i = 0; i < n; ++i) {
    Eigen::VectorXd low = q, high = q;
    low[i] -= kStep;
    high[i] += kStep;
    const double numeric = (EvaluatePostureCost(chain, cost, high, unused, curvature) -
                            EvaluatePostureCost(chain, cost, low, unused, curvature)) /
                           (2 * kStep);
    EXPECT_NEAR(gradient[i], numeric, 1e-5 * (1 + std::abs(numeric))) << name << " joint " << i;
  }
}

/// Well within the limits, where differences do not cross the steep end of a cost.
Eigen::VectorXd InnerPosture(const Chain& chain, Rng& rng) {
  const Eigen::VectorXd middle = testing::MiddlePosture(chain);
  return middle + 0.8 * (testing::RandomPosture(chain, rng) - middle);
}

TEST(PostureCost, GradientsAreTheDerivatives) {
  Rng rng(31);
  std::vector<testing::NamedChain> chains = testing::AllChains();
  const RobotModel mixed = testing::Parse(testing::MixedRobot());
  chains.push_back({"mixed", mixed, testing::ChainOf(mixed)});
  chains.push_back({"mixed, leaf to leaf", mixed, testing::ChainOf(mixed, "tool", "left")});
  const RobotModel two = testing::Parse(testing::TwoLinkRobot());
  chains.push_back({"two", two, testing::ChainOf(two)});
  for (const testing::NamedChain& named : chains) {
    const int n = named.chain.dof();
    for (int round = 0; round < 5; ++round) {
      const Eigen::VectorXd q = InnerPosture(named.chain, rng);
      PostureCost preferred{.preferred = InnerPosture(named.chain, rng),
                            .preferred_weights = Eigen::VectorXd::LinSpaced(n, 1, 3)};
      ExpectGradientIsTheDerivative(named.chain, preferred, q, named.name + " preferred");
      ExpectGradientIsTheDerivative(named.chain, {.limits_weight = 2}, q, named.name + " limits");
      ExpectGradientIsTheDerivative(named.chain, {.manipulability_weight = 0.5}, q,
                                    named.name + " manipulability");
      const Result<ChainInertia> inertia = ChainInertia::Create(named.model, named.chain);
      if (!inertia.ok()) continue;
      PostureCost energy{.energy_from = InnerPosture(named.chain, rng)};
      energy.energy_metric = inertia->MassMatrix(energy.energy_from);
      ExpectGradientIsTheDerivative(named.chain, energy, q, named.name + " energy");
    }
  }
}

TEST(SolveIk, LowersEachCostAlongTheNullSpaceAndKeepsThePose) {
  const RobotModel model = *ReadUrdf(testing::ModelFolder("leonardo") / "leonardo.urdf");
  const Chain chain = testing::ChainOf(model);
  const ChainInertia inertia = *ChainInertia::Create(model, chain);
  Rng rng(14);
  Eigen::VectorXd slope(9), curvature(9);
  double gained[3] = {};
  for (int round = 0; round < 30; ++round) {
    const Eigen::VectorXd seed = InnerPosture(chain, rng);
    const geometry::Pose goal = chain.ToolPose(seed);
    PostureCost costs[3] = {{.limits_weight = 9}, {.manipulability_weight = 1}, {}};
    costs[2].energy_from = InnerPosture(chain, rng);
    costs[2].energy_metric = inertia.MassMatrix(costs[2].energy_from);
    for (int which = 0; which < 3; ++which) {
      IkOptions options;
      options.posture = costs[which];
      const Result<IkSolution> solution = SolveIk(chain, goal, seed, options);
      ASSERT_TRUE(solution.ok()) << solution.error().message;
      EXPECT_TRUE(testing::WithinLimits(chain, solution->q));
      const geometry::Pose reached = chain.ToolPose(solution->q);
      EXPECT_LT((reached.translation - goal.translation).norm(), 1.0001e-5);
      EXPECT_LT(geometry::AngleBetween(reached.rotation, goal.rotation), 1.0001e-5);
      const double before = EvaluatePostureCost(chain, costs[which], seed, slope, curvature);
      const double after = EvaluatePostureCost(chain, costs[which], solution->q, slope, curvature);
      EXPECT_LE(after, before + 1e-9) << which;
      gained[which] += (before - after) / (std::abs(before) + 1e-12);
    }
  }
  for (const double gain : gained) EXPECT_GT(gain / 30, 0.05);
}

TEST(SolveIk, StaysWithinTheSlackOfEachAxis) {
  const RobotModel model = *ReadUrdf(testing::ModelFolder("ur5e_like") / "ur5e_like.urdf");
  const Chain chain = testing::ChainOf(model);
  Rng rng(15);
  int used = 0;
  for (int round = 0; round < 200; ++round) {
    const geometry::Pose goal = chain.ToolPose(testing::RandomPosture(chain, rng));
    IkOptions options;
    options.position_slack_m = {0.02, 0, 0.001};
    options.rotation_slack_rad = {0, 0.3, kFree};
    const Result<IkSolution> solution =
        SolveIk(chain, goal, testing::MiddlePosture(chain), options);
    ASSERT_TRUE(solution.ok()) << solution.error().message;
    const geometry::Pose goal_T_tool = goal.Inverse() * chain.ToolPose(solution->q);
    const Eigen::Vector3d turn = geometry::LogSo3(goal_T_tool.rotation);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LE(std::abs(goal_T_tool.translation[axis]), options.position_slack_m[axis] + 1.1e-5);
      EXPECT_LE(std::abs(turn[axis]), options.rotation_slack_rad[axis] + 1.1e-5);
    }
    used += std::abs(turn.z()) > 0.1 ? 1 : 0;
  }
  EXPECT_GT(used, 50) << "the turn about z is free";
}

TEST(SolveIk, ReachesPosesThatOnlyTheSlackBringsWithinReach) {
  const Chain chain = testing::ChainOf(testing::Parse(testing::TwoLinkRobot()));
  IkOptions options;
  options.use_rotation = false;
  options.position_slack_m = {0.11, 0, 0};
  const Result<IkSolution> solution = SolveIk(chain, geometry::Pose::FromTranslation({0.9, 0, 0}),
                                              Eigen::Vector2d(0.4, 0.4), options);
  ASSERT_TRUE(solution.ok()) << solution.error().message;
  EXPECT_GE(chain.ToolPose(solution->q).translation.x(), 0.79 - 1e-4);
}

TEST(SolveIk, PointsTheToolAtAPlaceFromWhereverItStands) {
  const RobotModel model = *ReadUrdf(testing::ModelFolder("arm7") / "arm7.urdf");
  const Chain chain = testing::ChainOf(model);
  Rng rng(16);
  int solved = 0;
  for (int round = 0; round < 100; ++round) {
    const Eigen::VectorXd seed = InnerPosture(chain, rng);
    const geometry::Pose from = chain.ToolPose(seed);
    // A little off where it points now.
    const Eigen::Vector3d aside(rng.Uniform(-0.3, 0.3), rng.Uniform(-0.3, 0.3), 1);
    const Eigen::Vector3d place = from * Eigen::Vector3d(rng.Uniform(0.2, 2.0) * aside);
    IkOptions options;
    options.point_at = place;
    // With the place of the tool held, and free in x and y.
    if (round % 2 == 1) options.position_slack_m = {kFree, kFree, 0};
    const Result<IkSolution> solution = SolveIk(chain, from, seed, options);
    if (!solution.ok()) continue;
    ++solved;
    const geometry::Pose tool = chain.ToolPose(solution->q);
    const Eigen::Vector3d way = (place - tool.translation).normalized();
    EXPECT_LT((tool.rotation * Eigen::Vector3d::UnitZ() - way).norm(), 1.1e-5);
    if (round % 2 == 0) {
      EXPECT_LT((tool.translation - from.translation).norm(), 1.1e-5);
    }
  }
  EXPECT_GE(solved, 90);
}

TEST(SolveIk, RefusesASlackThatIsNone) {
  const Chain chain = testing::ChainOf(testing::Parse(testing::TwoLinkRobot()));
  IkOptions options;
  options.rotation_slack_rad = {0, -0.1, 0};
  EXPECT_EQ(SolveIk(chain, {}, Eigen::Vector2d::Zero(), options).error().field, "slack");
  options.rotation_slack_rad.setZero();
  options.point_at = Eigen::Vector3d(0, std::nan(""), 0);
  EXPECT_EQ(SolveIk(chain, {}, Eigen::Vector2d::Zero(), options).error().field, "point_at");
}

}  // namespace
}  // namespace exemplar::kinematics
