#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "exemplar/base/rng.hpp"
#include "exemplar/learning/aligned.hpp"
#include "exemplar/learning/warp.hpp"
#include "exemplar/signal/resample.hpp"
#include "known_episodes.hpp"

namespace exemplar::learning {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<UniformTrial> TrialsOf(const std::vector<Demonstration>& all) {
  std::vector<UniformTrial> trials;
  for (const Demonstration& d : all) trials.push_back(d.trial);
  return trials;
}

Alignment Aligned(std::vector<UniformTrial> trials, const LearnOptions& options = {}) {
  Result<Alignment> result = Align(std::move(trials), options);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
  return result.ok() ? std::move(*result) : Alignment{};
}

// PAPER.md section 9, claim 3, with what the two rules do not share: a vote is also cast for
// subsets that nobody chooses in the end.
TEST(Align, FindsTheTrueBoundariesAmongSpuriousOnes) {
  Rng rng(1);
  int vote_wrong = 0, joint_wrong = 0;
  std::size_t candidates = 0, trials = 0;
  for (int round = 0; round < 25; ++round) {
    const std::vector<Demonstration> all = DemonstrateAll(rng, 4);
    LearnOptions options;
    options.selection = Selection::kVote;
    const Alignment vote = Aligned(TrialsOf(all), options);
    options.selection = Selection::kJoint;
    const Alignment joint = Aligned(TrialsOf(all), options);
    ASSERT_EQ(vote.knots_s.size(), 5u);  // start, three episodes, end
    ASSERT_EQ(joint.knots_s.size(), 5u);
    vote_wrong += CountWrongTrials(vote, all);
    joint_wrong += CountWrongTrials(joint, all);
    trials += all.size();
    for (const AlignedTrial& trial : vote.trials) {
      for (const Marker& marker : trial.segmentation.markers) {
        if (marker.kind == MarkerKind::kBeginning) ++candidates;
      }
    }
  }
  EXPECT_GT(candidates, 3 * trials + 20);  // there were spurious ones to reject
  EXPECT_LE(vote_wrong, 5);
  EXPECT_LE(joint_wrong, vote_wrong);
  RecordProperty("trials", static_cast<int>(trials));
  RecordProperty("candidates", static_cast<int>(candidates));
  RecordProperty("vote_wrong", vote_wrong);
  RecordProperty("joint_wrong", joint_wrong);
}

// PAPER.md section 9, claim 4; Figs. 4, 8, 9.
TEST(Align, TheCanonicalMotionKeepsTheTrialsExtremaAndThePlainMeanDoesNot) {
  Rng rng(2);
  std::vector<Demonstration> all;
  // A joint that goes there and back, at times of its own in each trial.
  for (int i = 0; i < 5; ++i) {
    Demonstration made;
    made.trial = EvenTrial(6, 60);
    made.trial.id = "t" + std::to_string(i);
    const double begin_s = 0.4 + 0.7 * i;
    const auto n = static_cast<Eigen::Index>(made.trial.time_s.size());
    made.trial.joints.resize(n, 1);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double t = made.trial.time_s[static_cast<std::size_t>(k)];
      made.trial.joints(k, 0) =
          MinimumJerk((t - begin_s) / 0.9) - MinimumJerk((t - begin_s - 1.0) / 0.9);
    }
    all.push_back(made);
  }
  const Alignment aligned = Aligned(TrialsOf(all));
  Eigen::VectorXd plain = Eigen::VectorXd::Zero(all[0].trial.joints.rows());
  double extremum = 0;
  for (const Demonstration& d : all) {
    plain += d.trial.joints.col(0) / 5;
    extremum += d.trial.joints.maxCoeff() / 5;
  }
  EXPECT_GT(aligned.canonical_joints.maxCoeff(), 0.95 * extremum);
  EXPECT_LT(plain.maxCoeff(), 0.75 * extremum);
  EXPECT_GT(aligned.mean_correlation, 0.8);
  EXPECT_LT(aligned.plain_correlation, 0.5);
}

