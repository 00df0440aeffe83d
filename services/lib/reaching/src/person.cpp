#include "exemplar/reaching/person.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "hand_path.hpp"

namespace exemplar::reaching {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kFineRate = 960;        // Hz, at least: the hand is simulated so finely
constexpr double kTilt = 0.26;           // rad, of the pressing finger, its tip away from the body
constexpr double kPostureSpread = 0.06;  // rad, of the comfortable posture from trial to trial
constexpr double kPostureDrift = 0.02;   // rad, of that posture within a trial
constexpr double kSuitNoise = 3e-4;      // rad
constexpr double kForceNoise = 0.03;     // N
constexpr double kObjectNoise = 0.5e-3;  // m
constexpr double kTurnedBefore = 0.9;    // s, before it takes or lays down, the hand is turned
constexpr double kTrunkWeight = 4;       // what moving the trunk costs more than the wrist

Status CheckOption(bool fine, const char* name, double value, const char* rule) {
  if (fine) return {};
  return InvalidArgument(std::string(name) + " is " + FormatDouble(value) + ", must be " + rule,
                         name);
}

Status Check(const PersonOptions& o) {
  const std::pair<const char*, double> positive[] = {
      {"rate_hz", o.rate_hz},
      {"object_rate_hz", o.object_rate_hz},
      {"tempo", o.tempo},
      {"press_depth_m", o.press_depth_m},
      {"contact_stiffness_n_m", o.contact_stiffness_n_m}};
  for (const auto& [name, value] : positive) {
    const bool fine = std::isfinite(value) && value > 0;
    if (Status status = CheckOption(fine, name, value, "positive"); !status) return status;
  }
  for (const auto& [name, value] :
       {std::pair("noise_scale", o.noise_scale), std::pair("variation_scale", o.variation_scale)}) {
    const bool fine = std::isfinite(value) && value >= 0;
    if (Status status = CheckOption(fine, name, value, "0 or more"); !status) return status;
  }
  return {};
}

HandTarget InBase(const Target& target, double tilt) {
  HandTarget hand;
  hand.base_p_contact = target.base_T_object * target.object_p_contact;
  hand.base_normal = target.base_T_object.rotation * target.object_normal.normalized();
  Vector3d outward(hand.base_p_contact.x(), hand.base_p_contact.y(), 0);
  outward -= outward.dot(hand.base_normal) * hand.base_normal;
  if (outward.norm() > 1e-6) outward.normalize();
  hand.base_pointing = (std::tan(tilt) * outward - hand.base_normal).normalized();
  return hand;
}

/// The hand from above, its fingers to both sides along the target's x or y, as little turned from
/// `base_R_near` as can be.
Eigen::Quaterniond Grip(const Target& target, const Eigen::Quaterniond& base_R_near) {
  const Vector3d z = -(target.base_T_object.rotation * target.object_normal.normalized());
  Eigen::Quaterniond best = base_R_near;
  double least = std::numeric_limits<double>::infinity();
  for (const Vector3d& axis :
       {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(-1, 0, 0), Vector3d(0, -1, 0)}) {
    Vector3d x = target.base_T_object.rotation * axis;
    x = (x - x.dot(z) * z).normalized();
    if (!x.allFinite()) continue;
    Eigen::Matrix3d base_R_tool;
    base_R_tool << x, z.cross(x), z;
    const Eigen::Quaterniond grip(base_R_tool);
    const double turn = grip.angularDistance(base_R_near);
    if (turn < least) {
      least = turn;
      best = grip;
    }
  }
  return best;
}

Vector3d PointingOf(const geometry::Pose& base_T_tool) {
  return base_T_tool.rotation * Vector3d::UnitZ();
}

/// The posture a body would like best, which wanders slowly.
class Comfort {
 public:
  Comfort(const kinematics::Chain& chain, const VectorXd& rest, double variation, Rng& rng)
      : middle_(rest), sway_(rest.size()), phase_(rest.size()), rate_(rest.size()) {
    for (Eigen::Index i = 0; i < rest.size(); ++i) {
      const kinematics::JointLimits& limits = chain.limits()[static_cast<std::size_t>(i)];
      middle_[i] = std::clamp(rest[i] + variation * rng.Normal(0, kPostureSpread), limits.lower,
                              limits.upper);
      sway_[i] = variation * rng.Normal(0, kPostureDrift);
      phase_[i] = rng.Uniform(0, 2 * std::numbers::pi);
      rate_[i] = rng.Uniform(0.4, 1.5);
    }
  }
  VectorXd At(double t) const {
    return middle_ + sway_.cwiseProduct((phase_ + t * rate_).array().sin().matrix());
  }

