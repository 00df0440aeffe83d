#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "exemplar/base/rng.hpp"
#include "exemplar/learning/aligned.hpp"
#include "exemplar/signal/resample.hpp"
#include "motions.hpp"
#include "static_pose.hpp"

namespace exemplar::learning {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A reach of 0.4 m seen by a source with its own clock and noise.
demonstration::PoseSeries Reach(const std::vector<double>& time_s, double noise_m, Rng& rng) {
  demonstration::PoseSeries hand;
  hand.time_s = time_s;
  for (const double t : time_s) {
    geometry::Pose pose;
    pose.translation = {0.4 * MinimumJerk((t - 1) / 2), 0.1, 0.3};
    for (double& x : pose.translation) x += rng.Normal(0, noise_m);
    pose.rotation = geometry::ExpSo3({0, 0, MinimumJerk((t - 1) / 2)});
    hand.base_T_frame.push_back(pose);
  }
  return hand;
}

std::vector<double> IrregularTimes(double duration_s, double rate_hz, Rng& rng) {
  std::vector<double> times = {0};
  while (times.back() < duration_s) {
    times.push_back(times.back() + rng.Uniform(0.4, 1.6) / rate_hz);
  }
  return times;
}

demonstration::Trial TrialOf(demonstration::PoseSeries hand) {
  demonstration::Trial trial;
  trial.source = "trial.csv";
  trial.end_effectors.push_back(std::move(hand));
  return trial;
}

demonstration::ScalarSeries Scalars(std::vector<std::string> names,
                                    const std::vector<double>& time_s, auto&& value) {
  demonstration::ScalarSeries series;
  series.names = std::move(names);
  series.time_s = time_s;
  series.values.resize(static_cast<Eigen::Index>(time_s.size()),
                       static_cast<Eigen::Index>(series.names.size()));
  for (Eigen::Index k = 0; k < series.values.rows(); ++k) {
    for (Eigen::Index c = 0; c < series.values.cols(); ++c) {
      series.values(k, c) = value(time_s[static_cast<std::size_t>(k)], static_cast<int>(c));
    }
  }
  return series;
}

UniformTrial Prepared(const demonstration::Trial& trial, const LearnOptions& options = {},
                      const demonstration::ToolKinematics* tool = nullptr) {
  Result<UniformTrial> result = Prepare(trial, options, tool);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
  return result.ok() ? *result : UniformTrial{};
}

TEST(Prepare, BringsAnIrregularNoisyClockOntoTheBaseNearTheTruth) {
  Rng rng(1);
  const UniformTrial out = Prepared(TrialOf(Reach(IrregularTimes(4, 100, rng), 0.001, rng)));
  EXPECT_NEAR(static_cast<double>(out.time_s.size()), 241, 2);
  EXPECT_EQ(out.time_s.front(), 0);
  double square = 0;
  for (std::size_t k = 0; k < out.time_s.size(); ++k) {
    const double truth = 0.4 * MinimumJerk((out.time_s[k] - 1) / 2);
    square += std::pow(out.base_T_tool[k].translation.x() - truth, 2);
    EXPECT_NEAR(out.base_T_tool[k].rotation.norm(), 1, 1e-12);
  }
  EXPECT_LT(std::sqrt(square / static_cast<double>(out.time_s.size())), 0.0006);
  EXPECT_GT(out.cutoff_hz, 1.5);
  EXPECT_LT(out.cutoff_hz, 16);
  EXPECT_THAT(out.notes, Contains(HasSubstr("tool: cut-off ")));
}

TEST(Prepare, LeavesCleanSamplesOnTheBaseAsTheyAre) {
  Rng rng(2);
  const std::vector<double> times = signal::EvenTimes(0, 4, 241);
  const demonstration::PoseSeries hand = Reach(times, 0, rng);
  const UniformTrial out = Prepared(TrialOf(hand));
  ASSERT_EQ(out.time_s.size(), times.size());
  EXPECT_EQ(out.cutoff_hz, 0);
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_LT((out.base_T_tool[k].translation - hand.base_T_frame[k].translation).norm(), 1e-12);
    EXPECT_LT(geometry::AngleBetween(out.base_T_tool[k].rotation, hand.base_T_frame[k].rotation),
              1e-6);
  }
}

