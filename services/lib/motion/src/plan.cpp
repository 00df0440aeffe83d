#include "exemplar/motion/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "approach.hpp"
#include "avoid.hpp"
#include "clear_postures.hpp"
#include "describe.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "timing.hpp"
#include "trajectory.hpp"
#include "windows.hpp"

namespace exemplar::motion {
namespace {

using demonstration::SkillMotion;

constexpr double kDemonstratedDeviation_rad = 0.2;
/// Of the half range, where nothing was demonstrated.
constexpr double kComfortableShare = 0.6;
/// The motion begins where the robot stands when its first pose is this near.
constexpr double kSameStart_m = 0.02;
constexpr double kSameStart_rad = 0.25;
constexpr double kRoughSmoothness = 1e-4;
/// Beyond the clearance asked for, where joints turn away from obstacles.
constexpr double kAvoidingMargin_m = 0.02;
constexpr int kAvoidingRounds = 10;
/// Other postures that the joints may be drawn to, at each of the frames where they are sought.
constexpr std::size_t kOtherPostures = 3;

std::string FrameAt(const SkillMotion& motion, int frame) {
  return "frame " + std::to_string(frame) + " of " + std::to_string(motion.frames()) + " (" +
         FormatFixed(motion.time_s[frame], 2) + " s)";
}

Status CheckInput(const SkillMotion& motion, const kinematics::RobotModel& model,
                  const kinematics::Chain& chain, const Eigen::Ref<const Eigen::VectorXd>& start,
                  const PlanOptions& options) {
  const auto frames = static_cast<std::size_t>(motion.frames());
  if (frames < 2) {
    return InvalidArgument("a motion of " + std::to_string(frames) +
                               " frames cannot be executed; at least 2 are needed",
                           "motion");
  }
  for (std::size_t k = 0; k < frames; ++k) {
    if (!std::isfinite(motion.time_s[k]) || (k > 0 && motion.time_s[k] <= motion.time_s[k - 1])) {
      return InvalidArgument("the motion's time does not increase at frame " + std::to_string(k) +
                                 " (" + FormatDouble(motion.time_s[k]) + " s)",
                             "motion.time_s");
    }
  }
  if (!motion.base_T_tool.empty() && motion.base_T_tool.size() != frames) {
    return InvalidArgument("the motion has " + std::to_string(frames) + " frames but " +
                               std::to_string(motion.base_T_tool.size()) + " tool poses",
                           "motion.base_T_tool");
  }
  for (std::size_t k = 0; k < motion.base_T_tool.size(); ++k) {
    const geometry::Pose& pose = motion.base_T_tool[k];
    if (!pose.translation.allFinite() || !pose.rotation.coeffs().allFinite()) {
      return InvalidArgument("the tool pose of frame " + std::to_string(k) + " is not finite",
                             "motion.base_T_tool");
    }
  }
  if (!motion.hand_open.empty() &&
      (motion.hand_open.size() != frames ||
       !std::all_of(motion.hand_open.begin(), motion.hand_open.end(),
                    [](double open) { return open >= 0 && open <= 1; }))) {
    return InvalidArgument("the hand's opening is not one a frame, or not between 0 and 1",
                           "motion.hand_open");
  }
  if (!motion.joint_names.empty() &&
      (motion.joints.rows() != static_cast<Eigen::Index>(frames) ||
       motion.joints.cols() != static_cast<Eigen::Index>(motion.joint_names.size()) ||
       !motion.joints.allFinite())) {
    return InvalidArgument("the motion's joints are not finite, or not one a frame and name",
                           "motion.joints");
  }
  for (const demonstration::Contact& contact : motion.contacts) {
    if (contact.first < 0 || contact.last < contact.first || contact.last >= motion.frames()) {
      return InvalidArgument("the contact with \"" + contact.object + "\" spans frames " +
                                 std::to_string(contact.first) + " to " +
                                 std::to_string(contact.last) + " of " + std::to_string(frames),
                             "motion.contacts");
    }
  }
  if (start.size() != chain.dof() || !start.allFinite()) {
    return InvalidArgument("the start has " + std::to_string(start.size()) +
                               " joints, or not finite ones; the chain has " +
                               std::to_string(chain.dof()),
                           "start");
  }
  for (int j = 0; j < chain.dof(); ++j) {
    const kinematics::JointLimits& limits = chain.limits()[j];
    if (start[j] < limits.lower - 1e-3 || start[j] > limits.upper + 1e-3) {
      return FailedPrecondition("joint \"" + chain.joint_names()[j] + "\" stands at " +
                                    FormatFixed(start[j], 4) + ", outside its limits " +
                                    FormatFixed(limits.lower, 4) + " to " +
                                    FormatFixed(limits.upper, 4),
                                "start");
    }
  }
  for (const std::string& link : options.touch_links) {
    if (model.FindLink(link) < 0) {
      return NotFound("touch link: the robot \"" + model.name + "\" has no link \"" + link + "\"",
                      "touch_links");
    }
  }
  if (!(options.speed_scale > 0 && options.speed_scale <= 1)) {
    return InvalidArgument(
        "speed is " + FormatDouble(options.speed_scale) + ", must be above 0 and at most 1",
        "speed");
  }
  if (!(options.approach_velocity > 0 && options.approach_velocity <= 1)) {
    return InvalidArgument("approach velocity is " + FormatDouble(options.approach_velocity) +
                               ", must be above 0 and at most 1",
                           "approach_velocity");
  }
  if (options.comfortable.size() != 0 && options.comfortable.size() != chain.dof()) {
    return InvalidArgument("the comfortable posture has " +
                               std::to_string(options.comfortable.size()) +
                               " joints; the chain has " + std::to_string(chain.dof()),
                           "comfortable");
  }
  return {};
}

Eigen::VectorXd Comfortable(const kinematics::Chain& chain, const PlanOptions& options) {
  if (options.comfortable.size() == chain.dof()) return options.comfortable;
  Eigen::VectorXd middle(chain.dof());
  for (int j = 0; j < chain.dof(); ++j) {
    const kinematics::JointLimits& limits = chain.limits()[j];
    const bool bounded = std::isfinite(limits.lower) && std::isfinite(limits.upper);
    middle[j] = bounded ? 0.5 * (limits.lower + limits.upper) : 0.0;
  }
  return middle;
}

/// The problem of a motion, and which of the chain's joints it demonstrates (columns of
/// motion.joints, -1: none).
struct Prepared {
  PathProblem path;
  std::vector<int> demonstrated;
};

Result<Prepared> Prepare(const SkillMotion& motion, const kinematics::Chain& chain,
                         const Eigen::Ref<const Eigen::VectorXd>& start,
                         const PlanOptions& options) {
  const int frames = motion.frames();
  Prepared out;
  PathProblem& path = out.path;
  path.time_s = motion.time_s;
  const double offset = path.time_s.front();
  for (double& t : path.time_s) t -= offset;
  path.style = Comfortable(chain, options).transpose().replicate(frames, 1);
  path.style_deviation_rad.resize(chain.dof());
  for (int j = 0; j < chain.dof(); ++j) {
    const auto& names = motion.joint_names;
    const auto found = std::find(names.begin(), names.end(), chain.joint_names()[j]);
    const int column = found == names.end() ? -1 : static_cast<int>(found - names.begin());
    out.demonstrated.push_back(column);
    const kinematics::JointLimits& limits = chain.limits()[j];
    const double half_range =
        std::isfinite(limits.upper - limits.lower) ? 0.5 * (limits.upper - limits.lower) : M_PI;
    path.style_deviation_rad[j] = kComfortableShare * half_range;
    if (column >= 0 && options.demonstrated_weight > 0) {
      path.style.col(j) = motion.joints.col(column);
      path.style_deviation_rad[j] =
          kDemonstratedDeviation_rad / std::sqrt(options.demonstrated_weight);
    }
  }
  if (!motion.base_T_tool.empty()) {
    path.base_T_tool = motion.base_T_tool;
    path.use_rotation = motion.has_orientation;
  } else {
    for (std::size_t j = 0; j < out.demonstrated.size(); ++j) {
      if (out.demonstrated[j] < 0) {
        return InvalidArgument("the motion has no tool path and does not name joint \"" +
                                   chain.joint_names()[j] + "\" of the robot",
                               "motion.joints");
      }
    }
    Eigen::VectorXd q(chain.dof());
    for (int k = 0; k < frames; ++k) {
      for (int j = 0; j < chain.dof(); ++j) q[j] = motion.joints(k, out.demonstrated[j]);
      path.base_T_tool.push_back(chain.ToolPose(q));
    }
  }
  path.exact.assign(static_cast<std::size_t>(frames), false);
  for (const demonstration::Contact& contact : motion.contacts) {
    for (int k = contact.first; k <= contact.last; ++k) path.exact[k] = true;
  }
  path.contact.position_tolerance_m = options.position_tolerance_m;
  path.contact.rotation_tolerance_rad = options.rotation_tolerance_rad;
  path.free.position_tolerance_m = options.free_tolerance_m;
  path.free.rotation_tolerance_rad = options.rotation_tolerance_rad;
  const geometry::Pose now = chain.ToolPose(start);
  const geometry::Pose& first = path.base_T_tool.front();
  if ((now.translation - first.translation).norm() < kSameStart_m &&
      (!path.use_rotation ||
       geometry::AngleBetween(now.rotation, first.rotation) < kSameStart_rad)) {
    path.first = start;
  }
  return out;
}

/// Refuses joints outside their limits, and steps so large that the tool leaves its path between
/// two frames: changes of posture.
Status VerifyBetween(const SkillMotion& motion, const kinematics::Chain& chain,
                     const PathProblem& path, const PathSolution& solution,
                     const PlanOptions& options) {
  for (int k = 0; k < motion.frames(); ++k) {
    for (int j = 0; j < chain.dof(); ++j) {
      const kinematics::JointLimits& limits = chain.limits()[j];
      const double q = solution.joints(k, j);
      if (q >= limits.lower && q <= limits.upper) continue;
      return FailedPrecondition("the robot cannot follow the motion: " + FrameAt(motion, k) +
                                    ": joint \"" + chain.joint_names()[j] + "\" would stand at " +
                                    FormatFixed(q, 3) + ", outside its limits " +
                                    FormatFixed(limits.lower, 3) + " to " +
                                    FormatFixed(limits.upper, 3),
                                "motion.base_T_tool");
    }
  }
  for (const int k : solution.large_steps) {
    const Eigen::VectorXd middle =
        0.5 * (solution.joints.row(k - 1) + solution.joints.row(k)).transpose();
    const geometry::Pose asked =
        geometry::Interpolate(path.base_T_tool[k - 1], path.base_T_tool[k], 0.5);
    const double off = (chain.ToolPose(middle).translation - asked.translation).norm();
    if (off <= 2 * options.free_tolerance_m) continue;
    int joint = 0;
    const double step =
        (solution.joints.row(k) - solution.joints.row(k - 1)).cwiseAbs().maxCoeff(&joint);
    return FailedPrecondition("the robot cannot follow the motion: before " + FrameAt(motion, k) +
                                  " joint \"" + chain.joint_names()[joint] + "\" has to move " +
                                  FormatFixed(step, 2) + " rad at once, and the tool leaves its " +
                                  "path by " + FormatFixed(1000 * off, 1) + " mm",
                              "motion.base_T_tool");
  }
  return {};
}

/// Errors of the joints against the tool path; refuses what is out of tolerance.
Status VerifyPath(const SkillMotion& motion, const kinematics::Chain& chain,
                  const Prepared& prepared, const PathSolution& solution,
                  const PlanOptions& options, PlanReport& report) {
  const PathProblem& path = prepared.path;
  const Eigen::MatrixXd& joints = solution.joints;
  double worst_excess = 1;
  std::string worst;
  double style = 0;
  int style_terms = 0;
  for (int k = 0; k < motion.frames(); ++k) {
    const double position = solution.position_error_m[k];
    const double rotation = solution.rotation_error_rad[k];
    const bool exact = path.exact[k];
    double& position_report = exact ? report.max_contact_error_m : report.max_position_error_m;
    position_report = std::max(position_report, position);
    report.max_rotation_error_rad = std::max(report.max_rotation_error_rad, rotation);
    const double tolerance = exact ? options.position_tolerance_m : options.free_tolerance_m;
    if (position / tolerance > worst_excess) {
      worst_excess = position / tolerance;
      worst = FrameAt(motion, k) + (exact ? ", in contact" : "") + ": the tool stays " +
              FormatFixed(1000 * position, 2) + " mm away from (" +
              FormatFixed(path.base_T_tool[k].translation.x(), 3) + ", " +
              FormatFixed(path.base_T_tool[k].translation.y(), 3) + ", " +
              FormatFixed(path.base_T_tool[k].translation.z(), 3) + ") m, " +
              FormatFixed(1000 * tolerance, 2) + " mm allowed";
    }
    if (rotation / options.rotation_tolerance_rad > worst_excess) {
      worst_excess = rotation / options.rotation_tolerance_rad;
      worst = FrameAt(motion, k) + ": the tool is turned " + FormatFixed(rotation, 3) +
              " rad away from what is asked, " + FormatFixed(options.rotation_tolerance_rad, 3) +
              " rad allowed";
    }
    for (int j = 0; j < chain.dof(); ++j) {
      if (prepared.demonstrated[j] < 0) continue;
      style += std::pow(joints(k, j) - motion.joints(k, prepared.demonstrated[j]), 2);
      ++style_terms;
    }
    if (k > 0) {
      report.max_joint_step_rad = std::max(
          report.max_joint_step_rad, (joints.row(k) - joints.row(k - 1)).cwiseAbs().maxCoeff());
    }
  }
  if (style_terms > 0) report.style_error_rad = std::sqrt(style / style_terms);
  if (!worst.empty()) {
    return FailedPrecondition("the robot cannot follow the motion: " + worst, "motion.base_T_tool");
  }
  return VerifyBetween(motion, chain, path, solution, options);
}

/// The opening that the skill has at each frame, taken to the trajectory's times.
void AddHand(const SkillMotion& motion, const std::vector<double>& frame_time_s,
             JointTrajectory& trajectory) {
  if (motion.hand_open.empty()) return;
  std::size_t k = 0;
  for (const double t : trajectory.time_s) {
    while (k + 2 < frame_time_s.size() && frame_time_s[k + 1] < t) ++k;
    const double r =
        std::clamp((t - frame_time_s[k]) / (frame_time_s[k + 1] - frame_time_s[k]), 0.0, 1.0);
    trajectory.hand_open.push_back(motion.hand_open[k] +
                                   r * (motion.hand_open[k + 1] - motion.hand_open[k]));
  }
}

class Planner {
 public:
  Planner(const SkillMotion& motion, const kinematics::RobotModel& model,
          const kinematics::Chain& chain, const collision::CollisionChecker& checker,
          const Eigen::Ref<const Eigen::VectorXd>& start, const PlanOptions& options,
          const Prepared& prepared)
      : motion_(motion),
        model_(model),
        chain_(chain),
        checker_(checker),
        start_(start),
        options_(options),
        prepared_(prepared) {}

