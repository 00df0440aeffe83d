#include "executor/following_path.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace exemplar::executor {
namespace {

// Of the share: it grows from so long before the contact to so long before it, and shrinks likewise
// after the release.
constexpr double kShareFrom_s = 1.4;
constexpr double kShareTo_s = 0.4;
constexpr double kShareAfter_s = 0.15;
constexpr double kShareGone_s = 1.0;
/// Between the frames of a blended path.
constexpr double kFrame_s = 0.008;
constexpr double kShortestBlend_s = 0.2;
constexpr double kLongestBlend_s = 0.8;
/// The blend is over so long before the contact.
constexpr double kBeforeContact_s = 0.1;
constexpr double kDamping = 1e-3;  // of the pseudoinverse, m or rad
constexpr double kSpares_m[] = {0.06, 0.03, 0.015, 0.008, 0.004};
/// Ways back out are not looked at more finely than this: a bound of what any point of the robot
/// moves from one to the next.
constexpr double kFinestRetreat_m = 1e-3;
/// The way back out may lag behind the path by so much.
constexpr double kRetreatLag_s = 0.25;

struct Smooth {
  double value = 0;
  double rate = 0;
};

/// From 0 to 1 between two times, at rest and without acceleration at both.
Smooth SmoothStep(double t, double begin, double end) {
  if (t <= begin || end <= begin) return {t < begin ? 0.0 : (end <= begin ? 1.0 : 0.0), 0};
  if (t >= end) return {1, 0};
  const double d = end - begin;
  const double s = (t - begin) / d;
  return {s * s * s * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) * (1 - s) / d};
}

std::size_t FrameAt(const std::vector<double>& time_s, double t) {
  const auto after = std::upper_bound(time_s.begin(), time_s.end(), t);
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - time_s.begin() - 1, 0));
}

/// The rest of a path, from the second to the last but one of whose frames accelerations are told.
void AddAccelerations(FollowedPath& path) {
  const motion::JointTrajectory& t = path.trajectory;
  const Eigen::Index n = t.velocities.rows();
  path.acceleration = Eigen::MatrixXd::Zero(n, t.velocities.cols());
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    const double h =
        t.time_s[static_cast<std::size_t>(i) + 1] - t.time_s[static_cast<std::size_t>(i)];
    const Eigen::RowVectorXd a = ((t.velocities.row(i + 1) - t.velocities.row(i)) / h).cwiseAbs();
    path.acceleration.row(i) = path.acceleration.row(i).cwiseMax(a);
    path.acceleration.row(i + 1) = path.acceleration.row(i + 1).cwiseMax(a);
  }
}

void AddJoints(const kinematics::Chain& chain, FollowedPath& path) {
  const motion::JointTrajectory& t = path.trajectory;
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, chain.dof());
  path.joints_m.clear();
  for (Eigen::Index i = 0; i < t.positions.rows(); ++i) {
    (void)chain.ToolPoseAndJacobian(t.positions.row(i).transpose(), jacobian);
    Eigen::Matrix<double, 6, 6> square = jacobian * jacobian.transpose();
    square.diagonal().array() += kDamping * kDamping;
    const Eigen::Matrix<double, 6, 6> inverse = square.inverse();
    path.joints_m.emplace_back((jacobian.transpose() * inverse).leftCols(3));
  }
}

void AddDepths(const kinematics::Chain& chain, const TargetPress& press, FollowedPath& path) {
  path.depth_m.clear();
  for (Eigen::Index i = 0; i < path.trajectory.positions.rows(); ++i) {
    const geometry::Pose base_T_tool = chain.ToolPose(path.trajectory.positions.row(i).transpose());
    path.depth_m.push_back(press.base_inward.dot(
        base_T_tool.translation - path.base_p_object.row(i).transpose() - press.object_p_contact));
  }
}

/// What a touch at the first place where one counts sends the tool back by, at each frame.
std::vector<double> LargestRetreats(const FollowedPath& path, const TargetPress& press,
                                    const GuardZone& zone) {
  const std::vector<double>& time = path.trajectory.time_s;
  std::vector<double> retreat_m(time.size(), 0.0);
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (time[i] < zone.begin_s) continue;
    const double back = path.depth_m[i] - (press.first_depth_m - press.lift_m);
    if (back <= 0 && time[i] > zone.deepest_s) break;
    for (std::size_t k = i; k < time.size() && time[k] <= time[i] + kRetreatLag_s; ++k) {
      retreat_m[k] = std::max(retreat_m[k], back);
    }
  }
  return retreat_m;
}

