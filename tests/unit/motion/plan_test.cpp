#include "exemplar/motion/plan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "exemplar/base/rng.hpp"
#include "press.hpp"
#include "timing.hpp"

namespace exemplar::motion {
namespace {

using collision::CollisionChecker;
using collision::Scene;
using demonstration::SkillMotion;
using test::MakePress;

const Eigen::Vector3d kTarget(0.6, -0.2, 0.04);

class PlanOnArm7 : public ::testing::Test {
 protected:
  PlanOnArm7() : robot_(test::LoadRobot("arm7")) {
    options_.touch_links = robot_.touch_links;
    options_.comfortable = robot_.home;
    scene_.objects.push_back({"table", geometry::Pose::FromTranslation({0.5, 0, -0.02}),
                              kinematics::Box{{1.4, 1.4, 0.03}}});
    scene_.objects.push_back(
        {"target", geometry::Pose::FromTranslation(kTarget - Eigen::Vector3d(0, 0, 0.02)),
         kinematics::Cylinder{0.02, 0.04}});
  }

  geometry::Pose HomePose() const { return robot_.chain.ToolPose(robot_.home); }

  Result<PlannedMotion> Plan(const SkillMotion& motion, const Eigen::VectorXd& start) const {
    Result<CollisionChecker> checker = CollisionChecker::Create(robot_.model, scene_);
    if (!checker.ok()) return checker.error();
    return PlanMotion(motion, robot_.model, robot_.chain, *checker, start, options_);
  }

  Result<PlannedMotion> Plan(const SkillMotion& motion) const { return Plan(motion, robot_.home); }

  Eigen::VectorXd At(const JointTrajectory& trajectory, double t) const {
    Eigen::VectorXd q(robot_.chain.dof());
    Eigen::VectorXd v(robot_.chain.dof());
    Evaluate(trajectory, t, q, v);
    return q;
  }

  /// The smallest clearance of a plan by fine sampling, touches of the target by the finger aside.
  double SampledClearance(const JointTrajectory& trajectory, bool leave_touch_out) const {
    const CollisionChecker checker = *CollisionChecker::Create(robot_.model, scene_);
    double smallest = 1e9;
    std::vector<collision::AllowedTouch> allowed;
    if (leave_touch_out) allowed = {{"finger", "target"}};
    for (double t = 0; t <= trajectory.duration_s(); t += 0.001) {
      const Eigen::VectorXd q =
          kinematics::FullJointVector(robot_.model, robot_.chain, At(trajectory, t));
      smallest = std::min(smallest, checker.SmallestClearance(q, allowed).distance_m);
    }
    return smallest;
  }

