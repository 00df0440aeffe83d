#include "simulator/placing.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "exemplar/base/text.hpp"

namespace exemplar::simulator {
namespace {

/// Beyond this a place is a slip of the hand, and bad for the physics.
constexpr double kFarthest_m = 100;

}  // namespace

std::string PoseText(const geometry::Pose& pose) {
  const Eigen::Vector3d& p = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  std::vector<std::string> numbers;
  for (const double v : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}) {
    numbers.push_back(FormatDouble(v));
  }
  return Join(numbers, ",");
}

Result<geometry::Pose> ReadPose(const std::map<std::string, std::string>& arguments,
                                geometry::Pose pose) {
  const auto read = [&](const std::string& key, double& value) -> Status {
    const auto it = arguments.find(key);
    if (it == arguments.end()) return {};
    const std::optional<double> number = ParseDouble(it->second);
    if (!number || !std::isfinite(*number)) {
      return InvalidArgument(key + ": \"" + it->second + "\" is not a finite number", key);
    }
    if (std::abs(*number) > kFarthest_m) {
      return InvalidArgument(key + " is " + it->second + ", must be within " +
                                 FormatDouble(kFarthest_m) + " m of the robot's base",
                             key);
    }
    value = *number;
    return {};
  };
  const char* position_keys[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    if (Status status = read(position_keys[i], pose.translation[i]); !status) return status.error();
  }
  const char* rotation_keys[] = {"qx", "qy", "qz", "qw"};
  const bool has_rotation = std::any_of(std::begin(rotation_keys), std::end(rotation_keys),
                                        [&](const char* key) { return arguments.contains(key); });
  if (!has_rotation) return pose;
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();  // x y z w
  for (int i = 0; i < 4; ++i) {
    if (Status status = read(rotation_keys[i], rotation[i]); !status) return status.error();
  }
  if (std::abs(rotation.norm() - 1) > 0.01) {
    return InvalidArgument(
        "qx, qy, qz, qw: norm is " + FormatFixed(rotation.norm(), 4) + ", must be 1", "qw");
  }
  pose.rotation = Eigen::Quaterniond(rotation[3], rotation[0], rotation[1], rotation[2]);
  pose.rotation.normalize();
  return pose;
}

}  // namespace exemplar::simulator
