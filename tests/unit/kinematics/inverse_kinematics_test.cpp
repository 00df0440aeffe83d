#include "exemplar/kinematics/inverse_kinematics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "robots.hpp"

namespace exemplar::kinematics {
namespace {

using ::testing::HasSubstr;

void ExpectReached(const Chain& chain, const geometry::Pose& goal, const IkSolution& solution,
                   double tolerance) {
  const geometry::Pose reached = chain.ToolPose(solution.q);
  EXPECT_LE((reached.translation - goal.translation).norm(), tolerance);
  EXPECT_LE(geometry::AngleBetween(reached.rotation, goal.rotation), tolerance);
  EXPECT_TRUE(testing::WithinLimits(chain, solution.q));
}

TEST(SolveIk, InvertsForwardKinematicsOnEveryChain) {
  constexpr int kPoses = 2000;
  for (const testing::NamedChain& named : testing::AllChains()) {
    Rng rng(17);
    int solved = 0;
    for (int i = 0; i < kPoses; ++i) {
      const geometry::Pose goal = named.chain.ToolPose(testing::RandomPosture(named.chain, rng));
      const Result<IkSolution> solution =
          SolveIk(named.chain, goal, testing::MiddlePosture(named.chain));
      if (!solution) continue;
      ++solved;
      ExpectReached(named.chain, goal, *solution, 1.0001e-5);
    }
    EXPECT_GE(solved, kPoses - 1) << named.name;
  }
}

TEST(SolveIk, FindsPosturesOnTheLimits) {
  const RobotModel model = *ReadUrdf(testing::ModelFolder("leonardo") / "leonardo.urdf");
  const Chain chain = testing::ChainOf(model);
  Rng rng(4);
  for (int round = 0; round < 200; ++round) {
    Eigen::VectorXd q = testing::RandomPosture(chain, rng);
    const int joint = static_cast<int>(rng.Below(9));
    const JointLimits& limits = chain.limits()[static_cast<std::size_t>(joint)];
    q[joint] = round % 2 == 0 ? limits.lower : limits.upper;
    const geometry::Pose goal = chain.ToolPose(q);
    const Result<IkSolution> solution = SolveIk(chain, goal, testing::MiddlePosture(chain));
    ASSERT_TRUE(solution.ok()) << solution.error().message;
    ExpectReached(chain, goal, *solution, 1.0001e-5);
  }
}

TEST(SolveIk, GivesTheSameAnswerForTheSameSeed) {
  const RobotModel model = *ReadUrdf(testing::ModelFolder("arm7") / "arm7.urdf");
  const Chain chain = testing::ChainOf(model);
  Rng rng(2);
  for (int round = 0; round < 50; ++round) {
    const geometry::Pose goal = chain.ToolPose(testing::RandomPosture(chain, rng));
    const Eigen::VectorXd seed = testing::MiddlePosture(chain);
    const Result<IkSolution> a = SolveIk(chain, goal, seed, {.random_seed = 9});
    const Result<IkSolution> b = SolveIk(chain, goal, seed, {.random_seed = 9});
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->q, b->q);
  }
}

TEST(SolveIk, TakesTheNearestPostureToThePreferredOne) {
  const RobotModel model = *ReadUrdf(testing::ModelFolder("arm7") / "arm7.urdf");
  const Chain chain = testing::ChainOf(model);
  Rng rng(6);
  for (int round = 0; round < 100; ++round) {
    IkOptions options;
    options.position_tolerance_m = options.rotation_tolerance_rad = 1e-8;
    options.preferred_weights = Eigen::VectorXd::LinSpaced(7, 3, 1);
    const Eigen::VectorXd q = testing::RandomPosture(chain, rng);
    const geometry::Pose goal = chain.ToolPose(q);
    options.preferred = q;
    for (int i = 0; i < 7; ++i) options.preferred[i] += rng.Uniform(-0.2, 0.2);
    const Result<IkSolution> solution = SolveIk(chain, goal, q, options);
    ASSERT_TRUE(solution.ok()) << solution.error().message;
    ExpectReached(chain, goal, *solution, 1.0001e-8);
    // Along the null space nothing pulls any more, unless a limit is in the way.
    Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, 7);
    chain.ToolPoseAndJacobian(solution->q, jacobian);
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(jacobian);
    const Eigen::VectorXd pull =
        options.preferred_weights.cwiseProduct(options.preferred - solution->q);
    bool on_limit = false;
    for (int i = 0; i < 7; ++i) {
      const JointLimits& limits = chain.limits()[static_cast<std::size_t>(i)];
      on_limit = on_limit || solution->q[i] == limits.lower || solution->q[i] == limits.upper;
    }
    if (on_limit || lu.dimensionOfKernel() != 1) continue;
    const Eigen::VectorXd along = lu.kernel().col(0).normalized();
    EXPECT_LT(std::abs(along.dot(pull)), 2e-3);
  }
}

