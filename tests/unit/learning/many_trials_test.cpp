// How many, how long and how good trials may be.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <stop_token>

#include "pressing_arm.hpp"

namespace exemplar::learning {
namespace {

using Eigen::Vector3d;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

const auto kArm = std::make_shared<PressingArm>();

std::vector<NamedTrial> MakeMany(int count, PressOptions options = {}, int keep_every = 1,
                                 double longer = 1) {
  Rng rng(7);
  std::vector<NamedTrial> trials;
  for (int i = 0; i < count; ++i) {
    options.reach_s = longer * rng.Uniform(1.0, 1.6);
    options.hold_s = longer * rng.Uniform(0.4, 0.7);
    options.retract_s = longer * rng.Uniform(0.7, 1.2);
    const Vector3d button(rng.Uniform(.45, .75), rng.Uniform(-.3, .3), rng.Uniform(.1, .3));
    trials.push_back(MakePress("press-" + std::to_string(i), button, options));
    if (keep_every == 1) continue;
    demonstration::Trial& trial = trials.back().trial;
    const auto thin = [&](auto& values) {
      std::size_t kept = 0;
      for (std::size_t k = 0; k < values.size(); k += static_cast<std::size_t>(keep_every)) {
        values[kept++] = values[k];
      }
      values.resize(kept);
    };
    thin(trial.end_effectors[0].time_s);
    thin(trial.end_effectors[0].base_T_frame);
    thin(trial.objects[0].time_s);
    thin(trial.objects[0].base_T_frame);
    trial.tactile = {};
  }
  return trials;
}

double ContactError(const Skill& skill, const Vector3d& button) {
  const Result<demonstration::SkillMotion> motion = Answer(skill, ButtonAt(button));
  EXPECT_TRUE(motion.ok());
  EXPECT_FALSE(motion->contacts.empty());
  return (motion->contacts.at(0).base_p_contact - button).norm();
}

// A thousand trials of some 25 samples; of some 900, with joints and touch, where
// EXEMPLAR_LONG_TRIALS is set (ctest -C All).
TEST(ManyTrials, AThousandAreLearnedWithProgress) {
  const bool whole = std::getenv("EXEMPLAR_LONG_TRIALS") != nullptr;
  const std::vector<NamedTrial> trials =
      whole ? MakeMany(1000, {}, 1, 3) : MakeMany(1000, {.joints = false, .touch = false}, 10);
  double last = 0;
  int told = 0;
  const Result<Skill> skill = LearnSkill(trials, {}, kArm, [&](double fraction, std::string_view) {
    EXPECT_GE(fraction, last - 1e-12);
    last = fraction;
    ++told;
  });
  ASSERT_TRUE(skill.ok()) << skill.error().message;
  EXPECT_EQ(skill->report().trials.size(), 1000u);
  EXPECT_GT(told, 1000);
  EXPECT_EQ(last, 1);
  EXPECT_LT(ContactError(*skill, Vector3d(.6, .05, .2)), 5e-3);
  // r of a pair is at most 1.
  EXPECT_LE(skill->alignment().choice_value, skill->alignment().choice_bound + 1e-6);
  EXPECT_LE(skill->alignment().choice_bound, 1000 * 999 / 2.0 + 1e-6);
}

TEST(ManyTrials, LearningThemEndsSoonAfterItIsAskedTo) {
  const std::vector<NamedTrial> trials = MakeMany(150, {.joints = false, .touch = false}, 10);
  for (const double when : {0.1, 0.25, 0.5, 0.71, 0.9}) {
    std::stop_source stop;
    double asked_at = -1;
    double last = 0;
    const Result<Skill> skill = LearnSkill(
        trials, {}, kArm,
        [&](double fraction, std::string_view) {
          last = fraction;
          if (fraction >= when && asked_at < 0) {
            asked_at = fraction;
            stop.request_stop();
          }
        },
        stop.get_token());
    ASSERT_FALSE(skill.ok()) << when;
    EXPECT_EQ(skill.error().code, ErrorCode::kCancelled);
    EXPECT_LT(last, 0.999) << when;
  }
}

// Up to 15 trials each method is fitted anew without each; beyond, closed forms answer. What they
// say of the same kind of trials is of one size.
TEST(ManyTrials, ClosedFormsScoreAsRefitsDo) {
  const auto scores = [](int count) {
    return LearnSkill(MakeMany(count), {}, kArm)->report().methods;
  };
  const std::vector<MethodScore> refitted = scores(15);
  const std::vector<MethodScore> closed = scores(16);
  ASSERT_EQ(refitted.size(), closed.size());
  for (std::size_t m = 0; m < closed.size(); ++m) {
    EXPECT_EQ(refitted[m].method, closed[m].method);
    EXPECT_EQ(closed[m].frechet_by_trial_m.size(), 15u);
    EXPECT_LT(closed[m].frechet_m, 2.5 * refitted[m].frechet_m + 1e-6) << closed[m].method;
    EXPECT_GT(closed[m].frechet_m, 0.4 * refitted[m].frechet_m - 1e-6) << closed[m].method;
  }
}

// One person waved on the way.
TEST(TrialQuality, AnOutlierIsNamedAmongFewAndMany) {
  for (const int count : {12, 40}) {
    for (const Method method : {Method::kFrames, Method::kPaper}) {
      PressOptions options{.joints = false};
      std::vector<NamedTrial> trials = MakeMany(count, options);
      std::vector<geometry::Pose>& path = trials[3].trial.end_effectors[0].base_T_frame;
      for (std::size_t k = 0; k < path.size(); ++k) {
        const double s = static_cast<double>(k) / static_cast<double>(path.size() - 1);
        path[k].translation.y() += 0.4 * std::exp(-std::pow((s - .25) / .05, 2));
      }
      LearnOptions learn;
      learn.method = method;
      const Result<Skill> skill = LearnSkill(trials, learn);
      ASSERT_TRUE(skill.ok()) << skill.error().message;
      int others_named = 0;
      for (std::size_t j = 0; j < trials.size(); ++j) {
        const auto named = Contains(HasSubstr("outlier: "));
        if (j == 3) {
          EXPECT_THAT(skill->report().trials[j].notes, named)
              << count << " trials, method " << static_cast<int>(method);
        } else if (testing::Matches(named)(skill->report().trials[j].notes)) {
          ++others_named;
        }
      }
      EXPECT_LE(others_named, count / 10);
    }
  }
}

TEST(TrialQuality, ATrialWithoutTheContactThatOthersHaveIsNamed) {
  std::vector<NamedTrial> trials = MakePresses(6);
  trials[2].trial.tactile.values.setZero();
  const Result<Skill> skill = LearnSkill(trials, {}, kArm);
  ASSERT_TRUE(skill.ok()) << skill.error().message;
  for (std::size_t j = 0; j < trials.size(); ++j) {
    const auto named = Contains(HasSubstr("no touch was measured, where 5 other trials have it"));
    if (j == 2) {
      EXPECT_THAT(skill->report().trials[j].notes, named);
    } else {
      EXPECT_THAT(skill->report().trials[j].notes, Not(named));
    }
  }
}

TEST(TrialQuality, ATrialThatAloneDragsTheMarkersDownIsNamedInTheReport) {
  std::vector<NamedTrial> trials = MakePresses(5);
  // It ends on the way to the button, before it is touched.
  demonstration::Trial& cut = trials[1].trial;
  const Eigen::Index kept = cut.joints.values.rows() * 2 / 5;
  for (demonstration::ScalarSeries* series : {&cut.joints, &cut.tactile}) {
    series->time_s.resize(static_cast<std::size_t>(kept));
    series->values.conservativeResize(kept, Eigen::NoChange);
  }
  cut.tactile.values.setZero();
  const Result<Skill> skill = LearnSkill(trials, {}, kArm);
  ASSERT_TRUE(skill.ok()) << skill.error().message;
  EXPECT_THAT(
      skill->report().warnings,
      Contains(testing::AllOf(HasSubstr("press-1"), testing::AnyOf(HasSubstr("limits the number"),
                                                                   HasSubstr("no beginning")))));
}

}  // namespace
}  // namespace exemplar::learning
