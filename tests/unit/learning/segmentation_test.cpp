#include "exemplar/learning/segmentation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "exemplar/base/rng.hpp"
#include "motions.hpp"

namespace exemplar::learning {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Eigen::VectorXd Series(std::initializer_list<double> values) {
  Eigen::VectorXd series(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), series.begin());
  return series;
}

std::vector<int> Frames(const std::vector<Boundary>& boundaries) {
  std::vector<int> frames;
  for (const Boundary& boundary : boundaries) frames.push_back(boundary.frame);
  return frames;
}

std::vector<double> Times(const Segmentation& segmentation, MarkerKind kind) {
  std::vector<double> times;
  for (const Marker& marker : segmentation.markers) {
    if (marker.kind == kind) times.push_back(marker.time_s);
  }
  return times;
}

// PAPER.md section 3, check values.
TEST(Segmentation, MeetsTheCheckValuesOfEquations3And4) {
  const Eigen::VectorXd msv = Series({0, 0, 1, 4, 9, 4, 1, 0, 0, 1, 9, 16, 4, 1, 0, 0});
  const Thresholds thresholds = FindThresholds(msv);
  EXPECT_NEAR(thresholds.c, 0.910876302, 1e-9);
  EXPECT_NEAR(thresholds.k, 5.861524431, 1e-9);
  EXPECT_NEAR(thresholds.high(), 5.339123698, 1e-9);
  EXPECT_FALSE(thresholds.c_replaced);
  for (const EpisodeRule rule : {EpisodeRule::kTwitch, EpisodeRule::kLiteral}) {
    EXPECT_THAT(Frames(FindBeginnings(msv, thresholds, rule)), ElementsAre(2, 9));
    EXPECT_THAT(Frames(FindEndings(msv, thresholds, rule)), ElementsAre(6, 13));
  }
}

TEST(Segmentation, ATwitchIsAMarkerOnlyByTheLiteralRule) {
  const Eigen::VectorXd msv =
      Series({0, 0, 1, 4, 9, 4, 1, 0, 0, 3, 3.2, 0, 0, 0, 1, 9, 16, 4, 1, 0, 0});
  const Thresholds thresholds = FindThresholds(msv);
  EXPECT_NEAR(thresholds.c, 0.667761526, 1e-9);
  EXPECT_NEAR(thresholds.high(), 4.684619426, 1e-9);
  EXPECT_THAT(Frames(FindBeginnings(msv, thresholds, EpisodeRule::kLiteral)),
              ElementsAre(2, 9, 14));
  EXPECT_THAT(Frames(FindBeginnings(msv, thresholds, EpisodeRule::kTwitch)), ElementsAre(2, 14));
}

TEST(Segmentation, ASpikyTrialGetsAPositiveCutOffFromTheData) {
  Eigen::VectorXd msv = Eigen::VectorXd::Zero(21);
  msv[20] = 100;
  const double sigma = std::sqrt(100.0 * 100.0 * 20 / 21 / 21);
  const double high = 100.0 / 21 + sigma / 2;
  EXPECT_NEAR(100.0 / 21 - sigma / 2, -5.886, 1e-3);  // Eq. 3
  const Thresholds thresholds = FindThresholds(msv);
  EXPECT_TRUE(thresholds.c_replaced);
  EXPECT_GT(thresholds.c, 0);
  EXPECT_NEAR(thresholds.high(), high, 1e-9);  // c k stays
  EXPECT_THAT(Frames(FindBeginnings(msv, thresholds, EpisodeRule::kTwitch)), ElementsAre(20));
}

TEST(Segmentation, MotionFromTheFirstOrToTheLastSampleBeginsAndEndsThere) {
  const Eigen::VectorXd msv = Series({9, 9, 4, 0, 0, 0, 0, 4, 9, 9});
  const Thresholds thresholds = FindThresholds(msv);
  EXPECT_THAT(Frames(FindBeginnings(msv, thresholds, EpisodeRule::kTwitch)), ElementsAre(0, 7));
  EXPECT_THAT(Frames(FindEndings(msv, thresholds, EpisodeRule::kTwitch)), ElementsAre(2, 9));
}