TEST(Align, MarkersOfAllTrialsFallOnTheirMean) {
  Rng rng(3);
  const std::vector<Demonstration> all = DemonstrateAll(rng, 5);
  const Alignment aligned = Aligned(TrialsOf(all));
  for (std::size_t k = 0; k < aligned.knots_s.size(); ++k) {
    double mean = 0;
    for (const AlignedTrial& trial : aligned.trials) mean += trial.own_knots_s[k] / 5;
    EXPECT_NEAR(aligned.knots_s[k], mean, 1e-12);
  }
  EXPECT_EQ(aligned.time_s.back(), aligned.knots_s.back());
  for (std::size_t i = 0; i < aligned.trials.size(); ++i) {
    const AlignedTrial& trial = aligned.trials[i];
    const UniformTrial warped = Warped(aligned, i);
    ASSERT_EQ(trial.chosen.size() + 2, trial.own_knots_s.size());
    for (std::size_t m = 0; m < trial.chosen.size(); ++m) {
      const Marker& marker = trial.segmentation.markers[static_cast<std::size_t>(trial.chosen[m])];
      EXPECT_EQ(marker.kind, MarkerKind::kBeginning);
      EXPECT_NEAR(marker.time_s, trial.own_knots_s[m + 1], 0.04);
    }
    // Start on start, end on end.
    EXPECT_EQ(warped.joints.row(0), trial.own.joints.row(0));
    EXPECT_LT((warped.joints.bottomRows(1) - trial.own.joints.bottomRows(1)).norm(), 1e-12);
    EXPECT_EQ(warped.time_s, aligned.time_s);
  }
}

TEST(Align, OrderOfTheTrialsDoesNotMatter) {
  Rng rng(4);
  const std::vector<Demonstration> all = DemonstrateAll(rng, 4);
  std::vector<UniformTrial> trials = TrialsOf(all);
  for (const Selection selection : {Selection::kVote, Selection::kJoint}) {
    LearnOptions options;
    options.selection = selection;
    const Alignment forward = Aligned(trials, options);
    const Alignment backward = Aligned({trials.rbegin(), trials.rend()}, options);
    for (std::size_t i = 0; i < trials.size(); ++i) {
      EXPECT_EQ(forward.trials[i].chosen, backward.trials[trials.size() - 1 - i].chosen);
    }
  }
}

TEST(Align, TheJointChoiceReportsAProvenBound) {
  Rng rng(5);
  const Alignment aligned = Aligned(TrialsOf(DemonstrateAll(rng, 4)));
  EXPECT_GT(aligned.choice_value, 0);
  EXPECT_NEAR(aligned.choice_bound, aligned.choice_value, 1e-8);
}

TEST(Align, ATrialWithoutMarkersLeavesLinearTimeAndIsNamed) {
  Rng rng(6);
  std::vector<UniformTrial> trials = TrialsOf(DemonstrateAll(rng, 3));
  UniformTrial still = EvenTrial(4, 60);
  still.id = "still.csv";
  still.joint_names = trials[0].joint_names;
  still.joints = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(still.time_s.size()), 3);
  trials.push_back(still);
  const Alignment aligned = Aligned(trials);
  EXPECT_EQ(aligned.knots_s.size(), 2u);
  EXPECT_THAT(aligned.warnings, ElementsAre(HasSubstr("still.csv")));

  LearnOptions options;
  options.leave_out = {"still.csv"};
  const Alignment without = Aligned(trials, options);
  EXPECT_EQ(without.trials.size(), 3u);
  EXPECT_EQ(without.knots_s.size(), 5u);
  EXPECT_THAT(without.warnings, IsEmpty());
}

TEST(Align, ATrialThatAloneDragsTheNumberOfMarkersDownIsNamed) {
  Rng rng(7);
  std::vector<UniformTrial> trials = TrialsOf(DemonstrateAll(rng, 3));
  UniformTrial& cut = trials[1];
  const auto half = static_cast<Eigen::Index>(cut.time_s.size() * 2 / 5);
  cut.time_s.resize(static_cast<std::size_t>(half));
  cut.joints.conservativeResize(half, Eigen::NoChange);
  EXPECT_THAT(Aligned(trials).warnings, Contains(HasSubstr("trial t1 has ")));
}

// The hand begins to turn as it begins to move: two candidates that no warp could hold apart.
TEST(Align, CandidatesNearerThanAWarpCanBearAreOne) {
  std::vector<UniformTrial> trials;
  for (int i = 0; i < 2; ++i) {
    UniformTrial trial = EvenTrial(4, 60);
    trial.id = "t" + std::to_string(i);
    for (const double t : trial.time_s) {
      geometry::Pose pose;
      pose.translation.x() = 0.4 * MinimumJerk((t - 1) / 2);
      pose.rotation = geometry::ExpSo3({0, 0, MinimumJerk((t - 1.03) / 2)});
      trial.base_T_tool.push_back(pose);
    }
    trials.push_back(std::move(trial));
  }
  LearnOptions options;
  options.cues.orientation = true;
  const Alignment aligned = Aligned(trials, options);
  std::vector<double> begins;
  for (const Marker& marker : aligned.trials[0].segmentation.markers) {
    if (marker.kind == MarkerKind::kBeginning) begins.push_back(marker.time_s);
  }
  ASSERT_EQ(begins.size(), 2u);
  EXPECT_LT(begins[1] - begins[0], 0.1);
  EXPECT_EQ(aligned.trials[0].chosen.size(), 1u);
  EXPECT_EQ(aligned.knots_s.size(), 3u);
}

