#include "exemplar/motion/path_ik.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "exemplar/base/rng.hpp"
#include "press.hpp"

namespace exemplar::motion {
namespace {

constexpr int kFrames = 150;

/// Joints that swing about home, and their tool path shifted smoothly by up to `shift`: exact in
/// every frame.
PathProblem Blended(const kinematics::RobotDescription& robot, Rng& rng,
                    const Eigen::Vector3d& shift) {
  const kinematics::Chain& chain = robot.chain;
  PathProblem problem;
  problem.style.resize(kFrames, chain.dof());
  Eigen::VectorXd amplitude(chain.dof());
  for (int j = 0; j < chain.dof(); ++j) amplitude[j] = rng.Uniform(-0.4, 0.4);
  for (int k = 0; k < kFrames; ++k) {
    const double r = static_cast<double>(k) / (kFrames - 1);
    Eigen::VectorXd q = robot.home + test::MinimumJerk(r) * amplitude;
    for (int j = 0; j < chain.dof(); ++j) {
      const kinematics::JointLimits& limits = chain.limits()[static_cast<std::size_t>(j)];
      q[j] = std::clamp(q[j], limits.lower + 0.05, limits.upper - 0.05);
    }
    problem.style.row(k) = q.transpose();
    geometry::Pose pose = chain.ToolPose(q);
    pose.translation += test::MinimumJerk(1.5 * r) * shift;
    problem.time_s.push_back(k / 60.0);
    problem.base_T_tool.push_back(pose);
  }
  problem.exact.assign(kFrames, true);
  problem.contact = {1e-5, 1e-5, 5e-5, 5e-5};
  problem.style_deviation_rad = Eigen::VectorXd::Constant(chain.dof(), 0.2);
  return problem;
}

Eigen::Vector3d Direction(Rng& rng) {
  return Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal()).normalized();
}

double StyleError(const PathProblem& problem, const Eigen::MatrixXd& joints) {
  return std::sqrt((joints - problem.style).squaredNorm() / static_cast<double>(joints.size()));
}

double SquaredJerk(const Eigen::MatrixXd& q) {
  const Eigen::Index n = q.rows() - 3;
  return (q.bottomRows(n) - 3 * q.middleRows(2, n) + 3 * q.middleRows(1, n) - q.topRows(n))
      .squaredNorm();
}

bool WithinLimits(const kinematics::Chain& chain, const Eigen::MatrixXd& joints) {
  for (int j = 0; j < chain.dof(); ++j) {
    const kinematics::JointLimits& limits = chain.limits()[static_cast<std::size_t>(j)];
    if (joints.col(j).minCoeff() < limits.lower || joints.col(j).maxCoeff() > limits.upper) {
      return false;
    }
  }
  return true;
}

PathSolution Solve(const kinematics::RobotDescription& robot, const PathProblem& problem,
                   PathIkVariant variant = PathIkVariant::kExemplar) {
  const Result<kinematics::ChainInertia> inertia =
      kinematics::ChainInertia::Create(robot.model, robot.chain);
  Result<PathSolution> solution =
      SolvePath(robot.chain, problem, robot.home, variant, inertia.ok() ? &*inertia : nullptr);
  EXPECT_TRUE(solution.ok()) << (solution.ok() ? "" : solution.error().message);
  return *std::move(solution);
}

TEST(PathIk, MeetsEveryFrameWithinLimitsOnEveryModel) {
  Rng rng(3);
  for (const char* name : {"arm7", "leonardo", "ur5e_like"}) {
    const kinematics::RobotDescription robot = test::LoadRobot(name);
    for (int round = 0; round < 6; ++round) {
      const PathProblem problem = Blended(robot, rng, 0.05 * Direction(rng));
      const PathSolution solution = Solve(robot, problem);
      EXPECT_TRUE(solution.missed.empty())
          << name << " " << round << ": " << solution.missed.size();
      EXPECT_TRUE(solution.large_steps.empty()) << name << " " << round;
      EXPECT_TRUE(WithinLimits(robot.chain, solution.joints)) << name << " " << round;
      EXPECT_LT(StyleError(problem, solution.joints), 0.3) << name << " " << round;
    }
  }
}

TEST(PathIk, KeepsTheStyleItselfWhereItMeetsThePath) {
  Rng rng(8);
  const kinematics::RobotDescription robot = test::LoadRobot("leonardo");
  const PathProblem problem = Blended(robot, rng, Eigen::Vector3d::Zero());
  const PathSolution solution = Solve(robot, problem);
  EXPECT_LT((solution.joints - problem.style).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(PathIk, VariantsDifferAsTheirNamesSay) {
  Rng rng(4);
  const kinematics::RobotDescription robot = test::LoadRobot("leonardo");
  for (int round = 0; round < 3; ++round) {
    const PathProblem problem = Blended(robot, rng, 0.06 * Direction(rng));
    const PathSolution ours = Solve(robot, problem);
    const PathSolution plain = Solve(robot, problem, PathIkVariant::kPlain);
    const PathSolution energy = Solve(robot, problem, PathIkVariant::kEnergy);
    const PathSolution path = Solve(robot, problem, PathIkVariant::kPath);
    for (const PathSolution* solution : {&ours, &plain, &energy, &path}) {
      EXPECT_LT(solution->position_error_m.maxCoeff(), 1e-4);
      EXPECT_LT(solution->rotation_error_rad.maxCoeff(), 1e-4);
    }
    const auto steps = [](const PathSolution& solution) {
      const Eigen::Index n = solution.joints.rows() - 1;
      return (solution.joints.bottomRows(n) - solution.joints.topRows(n)).squaredNorm();
    };
    for (const PathSolution* other : {&ours, &plain, &energy})
      EXPECT_LT(steps(path), steps(*other));
    EXPECT_LT(StyleError(problem, ours.joints), StyleError(problem, energy.joints));
    EXPECT_LT(StyleError(problem, ours.joints), StyleError(problem, path.joints));
    EXPECT_LE(StyleError(problem, ours.joints), 1.05 * StyleError(problem, plain.joints));
    EXPECT_LE(SquaredJerk(ours.joints), 1.05 * SquaredJerk(plain.joints));
  }
}

TEST(PathIk, SaysHowFarItStaysAwayWhereThePathIsOutOfReach) {
  Rng rng(5);
  const kinematics::RobotDescription robot = test::LoadRobot("arm7");
  const PathProblem problem = Blended(robot, rng, {0.9, 0, 0});
  const PathSolution solution = Solve(robot, problem);
  ASSERT_FALSE(solution.missed.empty());
  EXPECT_TRUE(WithinLimits(robot.chain, solution.joints));
  EXPECT_GT(solution.position_error_m.maxCoeff(), 0.05);
  // What it says is what forward kinematics says, and where it can be met it is.
  for (const int k : {0, 10, kFrames - 1}) {
    const geometry::Pose at = robot.chain.ToolPose(solution.joints.row(k).transpose());
    const geometry::Pose& asked = problem.base_T_tool[static_cast<std::size_t>(k)];
    EXPECT_NEAR(solution.position_error_m[k], (at.translation - asked.translation).norm(), 1e-12);
  }
  EXPECT_LT(solution.position_error_m[5], 5e-5);
}

TEST(PathIk, LeavesABranchThatEndsAtALimit) {
  // A planar arm with its elbow bent the way of the style cannot follow: its first joint ends.
  const char* urdf = R"(<robot name="planar">
    <link name="base"/><link name="a"/><link name="b"/><link name="tool"/>
    <joint name="shoulder" type="revolute"><parent link="base"/><child link="a"/>
      <axis xyz="0 0 1"/><limit lower="-1.2" upper="1.2" velocity="3" effort="1"/></joint>
    <joint name="elbow" type="revolute"><origin xyz="0.5 0 0"/><parent link="a"/><child link="b"/>
      <axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" velocity="3" effort="1"/></joint>
    <joint name="end" type="fixed"><origin xyz="0.4 0 0"/><parent link="b"/><child link="tool"/>
    </joint></robot>)";
  const kinematics::RobotModel model = *kinematics::ParseUrdf(urdf, "planar.urdf");
  const kinematics::Chain chain = *kinematics::Chain::Create(model, "", "");
  PathProblem problem;
  problem.use_rotation = false;
  problem.style.resize(kFrames, 2);
  for (int k = 0; k < kFrames; ++k) {
    // Around at a constant distance; with the elbow at -1.2 the shoulder would go to 1.9.
    const double angle = 1.3 * test::MinimumJerk(static_cast<double>(k) / (kFrames - 1));
    problem.style.row(k) << angle + 0.55, -1.2;
    problem.base_T_tool.push_back(chain.ToolPose(problem.style.row(k).transpose()));
    problem.time_s.push_back(k / 60.0);
  }
  problem.exact.assign(kFrames, true);
  problem.style_deviation_rad = Eigen::Vector2d::Constant(0.2);
  const PathSolution one_branch = RefinePath(chain, problem, {problem.style, {}, 0, 0});
  ASSERT_FALSE(one_branch.missed.empty());
  const Result<PathSolution> solution = SolvePath(chain, problem, problem.style.row(0).transpose());
  ASSERT_TRUE(solution.ok());
  EXPECT_TRUE(solution->missed.empty());
  EXPECT_TRUE(solution->large_steps.empty());
  EXPECT_GT(solution->guesses, 1);
  EXPECT_GT(solution->joints(0, 1), 0) << "the elbow is bent the other way from the beginning";
}

TEST(PathIk, IsDeterministic) {
  Rng rng(6);
  const kinematics::RobotDescription robot = test::LoadRobot("ur5e_like");
  const PathProblem problem = Blended(robot, rng, {0.3, 0.3, 0.2});
  EXPECT_EQ(Solve(robot, problem).joints, Solve(robot, problem).joints);
}

TEST(PathIk, NamesItsVariantsBothWays) {
  for (const char* name : {"exemplar", "plain", "energy", "path"}) {
    EXPECT_EQ(ToString(*ParsePathIkVariant(name)), name);
  }
  const Result<PathIkVariant> unknown = ParsePathIkVariant("pseudo");
  ASSERT_FALSE(unknown.ok());
  EXPECT_THAT(unknown.error().message, ::testing::HasSubstr("\"pseudo\""));
  EXPECT_EQ(unknown.error().field, "inverse_kinematics");
}

TEST(PathIk, LeastEnergyAsksForMasses) {
  Rng rng(7);
  const kinematics::RobotDescription robot = test::LoadRobot("arm7");
  const PathProblem problem = Blended(robot, rng, Eigen::Vector3d::Zero());
  EXPECT_FALSE(SolvePath(robot.chain, problem, robot.home, PathIkVariant::kEnergy).ok());
}

}  // namespace
}  // namespace exemplar::motion
