#include "convert_skill.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "random_values.hpp"

namespace exemplar::rpc {
namespace {

void ExpectSame(const geometry::Pose& a, const geometry::Pose& b) {
  EXPECT_EQ(a.translation, b.translation);
  EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs());
}

void ExpectSame(const std::vector<geometry::Pose>& a, const std::vector<geometry::Pose>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ExpectSame(a[i], b[i]);
}

void ExpectSame(const std::vector<geometry::NamedPose>& a,
                const std::vector<geometry::NamedPose>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_EQ(a[i].has_orientation, b[i].has_orientation);
    ExpectSame(a[i].base_T_object, b[i].base_T_object);
  }
}

void ExpectSame(const demonstration::SkillQuery& a, const demonstration::SkillQuery& b) {
  ExpectSame(a.objects, b.objects);
  ASSERT_EQ(a.start.has_value(), b.start.has_value());
  if (a.start) ExpectSame(*a.start, *b.start);
  EXPECT_EQ(a.start_has_orientation, b.start_has_orientation);
  EXPECT_EQ(a.joint_start_names, b.joint_start_names);
  EXPECT_EQ(a.joint_start, b.joint_start);
}

void ExpectSame(const demonstration::SkillMotion& a, const demonstration::SkillMotion& b) {
  EXPECT_EQ(a.skill, b.skill);
  EXPECT_EQ(a.version, b.version);
  EXPECT_EQ(a.time_s, b.time_s);
  EXPECT_EQ(a.joint_names, b.joint_names);
  EXPECT_EQ(a.joints, b.joints);
  ExpectSame(a.base_T_tool, b.base_T_tool);
  EXPECT_EQ(a.has_orientation, b.has_orientation);
  EXPECT_EQ(a.hand_open, b.hand_open);
  EXPECT_EQ(a.object_names, b.object_names);
  EXPECT_EQ(a.objectivity, b.objectivity);
  EXPECT_EQ(a.sigma_m, b.sigma_m);
  EXPECT_EQ(a.markers_s, b.markers_s);
  ASSERT_EQ(a.contacts.size(), b.contacts.size());
  for (std::size_t i = 0; i < a.contacts.size(); ++i) {
    EXPECT_EQ(a.contacts[i].object, b.contacts[i].object);
    EXPECT_EQ(a.contacts[i].first, b.contacts[i].first);
    EXPECT_EQ(a.contacts[i].last, b.contacts[i].last);
    EXPECT_EQ(a.contacts[i].base_p_contact, b.contacts[i].base_p_contact);
    EXPECT_EQ(a.contacts[i].touch_measured, b.contacts[i].touch_measured);
  }
  ExpectSame(a.objects, b.objects);
  EXPECT_EQ(a.warnings, b.warnings);
}

TEST(ConvertSkill, MotionsComeBackBitForBit) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const demonstration::SkillMotion motion = RandomMotion(rng);
    v1::SkillMotion message;
    ToProto(motion, &message);
    const auto back = FromProto(message, "motion");
    ASSERT_TRUE(back.ok()) << back.error().message;
    ExpectSame(*back, motion);
  }
}

TEST(ConvertSkill, AMotionWithoutOptionalPartsComesBack) {
  demonstration::SkillMotion motion;
  motion.time_s = {0, 1};
  motion.joints.resize(2, 0);
  motion.objectivity.resize(2, 0);
  v1::SkillMotion message;
  ToProto(motion, &message);
  const auto back = FromProto(message, "motion");
  ASSERT_TRUE(back.ok()) << back.error().message;
  ExpectSame(*back, motion);
}