 private:
  VectorXd middle_, sway_, phase_, rate_;
};

/// The trunk moves less gladly than the arm.
VectorXd PostureWeights(int dof) {
  VectorXd weights(dof);
  for (int i = 0; i < dof; ++i) {
    const double from_tip = 1 - static_cast<double>(i) / std::max(1, dof - 1);
    weights[i] = 1 + kTrunkWeight * from_tip * from_tip;
  }
  return weights;
}

std::string Place(const Target& target) {
  const Vector3d p = target.base_T_object * target.object_p_contact;
  return "target \"" + target.name + "\" at (" + FormatFixed(p.x(), 3) + ", " +
         FormatFixed(p.y(), 3) + ", " + FormatFixed(p.z(), 3) + ") m";
}

}  // namespace

Person::Person(kinematics::Chain chain, VectorXd rest, const PersonOptions& options)
    : chain_(std::move(chain)), rest_(std::move(rest)), options_(options), rng_(options.seed) {}

Result<Person> Person::Create(const kinematics::RobotDescription& body,
                              const PersonOptions& options) {
  if (Status status = Check(options); !status) return status.error();
  return Person(body.chain, body.home, options);
}

Result<Demonstration> Person::Press(const Vector3d& base_p_button) {
  Target target;
  target.base_T_object.translation = base_p_button;
  return Press(target);
}