TEST(Prepare, AHeldStreamIsNotTakenForNoise) {
  Rng rng(3);
  const std::vector<double> slow = signal::EvenTimes(0, 4, 153);  // 38 Hz
  const demonstration::PoseSeries measured = Reach(slow, 0.0001, rng);
  demonstration::PoseSeries recorded;
  recorded.time_s = signal::EvenTimes(0, 4, 401);
  for (const double t : recorded.time_s) {
    const signal::Place place = signal::Locate(slow, t);
    recorded.base_T_frame.push_back(
        measured.base_T_frame[place.part == 1 ? place.index + 1 : place.index]);
  }
  const UniformTrial out = Prepared(TrialOf(recorded));
  EXPECT_THAT(out.notes, Contains(HasSubstr("samples repeat the one before, taken as held")));
  for (std::size_t k = 0; k < out.time_s.size(); ++k) {
    EXPECT_NEAR(out.base_T_tool[k].translation.x(), 0.4 * MinimumJerk((out.time_s[k] - 1) / 2),
                0.008);  // 0.4 m/s times the 26 ms that a sample may be late
  }
  EXPECT_GT(out.cutoff_hz, 1);
}

TEST(Prepare, AnObjectThatOnlyTremblesStandsStill) {
  Rng rng(4);
  demonstration::Trial trial = TrialOf(Reach(signal::EvenTimes(0, 4, 241), 0, rng));
  demonstration::PoseSeries button;
  button.name = "button";
  for (double t = 0.3; t < 3.5; t += 0.1) {  // vision's 10 Hz, starts late, ends early
    geometry::Pose pose = geometry::Pose::FromTranslation({0.5, -0.1, 0.2});
    for (double& x : pose.translation) x += rng.Normal(0, 0.006);
    pose.rotation = geometry::ExpSo3({rng.Normal(0, 0.02), rng.Normal(0, 0.02), 1});
    button.time_s.push_back(t);
    button.base_T_frame.push_back(pose);
  }
  trial.objects.push_back(button);
  const UniformTrial out = Prepared(trial);
  ASSERT_THAT(out.object_names, ElementsAre("button"));
  ASSERT_EQ(out.base_T_object[0].size(), out.time_s.size());
  for (const geometry::Pose& pose : out.base_T_object[0]) {
    EXPECT_EQ(pose.translation, out.base_T_object[0][0].translation);
    EXPECT_EQ(pose.rotation.coeffs(), out.base_T_object[0][0].rotation.coeffs());
  }
  EXPECT_LT((out.base_T_object[0][0].translation - Eigen::Vector3d(0.5, -0.1, 0.2)).norm(), 0.006);
  EXPECT_LT(geometry::AngleBetween(out.base_T_object[0][0].rotation, geometry::ExpSo3({0, 0, 1})),
            0.02);
}

TEST(Prepare, AnObjectThatMovesIsFollowedAcrossAnOcclusion) {
  Rng rng(5);
  demonstration::Trial trial = TrialOf(Reach(signal::EvenTimes(0, 4, 241), 0, rng));
  demonstration::PoseSeries box;
  box.name = "box";
  for (double t = 0; t <= 4.001; t += 0.1) {
    if (t > 1.05 && t < 2.05) continue;  // hidden behind the hand
    box.time_s.push_back(t);
    box.base_T_frame.push_back(geometry::Pose::FromTranslation({0.1 * t, 0, 0}));
  }
  trial.objects.push_back(box);
  const UniformTrial out = Prepared(trial);
  for (std::size_t k = 0; k < out.time_s.size(); ++k) {
    EXPECT_NEAR(out.base_T_object[0][k].translation.x(), 0.1 * out.time_s[k], 0.003);
  }
  EXPECT_THAT(out.notes, Contains(HasSubstr("object box: no sample from 1.00 to 2.10 s")));
  EXPECT_THAT(out.notes, Contains("object box: it moves"));
}

