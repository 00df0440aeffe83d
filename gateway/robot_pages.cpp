#include "gateway/robot_pages.hpp"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <variant>

namespace exemplar::gateway {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

std::string ToText(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

/// Shape and size; nothing for a mesh.
std::optional<Json> ShapeJson(const kinematics::Shape& shape) {
  if (const auto* box = std::get_if<kinematics::Box>(&shape)) {
    return Json{{"shape", "box"}, {"size", {box->size.x(), box->size.y(), box->size.z()}}};
  }
  if (const auto* sphere = std::get_if<kinematics::Sphere>(&shape)) {
    return Json{{"shape", "sphere"}, {"size", {sphere->radius}}};
  }
  if (const auto* cylinder = std::get_if<kinematics::Cylinder>(&shape)) {
    return Json{{"shape", "cylinder"}, {"size", {cylinder->radius, cylinder->length}}};
  }
  if (const auto* capsule = std::get_if<kinematics::Capsule>(&shape)) {
    return Json{{"shape", "capsule"}, {"size", {capsule->radius, capsule->length}}};
  }
  return std::nullopt;
}

Json PoseJson(const geometry::Pose& pose) {
  const Eigen::Vector3d& p = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  return {{"position", {p.x(), p.y(), p.z()}}, {"quaternion", {q.x(), q.y(), q.z(), q.w()}}};
}

/// Housing and cap in one: the cap's upper face is where the contact is.
Json ButtonJson(const scene::Button& button) {
  const geometry::Pose object_T_shape{
      button.object_p_contact - 0.5 * button.height_m * button.object_normal,
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), button.object_normal)};
  return {{"name", button.name},
          {"kind", "button"},
          {"shape", "cylinder"},
          {"size", {button.radius_m, button.height_m}},
          {"pose", PoseJson(button.base_T_object)},
          {"offset", PoseJson(object_T_shape)}};
}

bool IsBelow(const fs::path& path, const fs::path& folder) {
  const fs::path relative = path.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

/// Of which the robot's paths are told: its folder, or the URDF's package where that is elsewhere.
fs::path RootOf(const kinematics::RobotDescription& robot) {
  const fs::path folder = fs::absolute(robot.folder).lexically_normal();
  const fs::path urdf = fs::absolute(robot.urdf).lexically_normal();
  return IsBelow(urdf, folder) ? folder : urdf.parent_path().parent_path();
}

}  // namespace

Result<StaticFiles> RobotFiles(const kinematics::RobotDescription& robot) {
  return ReadStaticFiles(RootOf(robot));
}

std::string RobotJson(const kinematics::RobotDescription& robot, const StaticFiles& files) {
  const fs::path urdf = fs::absolute(robot.urdf).lexically_normal();
  Json home = Json::object();
  const std::vector<std::string> joints = robot.chain.joint_names();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    home[joints[i]] = robot.home[static_cast<Eigen::Index>(i)];
  }
  Json paths = Json::array();
  for (const auto& file : files) paths.push_back(file.first);
  return ToText({{"name", robot.name},
                 {"base", robot.chain.base_link()},
                 {"tip", robot.chain.tip_link()},
                 {"urdf", urdf.lexically_relative(RootOf(robot)).generic_string()},
                 {"joints", joints},
                 {"home", std::move(home)},
                 {"files", std::move(paths)}});
}

std::string SceneJson(const scene::Description& scene) {
  Json bodies = Json::array();
  Json left_out = Json::array();
  const auto add = [&](const char* kind, const std::string& name, const kinematics::Shape& shape,
                       const geometry::Pose& base_T_body) {
    std::optional<Json> drawn = ShapeJson(shape);
    if (!drawn) {
      left_out.push_back(name);
      return;
    }
    Json body = {{"name", name}, {"kind", kind}};
    body.update(*drawn);
    body["pose"] = PoseJson(base_T_body);
    body["offset"] = PoseJson({});
    bodies.push_back(std::move(body));
  };
  for (const scene::Obstacle& one : scene.obstacles) {
    add("obstacle", one.name, one.shape, one.base_T_shape);
  }
  for (const scene::Object& one : scene.objects) {
    add("object", one.name, one.shape, one.base_T_object);
  }
  for (const scene::Button& one : scene.buttons) bodies.push_back(ButtonJson(one));
  for (const scene::Cloud& one : scene.clouds) left_out.push_back(one.name);
  for (const scene::Held& one : scene.held) left_out.push_back(one.name);
  return ToText({{"bodies", std::move(bodies)}, {"left_out", std::move(left_out)}});
}

}  // namespace exemplar::gateway
