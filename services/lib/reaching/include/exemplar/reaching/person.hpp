#pragma once
// A simulated person who presses buttons: demonstrations with known truth, by a model of human
// reaching that shares nothing with the learner.
//
// The fingertip's path is a sum of minimum-jerk submovements (Flash & Hogan 1985): a first one that
// covers most of the way, corrective ones that overlap it and start from what the eyes then see
// (Meyer et al. 1988, Flash & Henis 1991), a slow push along the button's normal, a hold, a lift
// and a way back. Motor noise grows with speed (Harris & Wolpert 1998); there are reaction times,
// hesitations, tremor, and a tempo, curvature and aim of each trial's own. Joints follow by inverse
// kinematics near a comfortable posture that drifts.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/demonstration/trial.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::reaching {

struct PersonOptions {
  std::uint64_t seed = 1;
  double rate_hz = 60;           ///< of joints and touch
  double object_rate_hz = 10;    ///< of the objects' poses
  double noise_scale = 1;        ///< 0: no motor noise, tremor or sensor noise: the touch is exact
  double variation_scale = 1;    ///< 0: tempo, curvature, aim and posture of every trial are alike
  double tempo = 1;              ///< 2: twice as fast
  double press_depth_m = 0.005;  ///< below the untouched button's face
  /// The touch sensor reads this much per metre that the fingertip is below the untouched face.
  double contact_stiffness_n_m = 1000;
  std::string touch_sensor = "finger";
  bool tool_poses = false;  ///< also record the tool's true pose
};

/// What is to be pressed.
struct Target {
  std::string name = "target";
  geometry::Pose base_T_object;
  Eigen::Vector3d object_p_contact = Eigen::Vector3d::Zero();  ///< centre of the button's face
  Eigen::Vector3d object_normal = Eigen::Vector3d::UnitZ();    ///< outward, unit
};

/// The true boundaries of one press, in seconds since the trial's start.
struct PressTruth {
  double reach_onset_s = 0;    ///< the hand sets off for this target
  double press_onset_s = 0;    ///< the slow push begins
  double contact_onset_s = 0;  ///< the fingertip crosses the button's face
  double release_onset_s = 0;  ///< the finger begins to lift
  double contact_end_s = 0;    ///< the fingertip leaves the button's face
  /// Where the fingertip crossed the face (base frame).
  Eigen::Vector3d base_p_contact = Eigen::Vector3d::Zero();
};

/// When the hand took what it carried and let it go, in seconds since the trial's start.
struct CarryTruth {
  double grasp_s = 0;    ///< the hand begins to close
  double release_s = 0;  ///< and to open again
};

struct Demonstration {
  demonstration::Trial trial;
  std::vector<PressTruth> presses;  ///< one a target, in order
  CarryTruth carry = {};            ///< of Carry
  double end_s = 0;                 ///< the hand is back at rest
};

/// One person with one body. Every call is another trial, never alike; the same seed and the same
/// calls give the same trials. Thread-compatible.
class Person {
 public:
  /// kInvalidArgument names the option. Any chain will do as a body that reaches.
  static Result<Person> Create(const kinematics::RobotDescription& body,
                               const PersonOptions& options);

  /// Presses the targets one after the other, then returns near the resting posture (the body's
  /// home). The resting posture is also where the trial starts. kFailedPrecondition names a target
  /// that the body cannot reach.
  Result<Demonstration> Press(std::span<const Target> targets);
  Result<Demonstration> Press(const Target& target) { return Press(std::span(&target, 1)); }
  /// A target of the default name that faces up.
  Result<Demonstration> Press(const Eigen::Vector3d& base_p_button);

  /// Takes `from` with the hand from above, its fingers along the object's x or y, lays it down at
  /// `to`, turned as that, and returns near rest. Contact points are where the tool's frame goes;
  /// normals point up. The trial holds joints and the hand's opening.
  Result<Demonstration> Carry(const Target& from, const Target& to);

  /// The body's posture between trials.
  const Eigen::VectorXd& rest() const { return rest_; }
  const kinematics::Chain& chain() const { return chain_; }

 private:
  Person(kinematics::Chain chain, Eigen::VectorXd rest, const PersonOptions& options);

  kinematics::Chain chain_;
  Eigen::VectorXd rest_;
  PersonOptions options_;
  Rng rng_;
  std::uint64_t trials_ = 0;
};

}  // namespace exemplar::reaching
