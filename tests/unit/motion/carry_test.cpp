// What the hand carries is a body: on its way, and where it is laid.

#include "exemplar/motion/carry.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "exemplar/motion/plan.hpp"
#include "press.hpp"

namespace exemplar::motion {
namespace {

using collision::CollisionChecker;
using demonstration::SkillMotion;
using Eigen::Vector3d;

const Vector3d kBlock(0.48, -0.16, 0.02);
const Vector3d kTray(0.48, 0.2, -0.002);
constexpr double kTrayTop_m = 0.001;
constexpr double kHalfBlock_m = 0.025;
constexpr double kHigh_m = 0.13;  ///< of the tool, on the way
constexpr double kRate_hz = 60;

/// Adds frames that go straight to `to` in `seconds`, the hand's opening changing along.
void Go(SkillMotion& motion, const Vector3d& to, double open, double seconds) {
  const geometry::Pose from = motion.base_T_tool.back();
  const double from_open = motion.hand_open.back();
  const int count = static_cast<int>(seconds * kRate_hz);
  for (int k = 1; k <= count; ++k) {
    const double s = test::MinimumJerk(static_cast<double>(k) / count);
    motion.time_s.push_back(motion.time_s.back() + 1 / kRate_hz);
    motion.base_T_tool.push_back({from.translation + s * (to - from.translation), from.rotation});
    motion.hand_open.push_back(from_open + s * (open - from_open));
  }
}

class CarryOnArm7 : public ::testing::Test {
 protected:
  CarryOnArm7() : robot_(test::LoadRobot("arm7_hand")) {
    options_.touch_links = robot_.touch_links;
    options_.comfortable = robot_.home;
    options_.touch_margin_m = 0.1;
    scene_.objects.push_back({"table", geometry::Pose::FromTranslation({0.6, 0, -0.025}),
                              kinematics::Box{{1.6, 1.6, 0.04}}});
    scene_.objects.push_back({"block", geometry::Pose::FromTranslation(kBlock),
                              kinematics::Box{{0.04, 0.04, 2 * kHalfBlock_m}}});
    scene_.objects.push_back(
        {"tray", geometry::Pose::FromTranslation(kTray), kinematics::Box{{0.16, 0.16, 0.006}}});
  }

  /// Takes the block, carries it over and lays it on the tray, or keeps it.
  SkillMotion Carrying(bool releases = true) const {
    SkillMotion motion;
    motion.time_s = {0};
    motion.base_T_tool = {robot_.chain.ToolPose(robot_.home)};
    motion.hand_open = {1};
    const Vector3d down = kBlock + Vector3d(0, 0, 0.01);
    const Vector3d above(down.x(), down.y(), kHigh_m);
    const Vector3d over(kTray.x(), kTray.y(), kHigh_m);
    const Vector3d laid(kTray.x(), kTray.y(), kTrayTop_m + kHalfBlock_m + 0.01);
    Go(motion, above, 1, 1.2);
    Go(motion, down, 1, 0.8);
    const int first = motion.frames() - 1;
    Go(motion, down, 0.4, 0.4);
    motion.contacts.push_back({"block", first, motion.frames() - 1, down, false});
    Go(motion, above, 0.4, 0.8);
    Go(motion, over, 0.4, 1.5);
    if (!releases) return motion;
    Go(motion, laid, 0.4, 0.8);
    const int there = motion.frames() - 1;
    Go(motion, laid, 1, 0.4);
    motion.contacts.push_back({"tray", there, motion.frames() - 1, laid, false});
    Go(motion, over, 1, 0.8);
    return motion;
  }

  void AddWall(double top_m) {
    scene_.objects.push_back({"wall", geometry::Pose::FromTranslation({0.48, 0.02, top_m - 0.03}),
                              kinematics::Box{{0.3, 0.01, 0.06}}});
  }

  Result<std::vector<Carry>> Find(const SkillMotion& motion) const {
    return FindCarries(motion, scene_, {"block"}, robot_.chain.tip_link(), robot_.touch_links);
  }

  Result<PlannedMotion> Plan(const SkillMotion& motion, bool knows_what_it_carries = true) {
    collision::Scene scene = scene_;
    options_.carries.clear();
    if (knows_what_it_carries) {
      Result<std::vector<Carry>> carries = Find(motion);
      if (!carries.ok()) return carries.error();
      options_.carries = *std::move(carries);
      AddCarries(options_.carries, scene);
    }
    const Result<CollisionChecker> checker = CollisionChecker::Create(robot_.model, scene);
    if (!checker.ok()) return checker.error();
    return PlanMotion(motion, robot_.model, robot_.chain, *checker, robot_.home, options_);
  }

