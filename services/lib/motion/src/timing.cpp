#include "timing.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "path_clock.hpp"
#include "smooth_cubic.hpp"
#include "spline.hpp"

namespace exemplar::motion {
namespace {

constexpr double kGridStep_s = 0.008;
constexpr int kMaxGridPoints = 6000;
/// Bound of the rate at which the path speed itself changes, 1/s: full speed within an eighth of a
/// second.
constexpr double kPathAcceleration_per_s = 8;
/// Room for what happens between grid points.
constexpr double kLimitShare = 0.97;
constexpr double kLineStep_s = 0.01;
/// Rounds of slowing down where it is needed, before all is slowed down for what is left; and by
/// how much more than needed, for what a slow stretch itself costs at its ends.
constexpr int kSlowDownRounds = 8;
constexpr double kSlowDownMore = 1.02;

/// One step of the path: all pairs (x, u) of squared path speed and path acceleration with
/// a x + b u <= c for every row.
struct StepConstraints {
  Eigen::ArrayXd a, b, c;

  /// The u that x allows, cut to [low, high]; false when there is none.
  bool Accelerations(double x, double& low, double& high) const {
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      const double room = c[i] - a[i] * x;
      if (b[i] > 1e-12) {
        high = std::min(high, room / b[i]);
      } else if (b[i] < -1e-12) {
        low = std::max(low, room / b[i]);
      } else if (room < 0) {
        return false;
      }
    }
    return low <= high;
  }
};

class SpeedProfile {
 public:
  SpeedProfile(const std::vector<PathSpline::Point>& points, double step_s,
               const std::vector<kinematics::JointLimits>& limits, double speed_scale)
      : step_(step_s), steps_(static_cast<int>(points.size()) - 1) {
    const auto n = static_cast<Eigen::Index>(limits.size());
    highest_.resize(points.size());
    constraints_.resize(static_cast<std::size_t>(steps_));
    for (std::size_t i = 0; i < points.size(); ++i) {
      double x = speed_scale * speed_scale;
      for (Eigen::Index j = 0; j < n; ++j) {
        const double velocity = std::abs(points[i].first[j]);
        if (velocity > 1e-12) {
          x = std::min(x, std::pow(kLimitShare * limits[j].velocity / velocity, 2));
        }
      }
      highest_[i] = x;
    }
    highest_.front() = 0;
    highest_.back() = 0;
    for (int i = 0; i < steps_; ++i) {
      StepConstraints& rows = constraints_[i];
      rows.a.resize(4 * n);
      rows.b.resize(4 * n);
      rows.c.resize(4 * n);
      const PathSpline::Point& here = points[i];
      const PathSpline::Point& next = points[i + 1];
      for (Eigen::Index j = 0; j < n; ++j) {
        // At the step's begin, and at its end where x has become x + 2 step u.
        const double at_end = next.first[j] + 2 * step_ * next.second[j];
        rows.a.segment<4>(4 * j) << here.second[j], -here.second[j], next.second[j],
            -next.second[j];
        rows.b.segment<4>(4 * j) << here.first[j], -here.first[j], at_end, -at_end;
        rows.c.segment<4>(4 * j).setConstant(kLimitShare * limits[j].acceleration);
      }
    }
  }

  /// Squared path speed at every grid point.
  std::vector<double> Solve() const {
    // Backwards: from which speeds the end can be reached at rest.
    std::vector<double> reachable(highest_);
    for (int i = steps_ - 1; i >= 0; --i) {
      double good = 0;
      double bad = highest_[i];
      double u = 0;
      if (BestAcceleration(i, bad, reachable[i + 1], u)) {
        good = bad;
      } else {
        for (int bisection = 0; bisection < 50; ++bisection) {
          const double middle = 0.5 * (good + bad);
          (BestAcceleration(i, middle, reachable[i + 1], u) ? good : bad) = middle;
        }
      }
      reachable[i] = good;
    }
    // Forwards: as fast as that allows.
    std::vector<double> x(highest_.size(), 0.0);
    for (int i = 0; i < steps_; ++i) {
      double u = 0;
      if (!BestAcceleration(i, std::min(x[i], reachable[i]), reachable[i + 1], u)) u = 0;
      x[i + 1] = std::clamp(x[i] + 2 * step_ * u, 0.0, reachable[i + 1]);
    }
    return x;
  }

 private:
  /// The largest u that leads from x to at most `next`.
  bool BestAcceleration(int i, double x, double next, double& u) const {
    double low = std::max(-x / (2 * step_), -kPathAcceleration_per_s);
    double high = std::min((next - x) / (2 * step_), kPathAcceleration_per_s);
    if (!constraints_[i].Accelerations(x, low, high)) return false;
    u = high;
    return true;
  }