Result<Demonstration> Person::Press(std::span<const Target> targets) {
  if (targets.empty()) return InvalidArgument("there is no target to press", "targets");
  for (const Target& target : targets) {
    if (!target.base_T_object.translation.allFinite() || !target.object_p_contact.allFinite() ||
        !(target.object_normal.norm() > 1e-9)) {
      return InvalidArgument("target \"" + target.name + "\" has no finite place or direction",
                             "targets");
    }
  }
  const Rng trial_rng = rng_.Fork(++trials_);
  Rng rng = trial_rng.Fork(0);
  const double variation = options_.variation_scale;
  const Comfort comfort(chain_, rest_, variation, rng);
  const geometry::Pose base_T_rest = chain_.ToolPose(rest_);
  Vector3d start = base_T_rest.translation;
  for (int i = 0; i < 3; ++i) start[i] += variation * rng.Normal(0, 0.008);
  std::vector<HandTarget> hand_targets;
  for (const Target& target : targets) {
    hand_targets.push_back(InBase(target, kTilt + variation * rng.Normal(0, 0.05)));
  }

  const int every = static_cast<int>(std::ceil(kFineRate / options_.rate_hz));
  const double step_s = 1 / (options_.rate_hz * every);
  Result<HandPath> path = SimulateHand(start, PointingOf(base_T_rest), hand_targets, options_,
                                       step_s, trial_rng.Fork(1));
  if (!path) return path.error();

  Demonstration result;
  result.presses = path->presses;
  result.end_s = path->end_s;
  demonstration::Trial& trial = result.trial;
  trial.source = "simulated person, seed " + std::to_string(options_.seed) + ", trial " +
                 std::to_string(trials_);
  const Eigen::Index samples = static_cast<Eigen::Index>(
      (path->base_p_tip.size() - 1) / static_cast<std::size_t>(every) + 1);
  trial.joints.names = chain_.joint_names();
  trial.joints.values.resize(samples, chain_.dof());
  trial.tactile.names = {options_.touch_sensor};
  trial.tactile.values.resize(samples, 1);
  demonstration::PoseSeries tool;

  kinematics::IkOptions ik;
  ik.position_tolerance_m = 1e-7;
  ik.rotation_tolerance_rad = 1e-7;
  ik.free_tool_roll = true;
  ik.preferred_weights = PostureWeights(chain_.dof());
  ik.max_restarts = 0;  // another branch would be a jump
  VectorXd q = rest_;
  Rng sensors = trial_rng.Fork(2);
  for (Eigen::Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / options_.rate_hz;
    const std::size_t fine = static_cast<std::size_t>(k) * static_cast<std::size_t>(every);
    const geometry::Pose goal = {
        path->base_p_tip[fine],
        Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), path->base_pointing[fine])};
    ik.preferred = comfort.At(t);
    Result<kinematics::IkSolution> posture = kinematics::SolveIk(chain_, goal, q, ik);
    if (!posture) {
      std::size_t which = 0;
      while (which + 1 < targets.size() && t > result.presses[which + 1].reach_onset_s) ++which;
      return FailedPrecondition(
          Place(targets[which]) + " is out of comfortable reach: " + posture.error().message,
          "targets[" + std::to_string(which) + "]");
    }
    q = posture->q;
    double force = 0;
    for (const HandTarget& target : hand_targets) {
      const Vector3d off = goal.translation - target.base_p_contact;
      const double depth = -target.base_normal.dot(off);
      const double beside = (off + depth * target.base_normal).norm();
      if (depth > 0 && beside < 0.03) force += options_.contact_stiffness_n_m * depth;
    }
    force = std::max(0.0, force + options_.noise_scale * sensors.Normal(0, kForceNoise));
    trial.joints.time_s.push_back(t);
    trial.tactile.time_s.push_back(t);
    trial.tactile.values(k, 0) = force;
    for (int i = 0; i < chain_.dof(); ++i) {
      const kinematics::JointLimits& limits = chain_.limits()[static_cast<std::size_t>(i)];
      const double read = q[i] + options_.noise_scale * sensors.Normal(0, kSuitNoise);
      trial.joints.values(k, i) = std::clamp(read, limits.lower, limits.upper);
    }
    if (options_.tool_poses) {
      tool.time_s.push_back(t);
      tool.base_T_frame.push_back(chain_.ToolPose(q));
    }
  }
  if (options_.tool_poses) {
    geometry::MakeSignsContinuous(tool.base_T_frame);
    trial.end_effectors.push_back(std::move(tool));
  }
  for (const Target& target : targets) {
    demonstration::PoseSeries seen;
    seen.name = target.name;
    for (double t = 0; t <= trial.joints.time_s.back(); t += 1 / options_.object_rate_hz) {
      geometry::Pose pose = target.base_T_object;
      for (int i = 0; i < 3; ++i) {
        pose.translation[i] += options_.noise_scale * sensors.Normal(0, kObjectNoise);
      }
      seen.time_s.push_back(t);
      seen.base_T_frame.push_back(pose);
    }
    trial.objects.push_back(std::move(seen));
  }
  return result;
}

