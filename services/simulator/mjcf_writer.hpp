#pragma once
// Writes the simulated world as MuJoCo's XML: the robot from its kinematic model, the scene around
// it. The world's frame is the robot's base frame. Numbers are written so that they read back
// exactly.

#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::simulator {

struct MjcfOptions {
  double step_s = 1e-3;
  /// Reflected inertia of a joint's drive, kg m^2 (kg for a prismatic one).
  double armature = 0.05;
  /// Friction of a joint that grows with its speed, N m s / rad.
  double joint_damping = 0.1;
  /// Pairs of links that never touch each other, beside those that a joint connects.
  std::vector<std::pair<std::string, std::string>> excluded_links = {};
};

/// What a button's mechanism is made of. Depth x grows from 0 (released) to the travel; the spring
/// pushes back with force(x), reaches the click force at click_depth_m and is preloaded at x = 0.
struct ButtonMechanism {
  double stiffness_n_m = 0;
  double preload_n = 0;
  double cap_mass_kg = 0;
  double damping_n_s_m = 0;
  double click_depth_m = 0;    ///< clicks on the way down
  double release_depth_m = 0;  ///< can click again once it came up to here

  double Force(double depth_m) const { return preload_n + stiffness_n_m * depth_m; }
};
ButtonMechanism MechanismOf(const scene::Button& button);

/// Names of the parts in the model. Links and joints keep theirs behind a prefix, so that a link
/// called "world" or like an obstacle does no harm.
std::string LinkBody(const std::string& link);
std::string RobotJoint(const std::string& joint);
std::string ThingBody(const std::string& thing);  ///< an obstacle, an object, a button's housing
std::string CapBody(const std::string& button);
std::string CapJoint(const std::string& button);
std::string EyeName(const std::string& camera, bool right);

/// Joints that hold still because no chain moves them keep the value nearest to 0 within limits,
/// by servos of default gains. Meshes that MuJoCo cannot read (neither STL nor OBJ) are errors
/// where they collide and are left out where they are only seen.
Result<std::string> WriteMjcf(const kinematics::RobotDescription& robot,
                              const scene::Description& scene, const MjcfOptions& options = {});

}  // namespace exemplar::simulator
