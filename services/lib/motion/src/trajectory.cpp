#include "trajectory.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::motion {
namespace {

/// The piece that holds `time_s`: frames i and i + 1. Precondition: at least two frames.
Eigen::Index PieceAt(const std::vector<double>& time_s, double time) {
  const auto after = std::upper_bound(time_s.begin() + 1, time_s.end() - 1, time);
  return static_cast<Eigen::Index>(after - time_s.begin()) - 1;
}

}  // namespace

void Evaluate(const JointTrajectory& trajectory, double time_s,
              Eigen::Ref<Eigen::VectorXd> position, Eigen::Ref<Eigen::VectorXd> velocity) {
  assert(position.size() == trajectory.positions.cols());
  const Eigen::Index last = trajectory.positions.rows() - 1;
  if (last == 0 || time_s <= trajectory.time_s.front() || time_s >= trajectory.time_s.back()) {
    const Eigen::Index held = last > 0 && time_s >= trajectory.time_s.back() ? last : 0;
    position = trajectory.positions.row(held).transpose();
    velocity.setZero();
    return;
  }
  const Eigen::Index i = PieceAt(trajectory.time_s, time_s);
  const double h = trajectory.time_s[i + 1] - trajectory.time_s[i];
  const double r = (time_s - trajectory.time_s[i]) / h;
  const double r2 = r * r;
  const double r3 = r2 * r;
  for (Eigen::Index j = 0; j < position.size(); ++j) {
    const double p0 = trajectory.positions(i, j);
    const double p1 = trajectory.positions(i + 1, j);
    const double v0 = trajectory.velocities(i, j);
    const double v1 = trajectory.velocities(i + 1, j);
    position[j] = (2 * r3 - 3 * r2 + 1) * p0 + (r3 - 2 * r2 + r) * h * v0 + (3 * r2 - 2 * r3) * p1 +
                  (r3 - r2) * h * v1;
    velocity[j] = 6 * (r2 - r) * (p0 - p1) / h + (3 * r2 - 4 * r + 1) * v0 + (3 * r2 - 2 * r) * v1;
  }
}

double EvaluateHand(const JointTrajectory& trajectory, double time_s) {
  assert(!trajectory.hand_open.empty());
  const std::vector<double>& time = trajectory.time_s;
  if (time.size() < 2 || time_s <= time.front()) return trajectory.hand_open.front();
  if (time_s >= time.back()) return trajectory.hand_open.back();
  const auto i = static_cast<std::size_t>(PieceAt(time, time_s));
  const double r = (time_s - time[i]) / (time[i + 1] - time[i]);
  return trajectory.hand_open[i] + r * (trajectory.hand_open[i + 1] - trajectory.hand_open[i]);
}

TrajectoryPath::TrajectoryPath(const JointTrajectory& trajectory,
                               const kinematics::RobotModel& model, const kinematics::Chain& chain)
    : trajectory_(trajectory),
      model_(model),
      chain_(chain),
      others_(kinematics::FullJointVector(model, chain, Eigen::VectorXd::Zero(chain.dof()))),
      travel_(Eigen::MatrixXd::Zero(trajectory.positions.rows(), trajectory.positions.cols())),
      position_(chain.dof()),
      velocity_(chain.dof()) {
  for (Eigen::Index i = 0; i + 1 < travel_.rows(); ++i) {
    for (Eigen::Index j = 0; j < travel_.cols(); ++j) {
      travel_(i + 1, j) =
          travel_(i, j) + TravelWithin(i, j, trajectory.time_s[i], trajectory.time_s[i + 1]);
    }
  }
  if (!model.hand || trajectory.hand_open.empty()) return;
  hand_travel_.assign(trajectory.time_s.size(), 0);
  for (std::size_t i = 1; i < hand_travel_.size(); ++i) {
    hand_travel_[i] =
        hand_travel_[i - 1] + std::abs(trajectory.hand_open[i] - trajectory.hand_open[i - 1]);
  }
}

void TrajectoryPath::Position(double s, Eigen::Ref<Eigen::VectorXd> q) const {
  Evaluate(trajectory_, s, position_, velocity_);
  q = others_;
  for (int j = 0; j < chain_.dof(); ++j) q[chain_.joint_indices()[j]] = position_[j];
  if (!hand_travel_.empty()) {
    kinematics::SetHandOpening(model_, EvaluateHand(trajectory_, s), q);
  }
}

double TrajectoryPath::HandTravelTo(double time_s) const {
  const std::vector<double>& time = trajectory_.time_s;
  if (time_s >= time.back()) return hand_travel_.back();
  const auto i = static_cast<std::size_t>(PieceAt(time, time_s));
  const double r = std::max(0.0, (time_s - time[i]) / (time[i + 1] - time[i]));
  return hand_travel_[i] + r * (hand_travel_[i + 1] - hand_travel_[i]);
}

void TrajectoryPath::Travel(double s0, double s1, Eigen::Ref<Eigen::VectorXd> travel) const {
  const std::vector<double>& time = trajectory_.time_s;
  if (time.size() < 2 || s1 <= time.front() || s0 >= time.back()) return;
  if (!hand_travel_.empty()) {
    const double way =
        (HandTravelTo(s1) - HandTravelTo(s0)) * std::abs(model_.hand->open - model_.hand->closed);
    travel[model_.hand->joint] = way;
    for (std::size_t i = 0; i < model_.joints.size(); ++i) {
      const std::optional<kinematics::Mimic>& mimic = model_.joints[i].mimic;
      if (!mimic || mimic->joint != model_.hand->joint) continue;
      travel[static_cast<Eigen::Index>(i)] = std::abs(mimic->multiplier) * way;
    }
  }
  const Eigen::Index first = PieceAt(time, s0);
  const Eigen::Index last = PieceAt(time, s1);
  for (int j = 0; j < chain_.dof(); ++j) {
    double& way = travel[chain_.joint_indices()[j]];
    if (first == last) {
      way = TravelWithin(first, j, s0, s1);
    } else {
      way = TravelWithin(first, j, s0, time[first + 1]) + travel_(last, j) - travel_(first + 1, j) +
            TravelWithin(last, j, time[last], s1);
    }
  }
}

double TrajectoryPath::TravelWithin(Eigen::Index piece, Eigen::Index joint, double begin_s,
                                    double end_s) const {
  const double t0 = trajectory_.time_s[piece];
  const double h = trajectory_.time_s[piece + 1] - t0;
  const double p0 = trajectory_.positions(piece, joint);
  const double p1 = trajectory_.positions(piece + 1, joint);
  const double v0 = trajectory_.velocities(piece, joint);
  const double v1 = trajectory_.velocities(piece + 1, joint);
  const double slope = (p1 - p0) / h;
  // Velocity on the piece: v0 + b r + a r^2, r in [0, 1].
  const double a = 3 * (v0 + v1 - 2 * slope);
  const double b = 6 * slope - 4 * v0 - 2 * v1;
  const auto velocity = [&](double r) { return v0 + r * (b + r * a); };
  const double r0 = std::clamp((begin_s - t0) / h, 0.0, 1.0);
  const double r1 = std::clamp((end_s - t0) / h, 0.0, 1.0);
  double fastest = std::max(std::abs(velocity(r0)), std::abs(velocity(r1)));
  if (std::abs(a) > 1e-15) {
    const double vertex = -b / (2 * a);
    if (vertex > r0 && vertex < r1) fastest = std::max(fastest, std::abs(velocity(vertex)));
  }
  return (r1 - r0) * h * fastest;
}

}  // namespace exemplar::motion
