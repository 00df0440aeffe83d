// What the scene may hold beside shapes that stand: clouds, and objects in the hand.

#include "exemplar/collision/scene.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "exemplar/base/rng.hpp"
#include "support/fcl_judge.hpp"

namespace exemplar::collision {
namespace {

using geometry::Pose;
using kinematics::Box;
using kinematics::RobotModel;
using kinematics::Sphere;
using ::testing::HasSubstr;

/// An upper and a lower arm of half a metre in a plane; the elbow bends.
RobotModel TwoLinks() {
  return *kinematics::ParseUrdf(R"(<robot name="two">
  <link name="base"/>
  <link name="upper">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.4 0.04 0.04"/></geometry></collision>
  </link>
  <link name="lower">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.4 0.04 0.04"/></geometry></collision>
  </link>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><origin xyz="0.5 0 0"/><parent link="upper"/><child link="lower"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
</robot>)",
                                "two.urdf");
}

Eigen::VectorXd State(double a, double b) { return Eigen::Vector2d(a, b); }

TEST(Held, ObjectIsCheckedWhereTheHandIs) {
  Scene scene;
  scene.objects = {{"ball", Pose::FromTranslation({1.2, 0, 0}), Sphere{0.05}},
                   {"post", Pose::FromTranslation({0, 1.2, 0}), Sphere{0.05}}};
  CollisionChecker checker = *CollisionChecker::Create(TwoLinks(), scene);
  EXPECT_NEAR(checker.SmallestClearance(State(0, 0)).distance_m, 1.2 - 0.95 - 0.05, 1e-9);
  const Clearance empty_handed = checker.SmallestClearance(State(M_PI / 2, 0));
  EXPECT_EQ(empty_handed.second, "post");
  EXPECT_NEAR(empty_handed.distance_m, 0.2, 1e-9);

  ASSERT_TRUE(checker.Attach("ball", "lower", State(0, 0)).ok());
  EXPECT_EQ(checker.scene().objects.size(), 1U);
  const Clearance carried = checker.SmallestClearance(State(M_PI / 2, 0));
  EXPECT_EQ(carried.first, "ball");
  EXPECT_EQ(carried.second, "post");
  EXPECT_NEAR(carried.distance_m, -0.1, 1e-9);

  ASSERT_TRUE(checker.Detach("ball", State(0, 0.5)).ok());
  EXPECT_TRUE(checker.scene().held.empty());
  const Pose& left = checker.scene().objects.back().base_T_shape;
  EXPECT_NEAR(left.translation.x(), 0.5 + 0.7 * std::cos(0.5), 1e-12);
  EXPECT_NEAR(left.translation.y(), 0.7 * std::sin(0.5), 1e-12);
  EXPECT_GT(checker.SmallestClearance(State(M_PI / 2, 0)).distance_m, 0.15);
}

TEST(Held, ObjectMayTouchItsLinkAndThoseNamedOnly) {
  Scene scene;
  // A bar across the end of the lower arm that meets the upper arm when the elbow folds.
  scene.held = {{"bar", "lower", Pose::FromTranslation({0.45, 0, 0}), Box{{0.02, 0.3, 0.02}}}};
  CollisionChecker checker = *CollisionChecker::Create(TwoLinks(), scene);
  const Clearance folded = checker.SmallestClearance(State(0, 2.9));
  EXPECT_LT(folded.distance_m, 0);
  EXPECT_EQ(folded.first, "upper");
  EXPECT_EQ(folded.second, "bar");
  EXPECT_GT(checker.SmallestClearance(State(0, 0)).distance_m, 0.1);
  scene.held[0].touch_links = {"upper"};
  ASSERT_TRUE(checker.SetScene(scene).ok());
  EXPECT_TRUE(std::isinf(checker.SmallestClearance(State(0, 2.9)).distance_m));
}

TEST(Held, ObjectMayTouchWhatItIsAllowedToInTheEpisodeAndNotOtherwise) {
  Scene scene;
  scene.held = {{"peg", "lower", Pose::FromTranslation({0.55, 0, 0}), Box{{0.2, 0.02, 0.02}}}};
  scene.objects = {{"plate", Pose::FromTranslation({1.2, 0, 0}), Box{{0.32, 0.2, 0.2}}}};
  const CollisionChecker checker = *CollisionChecker::Create(TwoLinks(), scene);
  const Clearance found = checker.SmallestClearance(State(0, 0));
  EXPECT_LT(found.distance_m, 0);
  EXPECT_EQ(found.first, "peg");
  const Clearance allowed = checker.SmallestClearance(State(0, 0), {{"peg", "plate"}});
  EXPECT_EQ(allowed.first, "lower");
  EXPECT_NEAR(allowed.distance_m, 1.04 - 0.95, 1e-9);
  EXPECT_LT(checker.SmallestClearance(State(0, 0), {{"lower", "plate"}}).distance_m, 0);
}

TEST(Held, ObjectIsPaddedLikeTheRobot) {
  Scene scene;
  scene.held = {{"tip", "lower", Pose::FromTranslation({0.5, 0, 0}), Sphere{0.05}}};
  scene.objects = {{"ball", Pose::FromTranslation({1.3, 0, 0}), Sphere{0.05}}};
  CheckerOptions options;
  options.padding_m = 0.03;
  const CollisionChecker checker = *CollisionChecker::Create(TwoLinks(), scene, options);
  EXPECT_NEAR(checker.SmallestClearance(State(0, 0)).distance_m, 0.2 - 0.03, 1e-9);
}

TEST(Held, ObjectCountsBetweenWaypoints) {
  Scene scene;
  scene.held = {{"stick", "lower", Pose::FromTranslation({0.6, 0, 0}), Box{{0.3, 0.004, 0.004}}}};
  Pose at = Pose::FromTranslation({1.2 * std::cos(0.8), 1.2 * std::sin(0.8), 0});
  scene.objects = {{"wire", at, Box{{1e-4, 1e-4, 0.2}}}};
  const CollisionChecker checker = *CollisionChecker::Create(TwoLinks(), scene);
  const testing::SampledPath path({State(0, 0), State(0.5, 0), State(1.1, 0), State(1.6, 0)});
  for (std::size_t i = 0; i < path.frames(); ++i) {
    ASSERT_GT(checker.SmallestClearance(path[i]).distance_m, 0.01);
  }
  const std::optional<Violation> found = checker.FirstViolation(path, 0, 3, 0);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->clearance.first, "stick");
  EXPECT_EQ(found->clearance.second, "wire");
}