TEST(Prepare, TouchIsTheSensorsSumAboveRest) {
  Rng rng(6);
  const std::vector<double> times = signal::EvenTimes(0, 4, 241);
  demonstration::Trial trial = TrialOf(Reach(times, 0, rng));
  trial.tactile = Scalars({"a", "b"}, times,
                          [](double t, int c) { return 0.3 + (t > 2 && t < 3 ? 2.0 + c : 0.0); });
  const UniformTrial out = Prepared(trial);
  EXPECT_NEAR(out.touch_n[150], 5, 0.2);
  EXPECT_NEAR(out.touch_n[30], 0, 1e-3);
  EXPECT_GE(out.touch_n.minCoeff(), 0);

  trial.tactile = {};
  trial.wrench = Scalars({"fx", "fy", "fz", "tx", "ty", "tz"}, times, [](double t, int c) {
    if (c >= 3) return 50.0;  // torques do not count
    return c == 2 ? (t > 2 && t < 3 ? -8.0 : -1.0) : 0.0;
  });
  EXPECT_NEAR(Prepared(trial).touch_n[150], 7, 0.3);
  trial.wrench = {};
  EXPECT_EQ(Prepared(trial).touch_n.size(), 0);
}

// Two joints that turn about z, links of 0.3 and 0.2 m.
class TwoLinks final : public demonstration::ToolKinematics {
 public:
  const std::vector<std::string>& joint_names() const override { return names_; }
  geometry::Pose ToolPose(const Eigen::Ref<const Eigen::VectorXd>& q) const override {
    const geometry::Pose shoulder{Eigen::Vector3d::Zero(), geometry::ExpSo3({0, 0, q[0]})};
    const geometry::Pose elbow{{0.3, 0, 0}, geometry::ExpSo3({0, 0, q[1]})};
    return shoulder * elbow * geometry::Pose::FromTranslation({0.2, 0, 0});
  }

 private:
  std::vector<std::string> names_ = {"shoulder", "elbow"};
};

TEST(Prepare, JointsWithoutPosesGetTheirToolFromTheRobotModel) {
  const std::vector<double> times = signal::EvenTimes(0, 4, 241);
  demonstration::Trial trial;
  trial.source = "suit.csv";
  trial.joints = Scalars({"knee", "elbow", "shoulder"}, times,
                         [](double t, int c) { return (c + 1) * 0.2 * MinimumJerk((t - 1) / 2); });
  const TwoLinks robot;
  const UniformTrial out = Prepared(trial, {}, &robot);
  EXPECT_THAT(out.joint_names, ElementsAre("shoulder", "elbow"));
  ASSERT_EQ(out.base_T_tool.size(), out.time_s.size());
  const geometry::Pose expected = robot.ToolPose(Eigen::Vector2d(0.6, 0.4));
  EXPECT_LT((out.base_T_tool.back().translation - expected.translation).norm(), 1e-9);
  // Without a model the joints are learned alone.
  const UniformTrial alone = Prepared(trial);
  EXPECT_TRUE(alone.base_T_tool.empty());
  EXPECT_EQ(alone.joints.cols(), 3);

  trial.joints.names[1] = "elbov";
  const Result<UniformTrial> wrong = Prepare(trial, {}, &robot);
  ASSERT_FALSE(wrong.ok());
  EXPECT_THAT(wrong.error().message, HasSubstr("suit.csv: joints: the robot model's joint"));
  EXPECT_THAT(wrong.error().message, HasSubstr("\"elbov\""));
}

TEST(Prepare, TheRobotsMeasuredJointsTakeTheSuitsPlaceWhereAsked) {
  const std::vector<double> times = signal::EvenTimes(0, 4, 241);
  demonstration::Trial trial;
  trial.source = "suit.csv";
  trial.joints = Scalars({"elbow"}, times, [](double t, int) { return MinimumJerk((t - 1) / 2); });
  LearnOptions options;
  options.joints = JointSource::kMeasured;
  const Result<UniformTrial> missing = Prepare(trial, options, nullptr);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().field, "joints");
  EXPECT_THAT(missing.error().message, HasSubstr("suit.csv: joints=measured"));
  trial.measured_joints =
      Scalars({"elbow"}, times, [](double t, int) { return 0.8 * MinimumJerk((t - 1.1) / 2); });
  EXPECT_NEAR(Prepared(trial).joints(240, 0), 1, 1e-6);
  EXPECT_NEAR(Prepared(trial, options).joints(240, 0), 0.8, 1e-6);
}