  kinematics::RobotDescription robot_;
  Scene scene_;
  PlanOptions options_;
};

TEST_F(PlanOnArm7, FollowsAPressExactlyInContact) {
  const SkillMotion press = MakePress(HomePose(), kTarget);
  const Result<PlannedMotion> plan = Plan(press);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_LE(plan->report.max_contact_error_m, options_.position_tolerance_m);
  EXPECT_LE(plan->report.max_position_error_m, options_.free_tolerance_m);
  EXPECT_LE(plan->report.max_rotation_error_rad, options_.rotation_tolerance_rad);
  ASSERT_EQ(plan->contacts.size(), 1U);
  // The tool goes through the contact point on its way down.
  double nearest = 1;
  const ContactWindow& window = plan->contacts[0];
  for (double t = window.begin_s - 0.05; t <= window.end_s; t += 0.0005) {
    const geometry::Pose tool = robot_.chain.ToolPose(At(plan->trajectory, t));
    nearest = std::min(nearest, (tool.translation - window.base_p_contact).norm());
  }
  EXPECT_LT(nearest, 2e-4);
}

TEST_F(PlanOnArm7, KeepsVelocityAccelerationAndPositionLimits) {
  for (const double reach_s : {2.0, 0.6, 0.15}) {
    const SkillMotion press =
        MakePress(HomePose(), kTarget, {.reach_s = reach_s, .press_s = 0.4 * reach_s});
    const Result<PlannedMotion> plan = Plan(press);
    ASSERT_TRUE(plan.ok()) << plan.error().message;
    const LimitUse use = MeasureLimitUse(plan->trajectory, robot_.chain.limits());
    EXPECT_LE(use.velocity, 1.0) << reach_s;
    EXPECT_LE(use.acceleration, 1.0) << reach_s;
    for (double t = 0; t <= plan->trajectory.duration_s(); t += 0.003) {
      const Eigen::VectorXd q = At(plan->trajectory, t);
      for (int j = 0; j < robot_.chain.dof(); ++j) {
        EXPECT_GE(q[j], robot_.chain.limits()[j].lower);
        EXPECT_LE(q[j], robot_.chain.limits()[j].upper);
      }
    }
  }
}

TEST_F(PlanOnArm7, StartsAndEndsAtRest) {
  const Result<PlannedMotion> plan = Plan(MakePress(HomePose(), kTarget));
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_EQ(plan->trajectory.velocities.row(0).norm(), 0);
  EXPECT_EQ(plan->trajectory.velocities.bottomRows(1).norm(), 0);
  EXPECT_LT((plan->trajectory.positions.row(0).transpose() - robot_.home).norm(), 1e-9);
}

TEST_F(PlanOnArm7, KeepsTheDemonstratedTimingWhereItFits) {
  const SkillMotion press = MakePress(HomePose(), kTarget, {.reach_s = 2.5, .press_s = 1.2});
  const Result<PlannedMotion> plan = Plan(press);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_LT(plan->report.time_stretch, 1.1);
  EXPECT_GT(plan->report.time_stretch, 0.99);
  const demonstration::Contact& contact = press.contacts[0];
  const double demonstrated = press.time_s[contact.last] - press.time_s[contact.first];
  EXPECT_NEAR(plan->contacts[0].end_s - plan->contacts[0].begin_s, demonstrated, 0.02);
}

TEST_F(PlanOnArm7, SlowsDownAMotionThatIsTooFast) {
  const SkillMotion press = MakePress(HomePose(), kTarget, {.reach_s = 0.2, .press_s = 0.1});
  const Result<PlannedMotion> plan = Plan(press);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_GT(plan->report.time_stretch, 1.2);
}

TEST_F(PlanOnArm7, RunsSlowerAtALowerSpeed) {
  const SkillMotion press = MakePress(HomePose(), kTarget);
  const double full = Plan(press)->trajectory.duration_s();
  options_.speed_scale = 0.5;
  // Getting under way and coming to rest take their time at any speed.
  const double slow = Plan(press)->trajectory.duration_s();
  EXPECT_LT(slow, 2 * full);
  EXPECT_GT(slow, 1.8 * full);
}

TEST_F(PlanOnArm7, StaysNearTheDemonstratedJoints) {
  // Demonstrated with the elbow turned out: joints of another branch of the null space.
  SkillMotion press = MakePress(HomePose(), kTarget);
  Eigen::VectorXd turned = robot_.home;
  turned[2] += 0.7;
  const CollisionChecker checker = *CollisionChecker::Create(robot_.model, scene_);
  PlanOptions there = options_;
  there.comfortable = turned;
  const PlannedMotion demonstrated =
      *PlanMotion(press, robot_.model, robot_.chain, checker, turned, there);
  press.joint_names = robot_.chain.joint_names();
  press.joints.resize(press.frames(), robot_.chain.dof());
  for (int k = 0; k < press.frames(); ++k) {
    const double t = demonstrated.report.approach_s +
                     (demonstrated.trajectory.duration_s() - demonstrated.report.approach_s) * k /
                         (press.frames() - 1);
    press.joints.row(k) = At(demonstrated.trajectory, t).transpose();
  }
  const PlannedMotion with =
      *PlanMotion(press, robot_.model, robot_.chain, checker, press.joints.row(0), options_);
  options_.demonstrated_weight = 0;
  const PlannedMotion without =
      *PlanMotion(press, robot_.model, robot_.chain, checker, press.joints.row(0), options_);
  EXPECT_LT(with.report.style_error_rad, 0.1);
  EXPECT_LT(with.report.style_error_rad, 0.5 * without.report.style_error_rad);
}

TEST_F(PlanOnArm7, RefusesAPathOutOfReachAndNamesTheFrame) {
  const SkillMotion press = MakePress(HomePose(), {1.9, 0, 0.3});
  const Result<PlannedMotion> plan = Plan(press);
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_NE(plan.error().message.find("frame"), std::string::npos) << plan.error().message;
  EXPECT_NE(plan.error().message.find("mm away"), std::string::npos) << plan.error().message;
}

TEST_F(PlanOnArm7, TurnsItsElbowAwayFromAnObstacle) {
  SkillMotion sideways = MakePress(HomePose(), {0.45, 0.3, 0.15}, {.reach_s = 2.5});
  sideways.contacts.clear();
  const Result<PlannedMotion> alone = Plan(sideways);
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  // A ball beside the elbow where the motion ends, a good centimetre into it.
  std::vector<geometry::Pose> poses;
  const Eigen::VectorXd end = At(alone->trajectory, alone->trajectory.duration_s());
  kinematics::LinkPoses(robot_.model, kinematics::FullJointVector(robot_.model, robot_.chain, end),
                        poses);
  const geometry::Pose& elbow = poses[static_cast<std::size_t>(robot_.model.FindLink("link4"))];
  scene_.objects.push_back(
      {"ball", geometry::Pose::FromTranslation(elbow.translation + Eigen::Vector3d(0, 0.1, 0)),
       kinematics::Sphere{0.06}});
  ASSERT_LT(SampledClearance(alone->trajectory, false), 0);
  const Result<PlannedMotion> plan = Plan(sideways);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_GE(SampledClearance(plan->trajectory, false), options_.required_clearance_m - 1e-4);
  EXPECT_LE(plan->report.max_position_error_m, options_.free_tolerance_m);
  EXPECT_LE(plan->report.max_rotation_error_rad, options_.rotation_tolerance_rad);
}

TEST_F(PlanOnArm7, RefusesWhereNoFreedomIsLeftAndSaysWhenWhichHowDeepAndWhere) {
  const SkillMotion press = MakePress(HomePose(), kTarget);
  // A ball on the tool's own way.
  const Eigen::Vector3d between =
      0.5 * (press.base_T_tool[0].translation + press.base_T_tool[90].translation);
  scene_.objects.push_back(
      {"ball", geometry::Pose::FromTranslation(between), kinematics::Sphere{0.02}});
  const Result<PlannedMotion> plan = Plan(press);
  ASSERT_FALSE(plan.ok());
  const std::string& said = plan.error().message;
  for (const char* part : {"at ", " s \"", "\"ball\"", " mm ", " near ("}) {
    EXPECT_NE(said.find(part), std::string::npos) << said;
  }
}

TEST_F(PlanOnArm7, RefusesAThinPlateThatFramesStepOver) {
  // Across the way of the finger, far thinner than the step between frames.
  const geometry::Pose home = HomePose();
  Eigen::Vector3d above = kTarget;
  above.z() += 0.08;
  const Eigen::Vector3d middle = 0.5 * (home.translation + above);
  geometry::Pose plate;
  plate.translation = middle;
  plate.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(),
                                                      (above - home.translation).normalized());
  scene_.objects.push_back({"plate", plate, kinematics::Box{{0.0002, 0.03, 0.03}}});
  const Result<PlannedMotion> plan =
      Plan(MakePress(home, kTarget, {.reach_s = 0.3, .rate_hz = 30}));
  ASSERT_FALSE(plan.ok());
  EXPECT_NE(plan.error().message.find("plate"), std::string::npos) << plan.error().message;
  EXPECT_NE(plan.error().message.find(" s "), std::string::npos) << plan.error().message;
}

TEST_F(PlanOnArm7, RefusesATouchOfTheTargetWithoutAContact) {
  SkillMotion press = MakePress(HomePose(), kTarget);
  press.contacts.clear();
  const Result<PlannedMotion> plan = Plan(press);
  ASSERT_FALSE(plan.ok());
  EXPECT_NE(plan.error().message.find("\"finger\" and \"target\""), std::string::npos)
      << plan.error().message;
}

TEST_F(PlanOnArm7, RefusesATouchByAnotherLinkInContact) {
  options_.touch_links = {"link7"};
  const Result<PlannedMotion> plan = Plan(MakePress(HomePose(), kTarget));
  ASSERT_FALSE(plan.ok());
  EXPECT_NE(plan.error().message.find("finger"), std::string::npos) << plan.error().message;
}

TEST_F(PlanOnArm7, KeepsTheRequiredClearanceByFineSampling) {
  const Result<PlannedMotion> plan = Plan(MakePress(HomePose(), kTarget));
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  const double sampled = SampledClearance(plan->trajectory, true);
  EXPECT_GE(sampled, options_.required_clearance_m);
  EXPECT_GE(sampled, plan->report.smallest_clearance.distance_m - 1e-3);
}

TEST_F(PlanOnArm7, ApproachesTheFirstFrameFromElsewhere) {
  Eigen::VectorXd start = robot_.home;
  start[0] += 0.8;
  start[3] -= 0.3;
  const SkillMotion press = MakePress(HomePose(), kTarget);
  const Result<PlannedMotion> plan = Plan(press, start);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_GT(plan->report.approach_s, 0.3);
  EXPECT_LT((plan->trajectory.positions.row(0).transpose() - start).norm(), 1e-9);
  const geometry::Pose there = robot_.chain.ToolPose(At(plan->trajectory, plan->report.approach_s));
  EXPECT_LT((there.translation - press.base_T_tool[0].translation).norm(),
            options_.free_tolerance_m);
  EXPECT_LE(MeasureLimitUse(plan->trajectory, robot_.chain.limits()).velocity, 1.0);
}

TEST_F(PlanOnArm7, ApproachesOverAnObstacleInTheWay) {
  Eigen::VectorXd start = robot_.home;
  start[0] += 0.9;
  const geometry::Pose from = robot_.chain.ToolPose(start);
  const geometry::Pose to = HomePose();
  // A wall on the table between the two, lower than the raised finger.
  const double yaw = robot_.home[0] + 0.45;
  const double radius = to.translation.head<2>().norm();
  geometry::Pose wall;
  wall.translation = {radius * std::cos(yaw), radius * std::sin(yaw), 0.5 * from.translation.z()};
  wall.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  scene_.objects.push_back(
      {"wall", wall, kinematics::Box{{0.15, 0.02, from.translation.z() + 0.05}}});
  const Result<PlannedMotion> plan = Plan(MakePress(to, kTarget), start);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_GE(SampledClearance(plan->trajectory, true), options_.required_clearance_m);
}

TEST_F(PlanOnArm7, RefusesWhenTheStartItselfIsInAnObstacle) {
  Eigen::VectorXd start = robot_.home;
  start[0] += 0.9;
  const geometry::Pose from = robot_.chain.ToolPose(start);
  scene_.objects.push_back({"crate", from, kinematics::Box{{0.3, 0.3, 0.3}}});
  const Result<PlannedMotion> plan = Plan(MakePress(HomePose(), kTarget), start);
  ASSERT_FALSE(plan.ok());
  EXPECT_NE(plan.error().message.find("crate"), std::string::npos) << plan.error().message;
  EXPECT_NE(plan.error().message.find("at 0.00 s"), std::string::npos) << plan.error().message;
}

TEST_F(PlanOnArm7, RefusesToBeginInATouch) {
  // A first motion that ends in the press; PlanDeparture leads out of it.
  SkillMotion press = MakePress(HomePose(), kTarget);
  const auto end = static_cast<std::size_t>(press.contacts[0].last);
  press.time_s.resize(end);
  press.base_T_tool.resize(end);
  press.contacts[0].last = static_cast<int>(end) - 1;
  const Result<PlannedMotion> first = Plan(press);
  ASSERT_TRUE(first.ok()) << first.error().message;
  const Eigen::VectorXd pressed = first->trajectory.positions.bottomRows(1).transpose();
  EXPECT_FALSE(Plan(MakePress(HomePose(), kTarget), pressed).ok());
}

TEST_F(PlanOnArm7, CountsTheMarginOfATouchFromTheContactsPlaceHoweverDeepItGoes) {
  const Result<PlannedMotion> plain = Plan(MakePress(HomePose(), kTarget));
  ASSERT_TRUE(plain.ok()) << plain.error().message;
  // A short contact far below the place where it is expected, as of a guarded press.
  SkillMotion deep = MakePress(HomePose(), kTarget, {.depth_m = 0.014});
  demonstration::Contact& contact = deep.contacts[0];
  const int middle = (contact.first + contact.last) / 2;
  contact.first = middle - 2;
  contact.last = middle + 2;
  const Result<PlannedMotion> plan = Plan(deep);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_NEAR(plan->report.smallest_clearance.distance_m,
              plain->report.smallest_clearance.distance_m, 2e-3);
  for (const double t : {plan->touches[0].begin_s, plan->touches[0].end_s}) {
    const geometry::Pose tool = robot_.chain.ToolPose(At(plan->trajectory, t));
    EXPECT_NEAR((tool.translation - kTarget).norm(), options_.touch_margin_m, 4e-3) << t;
  }
}

TEST_F(PlanOnArm7, FollowsAPathWithoutOrientationByPosition) {
  SkillMotion press = MakePress(HomePose(), kTarget);
  press.has_orientation = false;
  for (geometry::Pose& pose : press.base_T_tool) pose.rotation.setIdentity();
  const Result<PlannedMotion> plan = Plan(press);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_LE(plan->report.max_contact_error_m, options_.position_tolerance_m);
  EXPECT_EQ(plan->report.max_rotation_error_rad, 0);
}

TEST_F(PlanOnArm7, FollowsJointsWhereThereIsNoToolPath) {
  scene_.objects.pop_back();
  SkillMotion wave;
  wave.joint_names = robot_.chain.joint_names();
  wave.joints = robot_.home.transpose().replicate(120, 1);
  for (int k = 0; k < 120; ++k) {
    wave.time_s.push_back(k / 60.0);
    wave.joints(k, 0) += 0.4 * std::sin(k / 60.0 * M_PI);
  }
  const Result<PlannedMotion> plan = Plan(wave);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_LT(plan->report.style_error_rad, 2e-3);
  wave.joint_names[3] = "another";
  EXPECT_FALSE(Plan(wave).ok());
}

TEST_F(PlanOnArm7, RefusesWhatIsNotAMotion) {
  SkillMotion press = MakePress(HomePose(), kTarget);
  press.time_s[7] = press.time_s[6];
  EXPECT_NE(Plan(press).error().message.find("frame 7"), std::string::npos);
  press = MakePress(HomePose(), kTarget);
  press.base_T_tool[3].translation.x() = std::nan("");
  EXPECT_NE(Plan(press).error().message.find("frame 3"), std::string::npos);
  press = MakePress(HomePose(), kTarget);
  press.contacts[0].last = press.frames();
  EXPECT_FALSE(Plan(press).ok());
  press = MakePress(HomePose(), kTarget);
  options_.speed_scale = 0;
  EXPECT_NE(Plan(press).error().message.find("speed is 0"), std::string::npos);
}

TEST_F(PlanOnArm7, StopsWhenCancelled) {
  std::stop_source stop;
  stop.request_stop();
  const CollisionChecker checker = *CollisionChecker::Create(robot_.model, scene_);
  const Result<PlannedMotion> plan =
      PlanMotion(MakePress(HomePose(), kTarget), robot_.model, robot_.chain, checker, robot_.home,
                 options_, stop.get_token());
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, ErrorCode::kCancelled);
}

