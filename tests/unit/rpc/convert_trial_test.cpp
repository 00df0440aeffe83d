#include "convert_trial.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "random_values.hpp"

namespace exemplar::rpc {
namespace {

TEST(ConvertTrial, TrialsComeBackSampleForSample) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const demonstration::Trial trial = RandomTrial(rng);
    v1::Trial message;
    ToProto(trial, &message);
    const Result<demonstration::Trial> back = FromProto(message, "trial");
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_TRUE(SameContent(*back, trial));
    EXPECT_EQ(back->source, trial.source);
    EXPECT_EQ(back->start, trial.start);
    EXPECT_EQ(back->prismatic_joints, trial.prismatic_joints);
    EXPECT_EQ(back->notices, trial.notices);
  }
}

TEST(ConvertTrial, AbsentStreamsStayAbsent) {
  demonstration::Trial trial;
  Rng rng(2);
  trial.end_effectors = {RandomPoseSeries(rng)};
  v1::Trial message;
  ToProto(trial, &message);
  const Result<demonstration::Trial> back = FromProto(message, "trial");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_TRUE(SameContent(*back, trial));
  EXPECT_EQ(back->start, Stamp());
}

TEST(ConvertTrial, InfosComeBack) {
  Rng rng(3);
  const api::TrialInfo info = RandomTrialInfo(rng);
  v1::TrialInfo message;
  ToProto(info, &message);
  const api::TrialInfo back = FromProto(message);
  EXPECT_EQ(back.id, info.id);
  EXPECT_EQ(back.skill, info.skill);
  EXPECT_EQ(back.source, info.source);
  EXPECT_EQ(back.submitted, info.submitted);
  EXPECT_EQ(back.duration_s, info.duration_s);
  EXPECT_EQ(back.streams, info.streams);
  EXPECT_EQ(back.samples, info.samples);
  EXPECT_EQ(back.notices, info.notices);
}

TEST(ConvertTrial, SegmentsComeBack) {
  Rng rng(4);
  api::TrialSegments segments;
  segments.id = "trial-1";
  segments.time_s = RandomNumbers(rng, 9);
  segments.segmentation.msv = RandomVector(rng, 9);
  segments.segmentation.touch_term = RandomVector(rng, 9);
  segments.segmentation.c = 1.5;
  segments.segmentation.k = 2.5;
  segments.segmentation.c_tactile = 3.5;
  segments.segmentation.c_replaced = true;
  segments.segmentation.c_along = RandomVector(rng, 9);
  segments.segmentation.high_along = RandomVector(rng, 9);
  segments.segmentation.markers = {{.time_s = 0.1,
                                    .frame = 6,
                                    .kind = learning::MarkerKind::kBeginning,
                                    .cause = "motion",
                                    .score = 2},
                                   {.time_s = 0.5,
                                    .frame = 30,
                                    .kind = learning::MarkerKind::kEnding,
                                    .cause = "touch",
                                    .score = 4}};
  v1::SegmentTrialResponse message;
  ToProto(segments, &message);
  const Result<api::TrialSegments> back = FromProto(message);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->id, segments.id);
  EXPECT_EQ(back->time_s, segments.time_s);
  EXPECT_EQ(back->segmentation.msv, segments.segmentation.msv);
  EXPECT_EQ(back->segmentation.touch_term, segments.segmentation.touch_term);
  EXPECT_EQ(back->segmentation.c, 1.5);
  EXPECT_EQ(back->segmentation.k, 2.5);
  EXPECT_EQ(back->segmentation.c_tactile, 3.5);
  EXPECT_TRUE(back->segmentation.c_replaced);
  EXPECT_EQ(back->segmentation.c_along, segments.segmentation.c_along);
  EXPECT_EQ(back->segmentation.high_along, segments.segmentation.high_along);
  ASSERT_EQ(back->segmentation.markers.size(), 2u);
  EXPECT_EQ(back->segmentation.markers[1].kind, learning::MarkerKind::kEnding);
  EXPECT_EQ(back->segmentation.markers[1].time_s, 0.5);
  EXPECT_EQ(back->segmentation.markers[1].frame, 30);
  EXPECT_EQ(back->segmentation.markers[1].cause, "touch");
  EXPECT_EQ(back->segmentation.markers[1].score, 4);
}

TEST(ConvertTrial, RejectsSeriesOfTheWrongShapeAndNamesThem) {
  Rng rng(5);
  v1::Trial message;
  ToProto(RandomTrial(rng), &message);
  message.mutable_tactile()->add_values(1);
  const Result<demonstration::Trial> scalars = FromProto(message, "trial");
  ASSERT_FALSE(scalars.ok());
  EXPECT_EQ(scalars.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(scalars.error().field, "trial.tactile.values");

  message.Clear();
  ToProto(RandomTrial(rng), &message);
  message.mutable_objects(0)->add_time_s(1);
  const Result<demonstration::Trial> poses = FromProto(message, "trial");
  ASSERT_FALSE(poses.ok());
  EXPECT_EQ(poses.error().field, "trial.objects[0].poses");
}

TEST(ConvertTrial, RejectsAZeroQuaternionAndNamesThePose) {
  v1::PoseSeries message;
  message.add_time_s(0);
  message.add_time_s(1);
  for (int i = 0; i < 14; ++i) message.add_poses(i < 7 ? 1 : 0);
  const auto back = FromProto(message, "tool");
  ASSERT_FALSE(back.ok());
  EXPECT_EQ(back.error().field, "tool.poses[1]");
}

TEST(ConvertTrial, RejectsAPoseThatIsNotFinite) {
  v1::Pose message;
  ToProto(geometry::Pose::Identity(), true, &message);
  message.mutable_position()->set_y(std::nan(""));
  EXPECT_EQ(FromProto(message, "start").error().field, "start.position");
  message.mutable_position()->set_y(0);
  message.mutable_rotation()->set_w(std::nan(""));
  EXPECT_EQ(FromProto(message, "start").error().field, "start.rotation");
  message.mutable_rotation()->set_w(0);
  EXPECT_EQ(FromProto(message, "start").error().field, "start.rotation");
  message.clear_position();
  EXPECT_EQ(FromProto(message, "start").error().field, "start.position");
}

TEST(Utf8, KeepsWhatIsUtf8AndReplacesTheRest) {
  EXPECT_EQ(Utf8("größe – 机器人 🤖"), "größe – 机器人 🤖");
  EXPECT_EQ(Utf8("a\xff"
                 "b\xc3"),
            "a?b?");
  EXPECT_EQ(Utf8("\xed\xa0\x80"), "???");       // a surrogate
  EXPECT_EQ(Utf8("\xc0\x80"), "??");            // an overlong zero
  EXPECT_EQ(Utf8("\xf4\x90\x80\x80"), "????");  // beyond U+10FFFF
}

TEST(Utf8, CutsBetweenCharacters) {
  EXPECT_EQ(Utf8("aöb", 2), "a");
  EXPECT_EQ(Utf8("aöb", 3), "aö");
  EXPECT_EQ(Utf8("aöb", 0), "");
}

}  // namespace
}  // namespace exemplar::rpc
