#include "exemplar/reaching/person.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace exemplar::reaching {
namespace {

using ::testing::HasSubstr;

const kinematics::RobotDescription& Leonardo() {
  static const kinematics::RobotDescription robot = [] {
    Result<kinematics::RobotDescription> read =
        kinematics::ReadRobotDescription(EXEMPLAR_SOURCE_DIR "/deploy/models/leonardo");
    EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().message);
    return *std::move(read);
  }();
  return robot;
}

Person MakePerson(const PersonOptions& options) {
  Result<Person> person = Person::Create(Leonardo(), options);
  EXPECT_TRUE(person.ok()) << (person.ok() ? "" : person.error().message);
  return *std::move(person);
}

std::vector<Eigen::Vector3d> Places(int count) {
  Rng rng(99);
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < count; ++i) {
    places.emplace_back(rng.Uniform(0.32, 0.55), rng.Uniform(-0.38, 0.02), rng.Uniform(0.02, 0.07));
  }
  return places;
}

Demonstration PressAt(Person& person, const Eigen::Vector3d& place) {
  Result<Demonstration> pressed = person.Press(place);
  EXPECT_TRUE(pressed.ok()) << (pressed.ok() ? "" : pressed.error().message);
  return *std::move(pressed);
}

std::vector<Eigen::Vector3d> TipPath(const demonstration::Trial& trial) {
  std::vector<Eigen::Vector3d> path;
  for (Eigen::Index k = 0; k < trial.joints.values.rows(); ++k) {
    path.push_back(Leonardo().chain.ToolPose(trial.joints.values.row(k).transpose()).translation);
  }
  return path;
}

TEST(Person, PressesAllOverTheTable) {
  Person person = MakePerson({.seed = 1});
  for (const Eigen::Vector3d& place : Places(60)) {
    const Demonstration done = PressAt(person, place);
    ASSERT_TRUE(demonstration::Validate(done.trial).ok());
    const PressTruth& truth = done.presses.at(0);
    EXPECT_LT(0.1, truth.reach_onset_s);
    EXPECT_LT(truth.reach_onset_s + 0.4, truth.press_onset_s);
    EXPECT_LT(truth.press_onset_s, truth.contact_onset_s);
    EXPECT_LT(truth.contact_onset_s, truth.release_onset_s);
    EXPECT_LT(truth.release_onset_s, truth.contact_end_s);
    EXPECT_LT(truth.contact_end_s, done.end_s);
    EXPECT_LT(done.end_s, done.trial.duration_s());
  }
}

TEST(Person, MovesJointsSmoothlyWithinTheirLimits) {
  Person person = MakePerson({.seed = 2});
  for (const Eigen::Vector3d& place : Places(30)) {
    const demonstration::Trial trial = PressAt(person, place).trial;
    const Eigen::MatrixXd& q = trial.joints.values;
    for (int i = 0; i < 9; ++i) {
      const kinematics::JointLimits& limits = Leonardo().chain.limits()[i];
      EXPECT_GE(q.col(i).minCoeff(), limits.lower);
      EXPECT_LE(q.col(i).maxCoeff(), limits.upper);
    }
    const Eigen::Index n = q.rows();
    EXPECT_LT((q.bottomRows(n - 1) - q.topRows(n - 1)).cwiseAbs().maxCoeff(), 0.06);
  }
}

TEST(Person, TouchesExactlyWithoutNoise) {
  Person person = MakePerson({.seed = 3, .noise_scale = 0});
  for (const Eigen::Vector3d& place : Places(20)) {
    const Demonstration done = PressAt(person, place);
    const PressTruth& truth = done.presses.at(0);
    EXPECT_LT((truth.base_p_contact - place).norm(), 1e-5);
    const std::vector<Eigen::Vector3d> tip = TipPath(done.trial);
    const demonstration::ScalarSeries& touch = done.trial.tactile;
    for (std::size_t k = 0; k < tip.size(); ++k) {
      const double t = touch.time_s[k];
      const double force = touch.values(static_cast<Eigen::Index>(k), 0);
      const bool touching = t > truth.contact_onset_s && t < truth.contact_end_s;
      EXPECT_EQ(force > 0, touching) << "at " << t;
      EXPECT_NEAR(force, touching ? 1000 * (place.z() - tip[k].z()) : 0, 1e-3);
    }
  }
}

TEST(Person, HitsAsAPersonDoesWithNoise) {
  Person person = MakePerson({.seed = 4});
  double squared = 0;
  const std::vector<Eigen::Vector3d> places = Places(100);
  for (const Eigen::Vector3d& place : places) {
    const double miss = (PressAt(person, place).presses.at(0).base_p_contact - place).norm();
    EXPECT_LT(miss, 0.01);
    squared += miss * miss;
  }
  const double rms = std::sqrt(squared / static_cast<double>(places.size()));
  EXPECT_GT(rms, 0.001);
  EXPECT_LT(rms, 0.004);
}