  double step_;
  int steps_;
  std::vector<double> highest_;
  std::vector<StepConstraints> constraints_;
};

void Stretch(JointTrajectory& trajectory, double factor) {
  for (double& t : trajectory.time_s) t *= factor;
  trajectory.velocities /= factor;
}

/// How much longer a stretch must take for its limits to hold, 1: they do.
double NeededFactor(const LimitUse& use) {
  return std::max({use.velocity, std::sqrt(use.acceleration), std::cbrt(use.jerk)}) / kLimitShare;
}

/// Slows all of it down until the limits hold on the cubic pieces themselves.
void FitLimits(JointTrajectory& trajectory, const std::vector<kinematics::JointLimits>& limits) {
  const double factor = NeededFactor(MeasureLimitUse(trajectory, limits));
  if (factor > 1) Stretch(trajectory, factor * (1 + 1e-9));
}

/// The use of the limits on the piece from frame i to the next.
LimitUse PieceUse(const JointTrajectory& trajectory,
                  const std::vector<kinematics::JointLimits>& limits, Eigen::Index i) {
  LimitUse use;
  const double h = trajectory.time_s[i + 1] - trajectory.time_s[i];
  for (Eigen::Index j = 0; j < trajectory.positions.cols(); ++j) {
    const double slope = (trajectory.positions(i + 1, j) - trajectory.positions(i, j)) / h;
    const double v0 = trajectory.velocities(i, j);
    const double v1 = trajectory.velocities(i + 1, j);
    // On a cubic piece the jerk is constant and the acceleration linear: its extremes are at the
    // ends.
    const double a0 = (6 * slope - 4 * v0 - 2 * v1) / h;
    const double a1 = (2 * v0 + 4 * v1 - 6 * slope) / h;
    double velocity = std::max(std::abs(v0), std::abs(v1));
    if ((a0 < 0) != (a1 < 0)) {
      velocity = std::max(velocity, std::abs(v0 - 0.5 * a0 * a0 * h / (a1 - a0)));
    }
    use.velocity = std::max(use.velocity, velocity / limits[j].velocity);
    use.acceleration =
        std::max(use.acceleration, std::max(std::abs(a0), std::abs(a1)) / limits[j].acceleration);
    use.jerk = std::max(use.jerk, std::abs(a1 - a0) / h / limits[j].jerk);
  }
  return use;
}

/// Slows down where a limit is broken and a little around it, a few times. True when none is.
bool SlowDownWhereNeeded(PathClock& clock, JointTrajectory& trajectory,
                         const std::vector<kinematics::JointLimits>& limits) {
  std::vector<double> factors(clock.time_s.size(), 1.0);
  bool broken = false;
  for (std::size_t i = 0; i + 1 < factors.size(); ++i) {
    const double needed = NeededFactor(PieceUse(trajectory, limits, static_cast<Eigen::Index>(i)));
    if (needed <= 1) continue;
    broken = true;
    factors[i] = std::max(factors[i], kSlowDownMore * needed);
    factors[i + 1] = kSlowDownMore * needed;
  }
  if (!broken) return true;
  SlowDown(clock, factors);
  trajectory.time_s = clock.time_s;
  return false;
}

}  // namespace

JointTrajectory TimePath(std::span<const double> time_s,
                         const Eigen::Ref<const Eigen::MatrixXd>& joints,
                         const std::vector<std::string>& joint_names,
                         const std::vector<kinematics::JointLimits>& limits, double speed_scale,
                         std::vector<double>& frame_time_s) {
  const double duration = time_s.back() - time_s.front();
  const int points =
      std::clamp(static_cast<int>(std::ceil(duration / kGridStep_s)) + 1,
                 std::min(2 * static_cast<int>(time_s.size()), kMaxGridPoints), kMaxGridPoints);
  const double step = duration / (points - 1);
  const PathSpline spline(time_s, joints);
  std::vector<PathSpline::Point> grid;
  grid.reserve(static_cast<std::size_t>(points));
  for (int i = 0; i < points; ++i) grid.push_back(spline.At(time_s.front() + i * step));
  const std::vector<double> x = SpeedProfile(grid, step, limits, speed_scale).Solve();

  PathClock clock = MakeClock(x, step);
  JointTrajectory out;
  out.joint_names = joint_names;
  out.time_s = clock.time_s;
  out.positions.resize(static_cast<Eigen::Index>(clock.place.size()), joints.cols());
  for (std::size_t i = 0; i < clock.place.size(); ++i) {
    out.positions.row(static_cast<Eigen::Index>(i)) =
        spline.At(time_s.front() + clock.place[i]).value.transpose();
  }
  const Eigen::MatrixXd on_path = out.positions;
  JoinSmoothly(out);
  for (int round = 0; round < kSlowDownRounds; ++round) {
    if (SlowDownWhereNeeded(clock, out, limits)) break;
    out.positions = on_path;
    JoinSmoothly(out);
  }
  FitLimits(out, limits);
  const double stretched = out.duration_s() / clock.time_s.back();

  frame_time_s.resize(time_s.size());
  for (std::size_t k = 0; k < time_s.size(); ++k) {
    frame_time_s[k] = stretched * TimeAt(clock, time_s[k] - time_s.front());
  }
  return out;
}