/// The path with the tool led back out by so much.
motion::JointTrajectory LedOut(const FollowedPath& path, const TargetPress& press,
                               const std::vector<double>& retreat_m) {
  motion::JointTrajectory out = path.trajectory;
  const Eigen::Index n = out.positions.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (retreat_m[k] == 0) continue;
    out.positions.row(i) -= retreat_m[k] * (path.joints_m[k] * press.base_inward).transpose();
  }
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (retreat_m[k - 1] == 0 && retreat_m[k + 1] == 0) continue;
    out.velocities.row(i) = (out.positions.row(i + 1) - out.positions.row(i - 1)) /
                            (out.time_s[k + 1] - out.time_s[k - 1]);
  }
  return out;
}

/// A path as the collision checker sees it.
class Swept final : public collision::JointPath {
 public:
  Swept(const kinematics::RobotDescription& robot, const motion::JointTrajectory& trajectory)
      : robot_(robot),
        trajectory_(trajectory),
        others_(kinematics::FullJointVector(robot.model, robot.chain,
                                            Eigen::VectorXd::Zero(robot.chain.dof()))),
        position_(robot.chain.dof()),
        velocity_(robot.chain.dof()) {}

  void Position(double s, Eigen::Ref<Eigen::VectorXd> q) const override {
    motion::Evaluate(trajectory_, s, position_, velocity_);
    q = others_;
    for (int j = 0; j < robot_.chain.dof(); ++j) q[robot_.chain.joint_indices()[j]] = position_[j];
    if (!trajectory_.hand_open.empty()) {
      kinematics::SetHandOpening(robot_.model, motion::EvaluateHand(trajectory_, s), q);
    }
  }

  void Travel(double s0, double s1, Eigen::Ref<Eigen::VectorXd> travel) const override {
    const std::vector<double>& time = trajectory_.time_s;
    const std::size_t first = FrameAt(time, s0);
    for (std::size_t i = first; i + 1 < time.size() && time[i] < s1; ++i) {
      const double from = std::max(s0, time[i]);
      const double part = std::max(0.0, std::min(s1, time[i + 1]) - from);
      const double h = time[i + 1] - time[i];
      const auto k = static_cast<Eigen::Index>(i);
      for (int j = 0; j < robot_.chain.dof(); ++j) {
        // Of a cubic no speed is more than the largest of those of its control points.
        const double v0 = trajectory_.velocities(k, j);
        const double v1 = trajectory_.velocities(k + 1, j);
        const double way = trajectory_.positions(k + 1, j) - trajectory_.positions(k, j);
        const double middle = 3 * way / h - v0 - v1;
        travel[robot_.chain.joint_indices()[j]] +=
            part * std::max({std::abs(v0), std::abs(v1), std::abs(middle)});
      }
      if (trajectory_.hand_open.empty() || !robot_.model.hand) continue;
      const kinematics::Hand& hand = *robot_.model.hand;
      travel[hand.joint] += part / h * std::abs(hand.open - hand.closed) *
                            std::abs(trajectory_.hand_open[i + 1] - trajectory_.hand_open[i]);
    }
  }

 private:
  const kinematics::RobotDescription& robot_;
  const motion::JointTrajectory& trajectory_;
  const Eigen::VectorXd others_;
  mutable Eigen::VectorXd position_, velocity_;
};

}  // namespace

double TargetTimes::ShareAt(double time_s) const {
  const double share =
      SmoothStep(time_s, contact_s - kShareFrom_s, contact_s - kShareTo_s).value *
      (1 - SmoothStep(time_s, release_s + kShareAfter_s, release_s + kShareGone_s).value);
  return std::clamp(share, 0.0, 1.0);
}

double TargetTimes::begin_s() const { return contact_s - kShareFrom_s; }
double TargetTimes::end_s() const { return release_s + kShareGone_s; }

FollowedPath MakeFollowedPath(const kinematics::Chain& chain, motion::JointTrajectory trajectory,
                              const TargetTimes& times, const TargetTrack& track, Duration start,
                              const TargetPress* press) {
  FollowedPath path;
  path.trajectory = std::move(trajectory);
  const std::size_t frames = path.trajectory.time_s.size();
  path.base_p_object.resize(static_cast<Eigen::Index>(frames), 3);
  for (std::size_t i = 0; i < frames; ++i) {
    const double t = path.trajectory.time_s[i];
    path.base_p_object.row(static_cast<Eigen::Index>(i)) =
        track.PositionAt(start + FromSeconds(t)).transpose();
    path.share.push_back(times.ShareAt(t));
  }
  AddJoints(chain, path);
  AddAccelerations(path);
  if (press != nullptr) AddDepths(chain, *press, path);
  return path;
}