TEST(Person, SetsOffAndStopsWhenTheTruthSays) {
  Person person = MakePerson({.seed = 5, .noise_scale = 0});
  for (const Eigen::Vector3d& place : Places(10)) {
    const Demonstration done = PressAt(person, place);
    const std::vector<Eigen::Vector3d> tip = TipPath(done.trial);
    const std::vector<double>& time = done.trial.joints.time_s;
    for (std::size_t k = 0; k < tip.size(); ++k) {
      if (time[k] <= done.presses[0].reach_onset_s) {
        EXPECT_LT((tip[k] - tip.front()).norm(), 1e-5);
      }
      if (time[k] >= done.end_s) {
        EXPECT_LT((tip[k] - tip.back()).norm(), 1e-5);
      }
    }
    EXPECT_LT((tip.back() - tip.front()).norm(), 0.06) << "the hand returns near its rest";
  }
}

TEST(Person, IsNeverTwiceTheSame) {
  Person person = MakePerson({.seed = 6});
  std::set<double> contacts, ends;
  std::set<std::size_t> lengths;
  for (int i = 0; i < 20; ++i) {
    const Demonstration done = PressAt(person, {0.45, -0.2, 0.04});
    contacts.insert(done.presses[0].contact_onset_s);
    ends.insert(done.end_s);
    lengths.insert(done.trial.joints.size());
  }
  EXPECT_EQ(contacts.size(), 20U);
  EXPECT_GT(ends.size(), 15U);
  EXPECT_GT(lengths.size(), 10U);
  EXPECT_GT(*contacts.rbegin() - *contacts.begin(), 0.3);
}

TEST(Person, RepeatsItselfForTheSameSeed) {
  Person a = MakePerson({.seed = 7});
  Person b = MakePerson({.seed = 7});
  Person other = MakePerson({.seed = 8});
  for (const Eigen::Vector3d& place : Places(3)) {
    const demonstration::Trial trial = PressAt(a, place).trial;
    EXPECT_TRUE(demonstration::SameContent(trial, PressAt(b, place).trial));
    EXPECT_FALSE(demonstration::SameContent(trial, PressAt(other, place).trial));
  }
}

TEST(Person, MovesFastThenSlowly) {
  // A reach is one quick movement with a single clear peak of speed; the push is far slower.
  Person person = MakePerson({.seed = 9, .tool_poses = true});
  for (const Eigen::Vector3d& place : Places(20)) {
    const Demonstration done = PressAt(person, place);
    const demonstration::PoseSeries& tool = done.trial.end_effectors.at(0);
    double reach_peak = 0, push_peak = 0;
    for (std::size_t k = 1; k < tool.size(); ++k) {
      const double speed =
          (tool.base_T_frame[k].translation - tool.base_T_frame[k - 1].translation).norm() * 60;
      const double t = tool.time_s[k];
      const PressTruth& truth = done.presses[0];
      if (t < truth.press_onset_s) reach_peak = std::max(reach_peak, speed);
      if (t > truth.press_onset_s + 0.1 && t < truth.release_onset_s) {
        push_peak = std::max(push_peak, speed);
      }
    }
    EXPECT_GT(reach_peak, 1.5 * push_peak);
    EXPECT_LT(reach_peak, 2.5);
  }
}

TEST(Person, PressesSeveralTargetsInOneTrial) {
  Person person = MakePerson({.seed = 10, .noise_scale = 0});
  std::vector<Target> targets(2);
  targets[0].name = "left";
  targets[0].base_T_object.translation = {0.4, -0.05, 0.04};
  targets[1].name = "right";
  targets[1].base_T_object.translation = {0.45, -0.3, 0.06};
  const Result<Demonstration> done = person.Press(targets);
  ASSERT_TRUE(done.ok()) << done.error().message;
  ASSERT_EQ(done->presses.size(), 2U);
  EXPECT_LT(done->presses[0].contact_end_s, done->presses[1].contact_onset_s);
  for (int i = 0; i < 2; ++i) {
    EXPECT_LT((done->presses[i].base_p_contact - targets[i].base_T_object.translation).norm(),
              1e-5);
  }
  EXPECT_NE(done->trial.FindObject("left"), nullptr);
  EXPECT_NE(done->trial.FindObject("right"), nullptr);
}

TEST(Person, PressesAlongTheNormalOfATiltedButton) {
  Person person = MakePerson({.seed = 11, .noise_scale = 0});
  Target target;
  target.base_T_object.translation = {0.45, -0.2, 0.08};
  target.base_T_object.rotation = Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY());
  target.object_p_contact = {0, 0, 0.01};
  const Result<Demonstration> done = person.Press(target);
  ASSERT_TRUE(done.ok()) << done.error().message;
  const Eigen::Vector3d face = target.base_T_object * target.object_p_contact;
  EXPECT_LT((done->presses[0].base_p_contact - face).norm(), 1e-5);
  // In contact the tip stays on the normal through the face.
  const std::vector<Eigen::Vector3d> tip = TipPath(done->trial);
  const Eigen::Vector3d normal = target.base_T_object.rotation * Eigen::Vector3d::UnitZ();
  for (std::size_t k = 0; k < tip.size(); ++k) {
    const double t = done->trial.joints.time_s[k];
    if (t < done->presses[0].contact_onset_s || t > done->presses[0].release_onset_s) continue;
    EXPECT_LT((tip[k] - face).cross(normal).norm(), 1e-5);
  }
}