Result<Demonstration> Person::Carry(const Target& from, const Target& to) {
  const Target* ends[] = {&from, &to};
  for (const Target* target : ends) {
    if (target->base_T_object.translation.allFinite() && target->object_p_contact.allFinite() &&
        target->object_normal.norm() > 1e-9) {
      continue;
    }
    return InvalidArgument("target \"" + target->name + "\" has no finite place or direction",
                           "targets");
  }
  const Rng trial_rng = rng_.Fork(++trials_);
  Rng rng = trial_rng.Fork(0);
  const double variation = options_.variation_scale;
  const Comfort comfort(chain_, rest_, variation, rng);
  const geometry::Pose base_T_rest = chain_.ToolPose(rest_);
  Vector3d start = base_T_rest.translation;
  for (int i = 0; i < 3; ++i) start[i] += variation * rng.Normal(0, 0.008);
  const HandTarget taken = InBase(from, 0);
  const HandTarget laid = InBase(to, 0);
  const Eigen::Quaterniond base_R_take = Grip(from, base_T_rest.rotation);
  const Eigen::Quaterniond base_R_lay = Grip(to, base_R_take);

  const int every = static_cast<int>(std::ceil(kFineRate / options_.rate_hz));
  const double step_s = 1 / (options_.rate_hz * every);
  const HandPath path = SimulateCarry(start, taken, laid, options_, step_s, trial_rng.Fork(1));

  Demonstration result;
  result.carry = path.carry;
  result.end_s = path.end_s;
  demonstration::Trial& trial = result.trial;
  trial.source = "simulated person, seed " + std::to_string(options_.seed) + ", trial " +
                 std::to_string(trials_);
  const Eigen::Index samples =
      static_cast<Eigen::Index>((path.base_p_tip.size() - 1) / static_cast<std::size_t>(every) + 1);
  trial.joints.names = chain_.joint_names();
  trial.joints.values.resize(samples, chain_.dof());
  trial.hands.names = {""};
  trial.hands.values.resize(samples, 1);
  demonstration::PoseSeries tool;

  kinematics::IkOptions ik;
  ik.position_tolerance_m = 1e-7;
  ik.rotation_tolerance_rad = 1e-7;
  ik.preferred_weights = PostureWeights(chain_.dof());
  ik.max_restarts = 0;  // another branch would be a jump
  VectorXd q = rest_;
  Rng sensors = trial_rng.Fork(2);
  const auto turning = [](double t, double begin, double end) {
    const double s = std::clamp((t - begin) / (end - begin), 0.0, 1.0);
    return s * s * s * (10 - 15 * s + 6 * s * s);
  };
  for (Eigen::Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / options_.rate_hz;
    const std::size_t fine = static_cast<std::size_t>(k) * static_cast<std::size_t>(every);
    const CarryTruth& carry = path.carry;
    const double down_s = kTurnedBefore;
    Eigen::Quaterniond base_R_tool =
        base_T_rest.rotation.slerp(turning(t, 0.3, carry.grasp_s - down_s), base_R_take);
    base_R_tool =
        base_R_tool.slerp(turning(t, carry.grasp_s + down_s, carry.release_s - down_s), base_R_lay);
    base_R_tool =
        base_R_tool.slerp(turning(t, carry.release_s + down_s, path.end_s), base_T_rest.rotation);
    ik.preferred = comfort.At(t);
    Result<kinematics::IkSolution> posture =
        kinematics::SolveIk(chain_, {path.base_p_tip[fine], base_R_tool}, q, ik);
    if (!posture) {
      const bool first = t < carry.grasp_s + down_s;
      return FailedPrecondition(
          Place(first ? from : to) + " is out of comfortable reach: " + posture.error().message,
          first ? "targets[0]" : "targets[1]");
    }
    q = posture->q;
    trial.joints.time_s.push_back(t);
    trial.hands.time_s.push_back(t);
    trial.hands.values(k, 0) = path.open[fine];
    for (int i = 0; i < chain_.dof(); ++i) {
      const kinematics::JointLimits& limits = chain_.limits()[static_cast<std::size_t>(i)];
      const double read = q[i] + options_.noise_scale * sensors.Normal(0, kSuitNoise);
      trial.joints.values(k, i) = std::clamp(read, limits.lower, limits.upper);
    }
    if (options_.tool_poses) {
      tool.time_s.push_back(t);
      tool.base_T_frame.push_back(chain_.ToolPose(q));
    }
  }
  if (options_.tool_poses) {
    geometry::MakeSignsContinuous(tool.base_T_frame);
    trial.end_effectors.push_back(std::move(tool));
  }
  return result;
}

}  // namespace exemplar::reaching