FollowedPath Blend(const kinematics::Chain& chain, const FollowedPath& path,
                   const FollowedPath& fresh, const motion::JointTrajectory& first, double ahead_s,
                   double begin_s, const TargetTimes& times, const TargetPress* press) {
  const double end_s = first.duration_s();
  const double over_s = begin_s + std::clamp(times.contact_s - kBeforeContact_s - begin_s,
                                             kShortestBlend_s, kLongestBlend_s);
  const double back_s = times.release_s + kShareAfter_s;
  const auto frames = static_cast<Eigen::Index>(std::ceil(end_s / kFrame_s)) + 1;
  const Eigen::Index dof = first.positions.cols();
  FollowedPath out;
  motion::JointTrajectory& t = out.trajectory;
  t.joint_names = first.joint_names;
  t.positions.resize(frames, dof);
  t.velocities.resize(frames, dof);
  out.base_p_object.resize(frames, 3);
  Eigen::VectorXd q(dof), v(dof), other_q(dof), other_v(dof);
  for (Eigen::Index i = 0; i < frames; ++i) {
    const double s = end_s * static_cast<double>(i) / static_cast<double>(frames - 1);
    t.time_s.push_back(s);
    const Smooth to = SmoothStep(s, begin_s, over_s);
    const Smooth back = SmoothStep(s, back_s, end_s);
    motion::Evaluate(path.trajectory, s, q, v);
    motion::Evaluate(fresh.trajectory, s + ahead_s, other_q, other_v);
    v += to.value * (other_v - v) + to.rate * (other_q - q);
    q += to.value * (other_q - q);
    motion::Evaluate(first, s, other_q, other_v);
    v += back.value * (other_v - v) + back.rate * (other_q - q);
    q += back.value * (other_q - q);
    t.positions.row(i) = q.transpose();
    t.velocities.row(i) = v.transpose();
    if (!first.hand_open.empty()) t.hand_open.push_back(motion::EvaluateHand(first, s));
    const auto object = [](const FollowedPath& of, double at) {
      const std::vector<double>& time = of.trajectory.time_s;
      const std::size_t k = std::min(FrameAt(time, at), time.size() - 2);
      const double r = std::clamp((at - time[k]) / (time[k + 1] - time[k]), 0.0, 1.0);
      const auto row = static_cast<Eigen::Index>(k);
      return Eigen::RowVector3d((1 - r) * of.base_p_object.row(row) +
                                r * of.base_p_object.row(row + 1));
    };
    out.base_p_object.row(i) =
        (1 - to.value) * object(path, s) + to.value * object(fresh, s + ahead_s);
    out.share.push_back(times.ShareAt(s));
  }
  AddJoints(chain, out);
  AddAccelerations(out);
  if (press != nullptr) AddDepths(chain, *press, out);
  return out;
}

std::optional<GuardZone> ZoneOf(const FollowedPath& path, const TargetPress& press,
                                const TargetTimes& times) {
  const std::vector<double>& time = path.trajectory.time_s;
  std::size_t deepest = 0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (time[i] < times.contact_s || time[i] > times.release_s + kShareAfter_s) continue;
    if (deepest == 0 || path.depth_m[i] > path.depth_m[deepest]) deepest = i;
  }
  if (deepest == 0 || path.depth_m[deepest] <= press.first_depth_m) return std::nullopt;
  std::size_t first = deepest;
  while (first > 0 && path.depth_m[first - 1] >= press.first_depth_m) --first;
  GuardZone zone;
  zone.begin_s = time[first];
  zone.deepest_s = time[deepest];
  return zone;
}

bool KeepsLimits(const motion::JointTrajectory& trajectory,
                 const std::vector<kinematics::JointLimits>& limits, double begin_s) {
  for (std::size_t i = FrameAt(trajectory.time_s, begin_s); i + 1 < trajectory.time_s.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double h = trajectory.time_s[i + 1] - trajectory.time_s[i];
    for (std::size_t j = 0; j < limits.size(); ++j) {
      const auto c = static_cast<Eigen::Index>(j);
      const double v = trajectory.velocities(k, c);
      const double a = (trajectory.velocities(k + 1, c) - v) / h;
      const double q = trajectory.positions(k, c);
      if (std::abs(v) > limits[j].velocity || std::abs(a) > limits[j].acceleration ||
          q < limits[j].lower || q > limits[j].upper) {
        return false;
      }
    }
  }
  return true;
}