  Result<PlannedMotion> From(const Branch& branch, const std::stop_token& stop) const {
    PathSolution path =
        RefinePath(chain_, prepared_.path, branch, options_.inverse_kinematics, stop);
    if (!path.missed.empty()) {
      // Perhaps only too quick to be followed smoothly; the timing slows it down afterwards.
      PathProblem rougher = prepared_.path;
      rougher.smoothness = kRoughSmoothness;
      path = RefinePath(chain_, rougher, {path.joints, branch.cuts, 0, 0},
                        options_.inverse_kinematics, stop);
    }
    Result<PlannedMotion> plan = Along(path);
    if (plan.ok() || !path.missed.empty()) return plan;
    // Perhaps the joints can stay clear where the tool's path leaves them free.
    const FrameTouches touches = TouchesByFrame();
    for (int round = 0; round < kAvoidingRounds && !stop.stop_requested(); ++round) {
      const std::optional<PathProblem> away =
          AwayFromObstacles(model_, chain_, checker_, prepared_.path, path.joints, touches,
                            options_.required_clearance_m + kAvoidingMargin_m);
      if (!away) break;
      path = RefinePath(chain_, *away, {path.joints, branch.cuts, 0, 0},
                        options_.inverse_kinematics, stop);
      Result<PlannedMotion> clear = Along(path);
      if (clear.ok()) return clear;
    }
    return plan;
  }

