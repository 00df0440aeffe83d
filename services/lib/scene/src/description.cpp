#include "exemplar/scene/description.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

#include "exemplar/base/text.hpp"
#include "points_file.hpp"
#include "yaml_reader.hpp"

namespace exemplar::scene {
namespace {

constexpr int kMarkerIds = 50;

geometry::Pose ReadPose(const MapReader& map) {
  return {map.Vector("position", std::nullopt), map.Quaternion("quaternion")};
}

kinematics::Shape ReadShape(const MapReader& map, const std::filesystem::path& folder) {
  const std::string kind = map.Text("shape");
  const auto refuse = [&](const std::string& key) {
    if (map.Has(key)) map.Complain(key, "does not belong to a " + kind);
  };
  const auto positive = [&](const std::string& key) {
    return map.Number(key, std::nullopt, Range::kPositive);
  };
  for (const char* key : {"size", "radius", "length", "mesh", "scale", "convex"}) {
    const std::string k = key;
    const bool belongs =
        (kind == "box" && k == "size") || (kind == "sphere" && k == "radius") ||
        ((kind == "cylinder" || kind == "capsule") && (k == "radius" || k == "length")) ||
        (kind == "mesh" && (k == "mesh" || k == "scale" || k == "convex"));
    if (!belongs) refuse(k);
  }
  if (kind == "box") {
    return kinematics::Box{map.Vector("size", std::nullopt, Range::kPositive)};
  }
  if (kind == "sphere") return kinematics::Sphere{positive("radius")};
  if (kind == "cylinder") return kinematics::Cylinder{positive("radius"), positive("length")};
  if (kind == "capsule") return kinematics::Capsule{positive("radius"), positive("length")};
  if (kind == "mesh") {
    return kinematics::Mesh{
        (folder / map.Text("mesh")).lexically_normal().string(),
        map.Vector("scale", Eigen::Vector3d(Eigen::Vector3d::Ones()), Range::kPositive),
        map.Flag("convex", false)};
  }
  map.Complain("shape", '"' + kind + "\" is none of box, sphere, cylinder, capsule, mesh");
  return kinematics::Box{};
}

Cloud ReadCloud(const MapReader& map, const std::filesystem::path& folder) {
  Cloud cloud;
  cloud.name = map.Text("name");
  cloud.base_T_cloud = ReadPose(map);
  cloud.resolution_m = map.Number("resolution", cloud.resolution_m, Range::kPositive);
  const std::string file = map.Text("file");
  if (file.empty()) return cloud;
  Result<std::vector<Eigen::Vector3d>> points = ReadPoints(folder / file);
  if (points.ok()) {
    cloud.cloud_p_points = *std::move(points);
  } else {
    map.Complain("file", points.error().message);
  }
  return cloud;
}

Marker ReadMarker(const MapReader& map) {
  Marker marker;
  marker.id = map.Integer("id", std::nullopt, 0, kMarkerIds - 1);
  marker.size_m = map.Number("size", marker.size_m, Range::kPositive);
  marker.object_T_marker = ReadPose(map);
  return marker;
}

Rail ReadRail(const MapReader& map) {
  constexpr double kFastest_m_s = 0.2;
  Rail rail;
  rail.base_direction = map.Direction("direction", rail.base_direction);
  rail.length_m = map.Number("length", std::nullopt, Range::kPositive);
  rail.speed_m_s = map.Number("speed", std::nullopt, Range::kNotNegative);
  if (rail.speed_m_s > kFastest_m_s) {
    map.Complain("speed", FormatDouble(rail.speed_m_s) + " m/s is too fast, at most " +
                              FormatDouble(kFastest_m_s) + " are allowed");
  }
  return rail;
}

Button ReadButton(Findings& findings, const MapReader& map) {
  Button button;
  button.name = map.Text("name");
  button.base_T_object = ReadPose(map);
  button.object_p_contact = map.Vector("contact", button.object_p_contact);
  button.object_normal = map.Direction("normal", button.object_normal);
  button.radius_m = map.Number("radius", button.radius_m, Range::kPositive);
  button.height_m = map.Number("height", button.height_m, Range::kPositive);
  button.travel_m = map.Number("travel", button.travel_m, Range::kPositive);
  button.click_force_n = map.Number("click_force", button.click_force_n, Range::kPositive);
  if (button.travel_m >= button.height_m) {
    map.Complain("travel", "must be less than the housing's height");
  }
  if (map.Has("marker")) {
    button.marker = ReadMarker(MapReader(findings, map.Child("marker"), map.PathOf("marker"),
                                         {"id", "size", "position", "quaternion"}));
  }
  if (map.Has("rail")) {
    button.rail = ReadRail(MapReader(findings, map.Child("rail"), map.PathOf("rail"),
                                     {"direction", "length", "speed"}));
  }
  return button;
}

Object ReadObject(Findings& findings, const MapReader& map, const std::filesystem::path& folder) {
  Object object{map.Text("name"), ReadPose(map), ReadShape(map, folder)};
  object.fixed = map.Flag("fixed", object.fixed);
  if (object.fixed && map.Has("mass")) map.Complain("mass", "does not belong to a fixed object");
  if (!object.fixed && std::holds_alternative<kinematics::Mesh>(object.shape)) {
    map.Complain("shape", "only a fixed object may be a mesh");
  }
  object.mass_kg = map.Number("mass", object.mass_kg, Range::kPositive);
  object.friction = map.Number("friction", object.friction, Range::kPositive);
  if (map.Has("marker")) {
    object.marker = ReadMarker(MapReader(findings, map.Child("marker"), map.PathOf("marker"),
                                         {"id", "size", "position", "quaternion"}));
  }
  return object;
}

/// Optical frame from where the camera stands and what it looks at.
Eigen::Quaterniond LookAt(const MapReader& map, const Eigen::Vector3d& position) {
  const Eigen::Vector3d target = map.Vector("look_at", std::nullopt);
  const Eigen::Vector3d up = map.Direction("up", Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d forward = target - position;
  if (forward.norm() < 1e-6) {
    map.Complain("look_at", "is where the camera stands");
    return Eigen::Quaterniond::Identity();
  }
  const Eigen::Vector3d z = forward.normalized();
  const Eigen::Vector3d right = z.cross(up);
  if (right.norm() < 1e-3) {
    map.Complain(map.Has("up") ? "up" : "look_at",
                 "the camera looks along \"up\"; give another direction for the picture's top");
    return Eigen::Quaterniond::Identity();
  }
  const Eigen::Vector3d x = right.normalized();
  Eigen::Matrix3d base_R_optical;
  base_R_optical << x, z.cross(x), z;
  return Eigen::Quaterniond(base_R_optical).normalized();
}

StereoCamera ReadCamera(const MapReader& map) {
  StereoCamera camera;
  camera.name = map.Text("name");
  camera.base_T_left.translation = map.Vector("position", std::nullopt);
  if (map.Has("quaternion")) {
    if (map.Has("look_at")) map.Complain("look_at", "stands beside \"quaternion\"; give one");
    camera.base_T_left.rotation = map.Quaternion("quaternion");
  } else {
    camera.base_T_left.rotation = LookAt(map, camera.base_T_left.translation);
  }
  camera.baseline_m = map.Number("baseline", camera.baseline_m, Range::kPositive);
  camera.width = map.Integer("width", camera.width, 16, 4096);
  camera.height = map.Integer("height", camera.height, 16, 4096);
  const double fovy_deg = map.Number("fovy_deg", 50, Range::kPositive);
  if (fovy_deg > 170) map.Complain("fovy_deg", "must be at most 170");
  camera.fovy_rad = fovy_deg * std::numbers::pi / 180;
  camera.rate_hz = map.Number("rate_hz", camera.rate_hz, Range::kPositive);
  return camera;
}

Result<Description> Parse(std::string_view yaml, std::string_view source,
                          const std::filesystem::path& folder) {
  Findings findings{std::string(source)};
  YAML::Node document;
  try {
    document = YAML::Load(std::string(yaml));
  } catch (const YAML::Exception& e) {
    findings.Add(e.mark, "", e.msg);
    return findings.error();
  }
  Description description;
  if (document.IsNull()) return description;
  const MapReader top(findings, document, "",
                      {"obstacles", "clouds", "held", "buttons", "objects", "cameras"});
  std::set<std::string> things;
  std::set<std::string> cameras;
  const auto claim = [](std::set<std::string>& names, const MapReader& map,
                        const std::string& name) {
    if (!names.insert(name).second) map.Complain("name", '"' + name + "\" is taken already");
  };
  top.List("obstacles", [&](const YAML::Node& node, const std::string& path) {
    const MapReader map(findings, node, path,
                        {"name", "shape", "size", "radius", "length", "mesh", "scale", "convex",
                         "position", "quaternion"});
    Obstacle obstacle{map.Text("name"), ReadPose(map), ReadShape(map, folder)};
    claim(things, map, obstacle.name);
    description.obstacles.push_back(std::move(obstacle));
  });
  top.List("clouds", [&](const YAML::Node& node, const std::string& path) {
    const MapReader map(findings, node, path,
                        {"name", "file", "resolution", "position", "quaternion"});
    Cloud cloud = ReadCloud(map, folder);
    claim(things, map, cloud.name);
    description.clouds.push_back(std::move(cloud));
  });
  top.List("held", [&](const YAML::Node& node, const std::string& path) {
    const MapReader map(findings, node, path,
                        {"name", "link", "touch", "shape", "size", "radius", "length", "mesh",
                         "scale", "convex", "position", "quaternion"});
    Held held{map.Text("name"), map.Text("link"), ReadPose(map), ReadShape(map, folder),
              map.Texts("touch")};
    claim(things, map, held.name);
    description.held.push_back(std::move(held));
  });
  top.List("buttons", [&](const YAML::Node& node, const std::string& path) {
    const MapReader map(findings, node, path,
                        {"name", "position", "quaternion", "contact", "normal", "radius", "height",
                         "travel", "click_force", "marker", "rail"});
    Button button = ReadButton(findings, map);
    claim(things, map, button.name);
    description.buttons.push_back(std::move(button));
  });
  top.List("objects", [&](const YAML::Node& node, const std::string& path) {
    const MapReader map(findings, node, path,
                        {"name", "shape", "size", "radius", "length", "mesh", "scale", "convex",
                         "position", "quaternion", "mass", "friction", "fixed", "marker"});
    Object object = ReadObject(findings, map, folder);
    claim(things, map, object.name);
    description.objects.push_back(std::move(object));
  });
  top.List("cameras", [&](const YAML::Node& node, const std::string& path) {
    const MapReader map(findings, node, path,
                        {"name", "position", "quaternion", "look_at", "up", "baseline", "width",
                         "height", "fovy_deg", "rate_hz"});
    StereoCamera camera = ReadCamera(map);
    claim(cameras, map, camera.name);
    description.cameras.push_back(std::move(camera));
  });
  std::set<int> ids;
  for (const Marked& marked : MarkedThings(description)) {
    if (ids.insert(marked.marker.id).second) continue;
    const bool on_object =
        std::any_of(description.objects.begin(), description.objects.end(),
                    [&](const Object& object) { return object.name == marked.name; });
    top.Complain(on_object ? "objects" : "buttons",
                 "marker id " + std::to_string(marked.marker.id) + " of \"" + marked.name +
                     "\" is on another " + (on_object ? "thing" : "button") + " too");
  }
  if (!findings.ok()) return findings.error();
  return description;
}

}  // namespace

double StereoCamera::focal_px() const { return 0.5 * height / std::tan(0.5 * fovy_rad); }

double Rail::WayAt(double time_s) const {
  const double way = std::fmod(speed_m_s * time_s, 2 * length_m);
  return way > length_m ? 2 * length_m - way : way;
}

std::vector<Marked> MarkedThings(const Description& description) {
  std::vector<Marked> marked;
  for (const Button& button : description.buttons) {
    if (button.marker) marked.push_back({button.name, *button.marker});
  }
  for (const Object& object : description.objects) {
    if (object.marker) marked.push_back({object.name, *object.marker});
  }
  return marked;
}

Result<Description> ParseDescription(std::string_view yaml, std::string_view source) {
  return Parse(yaml, source, {});
}

Result<Description> ReadDescription(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return NotFound(file.string() + ": cannot be read", "scene");
  std::ostringstream text;
  text << in.rdbuf();
  return Parse(text.str(), file.string(), file.parent_path());
}

}  // namespace exemplar::scene