TEST(Segmentation, StillnessHasNoMarkers) {
  for (const double level : {0.0, 2.5}) {
    const Eigen::VectorXd msv = Eigen::VectorXd::Constant(50, level);
    const Thresholds thresholds = FindThresholds(msv);
    EXPECT_THAT(FindBeginnings(msv, thresholds, EpisodeRule::kTwitch), IsEmpty()) << level;
  }
}

Eigen::VectorXd RandomMsv(Rng& rng) {
  Eigen::VectorXd msv(30 + static_cast<Eigen::Index>(rng.Below(200)));
  double level = 0;
  for (double& value : msv) {
    level = 0.8 * level + rng.Normal();
    value = level * level;
  }
  return msv;
}

TEST(Segmentation, TwitchEpisodesAlternateAndEachRisesAboveCK) {
  Rng rng(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const Eigen::VectorXd msv = RandomMsv(rng);
    const Thresholds thresholds = FindThresholds(msv);
    const auto begins = FindBeginnings(msv, thresholds, EpisodeRule::kTwitch);
    const auto ends = FindEndings(msv, thresholds, EpisodeRule::kTwitch);
    ASSERT_EQ(begins.size(), ends.size());
    for (std::size_t i = 0; i < begins.size(); ++i) {
      ASSERT_LE(begins[i].frame, ends[i].frame);
      if (i > 0) {
        ASSERT_GT(begins[i].frame, ends[i - 1].frame);
      }
      const Eigen::VectorXd episode =
          msv.segment(begins[i].frame, ends[i].frame - begins[i].frame + 1);
      EXPECT_GE(episode.minCoeff(), thresholds.c);
      EXPECT_GT(episode.maxCoeff(), thresholds.high());
      EXPECT_EQ(begins[i].peak, episode.maxCoeff());
    }
  }
}

TEST(Segmentation, TheLiteralRuleKeepsEveryTwitchMarkerAndScaleChangesNothing) {
  Rng rng(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::VectorXd msv = RandomMsv(rng);
    const Thresholds thresholds = FindThresholds(msv);
    const auto begins = FindBeginnings(msv, thresholds, EpisodeRule::kTwitch);
    const std::vector<int> literal = Frames(FindBeginnings(msv, thresholds, EpisodeRule::kLiteral));
    for (const Boundary& begin : begins) {
      // The letter asks for a high value *after* the marker.
      const Eigen::Index after = msv.size() - 1 - begin.frame;
      if (after == 0 || msv.tail(after).maxCoeff() <= thresholds.high()) continue;
      EXPECT_THAT(literal, ::testing::Contains(begin.frame));
    }
    const Eigen::VectorXd scaled = 8 * msv;  // a power of two: exact
    EXPECT_EQ(Frames(FindBeginnings(scaled, FindThresholds(scaled), EpisodeRule::kTwitch)),
              Frames(begins));
  }
}

// Eq. 1 is a sum over joints, in (rad/s)^2.
TEST(Segmentation, MsvOfJointsIsTheSumOfSquaredVelocities) {
  UniformTrial trial = EvenTrial(5, 60);
  trial.joints.resize(static_cast<Eigen::Index>(trial.time_s.size()), 2);
  for (std::size_t k = 0; k < trial.time_s.size(); ++k) {
    trial.joints.row(static_cast<Eigen::Index>(k)) << 0.3 * trial.time_s[k],
        1 - 0.4 * trial.time_s[k];
  }
  const Eigen::VectorXd msv = MeanSquaredVelocity(trial);
  EXPECT_NEAR(msv.minCoeff(), 0.25, 1e-12);
  EXPECT_NEAR(msv.maxCoeff(), 0.25, 1e-12);
}

TEST(Segmentation, MsvOfAToolTurnsWithTheSizeOfItsPath) {
  UniformTrial trial = EvenTrial(4, 60);
  double sum = 0;
  for (const double t : trial.time_s) {
    geometry::Pose pose;
    pose.translation.x() = 0.2 * t;
    pose.rotation = geometry::ExpSo3({0, 0, 0.5 * t});
    trial.base_T_tool.push_back(pose);
    sum += (0.2 * t - 0.4) * (0.2 * t - 0.4);
  }
  const double length_squared = sum / static_cast<double>(trial.time_s.size()) / (M_PI * M_PI);
  const Eigen::VectorXd msv = MeanSquaredVelocity(trial);
  EXPECT_NEAR(msv[100], 0.04 + 0.25 * length_squared, 1e-9);
  trial.has_orientation = false;
  EXPECT_NEAR(MeanSquaredVelocity(trial)[100], 0.04, 1e-9);
}