  /// The plan that follows these joints, or why there is none.
  Result<PlannedMotion> Along(const PathSolution& path) const {
    PlannedMotion plan;
    Status followed = VerifyPath(motion_, chain_, prepared_, path, options_, plan.report);
    if (!followed.ok()) return followed.error();

    std::vector<double> frame_time_s;
    JointTrajectory skill = TimePath(prepared_.path.time_s, path.joints, chain_.joint_names(),
                                     chain_.limits(), options_.speed_scale, frame_time_s);
    AddHand(motion_, frame_time_s, skill);
    const Result<JointTrajectory> approach =
        PlanApproach(model_, chain_, checker_, start_, skill.positions.row(0).transpose(),
                     NotYet(options_.carries), options_);
    if (!approach.ok()) return approach.error();
    const double offset = approach->duration_s();
    plan.trajectory = Concatenate(*approach, skill);
    plan.report.approach_s = offset;
    for (const double t : frame_time_s) plan.frame_time_s.push_back(offset + t);
    plan.report.time_stretch = skill.duration_s() / prepared_.path.time_s.back();

    AddContacts(motion_, chain_, options_, frame_time_s, offset, plan);
    AddCarryWindows(motion_, chain_, options_, frame_time_s, offset, plan);
    const std::vector<Stretch> stretches = MakeStretches(plan, TouchLinks());
    const TrajectoryPath swept(plan.trajectory, model_, chain_);
    for (const Stretch& stretch : stretches) {
      const std::optional<collision::Violation> violation = checker_.FirstViolation(
          swept, stretch.begin_s, stretch.end_s, options_.required_clearance_m, stretch.allowed);
      if (violation) {
        return FailedPrecondition("the motion is not free: " +
                                      DescribeViolation(*violation, options_.required_clearance_m),
                                  "motion");
      }
    }
    MeasureClearance(plan.trajectory, model_, chain_, checker_, stretches, plan.report);
    if (plan.report.max_joint_step_rad > kLargeJointStep_rad) {
      plan.report.warnings.push_back("a joint moves " +
                                     FormatFixed(plan.report.max_joint_step_rad, 2) +
                                     " rad from one frame to the next");
    }
    return plan;
  }