// The arm comes across its own torso, where the elbow that hangs as at home has no room.
TEST(Plan, StandsAnotherWayWhereTheUsualOneIsInItsOwnWay) {
  const kinematics::RobotDescription robot = test::LoadRobot("leonardo");
  const CollisionChecker checker =
      *CollisionChecker::Create(robot.model, {}, collision::OptionsOf(robot));
  PlanOptions options;
  options.touch_links = robot.touch_links;
  options.comfortable = robot.home;
  const geometry::Pose contact{{0.342, 0.063, 0.036},
                               Eigen::Quaterniond(0.158, 0.625, 0.725, 0.243).normalized()};
  geometry::Pose above = contact;
  above.translation.z() += 0.08;
  const geometry::Pose ways[] = {robot.chain.ToolPose(robot.home), above, contact, above};
  SkillMotion motion;
  constexpr int kFrames = 60;
  for (int leg = 0; leg < 3; ++leg) {
    for (int k = 0; k < kFrames; ++k) {
      const double s = static_cast<double>(k) / kFrames;
      const double smooth = s * s * s * (10 - 15 * s + 6 * s * s);
      motion.base_T_tool.push_back(geometry::Interpolate(ways[leg], ways[leg + 1], smooth));
      motion.time_s.push_back((kFrames * leg + k) / 40.0);
    }
  }
  motion.joints.resize(motion.frames(), 0);
  const Result<PlannedMotion> plan =
      PlanMotion(motion, robot.model, robot.chain, checker, robot.home, options);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_GT(plan->report.branches_tried, options.max_branches);
  EXPECT_GE(plan->report.smallest_clearance.distance_m, options.required_clearance_m);
}

