#pragma once
// What a skill answers: a motion for one situation.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::demonstration {

/// Frames [first, last] in which the tool meets an object.
struct Contact {
  std::string object;
  int first = 0;
  int last = 0;
  /// Where the trials met the object, taken to this query's object pose (base frame, m).
  Eigen::Vector3d base_p_contact = Eigen::Vector3d::Zero();
  bool touch_measured = false;  ///< from touch sensors; else from the spread in the object's frame
};

/// A motion of `frames()` frames. Time starts at 0 and increases strictly.
struct SkillMotion {
  std::string skill;
  int version = 0;
  std::vector<double> time_s;
  std::vector<std::string> joint_names;     ///< empty for a skill of trials without joints
  Eigen::MatrixXd joints;                   ///< frames x joints, rad or m; the demonstrated style
  std::vector<geometry::Pose> base_T_tool;  ///< one a frame, or empty (joints without robot model)
  bool has_orientation = true;              ///< of base_T_tool
  std::vector<double> hand_open;            ///< one a frame, or empty
  std::vector<std::string> object_names;    ///< columns of `objectivity`
  Eigen::MatrixXd objectivity;              ///< frames x objects, each in [0, 1]
  std::vector<double> sigma_m;              ///< predicted standard error of the tool position
  std::vector<double> markers_s;            ///< episode boundaries
  std::vector<Contact> contacts;
  std::vector<geometry::NamedPose> objects;  ///< as asked, orientations filled in
  std::vector<std::string> warnings;         ///< extrapolation, assumed orientations, ...

  int frames() const { return static_cast<int>(time_s.size()); }
};

/// What is asked of a skill.
struct SkillQuery {
  std::vector<geometry::NamedPose> objects;  ///< base frame
  std::optional<geometry::Pose> start;       ///< tool pose now
  bool start_has_orientation = true;
  std::vector<std::string> joint_start_names;  ///< may be empty: the skill's joint order
  std::optional<Eigen::VectorXd> joint_start;  ///< rad or m
};

/// The contract's CSV (DESIGN.md): time_s, joints, end-effector pose, objectivity, sigma_m.
std::string ToCsv(const SkillMotion& motion);

/// How far a motion is from what a person did.
struct Deviation {
  double frechet_m = 0;    ///< discrete Fréchet distance of the tool paths (Eiter & Mannila 1994)
  double end_error_m = 0;  ///< distance of the last tool positions
  double end_angle_rad = 0;
};

/// Discrete Fréchet distance between two point sequences (rows; same width). Precondition: neither
/// empty.
double FrechetDistance(const Eigen::Ref<const Eigen::MatrixXd>& a,
                       const Eigen::Ref<const Eigen::MatrixXd>& b);

}  // namespace exemplar::demonstration