TEST(Prepare, RefusesWhatHoldsNoMotionAndNamesIt) {
  demonstration::Trial empty;
  empty.source = "empty.csv";
  EXPECT_THAT(Prepare(empty, {}, nullptr).error().message, HasSubstr("empty.csv"));
  Rng rng(7);
  const Result<UniformTrial> two =
      Prepare(TrialOf(Reach(std::vector<double>{0, 0.1}, 0, rng)), {}, nullptr);
  ASSERT_FALSE(two.ok());
  EXPECT_EQ(two.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(two.error().message, HasSubstr("trial.csv: 2 samples of motion, needs at least 5"));
  demonstration::Trial backwards = TrialOf(Reach(signal::EvenTimes(0, 1, 20), 0, rng));
  backwards.end_effectors[0].time_s[7] = 0.01;
  EXPECT_THAT(Prepare(backwards, {}, nullptr).error().message, HasSubstr("trial.csv: "));
}

TEST(Prepare, AnHourIsTakenOnACoarserBaseAndSaysSo) {
  demonstration::Trial trial;
  trial.source = "hour.csv";
  trial.joints = Scalars({"j"}, signal::EvenTimes(0, 3600, 36001),
                         [](double t, int) { return std::sin(2 * std::numbers::pi * t / 20); });
  const UniformTrial out = Prepared(trial);
  EXPECT_EQ(out.time_s.size(), 36000u);
  EXPECT_EQ(out.time_s.back(), 3600);
  EXPECT_THAT(out.notes, Contains(HasSubstr("would be 216001 frames; taken at 10.0 Hz")));
  EXPECT_NEAR(out.joints(18000, 0), std::sin(2 * std::numbers::pi * out.time_s[18000] / 20), 1e-3);
}

TEST(Prepare, ACutOffThatIsAskedForIsUsed) {
  Rng rng(8);
  LearnOptions options;
  options.cutoff_hz = 3;
  const UniformTrial out =
      Prepared(TrialOf(Reach(signal::EvenTimes(0, 4, 241), 0.001, rng)), options);
  EXPECT_EQ(out.cutoff_hz, 3);
  EXPECT_THAT(out.notes, Contains(HasSubstr("cut-off 3.0 Hz")));
}

TEST(StaticPose, TellsAPushFromATremble) {
  Rng rng(9);
  demonstration::PoseSeries box;
  for (int k = 0; k < 60; ++k) {
    geometry::Pose pose;
    pose.translation.x() = (k > 30 ? 0.03 : 0.0) + rng.Normal(0, 0.002);
    box.time_s.push_back(0.1 * k);
    box.base_T_frame.push_back(pose);
  }
  EXPECT_FALSE(StaticPose(box, 0.5).has_value());
  for (geometry::Pose& pose : box.base_T_frame) pose.translation.x() = rng.Normal(0, 0.002);
  EXPECT_TRUE(StaticPose(box, 0.5).has_value());
  for (std::size_t k = 30; k < 60; ++k) {
    box.base_T_frame[k].rotation = geometry::ExpSo3({0, 0.2, 0});
  }
  EXPECT_FALSE(StaticPose(box, 0.5).has_value());
  box.has_orientation = false;
  EXPECT_TRUE(StaticPose(box, 0.5).has_value());
}

TEST(TakenFrom, IsWhereAThingStoodBeforeTheHandTookIt) {
  Rng rng(8);
  demonstration::PoseSeries box;
  for (int k = 0; k < 100; ++k) {
    const double t = k / 10.0;
    box.time_s.push_back(t);
    geometry::Pose pose = geometry::Pose::FromTranslation({0.3 * MinimumJerk((t - 3) / 3), 0.2, 0});
    for (double& x : pose.translation) x += rng.Normal(0, 5e-4);
    box.base_T_frame.push_back(pose);
  }
  ASSERT_FALSE(StaticPose(box, 0.5).has_value());
  const std::optional<geometry::Pose> taken = TakenFrom(box, 0.5);
  ASSERT_TRUE(taken.has_value());
  EXPECT_LT((taken->translation - Eigen::Vector3d(0, 0.2, 0)).norm(), 1e-3);
  // What moves from the beginning, or still at the end, is not taken: it moves by itself.
  for (std::size_t k = 0; k < box.size(); ++k) {
    box.base_T_frame[k].translation.x() = 0.05 * box.time_s[k];
  }
  EXPECT_FALSE(TakenFrom(box, 0.5).has_value());
  demonstration::PoseSeries brief;
  brief.time_s = {0, 0.1};
  brief.base_T_frame.resize(2);
  EXPECT_FALSE(TakenFrom(brief, 0.5).has_value());
}

}  // namespace
}  // namespace exemplar::learning