  kinematics::RobotDescription robot_;
  collision::Scene scene_;
  PlanOptions options_;
};

TEST_F(CarryOnArm7, KnowsWhatIsTakenWhereItIsLaidAndWhatBearsIt) {
  AddWall(0.06);
  const Result<std::vector<Carry>> carries = Find(Carrying());
  ASSERT_TRUE(carries.ok()) << carries.error().message;
  ASSERT_EQ(carries->size(), 1U);
  const Carry& carry = carries->front();
  EXPECT_EQ(carry.object, "block");
  EXPECT_EQ(carry.from, std::vector<std::string>{"table"});
  EXPECT_NE(std::find(carry.to.begin(), carry.to.end(), "tray"), carry.to.end());
  EXPECT_EQ(std::find(carry.to.begin(), carry.to.end(), "wall"), carry.to.end());
  const Vector3d laid(kTray.x(), kTray.y(), kTrayTop_m + kHalfBlock_m);
  EXPECT_LT((carry.laid.base_T_shape.translation - laid).norm(), 1e-9);
  EXPECT_LT(carry.first, carry.last);
}

TEST_F(CarryOnArm7, AWallBesideIsNothingThatBearsWhatIsLaid) {
  scene_.objects.push_back(
      {"wall", geometry::Pose::FromTranslation({kTray.x(), kTray.y() + 0.02 + 0.003 + 0.005, 0.03}),
       kinematics::Box{{0.1, 0.01, 0.06}}});
  const Result<std::vector<Carry>> carries = Find(Carrying());
  ASSERT_TRUE(carries.ok()) << carries.error().message;
  const std::vector<std::string>& to = carries->front().to;
  EXPECT_EQ(std::find(to.begin(), to.end(), "wall"), to.end());
}

TEST_F(CarryOnArm7, CarriesWhereThereIsRoomForWhatItHolds) {
  AddWall(0.06);
  const Result<PlannedMotion> plan = Plan(Carrying());
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  ASSERT_EQ(plan->carries.size(), 1U);
  const CarryWindow& carry = plan->carries[0];
  EXPECT_LT(carry.begin_s, carry.lifted_s);
  EXPECT_LT(carry.lifted_s, carry.lowered_s);
  EXPECT_LT(carry.lowered_s, carry.end_s);
  EXPECT_LT(carry.end_s, carry.left_s);
  EXPECT_GE(plan->report.smallest_clearance.distance_m, options_.required_clearance_m);
}

TEST_F(CarryOnArm7, RefusesAWallThatOnlyTheBlockWouldHit) {
  // The fingers' tips are at the tool's height and higher, the block's foot 35 mm below.
  AddWall(kHigh_m - 0.025);
  const SkillMotion motion = Carrying();
  const Result<PlannedMotion> blind = Plan(motion, false);
  EXPECT_TRUE(blind.ok()) << blind.error().message;
  const Result<PlannedMotion> plan = Plan(motion);
  ASSERT_FALSE(plan.ok());
  EXPECT_NE(plan.error().message.find("block in the hand"), std::string::npos)
      << plan.error().message;
  EXPECT_NE(plan.error().message.find("wall"), std::string::npos) << plan.error().message;
}

TEST_F(CarryOnArm7, KeepsClearOfWhatItLaidDown) {
  // After the release the hand sweeps through the place where the block now stands.
  SkillMotion motion = Carrying();
  const Vector3d beside(kTray.x(), kTray.y() + 0.13, kHigh_m);
  const Vector3d low(beside.x(), beside.y(), 0.04);
  const Vector3d through(kTray.x(), kTray.y() - 0.12, 0.04);
  Go(motion, beside, 1, 0.8);
  Go(motion, low, 1, 0.8);
  Go(motion, through, 1, 1.0);
  const Result<PlannedMotion> blind = Plan(motion, false);
  EXPECT_TRUE(blind.ok()) << blind.error().message;
  const Result<PlannedMotion> plan = Plan(motion);
  ASSERT_FALSE(plan.ok());
  EXPECT_NE(plan.error().message.find("block as laid"), std::string::npos) << plan.error().message;
}

TEST_F(CarryOnArm7, KeepsWhatIsNeverReleased) {
  const SkillMotion motion = Carrying(false);
  const Result<PlannedMotion> plan = Plan(motion);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  ASSERT_EQ(plan->carries.size(), 1U);
  EXPECT_TRUE(std::isinf(plan->carries[0].end_s));
  const double end_s = plan->trajectory.duration_s();
  bool block_counts = true;
  bool held_counts = true;
  for (const collision::AllowedTouch& touch : AllowedAt(*plan, robot_.touch_links, end_s)) {
    if (touch.link.empty() && touch.object == "block") block_counts = false;
    if (touch.link == "block in the hand" && touch.object.empty()) held_counts = false;
  }
  EXPECT_FALSE(block_counts);
  EXPECT_TRUE(held_counts);
}

TEST_F(CarryOnArm7, TakesNothingWithoutAThingBetweenTheFingers) {
  scene_.objects[1].base_T_shape.translation.y() -= 0.1;
  const Result<std::vector<Carry>> carries = Find(Carrying());
  ASSERT_TRUE(carries.ok());
  EXPECT_TRUE(carries->empty());
}

}  // namespace
}  // namespace exemplar::motion