JointTrajectory TimeLine(const Eigen::Ref<const Eigen::VectorXd>& from,
                         const Eigen::Ref<const Eigen::VectorXd>& to,
                         const std::vector<std::string>& joint_names,
                         const std::vector<kinematics::JointLimits>& limits,
                         double velocity_fraction) {
  // The minimum-jerk profile 10 r^3 - 15 r^4 + 6 r^5 (Flash & Hogan 1985).
  constexpr double kPeakVelocity = 1.875;
  constexpr double kPeakJerk = 60;
  const double peak_acceleration = 10 / std::sqrt(3.0);
  const Eigen::VectorXd way = to - from;
  double duration = 0.1;
  for (Eigen::Index j = 0; j < way.size(); ++j) {
    const double length = std::abs(way[j]);
    duration = std::max(
        duration, kPeakVelocity * length / (velocity_fraction * kLimitShare * limits[j].velocity));
    duration = std::max(
        duration, std::sqrt(peak_acceleration * length / (kLimitShare * limits[j].acceleration)));
    duration = std::max(duration, std::cbrt(kPeakJerk * length / (kLimitShare * limits[j].jerk)));
  }
  const int points =
      std::clamp(static_cast<int>(std::ceil(duration / kLineStep_s)) + 1, 11, kMaxGridPoints);
  JointTrajectory out;
  out.joint_names = joint_names;
  out.time_s.resize(static_cast<std::size_t>(points));
  out.positions.resize(points, way.size());
  for (int i = 0; i < points; ++i) {
    const double r = static_cast<double>(i) / (points - 1);
    out.time_s[i] = duration * r;
    out.positions.row(i) = (from + r * r * r * (10 - 15 * r + 6 * r * r) * way).transpose();
  }
  out.positions.row(points - 1) = to.transpose();
  JoinSmoothly(out);
  FitLimits(out, limits);
  return out;
}

JointTrajectory Concatenate(const JointTrajectory& first, const JointTrajectory& second) {
  if (first.time_s.empty()) return second;
  JointTrajectory out = first;
  const Eigen::Index before = first.positions.rows();
  const Eigen::Index more = second.positions.rows() - 1;
  out.positions.conservativeResize(before + more, Eigen::NoChange);
  out.velocities.conservativeResize(before + more, Eigen::NoChange);
  out.positions.bottomRows(more) = second.positions.bottomRows(more);
  out.velocities.bottomRows(more) = second.velocities.bottomRows(more);
  for (Eigen::Index i = 1; i <= more; ++i) {
    out.time_s.push_back(first.duration_s() + second.time_s[i] - second.time_s.front());
  }
  if (!second.hand_open.empty()) {
    out.hand_open.resize(first.time_s.size(), second.hand_open.front());
    out.hand_open.insert(out.hand_open.end(), second.hand_open.begin() + 1, second.hand_open.end());
  }
  return out;
}

LimitUse MeasureLimitUse(const JointTrajectory& trajectory,
                         const std::vector<kinematics::JointLimits>& limits) {
  LimitUse use;
  for (std::size_t i = 0; i + 1 < trajectory.time_s.size(); ++i) {
    const LimitUse piece = PieceUse(trajectory, limits, static_cast<Eigen::Index>(i));
    use.velocity = std::max(use.velocity, piece.velocity);
    use.acceleration = std::max(use.acceleration, piece.acceleration);
    use.jerk = std::max(use.jerk, piece.jerk);
  }
  return use;
}

double LargestAccelerationJump(const JointTrajectory& trajectory) {
  double largest = 0;
  const auto frames = static_cast<Eigen::Index>(trajectory.time_s.size());
  for (Eigen::Index j = 0; j < trajectory.positions.cols(); ++j) {
    double before = 0;
    for (Eigen::Index i = 0; i + 1 < frames; ++i) {
      const double h = trajectory.time_s[i + 1] - trajectory.time_s[i];
      const double slope = (trajectory.positions(i + 1, j) - trajectory.positions(i, j)) / h;
      const double v0 = trajectory.velocities(i, j);
      const double v1 = trajectory.velocities(i + 1, j);
      largest = std::max(largest, std::abs((6 * slope - 4 * v0 - 2 * v1) / h - before));
      before = (2 * v0 + 4 * v1 - 6 * slope) / h;
    }
    largest = std::max(largest, std::abs(before));
  }
  return largest;
}

}  // namespace exemplar::motion