// PAPER.md section 9, claim 2: one reach during which something is touched on the way.
UniformTrial ReachThatTouchesWithoutStopping() {
  UniformTrial trial = EvenTrial(5, 60);
  const auto n = static_cast<Eigen::Index>(trial.time_s.size());
  trial.joints.resize(n, 1);
  trial.touch_n = Eigen::VectorXd::Zero(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double t = trial.time_s[static_cast<std::size_t>(k)];
    trial.joints(k, 0) = 1.2 * MinimumJerk((t - 0.5) / 4);
    trial.touch_n[k] = 4 * MinimumJerk((t - 1.4) / 0.2) - 4 * MinimumJerk((t - 2.2) / 0.2);
  }
  return trial;
}

TEST(Segmentation, TouchWithoutAStopIsABoundaryOnlyWithTheTactileTerm) {
  const UniformTrial touching = ReachThatTouchesWithoutStopping();
  UniformTrial unaware = touching;
  unaware.touch_n.resize(0);
  for (const ForceRate rate : {ForceRate::kAbsolute, ForceRate::kSigned}) {
    LearnOptions options;
    options.force_rate = rate;
    const std::vector<double> without = Times(Segment(unaware, options), MarkerKind::kBeginning);
    ASSERT_EQ(without.size(), 1u);
    EXPECT_LT(without[0], 1.4);
    const Segmentation with = Segment(touching, options);
    EXPECT_GT(with.c_tactile, 0);
    int at_touch = 0;
    for (const double t : Times(with, MarkerKind::kBeginning)) {
      if (t >= 1.4 && t <= 2.45) ++at_touch;
    }
    EXPECT_GE(at_touch, 1) << (rate == ForceRate::kSigned ? "signed" : "absolute");
  }
}

TEST(Segmentation, OnsetAndReleaseAreCandidatesWithTheirCause) {
  const Segmentation segmentation = Segment(ReachThatTouchesWithoutStopping(), {});
  double onset = 0, release = 0;
  for (const Marker& marker : segmentation.markers) {
    EXPECT_GT(marker.score, 0);
    EXPECT_FALSE(marker.cause.empty());
    if (marker.cause == "touch onset") onset = marker.time_s;
    if (marker.cause == "touch release" && marker.kind == MarkerKind::kBeginning) {
      release = marker.time_s;
    }
  }
  EXPECT_NEAR(onset, 1.45, 0.05);
  EXPECT_NEAR(release, 2.35, 0.05);
}

TEST(Segmentation, BothTermsOfEquation2HaveTheSameDeviation) {
  const UniformTrial trial = ReachThatTouchesWithoutStopping();
  const Segmentation segmentation = Segment(trial, {});
  const Eigen::VectorXd motion = MeanSquaredVelocity(trial);
  const auto deviation = [](const Eigen::VectorXd& v) {
    return std::sqrt((v.array() - v.mean()).square().mean());
  };
  EXPECT_NEAR(deviation(segmentation.touch_term), deviation(motion), 1e-12);
  EXPECT_LT((segmentation.msv - motion - segmentation.touch_term).norm(), 1e-12);
}

TEST(Segmentation, LettingGoLowersTheSignedSeriesAndRaisesTheAbsoluteOne) {
  const UniformTrial trial = ReachThatTouchesWithoutStopping();
  LearnOptions options;
  options.force_rate = ForceRate::kSigned;
  const Segmentation with_sign = Segment(trial, options);
  options.force_rate = ForceRate::kAbsolute;
  const Segmentation absolute = Segment(trial, options);
  const Eigen::Index onset = 90;     // 1.5 s
  const Eigen::Index release = 138;  // 2.3 s
  EXPECT_GT(with_sign.touch_term[onset], 0);
  EXPECT_LT(with_sign.touch_term[release], 0);
  EXPECT_LT(with_sign.msv[release], MeanSquaredVelocity(trial)[release]);
  EXPECT_GT(absolute.touch_term[onset], 0);
  EXPECT_GT(absolute.touch_term[release], 0);
}

