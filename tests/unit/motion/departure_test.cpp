#include "exemplar/motion/departure.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "press.hpp"
#include "timing.hpp"

namespace exemplar::motion {
namespace {

using collision::AllowedTouch;
using collision::CollisionChecker;
using collision::Scene;
using kinematics::Box;

const Eigen::Vector3d kTarget(0.6, -0.2, 0.04);

class DepartureOnArm7 : public ::testing::Test {
 protected:
  DepartureOnArm7() : robot_(test::LoadRobot("arm7")) {
    options_.touch_links = robot_.touch_links;
    scene_.objects.push_back(
        {"table", geometry::Pose::FromTranslation({0.5, 0, -0.02}), Box{{1.4, 1.4, 0.03}}});
    scene_.objects.push_back(
        {"target", geometry::Pose::FromTranslation(kTarget - Eigen::Vector3d(0, 0, 0.02)),
         kinematics::Cylinder{0.02, 0.04}});
  }

  /// The tool so far above the target, turned as at home.
  Eigen::VectorXd Above(double height_m) const {
    geometry::Pose pose = robot_.chain.ToolPose(robot_.home);
    pose.translation = kTarget + height_m * Eigen::Vector3d::UnitZ();
    return kinematics::SolveIk(robot_.chain, pose, robot_.home)->q;
  }

  CollisionChecker Checker() const {
    return *CollisionChecker::Create(robot_.model, scene_, collision::OptionsOf(robot_));
  }

  Result<Departure> From(const Eigen::VectorXd& start) const {
    return PlanDeparture(robot_.model, robot_.chain, Checker(), start, options_);
  }

  double DistanceAt(const CollisionChecker& checker, const JointTrajectory& way, double time_s,
                    const std::vector<AllowedTouch>& left_out) const {
    Eigen::VectorXd q(robot_.chain.dof());
    Eigen::VectorXd unused(robot_.chain.dof());
    Evaluate(way, time_s, q, unused);
    return checker
        .SmallestClearance(kinematics::FullJointVector(robot_.model, robot_.chain, q), left_out)
        .distance_m;
  }

  /// Moves the scene's last thing until the robot is so near.
  void MoveUntilNear(const Eigen::VectorXd& start, Eigen::Vector3d from,
                     const Eigen::Vector3d& direction, double near_m,
                     const std::vector<AllowedTouch>& left_out = {}) {
    const Eigen::VectorXd q = kinematics::FullJointVector(robot_.model, robot_.chain, start);
    CollisionChecker checker = Checker();
    for (double distance = 1; distance > near_m;) {
      scene_.objects.back().base_T_shape.translation = from;
      ASSERT_TRUE(checker.SetScene(scene_).ok());
      distance = checker.SmallestClearance(q, left_out).distance_m;
      from += std::max(0.3 * (distance - near_m), 5e-5) * direction;
      ASSERT_LT(from.norm(), 3);
    }
  }

  /// By fine sampling: what a departure is to keep to.
  void ExpectLawful(const Departure& departure, const Eigen::VectorXd& start) const {
    const JointTrajectory& way = departure.trajectory;
    EXPECT_LT((way.positions.row(0).transpose() - start).norm(), 1e-9);
    EXPECT_EQ(way.velocities.topRows(1).norm(), 0);
    EXPECT_EQ(way.velocities.bottomRows(1).norm(), 0);
    EXPECT_LE(MeasureLimitUse(way, robot_.chain.limits()).velocity, 1.0);
    const CollisionChecker all = Checker();
    std::vector<AllowedTouch> touched;
    for (const TouchWindow& touch : departure.touches) touched.push_back({"finger", touch.object});
    EXPECT_GE(DistanceAt(all, way, way.duration_s(), {}), options_.required_clearance_m);
    // Each touched thing alone, beside what may not be touched at all.
    for (const TouchWindow& touch : departure.touches) {
      std::vector<AllowedTouch> others;
      for (const AllowedTouch& pair : touched) {
        if (pair.object != touch.object) others.push_back(pair);
      }
      double farthest = -1;
      for (double t = 0; t <= way.duration_s(); t += 0.002) {
        EXPECT_GE(DistanceAt(all, way, t, touched), options_.required_clearance_m) << t;
        const double distance = DistanceAt(all, way, t, others);
        ASSERT_GE(std::min(distance, options_.required_clearance_m), farthest - 5e-4)
            << touch.object << " at " << t << " s";
        farthest = std::max(farthest, std::min(distance, options_.required_clearance_m));
        if (t > touch.end_s) {
          EXPECT_GE(distance, options_.required_clearance_m) << t;
        }
      }
    }
  }

