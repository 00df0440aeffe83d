#include "exemplar/learning/suggest.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pressing_arm.hpp"

namespace exemplar::learning {
namespace {

using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const auto kArm = std::make_shared<PressingArm>();

Skill LearnAt(const std::vector<Vector3d>& places, Method method) {
  Rng rng(6);
  std::vector<NamedTrial> trials;
  for (const Vector3d& place : places) {
    PressOptions options;
    options.reach_s = rng.Uniform(1.0, 1.6);
    options.arch_m = rng.Uniform(0.06, 0.1);
    trials.push_back(MakePress("press-" + std::to_string(trials.size()), place, options));
  }
  LearnOptions options;
  options.method = method;
  Result<Skill> skill = LearnSkill(trials, options, kArm);
  EXPECT_TRUE(skill.ok()) << (skill.ok() ? "" : skill.error().message);
  return *skill;
}

const Vector3d& PlaceOf(const Suggestion& suggestion) {
  return suggestion.target.base_T_object.translation;
}

TEST(Suggest, FindsTheGapBetweenTheTrials) {
  // The corners of a square with its sides shown twice, but for the one at the far left.
  const std::vector<Vector3d> places = {{.45, -.25, .2}, {.45, 0, .2},  {.45, .25, .2},
                                        {.60, -.25, .2}, {.60, 0, .2},  {.75, -.25, .2},
                                        {.75, 0, .2},    {.75, .25, .2}};
  for (const Method method : {Method::kPaper, Method::kFrames}) {
    const Result<Suggestions> found = Suggest(LearnAt(places, method), {.count = 1});
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_EQ(found->places.size(), 1u);
    const Suggestion& best = found->places[0];
    EXPECT_EQ(best.target.name, "button");
    EXPECT_GT(best.sigma_m, found->typical_sigma_m);
    EXPECT_GE(best.nearest_trial_m, .05);
    EXPECT_NEAR(PlaceOf(best).z(), .2, 1e-6);
    if (method == Method::kPaper) {
      EXPECT_LT((PlaceOf(best) - Vector3d(.60, .25, .2)).norm(), .1) << PlaceOf(best).transpose();
    }
  }
}

TEST(Suggest, StaysInTheHullAndApart) {
  const Result<Suggestions> found = Suggest(LearnAt(ButtonPlaces(), Method::kPaper), {.count = 3});
  ASSERT_TRUE(found.ok());
  ASSERT_GE(found->places.size(), 2u);
  for (std::size_t k = 0; k < found->places.size(); ++k) {
    const Vector3d& place = PlaceOf(found->places[k]);
    EXPECT_GE(place.x(), .48 - .01);
    EXPECT_LE(place.x(), .75 + .01);
    EXPECT_LE(std::abs(place.y()), .30 + .01);
    EXPECT_THAT(found->places[k].reason, HasSubstr("the nearest trial is"));
    for (std::size_t i = 0; i < k; ++i) {
      EXPECT_GT((place - PlaceOf(found->places[i])).norm(), .1);
      EXPECT_GE(found->places[i].sigma_m, found->places[k].sigma_m * 0.999);
    }
  }
}

TEST(Suggest, LeavesTheOnePlaceAndTheLine) {
  const Result<Suggestions> one =
      Suggest(LearnAt({{.6, 0, .2}, {.6, 0, .2}}, Method::kFrames), {.count = 1});
  ASSERT_TRUE(one.ok());
  EXPECT_GT((PlaceOf(one->places.at(0)) - Vector3d(.6, 0, .2)).norm(), .05);
  EXPECT_THAT(one->places[0].reason, HasSubstr("at one place"));
  const Result<Suggestions> line =
      Suggest(LearnAt({{.6, -.2, .2}, {.6, 0, .2}, {.6, .2, .2}}, Method::kFrames), {.count = 1});
  ASSERT_TRUE(line.ok());
  EXPECT_GT(std::abs(PlaceOf(line->places.at(0)).x() - .6), .05);
  EXPECT_THAT(line->places[0].reason, HasSubstr("on one line"));
}

TEST(Suggest, SaysThatTheObjectWasNeverTurned) {
  const Result<Suggestions> found = Suggest(LearnAt(ButtonPlaces(), Method::kFrames), {.count = 1});
  ASSERT_TRUE(found.ok());
  EXPECT_THAT(found->notes, Contains(HasSubstr("no trial turned \"button\"")));
}

TEST(Suggest, NamesWhatIsWrong) {
  const Skill skill = LearnAt(ButtonPlaces(), Method::kFrames);
  const Result<Suggestions> none = Suggest(skill, {.count = 0});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().field, "count");
  EXPECT_THAT(none.error().message, HasSubstr("count is 0"));
  std::vector<NamedTrial> trials = MakePresses(2);
  for (NamedTrial& trial : trials) trial.trial.objects.clear();
  const Result<Skill> objectless = LearnSkill(trials, {}, kArm);
  ASSERT_TRUE(objectless.ok());
  ASSERT_FALSE(Suggest(*objectless).ok());
  EXPECT_THAT(Suggest(*objectless).error().message, HasSubstr("no object"));
}

}  // namespace
}  // namespace exemplar::learning