TEST(Segmentation, TouchSensorsThatOnlyHissAreIgnored) {
  UniformTrial trial = ReachThatTouchesWithoutStopping();
  Rng rng(3);
  for (double& force : trial.touch_n) force = std::abs(rng.Normal(0, 0.02));
  const Segmentation segmentation = Segment(trial, {});
  EXPECT_EQ(segmentation.c_tactile, 0);
  EXPECT_EQ(Times(segmentation, MarkerKind::kBeginning).size(), 1u);
}

// Section 3.1: a press of 2 cm is slow beside a reach of 35 cm.
UniformTrial QuickReachAndSlowPress(Rng& rng) {
  UniformTrial trial = EvenTrial(6, 60);
  trial.joints.resize(static_cast<Eigen::Index>(trial.time_s.size()), 0);
  trial.has_orientation = false;
  for (const double t : trial.time_s) {
    const double x = 0.35 * MinimumJerk((t - 0.5) / 1.0);
    const double z = 0.02 * MinimumJerk((t - 1.8) / 1.2) - 0.02 * MinimumJerk((t - 3.4) / 1.0);
    const double back = 0.35 * MinimumJerk((t - 4.6) / 1.0);
    trial.base_T_tool.push_back(geometry::Pose::FromTranslation(
        {x - back + rng.Normal(0, 1e-6), rng.Normal(0, 1e-6), -z + rng.Normal(0, 1e-6)}));
  }
  return trial;
}

TEST(Segmentation, ASlowPressBesideAQuickReachIsFoundByLocalThresholdsOnly) {
  Rng rng(4);
  const UniformTrial trial = QuickReachAndSlowPress(rng);
  const auto near = [&](const LearnOptions& options, double time_s) {
    for (const double t : Times(Segment(trial, options), MarkerKind::kBeginning)) {
      if (std::abs(t - time_s) < 0.25) return true;
    }
    return false;
  };
  const LearnOptions whole;
  LearnOptions local;
  local.threshold = ThresholdRule::kLocal;
  for (const LearnOptions& options : {whole, local}) {
    EXPECT_TRUE(near(options, 0.5));
    EXPECT_TRUE(near(options, 4.6));
  }
  EXPECT_FALSE(near(whole, 1.8));
  EXPECT_TRUE(near(local, 1.8));
  EXPECT_EQ(Times(Segment(trial, local), MarkerKind::kBeginning).size(), 4u);
}

TEST(Segmentation, LocalThresholdsAreGivenOutAndHoldTheirOrder) {
  Rng rng(5);
  for (int round = 0; round < 200; ++round) {
    const Eigen::VectorXd msv = RandomMsv(rng);
    const ThresholdsAlong along = FindThresholdsAlong(msv);
    ASSERT_EQ(along.c.size(), msv.size());
    EXPECT_GT(along.c.minCoeff(), 0);
    EXPECT_GT((along.high - along.c).minCoeff(), 0);
    const auto begins = FindBeginnings(msv, along, EpisodeRule::kTwitch);
    EXPECT_EQ(begins.size(), FindEndings(msv, along, EpisodeRule::kTwitch).size());
    for (const Boundary& begin : begins) EXPECT_GT(begin.score, 1);
    const Eigen::VectorXd scaled = 8 * msv;  // a power of two: exact
    EXPECT_EQ(Frames(FindBeginnings(scaled, FindThresholdsAlong(scaled), EpisodeRule::kTwitch)),
              Frames(begins));
  }
  LearnOptions local;
  local.threshold = ThresholdRule::kLocal;
  const UniformTrial trial = QuickReachAndSlowPress(rng);
  EXPECT_EQ(Segment(trial, local).c_along.size(), Segment(trial, local).msv.size());
  EXPECT_EQ(Segment(trial, {}).c_along.size(), 0);
}