TEST(SolveIk, LeavesTheRollFreeWhenAsked) {
  const RobotModel model = *ReadUrdf(testing::ModelFolder("leonardo") / "leonardo.urdf");
  const Chain chain = testing::ChainOf(model);
  Rng rng(12);
  int other_roll = 0;
  for (int round = 0; round < 200; ++round) {
    const geometry::Pose goal = chain.ToolPose(testing::RandomPosture(chain, rng));
    const Result<IkSolution> solution =
        SolveIk(chain, goal, testing::MiddlePosture(chain), {.free_tool_roll = true});
    ASSERT_TRUE(solution.ok()) << solution.error().message;
    const geometry::Pose reached = chain.ToolPose(solution->q);
    const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
    EXPECT_LT((reached.translation - goal.translation).norm(), 1.0001e-5);
    EXPECT_LT((reached.rotation * z - goal.rotation * z).norm(), 1.0001e-5);
    if (geometry::AngleBetween(reached.rotation, goal.rotation) > 0.1) ++other_roll;
  }
  EXPECT_GT(other_roll, 100);
}

TEST(SolveIk, ReachesPositionsAlone) {
  const Chain chain = testing::ChainOf(testing::Parse(testing::TwoLinkRobot()));
  const geometry::Pose goal = geometry::Pose::FromTranslation({0.2, 0.5, 0});
  const Result<IkSolution> solution =
      SolveIk(chain, goal, Eigen::Vector2d(0.1, 0.3), {.use_rotation = false});
  ASSERT_TRUE(solution.ok()) << solution.error().message;
  EXPECT_LT((chain.ToolPose(solution->q).translation - goal.translation).norm(), 1.0001e-5);
  EXPECT_FALSE(SolveIk(chain, goal, Eigen::Vector2d(0.1, 0.3)).ok())
      << "two joints cannot also turn the tool";
}

TEST(SolveIk, SaysHowNearItCameWhenThePoseIsOutOfReach) {
  const Chain chain = testing::ChainOf(testing::Parse(testing::TwoLinkRobot()));
  const Result<IkSolution> solution = SolveIk(chain, geometry::Pose::FromTranslation({0.9, 0, 0}),
                                              Eigen::Vector2d(0.5, 0.5), {.use_rotation = false});
  ASSERT_FALSE(solution.ok());
  EXPECT_EQ(solution.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(solution.error().message, HasSubstr("(0.9000, 0.0000, 0.0000)"));
  EXPECT_THAT(solution.error().message, HasSubstr("100.0"));
}

TEST(SolveIk, RefusesPosesThatAreNotFinite) {
  const Chain chain = testing::ChainOf(testing::Parse(testing::TwoLinkRobot()));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector2d seed(0.1, 0.2);
  EXPECT_EQ(SolveIk(chain, geometry::Pose::FromTranslation({nan, 0, 0}), seed).error().field,
            "base_T_tool");
  geometry::Pose zero;
  zero.rotation.coeffs().setZero();
  EXPECT_EQ(SolveIk(chain, zero, seed).error().field, "base_T_tool");
  EXPECT_EQ(SolveIk(chain, {}, Eigen::Vector2d(nan, 0)).error().field, "seed");
}

}  // namespace
}  // namespace exemplar::kinematics
