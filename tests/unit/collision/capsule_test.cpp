// Capsules around shapes and robots: they contain, they are tight, and their distances bound.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "bounding_capsule.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "pairs.hpp"

namespace exemplar::collision {
namespace {

kinematics::RobotDescription LoadRobot(const std::string& name) {
  return *kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "deploy" /
                                           "models" / name);
}

/// The models of deploy/models, and a Panda with its meshes where the data is there.
std::vector<kinematics::RobotModel> AllModels() {
  std::vector<kinematics::RobotModel> models;
  for (const char* name : {"arm7", "leonardo", "ur5e_like"}) {
    models.push_back(LoadRobot(name).model);
  }
  const char* data = std::getenv("EXEMPLAR_DATA");
  const std::filesystem::path panda =
      (data != nullptr ? std::filesystem::path(data)
                       : std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "../shared/data") /
      "robots/panda/panda_description/urdf/panda.urdf";
  if (std::filesystem::exists(panda)) {
    const Result<kinematics::RobotModel> model = kinematics::ReadUrdf(panda);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message);
    if (model.ok()) models.push_back(*model);
  }
  return models;
}

Eigen::VectorXd RandomState(const kinematics::RobotModel& model, Rng& rng) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()));
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].type == kinematics::JointType::kFixed) continue;
    q[static_cast<Eigen::Index>(j)] = rng.Uniform(std::max(-3.1, model.joints[j].limits.lower),
                                                  std::min(3.1, model.joints[j].limits.upper));
  }
  return q;
}

Eigen::Vector3d RandomDirection(Rng& rng) {
  return Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal()).normalized();
}

double Outside(const BoundingCapsule& capsule, const Eigen::Vector3d& p) {
  const double along =
      std::clamp((p - capsule.centre).dot(capsule.axis), -capsule.half, capsule.half);
  return (p - capsule.centre - along * capsule.axis).norm() - capsule.radius;
}

TEST(BoundingCapsule, ContainsEveryPointOfEveryRobotsGeometry) {
  Rng rng(1);
  for (const kinematics::RobotModel& model : AllModels()) {
    const Result<std::vector<RobotPart>> made = MakeRobotParts(model);
    ASSERT_TRUE(made.ok()) << made.error().message;
    const std::vector<RobotPart>& parts = *made;
    EXPECT_FALSE(parts.empty());
    for (const RobotPart& part : parts) {
      for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d p = part.link_T_shape * part.body.hull.Support(RandomDirection(rng));
        ASSERT_LE(Outside(part.capsule, p), 1e-9) << model.name << " " << part.link;
      }
    }
  }
}

TEST(BoundingCapsule, IsTheShapeItselfWhereThatIsRound) {
  const BoundingCapsule of_capsule =
      FitCapsule(*ConvexShape::Create(kinematics::Capsule{0.1, 0.4}));
  EXPECT_EQ(of_capsule.radius, 0.1);
  EXPECT_EQ(of_capsule.half, 0.2);
  const BoundingCapsule of_sphere = FitCapsule(*ConvexShape::Create(kinematics::Sphere{0.3}));
  EXPECT_EQ(of_sphere.radius, 0.3);
  EXPECT_EQ(of_sphere.half, 0);
}

TEST(BoundingCapsule, IsTight) {
  // A long box: no capsule around it is narrower than its diagonal across.
  const BoundingCapsule of_box =
      FitCapsule(*ConvexShape::Create(kinematics::Box{{0.06, 0.08, 1.0}}));
  EXPECT_GT(std::abs(of_box.axis.z()), 0.999);
  EXPECT_LT(of_box.radius, 0.056);
  EXPECT_LT(2 * of_box.half, 1.0);
  // A long cylinder.
  const BoundingCapsule of_cylinder =
      FitCapsule(*ConvexShape::Create(kinematics::Cylinder{0.05, 0.8}));
  EXPECT_LT(of_cylinder.radius, 0.056);
  // A cube: the ball around it is the best.
  const BoundingCapsule of_cube = FitCapsule(*ConvexShape::Create(kinematics::Box{{1, 1, 1}}));
  EXPECT_LT(of_cube.volume(), 1.02 * 4.0 / 3.0 * M_PI * std::pow(std::sqrt(3.0) / 2, 3));
}

