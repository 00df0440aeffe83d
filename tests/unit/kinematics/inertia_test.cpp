#include "exemplar/kinematics/inertia.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "exemplar/kinematics/robot_description.hpp"
#include "robots.hpp"

namespace exemplar::kinematics {
namespace {

/// Kinetic energy by differences of the links' poses along dq.
double EnergyByDifferences(const RobotModel& model, const Chain& chain, const Eigen::VectorXd& q,
                           const Eigen::VectorXd& rate) {
  constexpr double kStep = 1e-6;
  std::vector<geometry::Pose> before, after;
  LinkPoses(model, FullJointVector(model, chain, q - kStep * rate), before);
  LinkPoses(model, FullJointVector(model, chain, q + kStep * rate), after);
  double energy = 0;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (!model.links[i].inertial) continue;
    const Inertial& inertial = *model.links[i].inertial;
    const geometry::Pose a = before[i] * inertial.link_T_inertia;
    const geometry::Pose b = after[i] * inertial.link_T_inertia;
    const Eigen::Vector3d v = (b.translation - a.translation) / (2 * kStep);
    // In the inertia's own frame.
    const Eigen::Vector3d w = geometry::LogSo3(a.rotation.conjugate() * b.rotation) / (2 * kStep);
    energy += 0.5 * inertial.mass_kg * v.squaredNorm() + 0.5 * w.dot(inertial.inertia_kg_m2 * w);
  }
  return energy;
}

TEST(ChainInertia, GivesTheKineticEnergyOfAllLinks) {
  Rng rng(9);
  int robots = 0;
  for (const testing::NamedChain& named : testing::AllChains()) {
    const Result<ChainInertia> inertia = ChainInertia::Create(named.model, named.chain);
    if (!inertia.ok()) continue;  // no masses
    ++robots;
    for (int round = 0; round < 20; ++round) {
      const Eigen::VectorXd q = testing::RandomPosture(named.chain, rng);
      Eigen::VectorXd rate(named.chain.dof());
      for (int j = 0; j < rate.size(); ++j) rate[j] = rng.Uniform(-1.0, 1.0);
      const Eigen::MatrixXd mass = inertia->MassMatrix(q);
      EXPECT_LT((mass - mass.transpose()).norm(), 1e-12 * mass.norm()) << named.name;
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(mass).eigenvalues().minCoeff(), 0)
          << named.name;
      const double expected = EnergyByDifferences(named.model, named.chain, q, rate);
      EXPECT_NEAR(0.5 * rate.dot(mass * rate), expected, 1e-6 * (1 + expected)) << named.name;
    }
  }
  EXPECT_GE(robots, 3);
}

TEST(ChainInertia, NamesTheJointThatMovesNoMass) {
  const RobotModel model = testing::Parse(testing::TwoLinkRobot());
  const Result<ChainInertia> inertia = ChainInertia::Create(model, testing::ChainOf(model));
  ASSERT_FALSE(inertia.ok());
  EXPECT_EQ(inertia.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(inertia.error().message, ::testing::HasSubstr("joint \"first\""));
}

}  // namespace
}  // namespace exemplar::kinematics
