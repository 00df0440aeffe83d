#pragma once
// What a page needs to draw a robot and its place of work.

#include <string>

#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/scene/description.hpp"
#include "gateway/static_pages.hpp"

namespace exemplar::gateway {

/// The robot's own files: of its folder, and of the URDF's package where that lies elsewhere.
Result<StaticFiles> RobotFiles(const kinematics::RobotDescription& robot);

/// {"name", "base", "tip", "urdf": a path of `files`, "joints", "home": {joint: value},
/// "files": [path, ...]}
std::string RobotJson(const kinematics::RobotDescription& robot, const StaticFiles& files);

/// {"bodies": [{"name", "kind": "obstacle"|"button"|"object", "shape": "box"|"sphere"|"cylinder"|
/// "capsule", "size": [...], "pose", "offset"}, ...], "left_out": [name, ...]}. A shape's size is a
/// box's three edges, else radius and length; `pose` is base_T_object and `offset` object_T_shape,
/// each {"position": [x, y, z], "quaternion": [x, y, z, w]}. What has no such shape is left out.
std::string SceneJson(const scene::Description& scene);

}  // namespace exemplar::gateway
