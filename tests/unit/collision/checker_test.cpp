// A whole robot against itself and a scene.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "exemplar/base/rng.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::collision {
namespace {

using geometry::Pose;
using kinematics::Box;
using kinematics::RobotModel;
using kinematics::Sphere;

kinematics::RobotDescription LoadRobot(const std::string& name) {
  return *kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "deploy" /
                                           "models" / name);
}

/// Two links of 0.5 m in a plane, each a thin box with a ball at its end.
constexpr const char* kTwoLinks = R"(<robot name="two">
  <link name="base"/>
  <link name="upper">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.4 0.04 0.04"/></geometry></collision>
  </link>
  <link name="lower">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.4 0.04 0.04"/></geometry></collision>
  </link>
  <link name="hand"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><origin xyz="0.5 0 0"/><parent link="upper"/><child link="lower"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
  <joint name="c" type="fixed"><origin xyz="0.5 0 0"/><parent link="lower"/><child link="hand"/></joint>
</robot>)";

RobotModel TwoLinks() { return *kinematics::ParseUrdf(kTwoLinks, "two.urdf"); }

Eigen::VectorXd State(const RobotModel& model, double a, double b) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()));
  q[model.FindJoint("a")] = a;
  q[model.FindJoint("b")] = b;
  return q;
}

Eigen::VectorXd RandomState(const RobotModel& model, Rng& rng) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()));
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].type == kinematics::JointType::kFixed) continue;
    q[static_cast<Eigen::Index>(j)] = rng.Uniform(std::max(-3.1, model.joints[j].limits.lower),
                                                  std::min(3.1, model.joints[j].limits.upper));
  }
  return q;
}

TEST(Checker, MeasuresTheDistanceOfHandAndBall) {
  const RobotModel model = TwoLinks();
  const CollisionChecker checker = *CollisionChecker::Create(
      model, {{{"ball", Pose::FromTranslation({1.3, 0, 0}), Sphere{0.1}}}});
  const Clearance clearance = checker.SmallestClearance(State(model, 0, 0));
  EXPECT_NEAR(clearance.distance_m, 0.15, 1e-12);
  EXPECT_EQ(clearance.first, "hand");
  EXPECT_EQ(clearance.second, "ball");
  EXPECT_NEAR(clearance.base_p_first.x(), 1.05, 1e-12);
  EXPECT_NEAR(clearance.base_p_second.x(), 1.2, 1e-12);
}

TEST(Checker, ReportsDepthBelowZero) {
  const RobotModel model = TwoLinks();
  const CollisionChecker checker = *CollisionChecker::Create(
      model, {{{"ball", Pose::FromTranslation({1.13, 0, 0}), Sphere{0.1}}}});
  EXPECT_NEAR(checker.SmallestClearance(State(model, 0, 0)).distance_m, -0.02, 1e-12);
}

TEST(Checker, FindsTheHandFoldedOntoTheUpperArm) {
  const RobotModel model = TwoLinks();
  const CollisionChecker checker = *CollisionChecker::Create(model, {});
  const Clearance apart = checker.SmallestClearance(State(model, 0, 1.5));
  EXPECT_GT(apart.distance_m, 0.1);
  const Clearance folded = checker.SmallestClearance(State(model, 0, 3.0));
  // The hand's ball against the nearest edge of the upper arm's box.
  const Eigen::Vector2d hand(0.5 + 0.5 * std::cos(3.0), 0.5 * std::sin(3.0));
  EXPECT_NEAR(folded.distance_m, (hand - Eigen::Vector2d(0.05, 0.02)).norm() - 0.05, 1e-12);
  EXPECT_EQ(folded.first + " " + folded.second, "upper hand");
}

TEST(Checker, LeavesOutNeighbours) {
  // Upper and lower arm overlap at the elbow whenever it is bent.
  RobotModel model = TwoLinks();
  model.links[static_cast<std::size_t>(model.FindLink("hand"))].collisions.clear();
  const CollisionChecker checker = *CollisionChecker::Create(model, {});
  const Clearance clearance = checker.SmallestClearance(State(model, 0, 2.9));
  EXPECT_TRUE(std::isinf(clearance.distance_m));
  EXPECT_TRUE(clearance.first.empty());
}

