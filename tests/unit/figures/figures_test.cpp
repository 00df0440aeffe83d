#include "exemplar/figures/figures.hpp"

#include <gmock/gmock.h>

#include "pressing_arm.hpp"
#include "well_formed.hpp"

namespace exemplar::figures {
namespace {

using learning::LearnOptions;
using learning::Skill;

struct Drawn {
  Skill skill;
  std::vector<Figure> figures;
  const Figure& at(int number) const { return figures[static_cast<std::size_t>(number - 4)]; }
};

Drawn Draw(std::vector<learning::NamedTrial> trials, bool robot, const LearnOptions& options = {}) {
  const auto arm = robot ? std::make_shared<learning::PressingArm>() : nullptr;
  Result<Skill> skill = learning::LearnSkill(trials, options, arm);
  EXPECT_TRUE(skill.ok()) << skill.error().message;
  const learning::Inspection inspection =
      learning::Inspect(*skill, {.map_columns = 9, .map_rows = 7});
  return {*skill, DrawFigures({.report = skill->report(),
                               .alignment = skill->alignment(),
                               .inspection = inspection})};
}

void ExpectWhole(const Drawn& drawn) {
  ASSERT_EQ(drawn.figures.size(), 11U);
  int number = 4;
  for (const Figure& figure : drawn.figures) {
    EXPECT_EQ(figure.number, number++);
    EXPECT_EQ(WrongIn(figure.svg), "") << "Fig. " << figure.number;
    EXPECT_THAT(figure.svg, testing::HasSubstr("Fig. " + std::to_string(figure.number)));
    EXPECT_THAT(figure.caption, testing::Not(testing::IsEmpty()));
    EXPECT_THAT(figure.caption, testing::Not(testing::HasSubstr("nan")));
  }
}

TEST(Figures, AllAreDrawnForTrialsWithJointsAndTouch) {
  const Drawn drawn = Draw(learning::MakePresses(6), true);
  ExpectWhole(drawn);
  for (const Figure& figure : drawn.figures) EXPECT_TRUE(figure.drawn) << figure.number;
  EXPECT_THAT(drawn.at(4).svg, testing::HasSubstr("rad"));
  EXPECT_THAT(drawn.at(5).svg, testing::HasSubstr("force in N"));
  EXPECT_THAT(drawn.at(10).svg, testing::HasSubstr("joint-wise RBF"));
  EXPECT_THAT(drawn.at(10).svg, testing::HasSubstr("blended by objectivity"));
  EXPECT_THAT(drawn.at(12).svg, testing::HasSubstr("contact with the object"));
}

TEST(Figures, PapersMethodNeedsNoSecondAnswer) {
  const Drawn drawn = Draw(learning::MakePresses(5), true, {.method = learning::Method::kPaper});
  ExpectWhole(drawn);
  EXPECT_THAT(drawn.at(10).svg, testing::Not(testing::HasSubstr("this skill")));
  EXPECT_THAT(drawn.at(14).svg, testing::Not(testing::HasSubstr("this skill")));
}

TEST(Figures, TrialsWithoutJointsShowThePlainRbfAndSaySo) {
  learning::PressOptions options;
  options.joints = false;
  options.touch = false;
  const Drawn drawn = Draw(learning::MakePresses(6, options), false);
  ExpectWhole(drawn);
  EXPECT_THAT(drawn.at(10).svg, testing::HasSubstr("plain RBF on paths"));
  EXPECT_THAT(drawn.at(10).caption, testing::HasSubstr("no joint-wise solution"));
  EXPECT_THAT(drawn.at(13).caption, testing::HasSubstr("which the objective one repeats"));
  EXPECT_THAT(drawn.at(5).caption, testing::HasSubstr("measured no touch"));
}

TEST(Figures, WhatNeedsARobotModelSaysSoWithoutOne) {
  const Drawn drawn = Draw(learning::MakePresses(4), false);
  ExpectWhole(drawn);
  for (const int number : {4, 5, 6, 7, 8}) EXPECT_TRUE(drawn.at(number).drawn) << number;
  for (const int number : {9, 10, 11, 12, 13, 14}) {
    EXPECT_FALSE(drawn.at(number).drawn) << number;
    EXPECT_THAT(drawn.at(number).svg, testing::HasSubstr("robot"));
  }
}

TEST(Figures, TrialsWithoutObjectsHaveNoFiguresOfTheirPlaces) {
  std::vector<learning::NamedTrial> trials = learning::MakePresses(3);
  for (learning::NamedTrial& named : trials) named.trial.objects.clear();
  const Drawn drawn = Draw(std::move(trials), true);
  ExpectWhole(drawn);
  EXPECT_TRUE(drawn.at(9).drawn);
  for (const int number : {10, 11, 12, 13, 14}) {
    EXPECT_THAT(drawn.at(number).caption, testing::HasSubstr("no object"));
  }
}

TEST(Figures, OneTrialIsEnoughForWhatNeedsNoMean) {
  const Drawn drawn = Draw(learning::MakePresses(1), true);
  ExpectWhole(drawn);
  EXPECT_FALSE(drawn.at(4).drawn);
  EXPECT_TRUE(drawn.at(5).drawn);
  EXPECT_TRUE(drawn.at(11).drawn);
}

TEST(Figures, IndexShowsEachWithItsCaption) {
  Drawn drawn = Draw(learning::MakePresses(2), true);
  const std::string html = IndexHtml(drawn.skill.Named("a<b", 3).report(), drawn.figures);
  for (const Figure& figure : drawn.figures) {
    EXPECT_THAT(html, testing::HasSubstr("src=\"" + FileName(figure) + "\""));
  }
  EXPECT_THAT(html, testing::HasSubstr("a&lt;b, version 3"));
  EXPECT_EQ(FileName(drawn.at(4)), "figure-04.svg");
  EXPECT_EQ(FileName(drawn.at(14)), "figure-14.svg");
}

}  // namespace
}  // namespace exemplar::figures
