#include "exemplar/learning/skill.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "exemplar/learning/inspection.hpp"
#include "pressing_arm.hpp"

namespace exemplar::learning {
namespace {

using demonstration::Contact;
using demonstration::SkillMotion;
using demonstration::SkillQuery;
using Eigen::Vector3d;
using testing::Contains;
using testing::HasSubstr;

const std::shared_ptr<const PressingArm> kArm = std::make_shared<PressingArm>();

Skill Learn(const std::vector<NamedTrial>& trials, Method method) {
  LearnOptions options;
  options.method = method;
  Result<Skill> skill = LearnSkill(trials, options, kArm);
  EXPECT_TRUE(skill.ok()) << (skill.ok() ? "" : skill.error().message);
  return *skill;
}

SkillMotion Ask(const Skill& skill, const SkillQuery& query) {
  Result<SkillMotion> motion = Answer(skill, query);
  EXPECT_TRUE(motion.ok()) << (motion.ok() ? "" : motion.error().message);
  return *motion;
}

/// Distance of the tool from the button, at worst over the contact but for its first and last four
/// frames, within which the onset lies.
double ContactError(const SkillMotion& motion, const Vector3d& button) {
  EXPECT_EQ(motion.contacts.size(), 1u);
  double worst = 0;
  EXPECT_GT(motion.contacts[0].last - motion.contacts[0].first, 15);
  for (int i = motion.contacts[0].first + 4; i <= motion.contacts[0].last - 4; ++i) {
    worst = std::max(worst,
                     (motion.base_T_tool[static_cast<std::size_t>(i)].translation - button).norm());
  }
  return worst;
}

double JointwiseError(const SkillMotion& motion, const Vector3d& button) {
  const int i = motion.contacts.at(0).first + 4;
  return (kArm->ToolPose(motion.joints.row(i).transpose()).translation - button).norm();
}

std::vector<Vector3d> Workspace() {
  std::vector<Vector3d> places;
  for (const double x : {.35, .5, .65, .8}) {
    for (const double y : {-.35, -.1, .1, .35}) {
      for (const double z : {.1, .3}) places.emplace_back(x, y, z);
    }
  }
  return places;
}

double EndError(const SkillMotion& a, const SkillMotion& b) {
  return (a.base_T_tool.back().translation - b.base_T_tool.back().translation).norm();
}

// Fig. 10: the joint-wise solution's error is zero at the trials and grows between and beyond them;
// the blended one's is zero everywhere.
TEST(PaperMethod, MeetsTheButtonOverTheWholeWorkspaceWhereJointwiseRbfDoesNot) {
  const std::vector<NamedTrial> trials = MakePresses(6);
  const Skill skill = Learn(trials, Method::kPaper);
  for (std::size_t j = 0; j < trials.size(); ++j) {
    EXPECT_LT(JointwiseError(Ask(skill, ButtonAt(ButtonPlaces()[j])), ButtonPlaces()[j]), 1e-9);
  }
  const Vector3d inside(.6, 0, .2);
  const Vector3d outside(.35, -.45, .2);
  EXPECT_GT(JointwiseError(Ask(skill, ButtonAt(inside)), inside), 1e-3);
  EXPECT_GT(JointwiseError(Ask(skill, ButtonAt(outside)), outside),
            3 * JointwiseError(Ask(skill, ButtonAt(inside)), inside));
  for (const Vector3d& place : Workspace()) {
    EXPECT_LT(ContactError(Ask(skill, ButtonAt(place)), place), 1e-9) << place.transpose();
  }
}

TEST(FramesMethod, MeetsTheButtonOverTheWholeWorkspace) {
  const Skill skill = Learn(MakePresses(6), Method::kFrames);
  for (const Vector3d& place : Workspace()) {
    const SkillMotion motion = Ask(skill, ButtonAt(place));
    // The trials' mean contact point is taken at the onset, which lies between two samples.
    EXPECT_LT(ContactError(motion, place), 5e-5) << place.transpose();
    const Contact& contact = motion.contacts[0];
    EXPECT_LT((contact.base_p_contact - place).norm(), 5e-5);
    EXPECT_LT((motion.base_T_tool[static_cast<std::size_t>(contact.first)].translation -
               contact.base_p_contact)
                  .norm(),
              1e-12);
    EXPECT_TRUE(motion.contacts[0].touch_measured);
  }
}

TEST(PaperMethod, IsAbsoluteAtRestAndObjectiveInContact) {
  const SkillMotion motion =
      Ask(Learn(MakePresses(6), Method::kPaper), ButtonAt(Vector3d(.6, 0, .2)));
  ASSERT_EQ(motion.objectivity.cols(), 1);
  const Contact& contact = motion.contacts.at(0);
  EXPECT_LT(motion.objectivity(0, 0), .02);
  for (int i = contact.first; i <= contact.last; ++i)
    EXPECT_NEAR(motion.objectivity(i, 0), 1, 1e-6);
  for (int i = 1; i <= contact.first; ++i) {
    EXPECT_GE(motion.objectivity(i, 0), motion.objectivity(i - 1, 0) - .02) << "frame " << i;
  }
}

TEST(PaperMethod, AnswersATrialsOwnPlaceWithTheTrial) {
  const std::vector<NamedTrial> trials = MakePresses(6);
  const Skill skill = Learn(trials, Method::kPaper);
  for (const NamedTrial& trial : trials) {
    const Result<Evaluation> evaluation = Evaluate(skill, trial.trial);
    ASSERT_TRUE(evaluation.ok()) << evaluation.error().message;
    EXPECT_LT(evaluation->deviation.frechet_m, .01);
    EXPECT_LT(evaluation->deviation.end_error_m, 1e-3);
  }
}

TEST(PaperMethod, SaysThatItDoesNotUseTheStart) {
  const Skill skill = Learn(MakePresses(4), Method::kPaper);
  SkillQuery query = ButtonAt(ButtonPlaces()[0]);
  EXPECT_THAT(Ask(skill, query).warnings, testing::IsEmpty());
  query.start = geometry::Pose{Ask(skill, query).base_T_tool[0].translation + Vector3d(0, .03, 0),
                               Ask(skill, query).base_T_tool[0].rotation};
  EXPECT_THAT(Ask(skill, query).warnings,
              testing::ElementsAre(
                  HasSubstr("method=paper does not use the start: the motion begins 0.030 m")));
}

TEST(PaperMethod, SaysThatTrialsWithoutJointsGiveAPlainRbfOnPaths) {
  const Skill paths = Learn(MakePresses(4, {.joints = false}), Method::kPaper);
  EXPECT_THAT(paths.report().notes,
              Contains(HasSubstr("the paper's method is a plain RBF on paths")));
  const Skill joints = Learn(MakePresses(4), Method::kPaper);
  EXPECT_THAT(joints.report().notes, testing::Not(Contains(HasSubstr("plain RBF"))));
}

// PAPER.md section 5.4: x_final = x_absolute + Upsilon (x_object - x_absolute), at every frame.
TEST(PaperMethod, BlendsBothSolutionsByObjectivity) {
  const Skill skill = Learn(MakePresses(6), Method::kPaper);
  const Vector3d place(.6, .05, .2);
  const SkillMotion motion = Ask(skill, ButtonAt(place));
  const std::optional<InspectedQuery> paths = InspectAt(skill, place);
  ASSERT_TRUE(paths.has_value());
  double apart = 0;
  for (std::size_t i = 0; i < motion.base_T_tool.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::RowVector3d absolute = paths->absolute.row(row);
    const Eigen::RowVector3d objective = paths->objective.row(row);
    const Eigen::RowVector3d blended =
        absolute + motion.objectivity(row, 0) * (objective - absolute);
    EXPECT_LT((blended.transpose() - motion.base_T_tool[i].translation).norm(), 1e-12);
    apart = std::max(apart, (objective - absolute).norm());
  }
  EXPECT_GT(apart, 1e-3);
}

TEST(PaperMethod, LastsAsLongAsTheTrialsOnAverage) {
  const std::vector<NamedTrial> trials = MakePresses(5);
  double mean_s = 0;
  for (const NamedTrial& trial : trials) mean_s += trial.trial.duration_s() / 5;
  const SkillMotion motion = Ask(Learn(trials, Method::kPaper), ButtonAt(ButtonPlaces()[1]));
  EXPECT_NEAR(motion.time_s.back(), mean_s, 1e-9);
}

// Eq. 3 is not positive for a trial that rests nearly all the time.
TEST(LearnSkill, SaysWhereTheCutOffHadToComeFromTheData) {
  std::vector<NamedTrial> trials = MakePresses(2);
  for (NamedTrial& named : trials) {
    demonstration::Trial& trial = named.trial;
    for (double& t : trial.joints.time_s) t += 20;
    trial.joints.time_s.front() = 0;
    trial.tactile.time_s = trial.joints.time_s;
  }
  LearnOptions options;
  options.method = Method::kPaper;
  const Result<Skill> skill = LearnSkill(trials, options, kArm);
  ASSERT_TRUE(skill.ok()) << skill.error().message;
  for (const SkillReport::TrialPart& part : skill->report().trials) {
    EXPECT_THAT(part.notes, Contains(HasSubstr("c of Eq. 3 is not positive")));
    EXPECT_GT(part.c, 0);
  }
  const Skill usual = Learn(MakePresses(2), Method::kPaper);
  for (const SkillReport::TrialPart& part : usual.report().trials) {
    EXPECT_THAT(part.notes, testing::Not(Contains(HasSubstr("Eq. 3"))));
  }
}

TEST(FramesMethod, BeginsExactlyAtTheGivenStart) {
  const Skill skill = Learn(MakePresses(6, {.joints = false}), Method::kFrames);
  SkillQuery query = ButtonAt(Vector3d(.6, 0, .2));
  query.start = geometry::Pose{Vector3d(.4, .3, .5), Eigen::Quaterniond(.8, .6, 0, 0)};
  const SkillMotion motion = Ask(skill, query);
  EXPECT_LT((motion.base_T_tool[0].translation - query.start->translation).norm(), 1e-12);
  EXPECT_LT(geometry::AngleBetween(motion.base_T_tool[0].rotation, query.start->rotation), 1e-9);
  EXPECT_LT(ContactError(motion, Vector3d(.6, 0, .2)), 5e-5);
  for (std::size_t i = 1; i < motion.base_T_tool.size(); ++i) {
    EXPECT_LT((motion.base_T_tool[i].translation - motion.base_T_tool[i - 1].translation).norm(),
              .05);
  }
}

TEST(FramesMethod, SaysWhenNoStartWasGiven) {
  const Skill skill = Learn(MakePresses(4), Method::kFrames);
  const SkillMotion motion = Ask(skill, ButtonAt(ButtonPlaces()[0]));
  EXPECT_THAT(motion.warnings, Contains(HasSubstr("no start was given")));
}

TEST(FramesMethod, BeginsAtTheGivenJoints) {
  const Skill skill = Learn(MakePresses(6), Method::kFrames);
  SkillQuery query = ButtonAt(Vector3d(.6, 0, .2));
  query.joint_start_names = {"elbow", "yaw", "shoulder"};
  query.joint_start = Vector3d(-1.2, .3, .9);
  const SkillMotion motion = Ask(skill, query);
  EXPECT_LT((motion.joints.row(0).transpose() - Vector3d(.3, .9, -1.2)).norm(), 1e-12);
  EXPECT_LT((motion.base_T_tool[0].translation - kArm->ToolPose(Vector3d(.3, .9, -1.2)).translation)
                .norm(),
            1e-12);
}

// A handle that was turned: what touches lies off the object's origin and turns with it.
TEST(FramesMethod, TurnsWithTheObjectWherePaperOnlyShifts) {
  std::vector<NamedTrial> trials;
  PressOptions options{.joints = false, .object_p_contact = {.08, 0, .02}};
  const double turns[] = {0, .7, -.5, 1.1, .3, -1};
  for (std::size_t j = 0; j < 6; ++j) {
    options.base_R_object = Eigen::AngleAxisd(turns[j], Vector3d::UnitZ());
    trials.push_back(MakePress("turn-" + std::to_string(j), ButtonPlaces()[j], options));
  }
  SkillQuery query = ButtonAt(Vector3d(.6, .05, .2));
  query.objects[0].base_T_object.rotation = Eigen::AngleAxisd(-.9, Vector3d::UnitZ());
  const Vector3d wanted = query.objects[0].base_T_object * options.object_p_contact;
  const SkillMotion frames = Ask(Learn(trials, Method::kFrames), query);
  EXPECT_LT((frames.contacts.at(0).base_p_contact - wanted).norm(), 5e-5);
  EXPECT_LT(ContactError(frames, wanted), 1e-4);
  const SkillMotion paper = Ask(Learn(trials, Method::kPaper), query);
  EXPECT_GT(ContactError(paper, wanted), .01);
  const Skill chosen = Learn(trials, Method::kAuto);
  EXPECT_EQ(chosen.report().method, "frames");
}

// A press is downward wherever the button is turned: the orientation keeps to the world although
// the object turns.
TEST(FramesMethod, KeepsOrientationToTheWorldWhereTheTrialsDid) {
  std::vector<NamedTrial> trials;
  PressOptions options{.joints = false};
  const double turns[] = {0, 1.4, -.8, 2.1, .6, -1.6};
  for (std::size_t j = 0; j < 6; ++j) {
    options.base_R_object = Eigen::AngleAxisd(turns[j], Vector3d::UnitZ());
    trials.push_back(MakePress("turn-" + std::to_string(j), ButtonPlaces()[j], options));
    for (geometry::Pose& pose : trials.back().trial.end_effectors[0].base_T_frame) {
      pose.rotation = Eigen::AngleAxisd(3.0, Vector3d::UnitX());
    }
  }
  SkillQuery query = ButtonAt(Vector3d(.6, .05, .2));
  query.objects[0].base_T_object.rotation = Eigen::AngleAxisd(1.0, Vector3d::UnitZ());
  const SkillMotion motion = Ask(Learn(trials, Method::kFrames), query);
  EXPECT_LT(geometry::AngleBetween(motion.base_T_tool.back().rotation,
                                   Eigen::Quaterniond(Eigen::AngleAxisd(3.0, Vector3d::UnitX()))),
            .01);
}

TEST(LearnSkill, ReportsTouchContactAndMethods) {
  const Skill skill = Learn(MakePresses(6), Method::kAuto);
  const SkillReport& report = skill.report();
  EXPECT_EQ(report.target, "button");
  EXPECT_EQ(report.trials.size(), 6u);
  EXPECT_EQ(report.joint_names, kArm->joint_names());
  ASSERT_TRUE(report.contact_begin_s.has_value());
  EXPECT_LT(report.contact_spread_m, 5e-5);
  EXPECT_EQ(report.methods.size(), 3u);
  EXPECT_EQ(std::count_if(report.methods.begin(), report.methods.end(),
                          [](const MethodScore& m) { return m.chosen; }),
            1);
}

TEST(LearnSkill, FindsContactWithoutTouchWhereThePathsMeetTheObject) {
  const Skill skill = Learn(MakePresses(6, {.joints = false, .touch = false}), Method::kFrames);
  const SkillMotion motion = Ask(skill, ButtonAt(Vector3d(.6, 0, .2)));
  ASSERT_EQ(motion.contacts.size(), 1u);
  EXPECT_FALSE(motion.contacts[0].touch_measured);
  EXPECT_LT((motion.contacts[0].base_p_contact - Vector3d(.6, 0, .2)).norm(), .005);
}

TEST(LearnSkill, WorksForOneTrialOnePlaceAndPlacesInAPlane) {
  for (const Method method : {Method::kPaper, Method::kFrames, Method::kAuto}) {
    const Skill one = Learn(MakePresses(1), method);
    EXPECT_THAT(one.report().warnings, Contains(HasSubstr("one trial only")));
    EXPECT_LT(ContactError(Ask(one, ButtonAt(Vector3d(.55, .1, .2))), Vector3d(.55, .1, .2)), 5e-5);

    PressOptions options;
    std::vector<NamedTrial> one_place, table;
    for (int j = 0; j < 4; ++j) {
      options.arch_m = .05 + .01 * j;
      options.reach_s = 1 + .1 * j;
      one_place.push_back(MakePress("p" + std::to_string(j), ButtonPlaces()[0], options));
      table.push_back(MakePress("t" + std::to_string(j),
                                Vector3d(.5 + .1 * (j % 2), -.2 + .15 * j, .2), options));
    }
    const Skill still = Learn(one_place, method);
    EXPECT_LT(ContactError(Ask(still, ButtonAt(ButtonPlaces()[0])), ButtonPlaces()[0]), 5e-5);
    const Skill flat = Learn(table, method);
    EXPECT_LT(ContactError(Ask(flat, ButtonAt(Vector3d(.58, .02, .2))), Vector3d(.58, .02, .2)),
              5e-5);
  }
}

TEST(LearnSkill, CountsTheSameTrialOnce) {
  std::vector<NamedTrial> trials = MakePresses(4);
  trials.push_back(trials[1]);
  trials.back().id = "again";
  const Skill skill = Learn(trials, Method::kPaper);
  EXPECT_EQ(skill.report().trials.size(), 4u);
  EXPECT_THAT(skill.report().warnings, Contains(HasSubstr("\"again\" is the same as \"press-1\"")));
}

TEST(LearnSkill, NamesWhatDoesNotFit) {
  const auto error = [](std::vector<NamedTrial> trials, const LearnOptions& options) {
    const Result<Skill> skill = LearnSkill(trials, options, kArm);
    EXPECT_FALSE(skill.ok());
    return skill.ok() ? std::string() : skill.error().message;
  };
  EXPECT_THAT(error({}, {}), HasSubstr("no trial"));

  std::vector<NamedTrial> joints = MakePresses(3);
  joints[1].trial.joints.names[2] = "ellbow";
  EXPECT_THAT(error(joints, {}), HasSubstr("press-1"));

  std::vector<NamedTrial> objects = MakePresses(3);
  objects[2].trial.objects.clear();
  EXPECT_THAT(error(objects, {}), HasSubstr("\"press-2\" has no object \"button\""));

  LearnOptions options;
  options.target = "buton";
  EXPECT_THAT(error(MakePresses(3), options), HasSubstr("did you mean \"button\""));
  options = {};
  options.leave_out = {"press-7"};
  EXPECT_THAT(error(MakePresses(3), options), HasSubstr("no trial is called \"press-7\""));
}

TEST(LearnSkill, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  const Result<Skill> skill = LearnSkill(MakePresses(3), {}, kArm, {}, stop.get_token());
  ASSERT_FALSE(skill.ok());
  EXPECT_EQ(skill.error().code, ErrorCode::kCancelled);
}

TEST(Answer, NamesWhatIsWrongWithTheQuery) {
  const Skill skill = Learn(MakePresses(4), Method::kFrames);
  const auto error = [&](const SkillQuery& query) {
    const Result<SkillMotion> motion = Answer(skill, query);
    EXPECT_FALSE(motion.ok());
    return motion.ok() ? Error{} : motion.error();
  };
  SkillQuery query = ButtonAt(ButtonPlaces()[0]);
  query.objects[0].name = "buttom";
  EXPECT_EQ(error(query).code, ErrorCode::kNotFound);
  EXPECT_THAT(error(query).message, HasSubstr("did you mean \"button\""));
  EXPECT_THAT(error({}).message, HasSubstr("lacks object \"button\""));
  query = ButtonAt(Vector3d(0, std::nan(""), 0));
  EXPECT_EQ(error(query).field, "objects[0].position");
  query = ButtonAt(ButtonPlaces()[0]);
  query.objects[0].base_T_object.rotation.coeffs().setZero();
  EXPECT_EQ(error(query).field, "objects[0].orientation");
  query = ButtonAt(ButtonPlaces()[0]);
  query.objects.push_back(query.objects[0]);
  EXPECT_THAT(error(query).message, HasSubstr("twice"));
  query = ButtonAt(ButtonPlaces()[0]);
  query.joint_start = Eigen::VectorXd::Zero(2);
  EXPECT_EQ(error(query).field, "joint_start");
}

TEST(Answer, WarnsOfFarExtrapolationAndAssumedOrientation) {
  const Skill skill = Learn(MakePresses(6), Method::kFrames);
  EXPECT_THAT(Ask(skill, ButtonAt(Vector3d(3, 0, .2))).warnings,
              Contains(HasSubstr("far extrapolation")));
  EXPECT_THAT(Ask(skill, ButtonAt(Vector3d(.6, 0, .2))).warnings,
              testing::Not(Contains(HasSubstr("far extrapolation"))));
  SkillQuery query = ButtonAt(Vector3d(.6, 0, .2));
  query.objects[0].has_orientation = false;
  const SkillMotion motion = Ask(skill, query);
  EXPECT_THAT(motion.warnings, Contains(HasSubstr("mean orientation is assumed")));
  EXPECT_TRUE(motion.objects.at(0).has_orientation);
}

TEST(Answer, PredictsALargerErrorFurtherFromTheTrials) {
  const Skill skill = Learn(MakePresses(6, {.joints = false}), Method::kFrames);
  const auto sigma = [&](const Vector3d& p) {
    const SkillMotion motion = Ask(skill, ButtonAt(p));
    return motion.sigma_m[motion.sigma_m.size() / 4];
  };
  EXPECT_LT(sigma(Vector3d(.6, 0, .2)), sigma(Vector3d(.9, .6, .6)));
}

TEST(SkillJson, AnElasticAlignmentReadsBackAndKeepsItsMarkers) {
  LearnOptions options;
  options.alignment = AlignmentRule::kElastic;
  options.threshold = ThresholdRule::kLocal;
  const Result<Skill> learned = LearnSkill(MakePresses(4), options, kArm);
  ASSERT_TRUE(learned.ok());
  EXPECT_GT(learned->alignment().knots_s.size(), 50u);
  EXPECT_EQ(learned->report().markers_s.size(), learned->alignment().trials[0].chosen.size() + 2);
  const Result<Skill> again = SkillFromJson(ToJson(*learned), kArm);
  ASSERT_TRUE(again.ok());
  const SkillQuery query = ButtonAt(Vector3d(.6, 0, .2));
  const SkillMotion motion = Ask(*learned, query);
  const SkillMotion same = Ask(*again, query);
  EXPECT_EQ(motion.markers_s, same.markers_s);
  EXPECT_EQ(motion.markers_s, learned->report().markers_s);
  EXPECT_EQ(EndError(motion, same), 0);
  EXPECT_LT(ContactError(motion, Vector3d(.6, 0, .2)), 2e-3);
  EXPECT_EQ(again->alignment().trials[0].segmentation.high_along,
            learned->alignment().trials[0].segmentation.high_along);
  EXPECT_EQ(again->report().contacts.size(), learned->report().contacts.size());
}

TEST(SkillJson, ReadBackAnswersTheSame) {
  for (const Method method : {Method::kPaper, Method::kFrames}) {
    const Skill skill = Learn(MakePresses(5), method).Named("press", 3);
    const std::string text = ToJson(skill).dump();
    const Result<Skill> read = SkillFromJson(nlohmann::json::parse(text), kArm);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(ToJson(skill.report()), ToJson(read->report()));
    const SkillMotion a = Ask(skill, ButtonAt(Vector3d(.6, .1, .2)));
    const SkillMotion b = Ask(*read, ButtonAt(Vector3d(.6, .1, .2)));
    EXPECT_EQ(a.skill, "press");
    EXPECT_EQ(b.version, 3);
    EXPECT_EQ(demonstration::ToCsv(a), demonstration::ToCsv(b));
    EXPECT_EQ(EndError(a, b), 0);
  }
}

TEST(SkillJson, DamagedTextIsAnError) {
  const nlohmann::json good = ToJson(Learn(MakePresses(3), Method::kPaper));
  EXPECT_FALSE(SkillFromJson(nlohmann::json::object()).ok());
  for (const char* path :
       {"/report/method", "/alignment/trials/0/own/base_T_tool", "/alignment/time_s", "/model",
        "/alignment/trials/1/own/joints/values"}) {
    nlohmann::json bad = good;
    bad[nlohmann::json::json_pointer(path)] = nlohmann::json::array({1, 2});
    const Result<Skill> read = SkillFromJson(bad, kArm);
    ASSERT_FALSE(read.ok()) << path;
    EXPECT_EQ(read.error().code, ErrorCode::kDataLoss) << path;
  }
}

}  // namespace
}  // namespace exemplar::learning