TEST(ConvertSkill, RejectsAMotionWhosePartsDoNotFit) {
  Rng rng(2);
  v1::SkillMotion message;
  const auto field_when = [&](auto spoil) {
    ToProto(RandomMotion(rng), &message);
    spoil(message);
    const auto back = FromProto(message, "motion");
    message.Clear();
    return back.ok() ? std::string("accepted") : back.error().field;
  };
  EXPECT_EQ(field_when([](auto& m) { m.add_joints(1); }), "motion.joints");
  EXPECT_EQ(field_when([](auto& m) { m.add_tool(1); }), "motion.tool");
  EXPECT_EQ(field_when([](auto& m) { m.add_objectivity(1); }), "motion.objectivity");
  EXPECT_EQ(field_when([](auto& m) { m.add_sigma_m(1); }), "motion");
  EXPECT_EQ(field_when([](auto& m) { m.add_hand_open(1); }), "motion");
  EXPECT_EQ(field_when([](auto& m) { m.mutable_contacts(0)->set_last(10'000); }),
            "motion.contacts[0]");
  EXPECT_EQ(field_when([](auto& m) { m.mutable_contacts(0)->set_first(-1); }),
            "motion.contacts[0]");
  EXPECT_EQ(field_when([](auto& m) { m.mutable_objects(1)->clear_name(); }),
            "motion.objects[1].name");
}

TEST(ConvertSkill, QueriesComeBack) {
  Rng rng(3);
  for (int i = 0; i < 100; ++i) {
    demonstration::SkillQuery query = RandomQuery(rng);
    if (i % 3 == 1) query.start.reset(), query.start_has_orientation = true;
    if (i % 3 == 2) query.joint_start.reset(), query.joint_start_names.clear();
    v1::SkillQuery message;
    ToProto(query, &message);
    const auto back = FromProto(message, "query");
    ASSERT_TRUE(back.ok()) << back.error().message;
    ExpectSame(*back, query);
  }
}

TEST(ConvertSkill, RejectsAQueryThatCannotBeMeantAndNamesTheField) {
  Rng rng(4);
  v1::SkillQuery message;
  const auto field_when = [&](auto spoil) {
    demonstration::SkillQuery query = RandomQuery(rng);
    query.start_has_orientation = true;
    query.objects[2].has_orientation = true;
    ToProto(query, &message);
    spoil(message);
    const auto back = FromProto(message, "query");
    message.Clear();
    return back.ok() ? std::string("accepted") : back.error().field;
  };
  EXPECT_EQ(field_when([](auto& m) { m.mutable_objects(2)->mutable_pose()->clear_position(); }),
            "query.objects[2].pose.position");
  EXPECT_EQ(field_when(
                [](auto& m) { m.mutable_objects(2)->mutable_pose()->mutable_rotation()->Clear(); }),
            "query.objects[2].pose.rotation");
  EXPECT_EQ(field_when([](auto& m) { m.mutable_start()->mutable_rotation()->set_x(INFINITY); }),
            "query.start.rotation");
  EXPECT_EQ(field_when([](auto& m) { m.set_joint_start(0, NAN); }), "query.joint_start");
  EXPECT_EQ(field_when([](auto& m) { m.add_joint_start(0); }), "query.joint_start");
}

TEST(ConvertSkill, ReportsComeBack) {
  Rng rng(5);
  for (int i = 0; i < 50; ++i) {
    const learning::SkillReport report = RandomReport(rng);
    v1::SkillReport message;
    ToProto(report, &message);
    const auto back = FromProto(message);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->skill, report.skill);
    EXPECT_EQ(back->version, report.version);
    EXPECT_EQ(back->method, report.method);
    EXPECT_EQ(back->target, report.target);
    EXPECT_EQ(back->options, report.options);
    EXPECT_EQ(back->frames, report.frames);
    EXPECT_EQ(back->duration_s, report.duration_s);
    EXPECT_EQ(back->joint_names, report.joint_names);
    EXPECT_EQ(back->markers_s, report.markers_s);
    ASSERT_EQ(back->contacts.size(), report.contacts.size());
    for (std::size_t c = 0; c < report.contacts.size(); ++c) {
      EXPECT_EQ(back->contacts[c].object, report.contacts[c].object);
      EXPECT_EQ(back->contacts[c].begin_s, report.contacts[c].begin_s);
      EXPECT_EQ(back->contacts[c].end_s, report.contacts[c].end_s);
      EXPECT_EQ(back->contacts[c].object_p_contact, report.contacts[c].object_p_contact);
      EXPECT_EQ(back->contacts[c].spread_m, report.contacts[c].spread_m);
      EXPECT_EQ(back->contacts[c].touch_measured, report.contacts[c].touch_measured);
    }
    EXPECT_EQ(back->contact_begin_s, report.contact_begin_s);
    EXPECT_EQ(back->contact_end_s, report.contact_end_s);
    EXPECT_EQ(back->target_p_contact, report.target_p_contact);
    EXPECT_EQ(back->contact_spread_m, report.contact_spread_m);
    EXPECT_EQ(back->mean_correlation, report.mean_correlation);
    EXPECT_EQ(back->plain_correlation, report.plain_correlation);
    EXPECT_EQ(back->notes, report.notes);
    EXPECT_EQ(back->warnings, report.warnings);
    ASSERT_EQ(back->trials.size(), report.trials.size());
    for (std::size_t t = 0; t < report.trials.size(); ++t) {
      EXPECT_EQ(back->trials[t].id, report.trials[t].id);
      EXPECT_EQ(back->trials[t].source, report.trials[t].source);
      EXPECT_EQ(back->trials[t].duration_s, report.trials[t].duration_s);
      EXPECT_EQ(back->trials[t].candidates, report.trials[t].candidates);
      EXPECT_EQ(back->trials[t].markers_s, report.trials[t].markers_s);
      EXPECT_EQ(back->trials[t].c, report.trials[t].c);
      EXPECT_EQ(back->trials[t].k, report.trials[t].k);
      EXPECT_EQ(back->trials[t].cutoff_hz, report.trials[t].cutoff_hz);
      ExpectSame(back->trials[t].base_T_target, report.trials[t].base_T_target);
      EXPECT_EQ(back->trials[t].notes, report.trials[t].notes);
    }
    ASSERT_EQ(back->methods.size(), 1u);
    EXPECT_EQ(back->methods[0].method, report.methods[0].method);
    EXPECT_EQ(back->methods[0].frechet_m, report.methods[0].frechet_m);
    EXPECT_EQ(back->methods[0].end_error_m, report.methods[0].end_error_m);
    EXPECT_EQ(back->methods[0].frechet_by_trial_m, report.methods[0].frechet_by_trial_m);
    EXPECT_EQ(back->methods[0].chosen, report.methods[0].chosen);
  }
}

TEST(ConvertSkill, EvaluationsComeBack) {
  Rng rng(6);
  const learning::Evaluation evaluation{
      .deviation = {0.1, 0.2, 0.3}, .answer = RandomMotion(rng), .query = RandomQuery(rng)};
  v1::EvaluateSkillResponse message;
  ToProto(evaluation, &message);
  const auto back = FromProto(message);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->deviation.frechet_m, 0.1);
  EXPECT_EQ(back->deviation.end_error_m, 0.2);
  EXPECT_EQ(back->deviation.end_angle_rad, 0.3);
  ExpectSame(back->answer, evaluation.answer);
  ExpectSame(back->query, evaluation.query);
}

TEST(ConvertSkill, SkillAndVersionInfosComeBack) {
  Rng rng(7);
  const api::SkillInfo info{.name = "press",
                            .version = 3,
                            .versions = 5,
                            .method = "frames",
                            .target = "button",
                            .trials = 6,
                            .learned = RandomStamp(rng)};
  v1::SkillInfo message;
  ToProto(info, &message);
  const api::SkillInfo back = FromProto(message);
  EXPECT_EQ(back.name, info.name);
  EXPECT_EQ(back.version, info.version);
  EXPECT_EQ(back.versions, info.versions);
  EXPECT_EQ(back.method, info.method);
  EXPECT_EQ(back.target, info.target);
  EXPECT_EQ(back.trials, info.trials);
  EXPECT_EQ(back.learned, info.learned);

  const api::VersionInfo version{.version = 2,
                                 .current = true,
                                 .method = "paper",
                                 .trial_ids = RandomTexts(rng, 4),
                                 .learned = RandomStamp(rng)};
  v1::SkillVersionInfo version_message;
  ToProto(version, &version_message);
  const api::VersionInfo version_back = FromProto(version_message);
  EXPECT_EQ(version_back.version, version.version);
  EXPECT_EQ(version_back.current, version.current);
  EXPECT_EQ(version_back.method, version.method);
  EXPECT_EQ(version_back.trial_ids, version.trial_ids);
  EXPECT_EQ(version_back.learned, version.learned);
}

}  // namespace
}  // namespace exemplar::rpc
