// Claims of the paper that need a whole skill (PAPER.md section 9); docs/claims.md lists all.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "pressing_arm.hpp"

namespace exemplar::learning {
namespace {

using demonstration::SkillMotion;
using demonstration::SkillQuery;
using Eigen::Vector3d;

const auto kArm = std::make_shared<PressingArm>();

/// A stretch of a made motion: to a point with minimum jerk, pressing all the while or not.
struct Leg {
  double duration_s = 0;
  Vector3d to = Vector3d::Zero();
  double touch_n = 0;
};

/// Joints of the arm, or tool poses, along the legs at 100 Hz.
NamedTrial MakeTrial(const std::string& id, const Vector3d& start, const std::vector<Leg>& legs,
                     bool joints) {
  constexpr double kStep = 0.01;
  NamedTrial named;
  named.id = id;
  named.trial.source = id + ".csv";
  std::vector<double> time_s;
  std::vector<Vector3d> path;
  std::vector<double> touch;
  Vector3d from = start;
  double begin = 0;
  for (const Leg& leg : legs) {
    for (double t = static_cast<double>(time_s.size()) * kStep; t < begin + leg.duration_s;
         t += kStep) {
      time_s.push_back(t);
      path.push_back(from + MinimumJerk((t - begin) / leg.duration_s) * (leg.to - from));
      touch.push_back(leg.touch_n);
    }
    begin += leg.duration_s;
    from = leg.to;
  }
  const auto n = static_cast<Eigen::Index>(path.size());
  Eigen::MatrixXd q(n, 3);
  Eigen::MatrixXd force(n, 1);
  std::vector<geometry::Pose> tool;
  for (Eigen::Index i = 0; i < n; ++i) {
    q.row(i) = kArm->Solve(path[static_cast<std::size_t>(i)]).transpose();
    force(i, 0) = touch[static_cast<std::size_t>(i)];
    tool.push_back(kArm->ToolPose(q.row(i).transpose()));
  }
  if (joints) {
    named.trial.joints = {kArm->joint_names(), time_s, q};
  } else {
    named.trial.end_effectors.push_back({.name = "", .time_s = time_s, .base_T_frame = tool});
  }
  named.trial.tactile = {{"finger"}, time_s, force};
  return named;
}

void AddObject(NamedTrial& named, const std::string& name,
               const std::function<Vector3d(double)>& place) {
  demonstration::PoseSeries object;
  object.name = name;
  object.time_s = named.trial.tactile.time_s;
  for (const double t : object.time_s) {
    object.base_T_frame.push_back(geometry::Pose::FromTranslation(place(t)));
  }
  named.trial.objects.push_back(std::move(object));
}

constexpr double kAbove_m = 0.08;

/// Over the button, straight down onto it, up again and back.
std::vector<NamedTrial> DownwardPresses(bool joints) {
  Rng rng(9);
  const Vector3d start(.45, 0, .45);
  std::vector<NamedTrial> trials;
  for (const Vector3d& button : ButtonPlaces()) {
    const Vector3d above = button + Vector3d(0, 0, kAbove_m);
    trials.push_back(MakeTrial("press-" + std::to_string(trials.size()), start,
                               {{.3, start},
                                {rng.Uniform(1.0, 1.4), above},
                                {rng.Uniform(.5, .7), button},
                                {rng.Uniform(.4, .6), button, 5},
                                {rng.Uniform(.4, .6), above},
                                {rng.Uniform(.8, 1.1), start},
                                {.3, start}},
                               joints));
    AddObject(trials.back(), "button", [&](double) { return button; });
  }
  return trials;
}

Skill LearnBy(const std::vector<NamedTrial>& trials, Method method) {
  const Result<LearnOptions> options =
      LearnOptions::FromStrings({{"method", method == Method::kPaper ? "paper" : "frames"}});
  const Result<Skill> skill = LearnSkill(trials, *options, kArm);
  if (!skill.ok()) throw std::runtime_error(skill.error().message);
  return *skill;
}

SkillMotion Ask(const Skill& skill, const SkillQuery& query) {
  const Result<SkillMotion> motion = Answer(skill, query);
  if (!motion.ok()) throw std::runtime_error(motion.error().message);
  return *motion;
}

const Vector3d& ToolAt(const SkillMotion& motion, int frame) {
  return motion.base_T_tool[static_cast<std::size_t>(frame)].translation;
}

// The onset itself lies between two samples.
int Middle(const demonstration::Contact& contact) { return (contact.first + contact.last) / 2; }

TEST(Claims, ObjectivityRisesFromNearZeroAtRestToOneAtContact) {
  for (const Method method : {Method::kPaper, Method::kFrames}) {
    const SkillMotion motion = Ask(LearnBy(MakePresses(6), method), ButtonAt(Vector3d(.6, 0, .2)));
    ASSERT_FALSE(motion.contacts.empty());
    const Eigen::VectorXd upsilon = motion.objectivity.col(0);
    EXPECT_LT(upsilon[0], 0.02);
    EXPECT_GT(upsilon[motion.contacts[0].first], 0.98);
    double highest = 0;
    for (int i = 0; i <= motion.contacts[0].first; ++i) {
      EXPECT_GT(upsilon[i], highest - 0.02) << "frame " << i;
      highest = std::max(highest, upsilon[i]);
    }
  }
}

// Within 8 degrees of straight down over the last four centimetres, wherever the button is.
TEST(Claims, TheDirectionOfApproachIsTheTrialsAnywhere) {
  constexpr double kMost = 8 * std::numbers::pi / 180;
  for (const Method method : {Method::kPaper, Method::kFrames}) {
    const Skill skill = LearnBy(DownwardPresses(method == Method::kPaper), method);
    for (double x = .45; x < .8; x += .1) {
      for (double y = -.3; y < .35; y += .15) {
        const Vector3d button(x, y, .2);
        const SkillMotion motion = Ask(skill, ButtonAt(button));
        ASSERT_FALSE(motion.contacts.empty());
        const int contact = motion.contacts[0].first;
        int before = contact;
        while (before > 0 && (ToolAt(motion, before) - ToolAt(motion, contact)).norm() < .04) {
          --before;
        }
        const Vector3d way = (ToolAt(motion, contact) - ToolAt(motion, before)).normalized();
        EXPECT_LT(std::acos(std::clamp(-way.z(), -1.0, 1.0)), kMost) << button.transpose();
      }
    }
  }
}

TEST(Claims, TwoPressesInOneTrialMeetTheirButtons) {
  const auto places = [](int j) {
    const Vector3d& left = ButtonPlaces()[static_cast<std::size_t>(j)];
    return std::pair(left, Vector3d(.62 - .02 * j, -.1 + .06 * j, .18 + .01 * j));
  };
  Rng rng(4);
  const Vector3d start(.45, 0, .45);
  std::vector<NamedTrial> trials;
  for (int j = 0; j < 6; ++j) {
    const auto [left, right] = places(j);
    const Vector3d up(0, 0, kAbove_m);
    trials.push_back(MakeTrial("twice-" + std::to_string(j), start,
                               {{.3, start},
                                {rng.Uniform(1.0, 1.4), left + up},
                                {rng.Uniform(.5, .7), left},
                                {.5, left, 5},
                                {rng.Uniform(.4, .6), left + up},
                                {rng.Uniform(.9, 1.2), right + up},
                                {rng.Uniform(.5, .7), right},
                                {.5, right, 5},
                                {rng.Uniform(.4, .6), right + up},
                                {rng.Uniform(.8, 1.1), start},
                                {.3, start}},
                               false));
    AddObject(trials.back(), "left", [&, at = left](double) { return at; });
    AddObject(trials.back(), "right", [&, at = right](double) { return at; });
  }
  const Skill skill = LearnBy(trials, Method::kFrames);
  SkillQuery query;
  query.objects = {{"left", geometry::Pose::FromTranslation(Vector3d(.58, .05, .2))},
                   {"right", geometry::Pose::FromTranslation(Vector3d(.56, .04, .2))}};
  const SkillMotion motion = Ask(skill, query);
  ASSERT_EQ(motion.contacts.size(), 2u);
  EXPECT_EQ(motion.contacts[0].object, "left");
  EXPECT_EQ(motion.contacts[1].object, "right");
  ASSERT_EQ(skill.report().contacts.size(), 2u);
  EXPECT_EQ(skill.report().contacts[0].object, "left");
  EXPECT_EQ(skill.report().contacts[1].object, "right");
  EXPECT_LT(skill.report().contacts[0].end_s, skill.report().contacts[1].begin_s);
  for (std::size_t k = 0; k < 2; ++k) {
    const Vector3d& button = query.objects[k].base_T_object.translation;
    EXPECT_LT((ToolAt(motion, Middle(motion.contacts[k])) - button).norm(), 2e-3) << k;
  }
}

TEST(Claims, AnObjectThatMovesIsMetWhereItIsAtContact) {
  Rng rng(5);
  const Vector3d start(.45, 0, .45);
  std::vector<NamedTrial> trials;
  for (const Vector3d& button : ButtonPlaces()) {
    const double reach_s = rng.Uniform(1.4, 1.8);
    trials.push_back(MakeTrial("moved-" + std::to_string(trials.size()), start,
                               {{.3, start},
                                {reach_s, button},
                                {.5, button, 5},
                                {rng.Uniform(.8, 1.1), start},
                                {.3, start}},
                               false));
    // The belt brings it and stops shortly before the press.
    const Vector3d from = button - Vector3d(.05, .15, 0);
    AddObject(trials.back(), "button", [&](double t) {
      return Vector3d(from + MinimumJerk(t / (.1 + reach_s)) * (button - from));
    });
  }
  for (const Method method : {Method::kPaper, Method::kFrames}) {
    const Skill skill = LearnBy(trials, method);
    const Vector3d button(.6, .05, .2);
    const SkillMotion motion = Ask(skill, ButtonAt(button));
    ASSERT_FALSE(motion.contacts.empty());
    EXPECT_LT((ToolAt(motion, Middle(motion.contacts[0])) - button).norm(), 3e-3);
  }
}

}  // namespace
}  // namespace exemplar::learning
