#pragma once
// Which joint of a suit drives which joint of a robot, as a YAML file
// (deploy/models/<robot>/suit.yaml):
//
//   same_names: true     # default: joints of the suit drive the robot's of the same names, unless
//                        # an entry says otherwise
//   joints:
//     - {suit: RightElbow, robot: right_elbow_in_out, scale: -1, offset: 1.57}
//
// The robot's joint is asked to be at scale * suit + offset (rad or m); scale is 1 and offset 0
// unless said. Joints of the suit that drive nothing are left aside; joints of the robot that
// nothing drives stay where they are.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::executor {

struct JointMapEntry {
  std::string suit;
  int joint = 0;  ///< of the robot's chain
  double scale = 1;
  double offset = 0;
};

/// A suit's joints on a robot's. Immutable.
class JointMap {
 public:
  /// Same names alone.
  explicit JointMap(std::vector<std::string> robot_joints);
  /// Errors name file, line and entry, and offer the nearest name. A joint of the robot has one
  /// entry at the most; scale is finite and not 0.
  static Result<JointMap> Parse(std::string_view yaml, const std::string& source,
                                std::vector<std::string> robot_joints);
  static Result<JointMap> Read(const std::filesystem::path& file,
                               std::vector<std::string> robot_joints);

  const std::vector<std::string>& robot_joints() const { return robot_joints_; }
  /// What drives each joint of the robot in samples with these names of joints: one entry a joint
  /// that is driven, with the place of its value.
  struct Binding {
    int place = 0;
    int joint = 0;
    double scale = 1;
    double offset = 0;
  };
  std::vector<Binding> Bind(const std::vector<std::string>& suit_joints) const;

 private:
  std::vector<std::string> robot_joints_;
  std::vector<JointMapEntry> entries_;
  bool same_names_ = true;
};

}  // namespace exemplar::executor
