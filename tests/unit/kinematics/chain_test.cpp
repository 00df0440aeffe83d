#include "exemplar/kinematics/chain.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#ifdef EXEMPLAR_WITH_KDL
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>

#include "support/kdl_peer.hpp"
#endif

#include "exemplar/kinematics/robot_description.hpp"
#include "robots.hpp"

namespace exemplar::kinematics {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

TEST(Chain, PutsTheTwoLinkRobotWhereTrigonometryDoes) {
  const Chain chain = testing::ChainOf(testing::Parse(testing::TwoLinkRobot()));
  EXPECT_THAT(chain.joint_names(), ElementsAre("first", "second"));
  const Eigen::Vector2d q(0.4, 1.1);
  Jacobian jacobian(6, 2);
  const geometry::Pose pose = chain.ToolPoseAndJacobian(q, jacobian);
  EXPECT_NEAR(pose.translation.x(), 0.5 * std::cos(0.4) + 0.3 * std::cos(1.5), 1e-15);
  EXPECT_NEAR(pose.translation.y(), 0.5 * std::sin(0.4) + 0.3 * std::sin(1.5), 1e-15);
  EXPECT_NEAR(geometry::LogSo3(pose.rotation).z(), 1.5, 1e-15);
  EXPECT_NEAR(jacobian(0, 0), -pose.translation.y(), 1e-15);
  EXPECT_NEAR(jacobian(1, 1), 0.3 * std::cos(1.5), 1e-15);
  EXPECT_NEAR(jacobian(5, 0), 1, 1e-15);
}

TEST(Chain, ManyPosesAtATimeAreThoseOfEach) {
  Rng rng(8);
  const RobotModel mixed = testing::Parse(testing::MixedRobot());
  const Chain chains[] = {testing::ChainOf(testing::Parse(testing::TwoLinkRobot())),
                          testing::ChainOf(mixed, "", "tool"),
                          testing::ChainOf(mixed, "left", "tool")};
  for (const Chain& chain : chains) {
    for (const int n : {1, 4, 7, 33}) {
      Eigen::MatrixXd joints(n, chain.dof());
      for (int i = 0; i < n; ++i) joints.row(i) = testing::RandomPosture(chain, rng).transpose();
      // Many turns, and more than can be taken off.
      if (n > 9) joints.row(9) *= 1000;
      if (n > 6) joints.row(6) *= 1e6;
      const demonstration::ToolKinematics::Path path = chain.ToolPath(joints);
      ASSERT_EQ(path.positions.rows(), n);
      ASSERT_EQ(path.rotations.rows(), n);
      for (int i = 0; i < n; ++i) {
        const geometry::Pose pose = chain.ToolPose(joints.row(i).transpose());
        const double scale = std::max(1.0, joints.row(i).cwiseAbs().maxCoeff());
        EXPECT_LT((path.positions.row(i).transpose() - pose.translation).norm(), 1e-15 * 8 * scale);
        const Eigen::Quaterniond rotation(path.rotations(i, 3), path.rotations(i, 0),
                                          path.rotations(i, 1), path.rotations(i, 2));
        EXPECT_LT(geometry::AngleBetween(rotation, pose.rotation), 1e-15 * 8 * scale);
        EXPECT_NEAR(rotation.norm(), 1, 1e-14);
      }
    }
  }
}

/// Central differences of the tool pose.
Jacobian NumericJacobian(const Chain& chain, const Eigen::VectorXd& q) {
  constexpr double kStep = 1e-6;
  Jacobian jacobian(6, chain.dof());
  for (int i = 0; i < chain.dof(); ++i) {
    Eigen::VectorXd low = q, high = q;
    low[i] -= kStep;
    high[i] += kStep;
    const geometry::Pose a = chain.ToolPose(low);
    const geometry::Pose b = chain.ToolPose(high);
    jacobian.col(i) << (b.translation - a.translation) / (2 * kStep),
        geometry::LogSo3(b.rotation * a.rotation.conjugate()) / (2 * kStep);
  }
  return jacobian;
}

void ExpectJacobianIsTheDerivative(const Chain& chain, const std::string& name) {
  Rng rng(5);
  Jacobian analytic(6, chain.dof());
  for (int round = 0; round < 50; ++round) {
    const Eigen::VectorXd q = testing::RandomPosture(chain, rng);
    const geometry::Pose pose = chain.ToolPoseAndJacobian(q, analytic);
    EXPECT_LT((pose.translation - chain.ToolPose(q).translation).norm(), 1e-15);
    EXPECT_LT((analytic - NumericJacobian(chain, q)).cwiseAbs().maxCoeff(), 1e-8) << name;
  }
}

TEST(Chain, JacobianIsTheDerivativeOfThePose) {
  for (const testing::NamedChain& named : testing::AllChains()) {
    ExpectJacobianIsTheDerivative(named.chain, named.name);
  }
}

TEST(Chain, JacobianHoldsForPrismaticAndMimicJoints) {
  const RobotModel model = testing::Parse(testing::MixedRobot());
  ExpectJacobianIsTheDerivative(testing::ChainOf(model), "root to tool");
  ExpectJacobianIsTheDerivative(testing::ChainOf(model, "tool", "left"), "leaf to leaf");
}

TEST(Chain, RunsUpAndDownATree) {
  const RobotModel model = testing::Parse(testing::MixedRobot());
  const Chain up = testing::ChainOf(model, "tool", "base");
  const Chain down = testing::ChainOf(model, "base", "tool");
  EXPECT_THAT(down.joint_names(), ElementsAre("slide", "spin", "bend"));
  EXPECT_THAT(up.joint_names(), ElementsAre("bend", "spin", "slide"));
  Rng rng(3);
  for (int round = 0; round < 20; ++round) {
    const Eigen::VectorXd q = testing::RandomPosture(down, rng);
    const geometry::Pose round_trip = down.ToolPose(q) * up.ToolPose(q.reverse());
    EXPECT_LT(round_trip.translation.norm(), 1e-14);
    EXPECT_LT(geometry::LogSo3(round_trip.rotation).norm(), 1e-14);
  }
}

TEST(Chain, KeepsAMimicJointWithinItsOwnLimits) {
  std::string urdf = testing::MixedRobot();
  // follow = -0.5 bend + 0.1 within +-0.6 leaves bend -1 to 1.4.
  urdf.replace(urdf.find("lower=\"-3\" upper=\"3\""), 20, "lower=\"-.6\" upper=\".6\"");
  const Chain chain = testing::ChainOf(testing::Parse(urdf));
  EXPECT_NEAR(chain.limits()[2].lower, -1.0, 1e-12);
  EXPECT_NEAR(chain.limits()[2].upper, 1.4, 1e-12);
}

TEST(Chain, SaysWhatIsWrongWithItsEnds) {
  const RobotModel model = testing::Parse(testing::TwoLinkRobot());
  const Result<Chain> misspelt = Chain::Create(model, "grund", "tool");
  ASSERT_FALSE(misspelt.ok());
  EXPECT_EQ(misspelt.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(misspelt.error().message, HasSubstr("did you mean \"ground\"?"));
  const Result<Chain> rigid = Chain::Create(model, "lower", "tool");
  ASSERT_FALSE(rigid.ok());
  EXPECT_THAT(rigid.error().message, HasSubstr("no movable joint"));

  std::string two_leaves = testing::MixedRobot();
  for (std::size_t at; (at = two_leaves.find("\"tool\"")) != std::string::npos;) {
    two_leaves.replace(at, 6, "\"hand\"");
  }
  const Result<Chain> unnamed = Chain::Create(testing::Parse(two_leaves), "", "");
  ASSERT_FALSE(unnamed.ok());
  EXPECT_THAT(unnamed.error().message, HasSubstr("several leaves"));
}

TEST(LinkPoses, AgreesWithTheChain) {
  Rng rng(8);
  std::vector<testing::NamedChain> chains = testing::AllChains();
  const RobotModel mixed = testing::Parse(testing::MixedRobot());
  chains.push_back({"mixed", mixed, testing::ChainOf(mixed)});
  std::vector<geometry::Pose> poses;
  for (const testing::NamedChain& named : chains) {
    for (int round = 0; round < 20; ++round) {
      const Eigen::VectorXd q = testing::RandomPosture(named.chain, rng);
      LinkPoses(named.model, FullJointVector(named.model, named.chain, q), poses);
      const geometry::Pose base_T_tip =
          poses[named.model.FindLink(named.chain.base_link())].Inverse() *
          poses[named.model.FindLink(named.chain.tip_link())];
      const geometry::Pose expected = named.chain.ToolPose(q);
      EXPECT_LT((base_T_tip.translation - expected.translation).norm(), 1e-12) << named.name;
      EXPECT_LT(geometry::AngleBetween(base_T_tip.rotation, expected.rotation), 1e-12)
          << named.name;
    }
  }
}

#ifdef EXEMPLAR_WITH_KDL
TEST(Chain, EqualsKdlInPoseAndJacobian) {
  for (const testing::NamedChain& named : testing::AllChains()) {
    const std::optional<KDL::Chain> made = exemplar::testing::ToKdl(named.model, named.chain);
    ASSERT_TRUE(made) << named.name;
    const KDL::Chain& peer = *made;
    KDL::ChainFkSolverPos_recursive forward(peer);
    KDL::ChainJntToJacSolver derivative(peer);
    const unsigned n = static_cast<unsigned>(named.chain.dof());
    ASSERT_EQ(peer.getNrOfJoints(), n);
    KDL::JntArray positions(n);
    KDL::Frame frame;
    KDL::Jacobian jacobian(n);
    Jacobian ours(6, named.chain.dof());
    Rng rng(21);
    for (int round = 0; round < 200; ++round) {
      const Eigen::VectorXd q = testing::RandomPosture(named.chain, rng);
      positions.data = q;
      ASSERT_GE(forward.JntToCart(positions, frame), 0);
      ASSERT_GE(derivative.JntToJac(positions, jacobian), 0);
      const geometry::Pose pose = named.chain.ToolPoseAndJacobian(q, ours);
      const Eigen::Map<const Eigen::Vector3d> position(frame.p.data);
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(frame.M.data);
      EXPECT_LT((pose.translation - position).norm(), 1e-12) << named.name;
      EXPECT_LT((pose.rotation.toRotationMatrix() - rotation).norm(), 1e-12) << named.name;
      EXPECT_LT((ours - jacobian.data).cwiseAbs().maxCoeff(), 1e-12) << named.name;
    }
  }
}
#endif

}  // namespace
}  // namespace exemplar::kinematics