  /// What may be touched at each frame of the skill's motion: near the contacts, along the path.
  FrameTouches TouchesByFrame() const {
    const std::vector<geometry::Pose>& path = prepared_.path.base_T_tool;
    FrameTouches touches(path.size());
    for (const demonstration::Contact& contact : motion_.contacts) {
      const auto near = [&](int frame) {
        const Eigen::Vector3d& tool = path[frame].translation;
        return std::min({(tool - path[contact.first].translation).norm(),
                         (tool - path[contact.last].translation).norm(),
                         (tool - contact.base_p_contact).norm()}) <= options_.touch_margin_m;
      };
      int first = contact.first;
      while (first > 0 && near(first - 1)) --first;
      int last = contact.last;
      while (last + 1 < motion_.frames() && near(last + 1)) ++last;
      for (int k = first; k <= last; ++k) {
        for (const std::string& link : TouchLinks()) touches[k].push_back({link, contact.object});
      }
    }
    for (const Carry& carry : options_.carries) AddByFrame(carry, touches);
    return touches;
  }

 private:
  /// As AllowedAt, by the frames of the skill's motion.
  void AddByFrame(const Carry& carry, FrameTouches& touches) const {
    const std::vector<geometry::Pose>& path = prepared_.path.base_T_tool;
    const auto apart = [&](int frame, int other) {
      return (path[frame].translation - path[other].translation).norm();
    };
    for (int k = 0; k < motion_.frames(); ++k) {
      std::vector<collision::AllowedTouch>& allowed = touches[k];
      if (k < carry.last) allowed.push_back({"", carry.laid.name});
      if (k < carry.first || k >= carry.last) allowed.push_back({carry.held.name, ""});
      if (k >= carry.first) allowed.push_back({"", carry.object});
      if (apart(k, carry.first) <= kLiftedMargin_m) {
        for (const std::string& object : carry.from) allowed.push_back({carry.held.name, object});
      }
      if (carry.last == motion_.frames()) continue;
      if (apart(k, carry.last) <= kLiftedMargin_m) {
        for (const std::string& object : carry.to) allowed.push_back({carry.held.name, object});
      }
      if (apart(k, carry.last) > options_.touch_margin_m) continue;
      for (const std::string& link : TouchLinks()) allowed.push_back({link, carry.laid.name});
    }
  }