TEST(BoundingCapsule, DoesNotDependOnWhereTheShapeLies) {
  Rng rng(2);
  const BoundingCapsule here = FitCapsule(*ConvexShape::Create(kinematics::Box{{0.1, 0.2, 0.5}}));
  Placement at;
  at.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), RandomDirection(rng))
                    .toRotationMatrix();
  at.translation = {1, 2, 3};
  const BoundingCapsule there = here.At(at);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p = 0.3 * RandomDirection(rng);
    EXPECT_NEAR(Outside(here, p), Outside(there, at * p), 1e-12);
  }
}

TEST(CapsuleSelfClearance, IsNeverMoreThanTheTrueOne) {
  Rng rng(3);
  for (const kinematics::RobotModel& model : AllModels()) {
    const CollisionChecker checker = *CollisionChecker::Create(model, {});
    int told_free = 0;
    int free = 0;
    for (int i = 0; i < 500; ++i) {
      const Eigen::VectorXd q = RandomState(model, rng);
      const double exact = checker.SmallestClearance(q).distance_m;
      const double by_capsules = checker.CapsuleSelfClearance(q);
      // How deep bodies overlap is no distance; that they do must not be missed.
      ASSERT_LE(by_capsules, std::max(0.0, exact) + 1e-9) << model.name << " " << i;
      free += exact >= 5e-3;
      told_free += by_capsules > 0;
    }
    RecordProperty(model.name + "_free", free);
    RecordProperty(model.name + "_free_by_capsules_alone", told_free);
    EXPECT_GT(told_free, 0) << model.name;
  }
}

TEST(CapsuleSelfClearance, HasTheGradientThatDifferencesShow) {
  Rng rng(4);
  constexpr double kStep = 1e-6;
  for (const kinematics::RobotModel& model : AllModels()) {
    const CollisionChecker checker = *CollisionChecker::Create(model, {});
    int smooth = 0;
    for (int i = 0; i < 200; ++i) {
      Eigen::VectorXd q = RandomState(model, rng);
      Eigen::VectorXd gradient;
      checker.CapsuleSelfClearance(q, &gradient);
      Eigen::VectorXd forward = Eigen::VectorXd::Zero(q.size());
      Eigen::VectorXd backward = Eigen::VectorXd::Zero(q.size());
      const double here = checker.CapsuleSelfClearance(q);
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const double value = q[j];
        q[j] = value + kStep;
        forward[j] = (checker.CapsuleSelfClearance(q) - here) / kStep;
        q[j] = value - kStep;
        backward[j] = (here - checker.CapsuleSelfClearance(q)) / kStep;
        q[j] = value;
      }
      // Where another pair becomes the nearest there is a kink.
      if ((forward - backward).norm() > 1e-3) continue;
      ++smooth;
      EXPECT_LT((0.5 * (forward + backward) - gradient).norm(), 1e-4) << model.name << " " << i;
    }
    EXPECT_GT(smooth, 150) << model.name;
  }
}

TEST(CapsuleSelfClearance, CountsThePadding) {
  const kinematics::RobotDescription robot = LoadRobot("arm7");
  CheckerOptions padded;
  padded.sampled_allowed_states = 0;
  const CollisionChecker plain = *CollisionChecker::Create(robot.model, {}, padded);
  padded.padding_m = 0.01;
  const CollisionChecker wide = *CollisionChecker::Create(robot.model, {}, padded);
  const Eigen::VectorXd q = kinematics::FullJointVector(robot.model, robot.chain, robot.home);
  EXPECT_NEAR(wide.CapsuleSelfClearance(q), plain.CapsuleSelfClearance(q) - 0.02, 1e-12);
}

}  // namespace
}  // namespace exemplar::collision