TEST(Person, SaysWhichTargetIsOutOfReach) {
  Person person = MakePerson({.seed = 12});
  const Result<Demonstration> done = person.Press(Eigen::Vector3d(1.5, 0, 0));
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(done.error().message, HasSubstr("target \"target\" at (1.500, 0.000, 0.000)"));
  EXPECT_EQ(done.error().field, "targets[0]");
}

TEST(Person, RefusesOptionsThatMakeNoSense) {
  const auto error_of = [](const PersonOptions& options) {
    const Result<Person> person = Person::Create(Leonardo(), options);
    return person.ok() ? std::string("none") : person.error().field;
  };
  EXPECT_EQ(error_of({.rate_hz = 0}), "rate_hz");
  EXPECT_EQ(error_of({.noise_scale = -1}), "noise_scale");
  EXPECT_EQ(error_of({.tempo = std::nan("")}), "tempo");
  EXPECT_EQ(error_of({.press_depth_m = -0.1}), "press_depth_m");
  EXPECT_EQ(error_of({}), "none");
  Person person = MakePerson({});
  EXPECT_EQ(person.Press(std::span<const Target>()).error().field, "targets");
}

TEST(Person, CarriesThingsFromOnePlaceToAnother) {
  Result<kinematics::RobotDescription> body =
      kinematics::ReadRobotDescription(EXEMPLAR_SOURCE_DIR "/deploy/models/arm7_hand");
  ASSERT_TRUE(body.ok()) << body.error().message;
  Result<Person> person =
      Person::Create(*body, {.seed = 3, .noise_scale = 0, .variation_scale = 0});
  ASSERT_TRUE(person.ok());
  Target from{"block", {{0.45, -0.2, 0.025}, geometry::ExpSo3({0, 0, 0.3})}};
  Target to{"tray", geometry::Pose::FromTranslation({0.5, 0.2, 0.01})};
  to.object_p_contact = {0, 0, 0.03};
  const Result<Demonstration> done = person->Carry(from, to);
  ASSERT_TRUE(done.ok()) << done.error().message;
  const demonstration::ScalarSeries& joints = done->trial.joints;
  const demonstration::ScalarSeries& hands = done->trial.hands;
  ASSERT_EQ(hands.size(), joints.size());
  const auto tool_at = [&](double t) {
    const auto k =
        std::upper_bound(joints.time_s.begin(), joints.time_s.end(), t) - joints.time_s.begin() - 1;
    return body->chain.ToolPose(joints.values.row(k).transpose());
  };
  for (const auto& [target, t] :
       {std::pair(from, done->carry.grasp_s + 0.3), std::pair(to, done->carry.release_s + 0.3)}) {
    const geometry::Pose tool = tool_at(t);
    const Eigen::Vector3d asked = target.base_T_object * target.object_p_contact;
    EXPECT_LT((tool.translation - asked).norm(), 1e-3) << target.name;
    EXPECT_LT((tool.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(), 1e-3);
    // The fingers, to both sides along the tool's x, close along the object's x or y.
    const Eigen::Vector3d fingers =
        target.base_T_object.rotation.conjugate() * (tool.rotation * Eigen::Vector3d::UnitX());
    EXPECT_GT(std::max(std::abs(fingers.x()), std::abs(fingers.y())), 0.999) << target.name;
  }
  EXPECT_EQ(hands.values(0, 0), 1);
  EXPECT_EQ(hands.values.minCoeff(), 0);
  EXPECT_EQ(hands.values(hands.values.rows() - 1, 0), 1);
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const double t = joints.time_s[k];
    if (t < done->carry.grasp_s + 1.2 || t > done->carry.release_s - 1.2) continue;
    EXPECT_GT(tool_at(t).translation.z(), 0.06) << "it is carried in the air, " << t << " s";
  }
}

TEST(Person, SaysWhichEndOfACarryIsOutOfReach) {
  Person person = MakePerson({.seed = 12});
  Target near{"block", geometry::Pose::FromTranslation({0.45, -0.2, 0.05})};
  Target far{"tray", geometry::Pose::FromTranslation({2, 0, 0})};
  const Result<Demonstration> done = person.Carry(near, far);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, ErrorCode::kFailedPrecondition);
  near.base_T_object.translation.x() = std::nan("");
  EXPECT_EQ(person.Carry(near, far).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace exemplar::reaching