TEST(Align, OneTrialIsItsOwnCanonicalMotion) {
  Rng rng(8);
  const Demonstration one = Demonstrate(rng, "one", 1);
  const Alignment aligned = Aligned({one.trial});
  EXPECT_LT((aligned.canonical_joints - one.trial.joints).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(aligned.mean_correlation, 1);
}

TEST(Align, TheNumberOfFramesCanBeAsked) {
  Rng rng(9);
  LearnOptions options;
  options.frames = 50;
  EXPECT_EQ(Aligned(TrialsOf(DemonstrateAll(rng, 3)), options).canonical_joints.rows(), 50);
}

TEST(Align, StopsWhenAskedAndRefusesNoTrials) {
  Rng rng(10);
  std::stop_source stop;
  stop.request_stop();
  const Result<Alignment> stopped =
      Align(TrialsOf(DemonstrateAll(rng, 3)), {}, {}, stop.get_token());
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  const Result<Alignment> none = Align({}, {});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kInvalidArgument);
}

// Whatever the trials are like: very short, spiky, still, in motion throughout.
TEST(Align, AnyTrialsGiveOneFiniteMotion) {
  Rng rng(12);
  for (int round = 0; round < 60; ++round) {
    std::vector<UniformTrial> trials;
    const std::size_t n = 1 + rng.Below(5);
    for (std::size_t i = 0; i < n; ++i) {
      UniformTrial trial = EvenTrial(rng.Uniform(0.1, 1.5), rng.Uniform(50, 60));
      trial.id = "t" + std::to_string(i);
      const auto frames = static_cast<Eigen::Index>(trial.time_s.size());
      trial.joints = Eigen::MatrixXd::Zero(frames, 2);
      trial.touch_n = Eigen::VectorXd::Zero(frames);
      const std::uint64_t kind = rng.Below(4);
      double level = 0, force = 0;
      for (Eigen::Index k = 0; k < frames; ++k) {
        if (kind == 1) level += rng.Normal(0, 0.05);
        if (kind == 2) level += rng.Uniform() < 0.05 ? 1.0 : 0.0;
        if (kind == 3) level += 0.01;
        if (rng.Uniform() < 0.03) force = rng.Uniform() < 0.5 ? 0 : rng.Uniform(0, 20);
        trial.joints.row(k) << level, -level;
        trial.touch_n[k] = force;
      }
      trials.push_back(trial);
    }
    LearnOptions options;
    options.selection = round % 2 == 0 ? Selection::kJoint : Selection::kVote;
    options.rule = round % 3 == 0 ? EpisodeRule::kLiteral : EpisodeRule::kTwitch;
    options.force_rate = round % 5 == 0 ? ForceRate::kSigned : ForceRate::kAbsolute;
    const Alignment aligned = Aligned(trials, options);
    ASSERT_EQ(aligned.trials.size(), n);
    EXPECT_TRUE(aligned.canonical_joints.allFinite());
    for (std::size_t i = 0; i < n; ++i) {
      const AlignedTrial& trial = aligned.trials[i];
      const UniformTrial warped = Warped(aligned, i);
      for (std::size_t k = 1; k < trial.own_knots_s.size(); ++k) {
        ASSERT_GT(trial.own_knots_s[k], trial.own_knots_s[k - 1]);
      }
      EXPECT_LE(warped.joints.maxCoeff(), trial.own.joints.maxCoeff() + 1e-12);
      EXPECT_GE(warped.joints.minCoeff(), trial.own.joints.minCoeff() - 1e-12);
    }
  }
}