TEST(Checker, LeavesOutAllowedPairsAndNamesUnknownLinks) {
  const RobotModel model = TwoLinks();
  CheckerOptions options;
  options.allowed_pairs = {{"hand", "upper"}};
  const CollisionChecker checker = *CollisionChecker::Create(model, {}, options);
  EXPECT_TRUE(std::isinf(checker.SmallestClearance(State(model, 0, 3.0)).distance_m));
  options.allowed_pairs = {{"hand", "foot"}};
  const Result<CollisionChecker> unknown = CollisionChecker::Create(model, {}, options);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("foot"), std::string::npos);
}

TEST(Checker, LeavesOutLinksThatAlwaysTouch) {
  RobotModel model = TwoLinks();
  // A ball around the elbow on the upper arm, large enough to hold the hand at every angle.
  model.links[static_cast<std::size_t>(model.FindLink("upper"))].collisions.push_back(
      {Pose::FromTranslation({0.5, 0, 0}), Sphere{0.52}});
  const CollisionChecker checker = *CollisionChecker::Create(model, {});
  EXPECT_TRUE(std::isinf(checker.SmallestClearance(State(model, 0, 1.0)).distance_m));
  CheckerOptions options;
  options.sampled_allowed_states = 0;
  const CollisionChecker all = *CollisionChecker::Create(model, {}, options);
  EXPECT_LT(all.SmallestClearance(State(model, 0, 1.0)).distance_m, 0);
}

TEST(Checker, AddsPaddingAroundTheRobot) {
  const RobotModel model = TwoLinks();
  CheckerOptions options;
  options.padding_m = 0.03;
  const CollisionChecker checker = *CollisionChecker::Create(
      model, {{{"ball", Pose::FromTranslation({1.3, 0, 0}), Sphere{0.1}}}}, options);
  EXPECT_NEAR(checker.SmallestClearance(State(model, 0, 0)).distance_m, 0.12, 1e-12);
}

TEST(Checker, PermitsATouchOfTheNamedLinkOnly) {
  const RobotModel model = TwoLinks();
  const CollisionChecker checker = *CollisionChecker::Create(
      model, {{{"ball", Pose::FromTranslation({1.13, 0, 0}), Sphere{0.1}}}});
  const Clearance touched = checker.SmallestClearance(State(model, 0, 0), {{"hand", "ball"}});
  EXPECT_EQ(touched.first, "lower");
  EXPECT_GT(touched.distance_m, 0);
  EXPECT_LT(checker.SmallestClearance(State(model, 0, 0), {{"lower", "ball"}}).distance_m, 0);
}

TEST(Checker, KeepsItsSceneWhenANewOneIsWrong) {
  const RobotModel model = TwoLinks();
  CollisionChecker checker = *CollisionChecker::Create(
      model, {{{"ball", Pose::FromTranslation({1.3, 0, 0}), Sphere{0.1}}}});
  const Status wrong = checker.SetScene({{{"egg", {}, Sphere{-1}}}});
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("egg"), std::string::npos);
  EXPECT_NEAR(checker.SmallestClearance(State(model, 0, 0)).distance_m, 0.15, 1e-12);
  ASSERT_TRUE(checker.SetScene({}).ok());
  EXPECT_GT(checker.SmallestClearance(State(model, 0, 1)).distance_m, 0.15);
}

TEST(Checker, NamesTheLinkWhoseMeshIsMissing) {
  RobotModel model = TwoLinks();
  model.links[1].collisions.push_back({{}, kinematics::Mesh{"/nowhere/arm.stl"}});
  const Result<CollisionChecker> checker = CollisionChecker::Create(model, {});
  ASSERT_FALSE(checker.ok());
  EXPECT_NE(checker.error().message.find(model.links[1].name), std::string::npos);
  EXPECT_NE(checker.error().message.find("/nowhere/arm.stl"), std::string::npos);
}

Scene RandomScene(Rng& rng, int objects) {
  Scene scene;
  for (int i = 0; i < objects; ++i) {
    Pose at;
    at.translation = {rng.Uniform(-0.9, 0.9), rng.Uniform(-0.9, 0.9), rng.Uniform(-0.2, 1.2)};
    at.rotation =
        Eigen::Quaterniond(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal()).normalized();
    kinematics::Shape shape = Sphere{rng.Uniform(0.02, 0.1)};
    if (i % 3 == 1) shape = Box{{rng.Uniform(0.001, 0.1), rng.Uniform(0.05, 0.3), 0.2}};
    if (i % 3 == 2) shape = kinematics::Capsule{rng.Uniform(0.01, 0.05), rng.Uniform(0.1, 0.4)};
    scene.objects.push_back({"object" + std::to_string(i), at, shape});
  }
  return scene;
}

