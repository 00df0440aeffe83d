// Contacts found from motion alone, on generated presses whose times and places are known.

#include "meetings.hpp"

#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::learning {
namespace {

// A smooth arrival is seen as rest this early: it moves less than kStill_m in these frames.
constexpr int kFewFrames = 10;
constexpr double kStill_m = 2e-3;

struct Truth {
  MeetingTrial trial;
  std::vector<Stay> presses;
};

class Path {
 public:
  explicit Path(const Eigen::Vector3d& start) : points_{start} {}
  void Move(const Eigen::Vector3d& goal, int frames) {
    const Eigen::Vector3d from = points_.back();
    for (int i = 1; i <= frames; ++i) {
      const double s = static_cast<double>(i) / frames;
      points_.push_back(from + s * s * s * (10 + s * (-15 + 6 * s)) * (goal - from));
    }
  }
  void Rest(int frames) { points_.insert(points_.end(), frames, points_.back()); }
  int frame() const { return static_cast<int>(points_.size()) - 1; }
  Eigen::MatrixXd Rows() const {
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(points_.size()), 3);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      rows.row(static_cast<Eigen::Index>(i)) = points_[i].transpose();
    }
    return rows;
  }

 private:
  std::vector<Eigen::Vector3d> points_;
};

// Reaches above each point (of the object's axes), waits, presses, rests and retracts.
Truth Press(Rng& rng, const std::vector<Eigen::Vector3d>& object_p_points, double turn) {
  const Eigen::Matrix3d base_R_object =
      Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d above(0, 0, 0.1);
  Path path(Eigen::Vector3d(-0.3 + rng.Uniform(-0.05, 0.05), rng.Uniform(-0.05, 0.05), 0.3));
  Truth truth;
  for (const Eigen::Vector3d& point : object_p_points) {
    const Eigen::Vector3d place = base_R_object * point;
    path.Move(place + above, 70 + static_cast<int>(rng.Below(30)));
    path.Rest(10 + static_cast<int>(rng.Below(10)));
    path.Move(place, 60 + static_cast<int>(rng.Below(30)));
    Stay press{.first = path.frame()};
    path.Rest(20 + static_cast<int>(rng.Below(20)));
    press.last = path.frame();
    truth.presses.push_back(press);
    path.Move(place + above, 50 + static_cast<int>(rng.Below(20)));
  }
  truth.trial.shifted = path.Rows();
  truth.trial.turned = truth.trial.shifted * base_R_object;
  return truth;
}

std::vector<Truth> Presses(std::uint64_t seed, const std::vector<Eigen::Vector3d>& points) {
  Rng rng(seed);
  std::vector<Truth> truths;
  for (int j = 0; j < 5; ++j) truths.push_back(Press(rng, points, 0.4 * j));
  return truths;
}

std::vector<MeetingTrial> TrialsOf(const std::vector<Truth>& truths) {
  std::vector<MeetingTrial> trials;
  for (const Truth& truth : truths) trials.push_back(truth.trial);
  return trials;
}

void ExpectPresses(const std::vector<Truth>& truths, const std::vector<Eigen::Vector3d>& points) {
  const std::vector<Meeting> meetings = FindMeetings(TrialsOf(truths));
  ASSERT_EQ(meetings.size(), points.size());
  for (std::size_t k = 0; k < meetings.size(); ++k) {
    EXPECT_LT((meetings[k].place - points[k]).norm(), 1e-9);
    EXPECT_LT(meetings[k].spread_m, 1e-9);
    for (std::size_t j = 0; j < truths.size(); ++j) {
      EXPECT_NEAR(meetings[k].stays[j].first, truths[j].presses[k].first, kFewFrames);
      const Eigen::MatrixXd& path = truths[j].trial.shifted;
      EXPECT_LT(
          (path.row(meetings[k].stays[j].first) - path.row(truths[j].presses[k].first)).norm(),
          kStill_m);
      EXPECT_NEAR(meetings[k].stays[j].last, truths[j].presses[k].last, kFewFrames);
    }
  }
}