namespace {

/// Proves clearances along a followed path and along the ways that a touch may send it.
class FollowedProof {
 public:
  FollowedProof(const kinematics::RobotDescription& robot,
                const collision::CollisionChecker& checker, const motion::PlannedMotion& plan,
                double begin_s, const FollowedPath& path, const TargetPress* press)
      : robot_(robot),
        checker_(checker),
        plan_(plan),
        begin_s_(begin_s),
        path_(path),
        press_(press) {}

  /// Between two times, as planned.
  bool Keeps(double required_m, double from_s, double to_s) const {
    return Keeps(path_.trajectory, required_m, from_s, to_s);
  }

  /// False where the press does not come near its target.
  bool FindWayOut(const TargetTimes& times) {
    const std::optional<GuardZone> zone = ZoneOf(path_, *press_, times);
    if (!zone) return false;
    out_begin_s_ = zone->begin_s;
    out_end_s_ = zone->begin_s;
    retreat_m_ = LargestRetreats(path_, *press_, *zone);
    const motion::JointTrajectory farthest = LedOut(path_, *press_, retreat_m_);
    const Eigen::VectorXd levers = checker_.LongestLevers();
    for (Eigen::Index i = 0; i < farthest.positions.rows(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (retreat_m_[k] > 0) out_end_s_ = path_.trajectory.time_s[k];
      double moved_m = 0;
      for (int j = 0; j < robot_.chain.dof(); ++j) {
        moved_m += levers[robot_.chain.joint_indices()[j]] *
                   std::abs(farthest.positions(i, j) - path_.trajectory.positions(i, j));
      }
      way_m_ = std::max(way_m_, moved_m);
    }
    return true;
  }

  /// Everywhere between these shares of the longest way out.
  bool KeepsOut(double required_m, double from_share, double to_share) const {
    const double middle = 0.5 * (from_share + to_share);
    const double around_m = 0.5 * (to_share - from_share) * way_m_;
    std::vector<double> retreat_m = retreat_m_;
    for (double& back : retreat_m) back *= middle;
    if (Keeps(LedOut(path_, *press_, retreat_m), required_m + around_m, out_begin_s_, out_end_s_)) {
      return true;
    }
    if (around_m < kFinestRetreat_m) return false;
    return KeepsOut(required_m, from_share, middle) && KeepsOut(required_m, middle, to_share);
  }

 private:
  bool Keeps(const motion::JointTrajectory& along, double required_m, double from_s,
             double to_s) const {
    std::vector<double> edges = motion::AllowedEdges(plan_);
    edges.push_back(from_s);
    edges.push_back(to_s);
    from_s = std::max(from_s, begin_s_);
    to_s = std::max(to_s, begin_s_);
    for (double& edge : edges) edge = std::clamp(edge, from_s, to_s);
    std::sort(edges.begin(), edges.end());
    const Swept swept(robot_, along);
    for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
      if (edges[i + 1] - edges[i] <= 0) continue;
      const double middle = 0.5 * (edges[i] + edges[i + 1]);
      const std::vector<collision::AllowedTouch> allowed =
          motion::AllowedAt(plan_, robot_.touch_links, middle);
      if (!checker_.KeepsClear(swept, edges[i], edges[i + 1], required_m, allowed)) return false;
    }
    return true;
  }

  const kinematics::RobotDescription& robot_;
  const collision::CollisionChecker& checker_;
  const motion::PlannedMotion& plan_;
  const double begin_s_;
  const FollowedPath& path_;
  const TargetPress* press_;
  std::vector<double> retreat_m_;
  double out_begin_s_ = 0;
  double out_end_s_ = 0;
  double way_m_ = 0;  ///< a bound of what any point of the robot moves by on the longest way out
};

}  // namespace

bool Prove(const kinematics::RobotDescription& robot, const collision::CollisionChecker& checker,
           const motion::PlannedMotion& plan, double required_clearance_m, double begin_s,
           const TargetTimes& times, const TargetPress* press, FollowedPath& path) {
  const double end_s = path.trajectory.duration_s();
  FollowedProof proof(robot, checker, plan, begin_s, path, press);
  if (!proof.Keeps(required_clearance_m, 0, end_s)) return false;
  if (press != nullptr &&
      !(proof.FindWayOut(times) && proof.KeepsOut(required_clearance_m, 0, 1))) {
    return false;
  }
  path.spare_m = 0;
  for (const double spare_m : kSpares_m) {
    const double required_m = required_clearance_m + spare_m;
    if (!proof.Keeps(required_m, times.begin_s(), std::min(times.end_s(), end_s))) continue;
    if (press != nullptr && !proof.KeepsOut(required_m, 0, 1)) continue;
    path.spare_m = spare_m;
    break;
  }
  return true;
}

}  // namespace exemplar::executor
