#pragma once
// A robot as read from a URDF: a tree of links and joints, as plain values.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::kinematics {

// Shapes are centred on their own frame, as in URDF. Metres.
struct Box {
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
};
struct Sphere {
  double radius = 0;
};
struct Cylinder {  ///< axis along z
  double radius = 0;
  double length = 0;
};
struct Capsule {  ///< axis along z; `length` without the caps. URDF has no capsules; scenes do.
  double radius = 0;
  double length = 0;
};
struct Mesh {
  std::string path;  ///< resolved file
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  bool convex = false;  ///< taken by its convex hull, which fills hollows and closes open meshes
};
using Shape = std::variant<Box, Sphere, Cylinder, Capsule, Mesh>;

struct Geometry {
  geometry::Pose link_T_shape;
  Shape shape;
};

struct Inertial {
  geometry::Pose link_T_inertia;
  double mass_kg = 0;
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();  ///< about the inertia frame
};

struct Link {
  std::string name;
  int parent_joint = -1;  ///< index into RobotModel::joints, -1 for the root
  std::vector<Geometry> collisions;
  std::vector<Geometry> visuals;
  std::optional<Inertial> inertial;
  std::optional<Eigen::Vector4d> colour;  ///< rgba of the first visual
};

enum class JointType { kFixed, kRevolute, kContinuous, kPrismatic };

// Used where a URDF says nothing: it has no acceleration and jerk limits, and continuous joints may
// go without any.
inline constexpr double kDefaultAcceleration = 10.0;  // rad/s^2 or m/s^2
/// The default acceleration is reached within a twentieth of a second.
inline constexpr double kDefaultJerk = 200.0;    // rad/s^3 or m/s^3
inline constexpr double kDefaultVelocity = 3.0;  // rad/s
inline constexpr double kDefaultEffort = 100.0;  // N m

struct JointLimits {
  double lower = 0;  ///< rad or m; -infinity for continuous joints
  double upper = 0;
  double velocity = 0;         ///< rad/s or m/s, positive
  double effort = 0;           ///< N m or N, positive
  double acceleration = 0;     ///< rad/s^2 or m/s^2; kDefaultAcceleration unless robot.yaml says
  double jerk = kDefaultJerk;  ///< rad/s^3 or m/s^3, positive; kDefaultJerk unless robot.yaml says
};

struct Mimic {
  int joint = -1;  ///< index of the joint that leads
  double multiplier = 1;
  double offset = 0;
};

struct Joint {
  std::string name;
  JointType type = JointType::kFixed;
  int parent_link = -1;
  int child_link = -1;
  geometry::Pose parent_T_joint;                    ///< at q = 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit, in the joint frame
  JointLimits limits;
  std::optional<Mimic> mimic;
};

/// A hand that opens and closes by one joint of the model; others follow that by mimic. No chain
/// moves it.
struct Hand {
  int joint = -1;     ///< index into RobotModel::joints
  double closed = 0;  ///< the joint's position (rad or m), within its limits
  double open = 0;    ///< likewise; not `closed`

  /// Where the joint stands at an opening from 0 (closed) to 1 (open), and back.
  double PositionAt(double opening) const { return closed + opening * (open - closed); }
  double OpeningAt(double position) const { return (position - closed) / (open - closed); }
};

/// A tree of links. Links and joints are ordered so that parents come before children; link 0 is
/// the root.
struct RobotModel {
  std::string name;
  std::vector<Link> links;
  std::vector<Joint> joints;
  std::optional<Hand> hand = {};  ///< robot.yaml says which

  int FindLink(std::string_view name) const;   ///< -1 when there is none
  int FindJoint(std::string_view name) const;  ///< -1 when there is none
};

/// Errors name file, line and element: `arm.urdf:41: joint "elbow": limit velocity is -2, must be
/// positive`.
Result<RobotModel> ReadUrdf(const std::filesystem::path& file);
/// `source` names the text in errors; `folder` is where relative mesh paths and package:// start.
Result<RobotModel> ParseUrdf(std::string_view text, std::string_view source,
                             const std::filesystem::path& folder = {});

}  // namespace exemplar::kinematics