  std::vector<std::string> TouchLinks() const {
    if (!options_.touch_links.empty()) return options_.touch_links;
    return {chain_.tip_link()};
  }

  const SkillMotion& motion_;
  const kinematics::RobotModel& model_;
  const kinematics::Chain& chain_;
  const collision::CollisionChecker& checker_;
  Eigen::VectorXd start_;
  const PlanOptions& options_;
  const Prepared& prepared_;
};

Result<PathSolution> SolveByFrames(const kinematics::RobotModel& model,
                                   const kinematics::Chain& chain, const PathProblem& path,
                                   const Eigen::Ref<const Eigen::VectorXd>& start,
                                   PathIkVariant variant) {
  if (variant != PathIkVariant::kEnergy) return SolvePath(chain, path, start, variant);
  const Result<kinematics::ChainInertia> inertia = kinematics::ChainInertia::Create(model, chain);
  if (!inertia.ok()) return inertia.error();
  return SolvePath(chain, path, start, variant, &*inertia);
}

}  // namespace

Result<PlannedMotion> PlanMotion(const SkillMotion& motion, const kinematics::RobotModel& model,
                                 const kinematics::Chain& chain,
                                 const collision::CollisionChecker& checker,
                                 const Eigen::Ref<const Eigen::VectorXd>& start,
                                 const PlanOptions& options, std::stop_token stop) {
  const Status input = CheckInput(motion, model, chain, start, options);
  if (!input.ok()) return input.error();
  Result<Prepared> prepared = Prepare(motion, chain, start, options);
  if (!prepared.ok()) return prepared.error();
  const Planner planner(motion, model, chain, checker, start, options, *prepared);
  std::optional<Error> first_refusal;
  int tried = 0;
  const auto attempt = [&](Result<PlannedMotion> plan) -> std::optional<Result<PlannedMotion>> {
    ++tried;
    if (stop.stop_requested()) {
      return Error{ErrorCode::kCancelled, "planning was cancelled"};
    }
    if (plan.ok()) {
      plan->report.branches_tried = tried;
      return plan;
    }
    // The best branch's refusal says most about the motion itself.
    if (!first_refusal) first_refusal = plan.error();
    return std::nullopt;
  };
  const PathIkVariant variant = options.inverse_kinematics;
  if (variant == PathIkVariant::kPlain || variant == PathIkVariant::kEnergy) {
    Result<PathSolution> path = SolveByFrames(model, chain, prepared->path, start, variant);
    if (!path.ok()) return path.error();
    if (auto done = attempt(planner.Along(*path))) return *done;
    return *first_refusal;
  }
  const bool all_demonstrated =
      options.demonstrated_weight > 0 &&
      std::find(prepared->demonstrated.begin(), prepared->demonstrated.end(), -1) ==
          prepared->demonstrated.end();
  if (all_demonstrated) {
    if (auto done = attempt(planner.From({prepared->path.style, {}, 0, 0}, stop))) return *done;
  }
  for (const Branch& branch : FindBranches(chain, prepared->path, start)) {
    if (tried >= std::max(1, options.max_branches)) break;
    if (auto done = attempt(planner.From(branch, stop))) return *done;
  }
  if (first_refusal->field != "motion" || all_demonstrated) return *first_refusal;
  // Perhaps what the joints are drawn to is in the way of itself, and another posture is not.
  const FrameTouches touches = planner.TouchesByFrame();
  std::vector<int> frames = {motion.frames() / 2};
  if (!motion.contacts.empty()) frames.insert(frames.begin(), motion.contacts.front().first);
  for (const int frame : frames) {
    for (const Eigen::VectorXd& posture :
         ClearPostures(model, chain, checker, prepared->path, frame, touches[frame],
                       options.required_clearance_m, kOtherPostures)) {
      Prepared other = *prepared;
      for (int j = 0; j < chain.dof(); ++j) {
        if (prepared->demonstrated[j] < 0) other.path.style.col(j).setConstant(posture[j]);
      }
      const Planner drawn(motion, model, chain, checker, start, options, other);
      const Branch way = FindBranches(chain, other.path, start).front();
      if (auto done = attempt(drawn.From(way, stop))) return *done;
    }
  }
  return *first_refusal;
}

}  // namespace exemplar::motion
