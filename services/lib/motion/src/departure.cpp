#include "exemplar/motion/departure.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "describe.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "timing.hpp"
#include "trajectory.hpp"
#include "windows.hpp"

namespace exemplar::motion {
namespace {

constexpr double kWays_m[] = {0.08, 0.05, 0.03};
/// What is touched may come nearer by so much again than it has been: the figures are worth no
/// more.
constexpr double kSlack_m = 2e-4;
/// Bodies that touch less deeply do not say where to.
constexpr double kTold_m = 1e-4;
constexpr int kFrames = 41;
constexpr double kDuration_s = 1.2;
constexpr double kLargestJointStep_rad = 0.2;
/// In which the distance is looked at, and proved between.
constexpr int kSteps = 100;

class DeparturePlanner {
 public:
  DeparturePlanner(const kinematics::RobotModel& model, const kinematics::Chain& chain,
                   const collision::CollisionChecker& checker,
                   const Eigen::Ref<const Eigen::VectorXd>& start, const PlanOptions& options)
      : model_(model), chain_(chain), checker_(checker), start_(start), options_(options) {}

  Result<Departure> Run() {
    if (const Status touched = FindTouched(); !touched.ok()) return touched.error();
    if (pairs_.empty()) return Departure{};
    std::optional<collision::Violation> first;
    for (const Eigen::Vector3d& direction : Directions()) {
      for (const double way_m : kWays_m) {
        const std::optional<JointTrajectory> way = Straight(direction, way_m);
        if (!way) continue;
        Departure departure;
        const std::optional<collision::Violation> violation = Prove(*way, departure.touches);
        if (!violation) {
          departure.trajectory = *way;
          Measure(departure);
          return departure;
        }
        if (!first) first = violation;
      }
    }
    return FailedPrecondition(Touching() + "; " +
                              (first ? "on the way back from there, " +
                                           DescribeViolation(*first, options_.required_clearance_m)
                                     : std::string("no way back from there is within reach")));
  }

 private:
  Status FindTouched() {
    const Eigen::VectorXd q = kinematics::FullJointVector(model_, chain_, start_);
    while (true) {
      const collision::Clearance nearest = checker_.SmallestClearance(q, pairs_);
      if (!(nearest.distance_m < options_.required_clearance_m)) return {};
      touched_.push_back(nearest);
      if (!MayTouch(nearest)) return FailedPrecondition(Touching());
      pairs_.push_back({nearest.first, nearest.second});
    }
  }

  bool MayTouch(const collision::Clearance& pair) const {
    const std::vector<std::string>& links = options_.touch_links;
    const bool link = links.empty()
                          ? pair.first == chain_.tip_link()
                          : std::find(links.begin(), links.end(), pair.first) != links.end();
    const auto named = [&](const auto& thing) { return thing.name == pair.second; };
    const collision::Scene& scene = checker_.scene();
    return link && (std::any_of(scene.objects.begin(), scene.objects.end(), named) ||
                    std::any_of(scene.clouds.begin(), scene.clouds.end(), named));
  }

  std::string Touching() const {
    return "no free way from where the robot stands: " +
           DescribeViolation({0, touched_.back()}, options_.required_clearance_m);
  }

  /// Away from the bodies that are touched, and up.
  std::vector<Eigen::Vector3d> Directions() const {
    Eigen::Vector3d away = Eigen::Vector3d::Zero();
    for (const collision::Clearance& pair : touched_) {
      if (std::abs(pair.distance_m) < kTold_m) continue;
      const Eigen::Vector3d apart = pair.base_p_first - pair.base_p_second;
      away += (pair.distance_m > 0 ? 1 : -1) * apart.normalized();
    }
    std::vector<Eigen::Vector3d> directions;
    if (away.norm() > 0.1) {
      directions.push_back(away.normalized());
      const Eigen::Vector3d between = directions[0] + Eigen::Vector3d::UnitZ();
      if (between.norm() > 0.1) directions.push_back(between.normalized());
    }
    directions.push_back(Eigen::Vector3d::UnitZ());
    return directions;
  }