TEST(Align, ElasticRegistrationBringsTrialsTogetherWithoutMarkers) {
  Rng rng(21);
  LearnOptions options;
  options.alignment = AlignmentRule::kElastic;
  std::vector<UniformTrial> trials;
  for (int i = 0; i < 5; ++i) {
    const double reach_s = rng.Uniform(1.0, 2.0);
    const double pause_s = rng.Uniform(0.2, 1.0);
    const double back_s = rng.Uniform(0.8, 1.4);
    UniformTrial trial = EvenTrial(0.6 + reach_s + pause_s + back_s, 60);
    trial.id = "trial" + std::to_string(i);
    trial.joint_names = {"a", "b"};
    trial.joints.resize(static_cast<Eigen::Index>(trial.time_s.size()), 2);
    for (std::size_t k = 0; k < trial.time_s.size(); ++k) {
      const double there = MinimumJerk((trial.time_s[k] - 0.3) / reach_s);
      const double back = MinimumJerk((trial.time_s[k] - 0.3 - reach_s - pause_s) / back_s);
      trial.joints.row(static_cast<Eigen::Index>(k)) << there - back, 0.5 * (there - back) * there;
    }
    trials.push_back(std::move(trial));
  }
  const auto aligned = Align(trials, options);
  ASSERT_TRUE(aligned.ok());
  // How far apart the trials' joints are at one common time, root mean square.
  const auto spread = [](const Alignment& alignment) {
    double squared = 0;
    for (std::size_t i = 0; i < alignment.trials.size(); ++i) {
      squared += (Warped(alignment, i).joints - alignment.canonical_joints).squaredNorm();
    }
    return std::sqrt(squared / static_cast<double>(alignment.canonical_joints.size()) / 5);
  };
  const auto by_markers = Align(trials, {});
  ASSERT_TRUE(by_markers.ok());
  EXPECT_LT(spread(*aligned), 0.01);
  EXPECT_LT(spread(*aligned), 0.3 * spread(*by_markers));
  for (const AlignedTrial& trial : aligned->trials) {
    ASSERT_EQ(trial.own_knots_s.size(), aligned->knots_s.size());
    EXPECT_EQ(trial.own_knots_s.back(), trial.own.time_s.back());
    for (std::size_t k = 1; k < trial.own_knots_s.size(); ++k) {
      ASSERT_GT(trial.own_knots_s[k], trial.own_knots_s[k - 1]);
    }
  }
  for (std::size_t k = 1; k < aligned->knots_s.size(); ++k) {
    ASSERT_GT(aligned->knots_s[k], aligned->knots_s[k - 1]);
  }
  EXPECT_EQ(aligned->markers_s.size(), aligned->trials[0].chosen.size() + 2);
  EXPECT_EQ(aligned->markers_s.back(), aligned->knots_s.back());
  EXPECT_THAT(aligned->warnings, testing::IsEmpty());
}

TEST(WarpTrial, OneWarpServesAllStreams) {
  Rng rng(11);
  UniformTrial trial = EvenTrial(3, 60);
  const auto n = static_cast<Eigen::Index>(trial.time_s.size());
  trial.joints.resize(n, 1);
  trial.touch_n.resize(n);
  trial.object_names = {"moving", "still"};
  const geometry::Pose place{{0.1, 0.2, 0.3}, geometry::ExpSo3({0.3, 0.1, 0.2})};
  std::vector<geometry::Pose> moving;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double t = trial.time_s[static_cast<std::size_t>(k)];
    trial.joints(k, 0) = t;
    trial.touch_n[k] = t;
    trial.hand_open.push_back(t);
    trial.base_T_tool.push_back({{t, 0, 0}, geometry::ExpSo3({0, 0, t})});
    moving.push_back(geometry::Pose::FromTranslation({0, t, 0}));
  }
  trial.base_T_object = {PosePath(moving), PosePath(moving.size(), place)};
  const std::vector<double> common = signal::EvenTimes(0, 4, 200);
  const UniformTrial warped =
      WarpTrial(trial, std::vector<double>{0, 1, 3}, std::vector<double>{0, 2.5, 4}, common);
  for (std::size_t k = 0; k < common.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double own = warped.joints(row, 0);
    EXPECT_NEAR(warped.touch_n[row], own, 1e-12);
    EXPECT_NEAR(warped.hand_open[k], own, 1e-12);
    EXPECT_NEAR(warped.base_T_tool[k].translation.x(), own, 1e-12);
    EXPECT_NEAR(geometry::LogSo3(warped.base_T_tool[k].rotation).z(), own, 1e-9);
    EXPECT_NEAR(warped.base_T_object[0][k].translation.y(), own, 1e-12);
    EXPECT_EQ(warped.base_T_object[1][k].rotation.coeffs(), place.rotation.coeffs());
    if (k > 0) {
      EXPECT_GE(own, warped.joints(row - 1, 0));
    }
  }
}

}  // namespace
}  // namespace exemplar::learning