TEST(Plan, FollowsRandomReachablePathsOnEveryModel) {
  Rng rng(11);
  for (const char* name : {"arm7", "leonardo", "ur5e_like"}) {
    const kinematics::RobotDescription robot = test::LoadRobot(name);
    const CollisionChecker checker = *CollisionChecker::Create(robot.model, {});
    int followed = 0;
    constexpr int kMotions = 10;
    for (int i = 0; i < kMotions; ++i) {
      // A path that the robot can make: home swung about by a few slow waves.
      Eigen::VectorXd amplitude(robot.chain.dof());
      Eigen::VectorXd phase(robot.chain.dof());
      for (int j = 0; j < robot.chain.dof(); ++j) {
        amplitude[j] = rng.Uniform(0.05, 0.35);
        phase[j] = rng.Uniform(0.0, 6.28);
      }
      SkillMotion motion;
      for (int k = 0; k < 180; ++k) {
        const double t = k / 60.0;
        Eigen::VectorXd q = robot.home;
        for (int j = 0; j < robot.chain.dof(); ++j) {
          q[j] += amplitude[j] * (std::sin(1.5 * t + phase[j]) - std::sin(phase[j]));
          q[j] = std::clamp(q[j], robot.chain.limits()[j].lower + 0.05,
                            robot.chain.limits()[j].upper - 0.05);
        }
        motion.time_s.push_back(t);
        motion.base_T_tool.push_back(robot.chain.ToolPose(q));
      }
      PlanOptions options;
      options.comfortable = robot.home;
      const Result<PlannedMotion> plan =
          PlanMotion(motion, robot.model, robot.chain, checker, robot.home, options);
      if (plan.ok()) {
        ++followed;
        EXPECT_LE(MeasureLimitUse(plan->trajectory, robot.chain.limits()).velocity, 1.0);
      } else {
        EXPECT_NE(plan.error().message.find("the motion is not free"), std::string::npos)
            << name << ": " << plan.error().message;
      }
    }
    EXPECT_GE(followed, kMotions - 2) << name;
  }
}

}  // namespace
}  // namespace exemplar::motion