  /// Smoothly, the tool turned as it stands.
  std::optional<JointTrajectory> Straight(const Eigen::Vector3d& direction, double way_m) const {
    const geometry::Pose from = chain_.ToolPose(start_);
    Eigen::MatrixXd joints(kFrames, chain_.dof());
    std::vector<double> time_s;
    kinematics::IkOptions ik;
    ik.max_restarts = 0;
    for (int k = 0; k < kFrames; ++k) {
      const double s = static_cast<double>(k) / (kFrames - 1);
      time_s.push_back(kDuration_s * s);
      if (k == 0) {
        joints.row(0) = start_.transpose();
        continue;
      }
      geometry::Pose to = from;
      to.translation += way_m * s * s * s * (10 - 15 * s + 6 * s * s) * direction;
      const Eigen::VectorXd before = joints.row(k - 1).transpose();
      const Result<kinematics::IkSolution> found = kinematics::SolveIk(chain_, to, before, ik);
      if (!found.ok()) return std::nullopt;
      if ((found->q - before).cwiseAbs().maxCoeff() > kLargestJointStep_rad) return std::nullopt;
      joints.row(k) = found->q.transpose();
    }
    std::vector<double> frame_time_s;
    return TimePath(time_s, joints, chain_.joint_names(), chain_.limits(), options_.speed_scale,
                    frame_time_s);
  }

  /// What contradicts the law; else how long each of the pairs is touched.
  std::optional<collision::Violation> Prove(const JointTrajectory& way,
                                            std::vector<TouchWindow>& touches) const {
    const TrajectoryPath path(way, model_, chain_);
    const double end_s = way.duration_s();
    const double required_m = options_.required_clearance_m;
    if (auto other = checker_.FirstViolation(path, 0, end_s, required_m, pairs_)) return other;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      // With the others left out only this pair can be nearer than asked for.
      std::vector<collision::AllowedTouch> others = pairs_;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      double farthest_m = touched_[i].distance_m;
      double left_s = end_s;
      for (int step = 0; step < kSteps && farthest_m < required_m; ++step) {
        const double begin_s = end_s * step / kSteps;
        left_s = end_s * (step + 1) / kSteps;
        if (auto nearer =
                checker_.FirstViolation(path, begin_s, left_s, farthest_m - kSlack_m, others)) {
          return nearer;
        }
        farthest_m = std::max(farthest_m, DistanceAt(path, left_s, others));
      }
      if (auto again = checker_.FirstViolation(path, left_s, end_s, required_m, others))
        return again;
      touches.push_back({pairs_[i].object, 0, left_s});
    }
    return std::nullopt;
  }

  double DistanceAt(const TrajectoryPath& path, double time_s,
                    const std::vector<collision::AllowedTouch>& allowed) const {
    Eigen::VectorXd q(static_cast<Eigen::Index>(model_.joints.size()));
    path.Position(time_s, q);
    return checker_.SmallestClearance(q, allowed).distance_m;
  }

  void Measure(Departure& departure) const {
    PlannedMotion alone;
    alone.trajectory = departure.trajectory;
    alone.touches = departure.touches;
    std::vector<std::string> links = options_.touch_links;
    if (links.empty()) links.push_back(chain_.tip_link());
    MeasureClearance(departure.trajectory, model_, chain_, checker_, MakeStretches(alone, links),
                     departure.report);
  }

  const kinematics::RobotModel& model_;
  const kinematics::Chain& chain_;
  const collision::CollisionChecker& checker_;
  const Eigen::VectorXd start_;
  const PlanOptions& options_;
  std::vector<collision::Clearance> touched_;
  std::vector<collision::AllowedTouch> pairs_;  ///< of touched_, in its order
};

}  // namespace

Result<Departure> PlanDeparture(const kinematics::RobotModel& model, const kinematics::Chain& chain,
                                const collision::CollisionChecker& checker,
                                const Eigen::Ref<const Eigen::VectorXd>& start,
                                const PlanOptions& options) {
  return DeparturePlanner(model, chain, checker, start, options).Run();
}

void Prepend(const Departure& departure, PlannedMotion& plan) {
  const double later_s = departure.trajectory.duration_s();
  if (later_s == 0) return;
  plan.trajectory = Concatenate(departure.trajectory, plan.trajectory);
  for (ContactWindow& window : plan.contacts) {
    window.begin_s += later_s;
    window.end_s += later_s;
  }
  for (TouchWindow& window : plan.touches) {
    window.begin_s += later_s;
    window.end_s += later_s;
  }
  for (CarryWindow& window : plan.carries) {
    for (double* time_s :
         {&window.begin_s, &window.lifted_s, &window.lowered_s, &window.end_s, &window.left_s}) {
      *time_s += later_s;
    }
  }
  for (double& time_s : plan.frame_time_s) time_s += later_s;
  plan.touches.insert(plan.touches.begin(), departure.touches.begin(), departure.touches.end());
  PlanReport& report = plan.report;
  report.approach_s += later_s;
  report.smallest_clearance_time_s += later_s;
  if (departure.report.smallest_clearance.distance_m < report.smallest_clearance.distance_m) {
    report.smallest_clearance = departure.report.smallest_clearance;
    report.smallest_clearance_time_s = departure.report.smallest_clearance_time_s;
  }
}

}  // namespace exemplar::motion