TEST(Checker, BroadPhaseFindsWhatCheckingObjectsOneByOneFinds) {
  Rng rng(3);
  for (const char* name : {"arm7", "leonardo", "ur5e_like"}) {
    const kinematics::RobotDescription robot = LoadRobot(name);
    CollisionChecker all = *CollisionChecker::Create(robot.model, {});
    CollisionChecker one = *CollisionChecker::Create(robot.model, {});
    for (int i = 0; i < 40; ++i) {
      const Scene scene = RandomScene(rng, 12);
      ASSERT_TRUE(all.SetScene(scene).ok());
      const Eigen::VectorXd q = RandomState(robot.model, rng);
      double smallest = 1e9;
      for (const SceneObject& object : scene.objects) {
        ASSERT_TRUE(one.SetScene({{object}}).ok());
        smallest = std::min(smallest, one.SmallestClearance(q).distance_m);
      }
      EXPECT_DOUBLE_EQ(all.SmallestClearance(q).distance_m, smallest) << name << " " << i;
    }
  }
}

// ---------------------------------------------------------------- between states

/// All joints on straight lines, s from 0 to 1.
class Line final : public JointPath {
 public:
  Line(Eigen::VectorXd from, Eigen::VectorXd to) : from_(std::move(from)), to_(std::move(to)) {}
  void Position(double s, Eigen::Ref<Eigen::VectorXd> q) const override {
    q = from_ + s * (to_ - from_);
  }
  void Travel(double s0, double s1, Eigen::Ref<Eigen::VectorXd> travel) const override {
    travel = (s1 - s0) * (to_ - from_).cwiseAbs();
  }

 private:
  Eigen::VectorXd from_, to_;
};

TEST(FirstViolation, SeesAThinSheetBetweenTwoFreeStates) {
  const RobotModel model = TwoLinks();
  Pose at = Pose::FromTranslation({1.0 * std::cos(0.8), 1.0 * std::sin(0.8), 0});
  at.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitZ()));
  const CollisionChecker checker =
      *CollisionChecker::Create(model, {{{"sheet", at, Box{{0.02, 0.00001, 0.02}}}}});
  const Line sweep(State(model, 0, 0), State(model, 1.6, 0));
  Eigen::VectorXd q(static_cast<Eigen::Index>(model.joints.size()));
  for (const double s : {0.0, 0.25, 0.75, 1.0}) {
    sweep.Position(s, q);
    ASSERT_GT(checker.SmallestClearance(q).distance_m, 0.05);
  }
  const std::optional<Violation> found = checker.FirstViolation(sweep, 0, 1, 0);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->clearance.second, "sheet");
  // The ball of 5 cm on a circle of 1 m meets the sheet's plane so much before it.
  EXPECT_NEAR(found->s, (0.8 - 0.05) / 1.6, 0.002);
}

TEST(FirstViolation, NeverMissesWhatFineSamplingFinds) {
  Rng rng(4);
  int free = 0;
  int violating = 0;
  constexpr double kRequired_m = 2e-3;
  for (const char* name : {"arm7", "leonardo", "ur5e_like"}) {
    const kinematics::RobotDescription robot = LoadRobot(name);
    CollisionChecker checker = *CollisionChecker::Create(robot.model, {});
    for (int i = 0; i < 25; ++i) {
      ASSERT_TRUE(checker.SetScene(RandomScene(rng, 4)).ok());
      const Eigen::VectorXd from = RandomState(robot.model, rng);
      const Line path(from, from + 0.3 * (RandomState(robot.model, rng) - from));
      Eigen::VectorXd q(from.size());
      double smallest = 1e9;
      double first_s = 2;
      for (int k = 0; k <= 400; ++k) {
        path.Position(k / 400.0, q);
        const double clearance = checker.SmallestClearance(q).distance_m;
        smallest = std::min(smallest, clearance);
        if (clearance < kRequired_m && first_s > 1) first_s = k / 400.0;
      }
      const std::optional<Violation> found = checker.FirstViolation(path, 0, 1, kRequired_m);
      if (smallest < kRequired_m) {
        ++violating;
        ASSERT_TRUE(found.has_value()) << name << " " << i << ": " << smallest;
        EXPECT_LE(found->s, first_s + 1e-9) << name << " " << i;
        EXPECT_GE(found->s, first_s - 1.0 / 400 - 1e-3) << name << " " << i;
      } else if (smallest > kRequired_m + 3e-3) {
        ++free;
        EXPECT_FALSE(found.has_value()) << name << " " << i << ": " << smallest;
      }
    }
  }
  EXPECT_GT(free, 15);
  EXPECT_GT(violating, 15);
}