TEST(Segmentation, AConstantThresholdAlongTheTrialIsTheTrialsOwn) {
  Rng rng(6);
  for (int round = 0; round < 200; ++round) {
    const Eigen::VectorXd msv = RandomMsv(rng);
    const Thresholds whole = FindThresholds(msv);
    const ThresholdsAlong along{Eigen::VectorXd::Constant(msv.size(), whole.c),
                                Eigen::VectorXd::Constant(msv.size(), whole.high())};
    for (const EpisodeRule rule : {EpisodeRule::kTwitch, EpisodeRule::kLiteral}) {
      EXPECT_EQ(Frames(FindBeginnings(msv, along, rule)), Frames(FindBeginnings(msv, whole, rule)));
    }
  }
}

// One reach in whose last third the hand begins to turn.
TEST(Segmentation, ATurnDuringAReachIsABoundaryByOrientationOnly) {
  UniformTrial trial = EvenTrial(5, 60);
  for (const double t : trial.time_s) {
    geometry::Pose pose;
    pose.translation.x() = 0.4 * MinimumJerk((t - 0.5) / 2);
    pose.rotation = geometry::ExpSo3({0, 0, 1.2 * MinimumJerk((t - 2.0) / 1)});
    trial.base_T_tool.push_back(pose);
  }
  LearnOptions options;
  const auto causes = [&](const std::string& cause) {
    std::vector<double> times;
    for (const Marker& marker : Segment(trial, options).markers) {
      if (marker.cause == cause && marker.kind == MarkerKind::kBeginning) {
        times.push_back(marker.time_s);
      }
    }
    return times;
  };
  EXPECT_THAT(causes("orientation"), IsEmpty());
  options.cues.orientation = true;
  const std::vector<double> turns = causes("orientation");
  ASSERT_EQ(turns.size(), 1u);
  EXPECT_NEAR(turns[0], 2.1, 0.15);
  for (geometry::Pose& pose : trial.base_T_tool) pose.rotation.setIdentity();
  EXPECT_THAT(causes("orientation"), IsEmpty()) << "a tool that never turns";
}

// Over a wall without a stop: the lift's top is an extremum of one joint only.
TEST(Segmentation, AJointThatTurnsBackIsABoundaryByExtremaOnly) {
  UniformTrial trial = EvenTrial(5, 60);
  trial.joint_names = {"pan", "lift", "still"};
  trial.joints.resize(static_cast<Eigen::Index>(trial.time_s.size()), 3);
  for (std::size_t k = 0; k < trial.time_s.size(); ++k) {
    const double t = trial.time_s[k];
    const double lift = std::sin(M_PI * MinimumJerk((t - 0.5) / 3));
    trial.joints.row(static_cast<Eigen::Index>(k)) << MinimumJerk((t - 0.5) / 3), 0.6 * lift,
        0.01 * std::sin(9 * t);
  }
  LearnOptions options;
  EXPECT_EQ(Times(Segment(trial, options), MarkerKind::kBeginning).size(), 1u);
  options.cues.extrema = true;
  int found = 0;
  for (const Marker& marker : Segment(trial, options).markers) {
    if (marker.cause != "extremum of lift") {
      EXPECT_EQ(marker.cause.rfind("extremum", 0), std::string::npos) << marker.cause;
      continue;
    }
    ++found;
    EXPECT_NEAR(marker.time_s, 2.0, 0.02);
    EXPECT_NEAR(marker.score, 1, 0.01);
  }
  EXPECT_EQ(found, 1);
}

TEST(Segmentation, AnExtremumThatRestsIsMarkedWhereTheRestEnds) {
  UniformTrial trial = EvenTrial(5, 60);
  for (const double t : trial.time_s) {
    const double z = MinimumJerk((t - 0.5) / 1) - MinimumJerk((t - 3.0) / 1);
    trial.base_T_tool.push_back(geometry::Pose::FromTranslation({0, 0, 0.2 * z}));
  }
  const std::vector<Marker> extrema = FindExtrema(trial);
  ASSERT_EQ(extrema.size(), 1u);
  EXPECT_EQ(extrema[0].cause, "extremum of tool z");
  EXPECT_NEAR(extrema[0].time_s, 3.15, 0.1);
}

}  // namespace
}  // namespace exemplar::learning