TEST(Meetings, FindThePressRatherThanThePauseAboveOrTheRetreat) {
  const std::vector<Eigen::Vector3d> points = {Eigen::Vector3d::Zero()};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) ExpectPresses(Presses(seed, points), points);
}

TEST(Meetings, FindTwoPressesOfOneTurnedObject) {
  const std::vector<Eigen::Vector3d> points = {{0.03, 0.01, 0}, {-0.03, 0.01, 0}};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) ExpectPresses(Presses(seed, points), points);
}

TEST(Meetings, FindTwoPressesOfOneButton) {
  const std::vector<Eigen::Vector3d> points = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) ExpectPresses(Presses(seed, points), points);
}

TEST(Meetings, AreFoundInOneTrialAlone) {
  const std::vector<Eigen::Vector3d> points = {Eigen::Vector3d::Zero()};
  std::vector<Truth> truths = Presses(3, points);
  truths.resize(1);
  ExpectPresses(truths, points);
}

TEST(Meetings, AreFilledInWhereOneTrialShowsNone) {
  const std::vector<Eigen::Vector3d> points = {Eigen::Vector3d::Zero()};
  std::vector<MeetingTrial> trials = TrialsOf(Presses(4, points));
  Path past(Eigen::Vector3d(-0.3, 0, 0.3));
  past.Move({0.3, 0.02, -0.3}, 200);
  trials.push_back({past.Rows(), past.Rows()});
  const std::vector<Meeting> meetings = FindMeetings(trials);
  ASSERT_EQ(meetings.size(), 1u);
  EXPECT_EQ(meetings[0].stays.size(), trials.size());
  EXPECT_NEAR(meetings[0].stays.back().still, 100, 10);
}

TEST(Meetings, AreWhereAReachEndsAtItsTarget) {
  Path path(Eigen::Vector3d(-0.4, 0.1, 0.2));
  path.Rest(20);
  path.Move(Eigen::Vector3d::Zero(), 90);
  path.Rest(30);
  const std::vector<Stay> stays = FindStays(path.Rows());
  ASSERT_EQ(stays.size(), 1u);
  EXPECT_NEAR(stays[0].first, 110, kFewFrames + 6);
}

TEST(Meetings, AreNotFoundFarFromThePath) {
  Path path(Eigen::Vector3d(5.4, 0.1, 0.2));
  path.Move({5, 0, 0}, 90);
  path.Rest(30);
  path.Move({5.4, 0.1, 0.2}, 90);
  EXPECT_TRUE(FindStays(path.Rows()).empty());
}

TEST(Meetings, JoinStrokesIntoOneLongMeeting) {
  std::vector<MeetingTrial> trials;
  std::vector<int> ends;
  for (int j = 0; j < 3; ++j) {
    Path path(Eigen::Vector3d(-0.5, 0.02 * j, 0.3));
    path.Move(Eigen::Vector3d::Zero(), 100);
    for (int stroke = 0; stroke < 8; ++stroke) {
      path.Move({-0.1, 0, 0.05}, 25);
      path.Move(Eigen::Vector3d::Zero(), 25);
    }
    ends.push_back(path.frame());
    path.Move({-0.5, 0, 0.3}, 100);
    trials.push_back({path.Rows(), {}});
  }
  const std::vector<Meeting> meetings = FindMeetings(trials);
  ASSERT_EQ(meetings.size(), 1u);
  for (std::size_t j = 0; j < trials.size(); ++j) {
    EXPECT_NEAR(meetings[0].stays[j].first, 100, 2 * kFewFrames);
    EXPECT_NEAR(meetings[0].stays[j].last, ends[j], 2 * kFewFrames);
  }
}

}  // namespace
}  // namespace exemplar::learning