TEST(FirstViolation, LeavesPermittedTouchesOut) {
  const RobotModel model = TwoLinks();
  const CollisionChecker checker = *CollisionChecker::Create(
      model, {{{"ball", Pose::FromTranslation({0.7, 0.78, 0}), Sphere{0.05}}}});
  const Line sweep(State(model, 0, 0), State(model, 1.6, 0));
  EXPECT_TRUE(checker.FirstViolation(sweep, 0, 1, 0).has_value());
  EXPECT_FALSE(
      checker.FirstViolation(sweep, 0, 1, 0, {{"hand", "ball"}, {"lower", "ball"}}).has_value());
  EXPECT_FALSE(checker.FirstViolation(sweep, 0, 0.3, 0).has_value());
}

TEST(FirstViolation, TellsHowDeepWhatOverlapsMayGo) {
  const RobotModel model = TwoLinks();
  // The ball of the hand goes through it, 60 mm deep in the middle.
  const CollisionChecker checker = *CollisionChecker::Create(
      model, {{{"ball", Pose::FromTranslation({1.04 * std::cos(0.8), 1.04 * std::sin(0.8), 0}),
                Sphere{0.05}}}});
  const Line sweep(State(model, 0.76, 0), State(model, 0.84, 0));
  const std::vector<AllowedTouch> lower = {{"lower", "ball"}};
  Eigen::VectorXd q(static_cast<Eigen::Index>(model.joints.size()));
  double deepest = 0;
  for (int k = 0; k <= 100; ++k) {
    sweep.Position(k / 100.0, q);
    deepest = std::min(deepest, checker.SmallestClearance(q, lower).distance_m);
  }
  ASSERT_NEAR(deepest, -0.06, 1e-3);
  sweep.Position(0, q);
  const double at_begin = checker.SmallestClearance(q, lower).distance_m;
  ASSERT_GT(at_begin, deepest + 3e-3);
  // Neither end is as deep as the middle, and boxes around both bodies overlap all along.
  const std::optional<Violation> found =
      checker.FirstViolation(sweep, 0, 1, 0.5 * (at_begin + deepest), lower);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(found->clearance.distance_m, 0.5 * (at_begin + deepest) + 1e-4);
  EXPECT_FALSE(checker.FirstViolation(sweep, 0, 1, deepest - 1e-3, lower).has_value());
}

// ---------------------------------------------------------------- scenes

TEST(MakeScene, PutsAButtonsBodyBelowItsContact) {
  scene::Description description;
  scene::Button button;
  button.name = "target";
  button.base_T_object.translation = {0.5, 0, 0.1};
  button.object_p_contact = {0, 0, 0.01};
  button.height_m = 0.04;
  button.radius_m = 0.02;
  description.buttons.push_back(button);
  const Scene as_described = MakeScene(description);
  ASSERT_EQ(as_described.objects.size(), 1U);
  EXPECT_EQ(as_described.objects[0].name, "target");
  EXPECT_TRUE(as_described.objects[0].base_T_shape.translation.isApprox(
      Eigen::Vector3d(0.5, 0, 0.09), 1e-12));

  // Seen elsewhere, lying on its side.
  Pose seen = Pose::FromTranslation({0.3, 0.2, 0.1});
  seen.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()));
  const Scene moved = MakeScene(description, {{"target", seen, true}, {"other", {}, true}});
  EXPECT_TRUE(
      moved.objects[0].base_T_shape.translation.isApprox(Eigen::Vector3d(0.29, 0.2, 0.1), 1e-12));

  // Seen without orientation it keeps the described one.
  const Scene shifted = MakeScene(description, {{"target", seen, false}});
  EXPECT_TRUE(
      shifted.objects[0].base_T_shape.translation.isApprox(Eigen::Vector3d(0.3, 0.2, 0.09), 1e-12));
}

}  // namespace
}  // namespace exemplar::collision
