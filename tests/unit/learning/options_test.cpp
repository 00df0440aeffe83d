#include "exemplar/learning/options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace exemplar::learning {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string MessageOf(const std::map<std::string, std::string>& options) {
  const Result<LearnOptions> result = LearnOptions::FromStrings(options);
  return result.ok() ? "accepted" : result.error().message;
}

TEST(LearnOptions, DefaultsComeBackFromTheirStrings) {
  const LearnOptions defaults;
  const Result<LearnOptions> again = LearnOptions::FromStrings(defaults.ToStrings());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->ToStrings(), defaults.ToStrings());
  EXPECT_TRUE(LearnOptions::FromStrings({}).ok());
}

TEST(LearnOptions, EveryOptionIsRead) {
  const Result<LearnOptions> options = LearnOptions::FromStrings({{"method", "frames"},
                                                                  {"selection", "vote"},
                                                                  {"rule", "literal"},
                                                                  {"force_rate", "signed"},
                                                                  {"alignment", "elastic"},
                                                                  {"joints", "measured"},
                                                                  {"threshold", "local"},
                                                                  {"cues", "extrema, orientation"},
                                                                  {"target", "button"},
                                                                  {"sample_rate_hz", "50"},
                                                                  {"cutoff_hz", "6.5"},
                                                                  {"frames", "300"},
                                                                  {"leave_out", "a, b,"}});
  ASSERT_TRUE(options.ok()) << options.error().message;
  EXPECT_EQ(options->method, Method::kFrames);
  EXPECT_EQ(options->selection, Selection::kVote);
  EXPECT_EQ(options->rule, EpisodeRule::kLiteral);
  EXPECT_EQ(options->force_rate, ForceRate::kSigned);
  EXPECT_EQ(options->alignment, AlignmentRule::kElastic);
  EXPECT_EQ(options->joints, JointSource::kMeasured);
  EXPECT_EQ(options->threshold, ThresholdRule::kLocal);
  EXPECT_TRUE(options->cues.orientation && options->cues.extrema);
  EXPECT_EQ(options->ToStrings().at("cues"), "orientation,extrema");
  EXPECT_EQ(options->target, "button");
  EXPECT_EQ(options->sample_rate_hz, 50);
  EXPECT_EQ(options->cutoff_hz, 6.5);
  EXPECT_EQ(options->frames, 300);
  EXPECT_THAT(options->leave_out, ElementsAre("a", "b"));
}

TEST(LearnOptions, ThePaperBringsItsOwnRulesUnlessTheyAreGiven) {
  const Result<LearnOptions> paper = LearnOptions::FromStrings({{"method", "paper"}});
  ASSERT_TRUE(paper.ok());
  EXPECT_EQ(paper->selection, Selection::kVote);
  EXPECT_EQ(paper->force_rate, ForceRate::kSigned);
  const Result<LearnOptions> mixed =
      LearnOptions::FromStrings({{"method", "paper"}, {"selection", "joint"}});
  ASSERT_TRUE(mixed.ok());
  EXPECT_EQ(mixed->selection, Selection::kJoint);
}

TEST(LearnOptions, WrongValuesAreNamedWithWhatIsAllowed) {
  EXPECT_THAT(MessageOf({{"method", "best"}}),
              HasSubstr("option method: \"best\" is not one of auto, paper, frames"));
  EXPECT_THAT(MessageOf({{"alignment", "soft"}}), HasSubstr("not one of markers, elastic"));
  EXPECT_THAT(MessageOf({{"threshold", "1"}}), HasSubstr("not one of trial, local"));
  EXPECT_THAT(MessageOf({{"cues", "extrema,touch"}}),
              HasSubstr("option cues: \"touch\" is not one of orientation, extrema"));
  EXPECT_THAT(MessageOf({{"sample_rate_hz", "0"}}), HasSubstr("\"0\" is not a number from 1"));
  EXPECT_THAT(MessageOf({{"sample_rate_hz", "nan"}}), HasSubstr("\"nan\" is not a number"));
  EXPECT_THAT(MessageOf({{"cutoff_hz", "-1"}}), HasSubstr("\"-1\""));
  EXPECT_THAT(MessageOf({{"cutoff_hz", "30"}}), HasSubstr("at most 0.4 of sample_rate_hz"));
  EXPECT_THAT(MessageOf({{"frames", "1"}}), HasSubstr("at least 2"));
  EXPECT_THAT(MessageOf({{"frames", "2.5"}}), HasSubstr("whole number"));
  EXPECT_EQ(LearnOptions::FromStrings({{"frames", "x"}}).error().field, "frames");
}

TEST(LearnOptions, AMistypedNameGetsTheNearestOne) {
  EXPECT_THAT(MessageOf({{"cutof_hz", "3"}}), HasSubstr("did you mean \"cutoff_hz\"?"));
  EXPECT_THAT(MessageOf({{"colour", "3"}}), HasSubstr("option \"colour\" is not known"));
}

}  // namespace
}  // namespace exemplar::learning