  kinematics::RobotDescription robot_;
  Scene scene_;
  PlanOptions options_;
};

TEST_F(DepartureOnArm7, IsNoneWhereNothingIsTouched) {
  const Result<Departure> departure = From(Above(0.01));
  ASSERT_TRUE(departure.ok()) << departure.error().message;
  EXPECT_TRUE(departure->trajectory.time_s.empty());
  EXPECT_TRUE(departure->touches.empty());
}

TEST_F(DepartureOnArm7, LeadsOutOfAPressAndNeverDeeperIntoIt) {
  for (const double height_m : {-0.012, -0.003, -0.00005, 0.001}) {
    SCOPED_TRACE(height_m);
    const Eigen::VectorXd pressed = Above(height_m);
    const Result<Departure> departure = From(pressed);
    ASSERT_TRUE(departure.ok()) << departure.error().message;
    ASSERT_EQ(departure->touches.size(), 1U);
    EXPECT_EQ(departure->touches[0].object, "target");
    EXPECT_LT(departure->touches[0].end_s, departure->trajectory.duration_s());
    ExpectLawful(*departure, pressed);
    const Eigen::VectorXd end = departure->trajectory.positions.bottomRows(1).transpose();
    EXPECT_GT(robot_.chain.ToolPose(end).translation.z(), kTarget.z() + 0.02);
    EXPECT_GE(departure->report.smallest_clearance.distance_m, options_.required_clearance_m);
  }
}

TEST_F(DepartureOnArm7, LeavesAWallTheWayItStandsAwayFromIt) {
  const Eigen::VectorXd start = Above(0.1);
  const Eigen::Vector3d tool = robot_.chain.ToolPose(start).translation;
  scene_.objects.push_back({"wall", {}, Box{{0.4, 0.004, 0.02}}});
  MoveUntilNear(start, tool + Eigen::Vector3d(0, 0.1, 0), -Eigen::Vector3d::UnitY(), 1e-3);
  const Result<Departure> departure = From(start);
  ASSERT_TRUE(departure.ok()) << departure.error().message;
  ASSERT_EQ(departure->touches.size(), 1U);
  ExpectLawful(*departure, start);
  const Eigen::VectorXd end = departure->trajectory.positions.bottomRows(1).transpose();
  EXPECT_LT(robot_.chain.ToolPose(end).translation.y(), tool.y() - 0.02);
}

TEST_F(DepartureOnArm7, IsRefusedWhereSomethingElseIsInTheWay) {
  const Eigen::VectorXd pressed = Above(-0.003);
  std::vector<geometry::Pose> poses;
  kinematics::LinkPoses(robot_.model,
                        kinematics::FullJointVector(robot_.model, robot_.chain, pressed), poses);
  const geometry::Pose& wrist = poses[static_cast<std::size_t>(robot_.model.FindLink("link6"))];
  ASSERT_TRUE(From(pressed).ok());
  scene_.objects.push_back({"lid", {}, Box{{0.2, 0.2, 0.01}}});
  MoveUntilNear(pressed, wrist.translation + Eigen::Vector3d(0, 0, 0.4), -Eigen::Vector3d::UnitZ(),
                4e-3, {{"finger", "target"}});
  const Result<Departure> departure = From(pressed);
  ASSERT_FALSE(departure.ok());
  for (const char* part : {"no free way from where the robot stands: at 0.00 s \"finger\"",
                           "on the way back from there, at ", "\"lid\""}) {
    EXPECT_NE(departure.error().message.find(part), std::string::npos) << departure.error().message;
  }
}

TEST_F(DepartureOnArm7, IsRefusedWhereAnotherLinkTouches) {
  options_.touch_links = {"link7"};
  const Result<Departure> departure = From(Above(-0.003));
  ASSERT_FALSE(departure.ok());
  EXPECT_NE(departure.error().message.find("\"finger\" and \"target\" are "), std::string::npos)
      << departure.error().message;
}

TEST_F(DepartureOnArm7, IsRefusedInTheMiddleOfAThing) {
  const Eigen::VectorXd start = Above(0.2);
  scene_.objects.push_back({"crate", robot_.chain.ToolPose(start), Box{{0.3, 0.3, 0.3}}});
  const Result<Departure> departure = From(start);
  ASSERT_FALSE(departure.ok());
  EXPECT_NE(departure.error().message.find("crate"), std::string::npos)
      << departure.error().message;
}

TEST_F(DepartureOnArm7, KeepsItsLawAmongRandomThings) {
  Rng rng(5);
  int free = 0;
  int refused = 0;
  for (int i = 0; i < 60; ++i) {
    scene_.objects.resize(2);
    const Eigen::VectorXd pressed = Above(rng.Uniform(-0.008, 0.001));
    const Eigen::Vector3d tool = robot_.chain.ToolPose(pressed).translation;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d off(rng.Uniform(-0.1, 0.1), rng.Uniform(-0.1, 0.1),
                                rng.Uniform(0.0, 0.1));
      scene_.objects.push_back(
          {"box" + std::to_string(k), geometry::Pose::FromTranslation(tool + off),
           Box{{rng.Uniform(0.005, 0.08), rng.Uniform(0.005, 0.08), rng.Uniform(0.005, 0.03)}}});
    }
    const Result<Departure> departure = From(pressed);
    if (departure.ok()) {
      ++free;
      ExpectLawful(*departure, pressed);
    } else {
      ++refused;
    }
  }
  EXPECT_GT(free, 10);
  EXPECT_GT(refused, 3);
}

TEST_F(DepartureOnArm7, GoesBeforeAPlanWithAllItsTimes) {
  const Eigen::VectorXd pressed = Above(-0.003);
  const Result<Departure> departure = From(pressed);
  ASSERT_TRUE(departure.ok()) << departure.error().message;
  const Eigen::VectorXd away = departure->trajectory.positions.bottomRows(1).transpose();
  const CollisionChecker checker = Checker();
  const Result<PlannedMotion> alone =
      PlanMotion(test::MakePress(robot_.chain.ToolPose(away), kTarget), robot_.model, robot_.chain,
                 checker, away, options_);
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  PlannedMotion plan = *alone;
  Prepend(*departure, plan);
  const double later_s = departure->trajectory.duration_s();
  EXPECT_NEAR(plan.trajectory.duration_s(), later_s + alone->trajectory.duration_s(), 1e-9);
  EXPECT_NEAR(plan.contacts[0].begin_s, later_s + alone->contacts[0].begin_s, 1e-9);
  EXPECT_NEAR(plan.frame_time_s.back(), plan.trajectory.duration_s(), 1e-9);
  ASSERT_EQ(plan.touches.size(), 2U);
  EXPECT_EQ(plan.touches[0].begin_s, 0);
  EXPECT_LT(plan.touches[0].end_s, later_s);
  EXPECT_NEAR(plan.touches[1].begin_s, later_s + alone->touches[0].begin_s, 1e-9);
  EXPECT_LT((plan.trajectory.positions.row(0).transpose() - pressed).norm(), 1e-9);
  EXPECT_LE(MeasureLimitUse(plan.trajectory, robot_.chain.limits()).velocity, 1.0);
  // Nothing to depart from changes nothing.
  PlannedMotion same = *alone;
  Prepend({}, same);
  EXPECT_EQ(same.trajectory.duration_s(), alone->trajectory.duration_s());
  EXPECT_EQ(same.touches.size(), 1U);
}

}  // namespace
}  // namespace exemplar::motion
