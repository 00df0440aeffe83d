#pragma once
// Rigid poses. Naming: base_T_tool maps points expressed in `tool` into `base`;
// base_T_tool = base_T_elbow * elbow_T_tool.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <string>
#include <vector>

namespace exemplar::geometry {

/// A rigid transform a_T_b: position of b's origin in a (metres) and rotation a_R_b (unit
/// quaternion).
struct Pose {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();

  static Pose Identity() { return {}; }
  static Pose FromTranslation(const Eigen::Vector3d& t) {
    return {t, Eigen::Quaterniond::Identity()};
  }
  static Pose FromIsometry(const Eigen::Isometry3d& isometry);
  Eigen::Isometry3d ToIsometry() const;

  Pose Inverse() const;
  friend Pose operator*(const Pose& a_T_b, const Pose& b_T_c) {
    return {a_T_b.translation + a_T_b.rotation * b_T_c.translation,
            (a_T_b.rotation * b_T_c.rotation).normalized()};
  }
  /// A point expressed in b, expressed in a.
  Eigen::Vector3d operator*(const Eigen::Vector3d& b_p) const {
    return translation + rotation * b_p;
  }
};

/// Rotation vector (axis times angle in [0, pi], rad) of a rotation, and back.
Eigen::Vector3d LogSo3(const Eigen::Quaterniond& rotation);
Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& rotation_vector);

/// Angle between two rotations, in [0, pi] rad; the sign of either quaternion does not matter.
double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// Translation linear, rotation along the shorter great arc; s in [0, 1].
Pose Interpolate(const Pose& a, const Pose& b, double s);

/// Weighted mean rotation: the minimiser of the weighted squared chordal distance (Markley et al.
/// 2007). Weights may be negative as long as a dominant eigenvector exists. Precondition: not
/// empty, same sizes.
Eigen::Quaterniond MeanRotation(std::span<const Eigen::Quaterniond> rotations,
                                std::span<const double> weights);
Eigen::Quaterniond MeanRotation(std::span<const Eigen::Quaterniond> rotations);

/// Flips signs so that each quaternion lies in the hemisphere of the one before; returns how many
/// were flipped.
int MakeSignsContinuous(std::span<Pose> poses);

/// A pose with the name of the thing that has it; orientation may be unknown.
struct NamedPose {
  std::string name;
  Pose base_T_object;
  bool has_orientation = true;
};

}  // namespace exemplar::geometry