TEST(Held, ErrorsNameWhatThereIsNot) {
  CollisionChecker checker = *CollisionChecker::Create(TwoLinks(), {});
  EXPECT_THAT(checker.Attach("ball", "lower", State(0, 0)).error().message, HasSubstr("\"ball\""));
  EXPECT_THAT(checker.Detach("ball", State(0, 0)).error().message, HasSubstr("\"ball\""));
  Scene scene;
  scene.objects = {{"ball", {}, Sphere{0.05}}};
  ASSERT_TRUE(checker.SetScene(scene).ok());
  EXPECT_THAT(checker.Attach("ball", "foot", State(0, 0)).error().message, HasSubstr("\"foot\""));
  EXPECT_THAT(checker.Attach("ball", "lower", State(0, 0), {"toe"}).error().message,
              HasSubstr("\"toe\""));
  EXPECT_EQ(checker.scene().objects.size(), 1U);
  scene.held = {{"ball", "lower", {}, Sphere{0.05}}};
  EXPECT_THAT(checker.SetScene(scene).error().message, HasSubstr("another object"));
  scene.held = {{"upper", "lower", {}, Sphere{0.05}}};
  EXPECT_THAT(checker.SetScene(scene).error().message, HasSubstr("\"upper\""));
}

TEST(Cloud, IsAnObstacle) {
  Rng rng(1);
  PointCloud wall{"wall", Pose::FromTranslation({1.2, 0, 0}), {}, 0.02};
  for (int i = 0; i < 5000; ++i) {
    wall.cloud_p_points.emplace_back(0.001, rng.Uniform(-0.3, 0.3), rng.Uniform(-0.3, 0.3));
  }
  Scene scene;
  scene.clouds = {wall};
  const CollisionChecker checker = *CollisionChecker::Create(TwoLinks(), scene);
  const Clearance clearance = checker.SmallestClearance(State(0, 0));
  EXPECT_EQ(clearance.second, "wall");
  EXPECT_NEAR(clearance.distance_m, 1.2 - 0.95, 1e-6);
  const testing::SampledPath sweep(
      {State(-1.2, 0), State(-1.1, 2.0), State(0.3, 0), State(1.5, 0)});
  EXPECT_FALSE(checker.FirstViolation(sweep, 0, 3, 0.002).has_value());
  scene.clouds[0].base_T_cloud.translation.x() = 0.9;
  CollisionChecker nearer = *CollisionChecker::Create(TwoLinks(), scene);
  EXPECT_LT(nearer.SmallestClearance(State(0, 0)).distance_m, 0);
  EXPECT_TRUE(nearer.FirstViolation(sweep, 0, 3, 0.002).has_value());
}

TEST(NearnessCost, HasTheGradientThatDifferencesShow) {
  Rng rng(2);
  const RobotModel model = TwoLinks();
  Scene scene;
  scene.objects = {{"ball", Pose::FromTranslation({0.9, 0.3, 0.02}), Sphere{0.1}},
                   {"box", Pose::FromTranslation({0.2, 0.7, 0.03}), Box{{0.2, 0.1, 0.1}}}};
  scene.held = {{"tip", "lower", Pose::FromTranslation({0.5, 0, 0}), Sphere{0.04}}};
  const CollisionChecker checker = *CollisionChecker::Create(model, scene);
  constexpr double kMargin_m = 0.15;
  constexpr double kStep = 1e-6;
  int near = 0;
  for (int i = 0; i < 400; ++i) {
    Eigen::VectorXd q = testing::RandomState(model, rng);
    if (checker.SmallestClearance(q).distance_m < 1e-3) continue;
    Eigen::VectorXd gradient;
    const double cost = checker.NearnessCost(q, kMargin_m, {}, &gradient);
    EXPECT_EQ(cost, checker.NearnessCost(q, kMargin_m));
    if (cost == 0) {
      EXPECT_EQ(gradient.norm(), 0);
      EXPECT_GE(checker.SmallestClearance(q).distance_m, kMargin_m - 1e-9);
      continue;
    }
    ++near;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const double value = q[j];
      q[j] = value + kStep;
      const double after = checker.NearnessCost(q, kMargin_m);
      q[j] = value - kStep;
      const double before = checker.NearnessCost(q, kMargin_m);
      q[j] = value;
      EXPECT_NEAR((after - before) / (2 * kStep), gradient[j], 2e-3 * (1 + gradient.norm())) << i;
    }
  }
  EXPECT_GT(near, 50);
}

}  // namespace
}  // namespace exemplar::collision
