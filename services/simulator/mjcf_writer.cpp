#include "simulator/mjcf_writer.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>

#include "exemplar/base/text.hpp"
#include "exemplar/perception/markers.hpp"
#include "simulator/xml_text.hpp"

namespace exemplar::simulator {
namespace {

using kinematics::Joint;
using kinematics::JointType;
using kinematics::Link;

// MuJoCo draws groups 0 to 2 and leaves out 3 to 5.
constexpr double kSeenGroup = 1;
constexpr double kHiddenGroup = 4;
/// A contact settles within a few of these; firm enough that a fingertip sinks in by less than a
/// millimetre, soft enough that it does not chatter at 1 ms steps.
constexpr double kContactTime = 0.004;
constexpr double kRobotDensity = 1000;  // kg/m^3, for links without inertia

Attributes ContactAttributes() {
  return {{"solref", {kContactTime, 1}},
          {"solimp", {0.9, 0.95, 0.001}},
          {"friction", {0.8, 0.005, 0.0001}}};
}
/// Links touch links and things; things do not touch each other, so that a button may stand in a
/// table.
Attributes LinkContact() {
  return ContactAttributes() + Attributes{{"contype", 1.0}, {"conaffinity", 3.0}};
}
Attributes ThingContact() {
  return ContactAttributes() + Attributes{{"contype", 2.0}, {"conaffinity", 1.0}};
}
/// Movable objects touch links, things and each other; what they say of friction counts for both.
/// They resist turning and rolling on the spot a little, as real ones do.
Attributes ObjectContact(double friction) {
  return {{"solref", {kContactTime, 1}},
          {"solimp", {0.95, 0.99, 0.001}},
          {"friction", {friction, 0.005, 0.0005}},
          {"priority", 1.0},
          {"condim", 6.0},
          {"contype", 4.0},
          {"conaffinity", 7.0}};
}
Attributes SeenOnly() { return {{"contype", 0.0}, {"conaffinity", 0.0}, {"mass", 0.0}}; }

/// Meshes by file and scale, each written once.
class MeshTable {
 public:
  /// The mesh's name in the model.
  std::string NameOf(const kinematics::Mesh& mesh) {
    const std::string key = mesh.path + '|' + FormatDouble(mesh.scale.x()) + '|' +
                            FormatDouble(mesh.scale.y()) + '|' + FormatDouble(mesh.scale.z());
    const auto [it, fresh] = names_.emplace(key, "mesh" + std::to_string(names_.size()));
    if (fresh) meshes_.emplace_back(it->second, mesh);
    return it->second;
  }
  void Write(XmlText& xml) const {
    for (const auto& entry : meshes_) {
      xml.Empty("mesh", {{"name", entry.first},
                         {"file", std::filesystem::absolute(entry.second.path).string()},
                         {"scale", entry.second.scale}});
    }
  }

 private:
  std::map<std::string, std::string> names_;
  std::vector<std::pair<std::string, kinematics::Mesh>> meshes_;
};

bool MeshIsReadable(const kinematics::Shape& shape) {
  const auto* mesh = std::get_if<kinematics::Mesh>(&shape);
  if (mesh == nullptr) return true;
  std::string ending = std::filesystem::path(mesh->path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending == ".stl" || ending == ".obj";
}

/// type, size and mesh of a shape; MuJoCo takes halves.
Attributes ShapeAttributes(const kinematics::Shape& shape, MeshTable& meshes) {
  struct Visitor {
    MeshTable& meshes;
    Attributes operator()(const kinematics::Box& box) const {
      return {{"type", "box"}, {"size", Eigen::Vector3d(0.5 * box.size)}};
    }
    Attributes operator()(const kinematics::Sphere& sphere) const {
      return {{"type", "sphere"}, {"size", sphere.radius}};
    }
    Attributes operator()(const kinematics::Cylinder& cylinder) const {
      return {{"type", "cylinder"}, {"size", {cylinder.radius, 0.5 * cylinder.length}}};
    }
    Attributes operator()(const kinematics::Capsule& capsule) const {
      return {{"type", "capsule"}, {"size", {capsule.radius, 0.5 * capsule.length}}};
    }
    Attributes operator()(const kinematics::Mesh& mesh) const {
      return {{"type", "mesh"}, {"mesh", meshes.NameOf(mesh)}};
    }
  };
  return std::visit(Visitor{meshes}, shape);
}

Attribute Colour(const Eigen::Vector4d& rgba) {
  return {"rgba", {rgba.x(), rgba.y(), rgba.z(), rgba.w()}};
}

class Writer {
 public:
  Writer(const kinematics::RobotDescription& robot, const scene::Description& scene,
         const MjcfOptions& options)
      : robot_(robot), model_(robot.model), scene_(scene), options_(options) {}

  Result<std::string> Write() {
    if (Status status = CollectMeshes(); !status) return status.error();
    xml_.Open("mujoco", {{"model", model_.name}});
    xml_.Empty("compiler", {{"angle", "radian"},
                            {"coordinate", "local"},
                            {"balanceinertia", "true"},
                            {"boundmass", 1e-3},
                            {"boundinertia", 1e-6}});
    WriteOptions();
    xml_.Empty("statistic", {{"extent", 1.0}, {"center", {0, 0, 0}}});
    WriteVisual();
    xml_.Open("asset");
    WriteMaterials();
    meshes_.Write(xml_);
    xml_.Close();
    xml_.Open("worldbody");
    WriteLightAndCameras();
    WriteRobot();
    for (const scene::Obstacle& obstacle : scene_.obstacles) WriteObstacle(obstacle);
    for (const scene::Button& button : scene_.buttons) WriteButton(button);
    for (const scene::Object& object : scene_.objects) WriteObject(object);
    xml_.Close();
    WriteExclusions();
    WriteMimics();
    WriteServos();
    xml_.Close();
    return std::move(xml_).Take();
  }

 private:
  Status CollectMeshes() {
    const auto collect = [this](const kinematics::Shape& shape) {
      if (const auto* mesh = std::get_if<kinematics::Mesh>(&shape)) meshes_.NameOf(*mesh);
    };
    for (const Link& link : model_.links) {
      for (const kinematics::Geometry& part : link.collisions) {
        if (!MeshIsReadable(part.shape)) {
          return InvalidArgument("link \"" + link.name +
                                 "\": the simulator reads STL and OBJ, not " +
                                 std::get<kinematics::Mesh>(part.shape).path);
        }
        collect(part.shape);
      }
      for (const kinematics::Geometry& part : link.visuals) {
        if (MeshIsReadable(part.shape)) collect(part.shape);
      }
    }
    for (const scene::Obstacle& obstacle : scene_.obstacles) {
      if (!MeshIsReadable(obstacle.shape)) {
        return InvalidArgument("obstacle \"" + obstacle.name +
                               "\": the simulator reads STL and OBJ, not " +
                               std::get<kinematics::Mesh>(obstacle.shape).path);
      }
      collect(obstacle.shape);
    }
    for (const scene::Object& object : scene_.objects) {
      if (!MeshIsReadable(object.shape)) {
        return InvalidArgument("object \"" + object.name +
                               "\": the simulator reads STL and OBJ, not " +
                               std::get<kinematics::Mesh>(object.shape).path);
      }
      collect(object.shape);
    }
    return {};
  }

  void WriteOptions() {
    const bool moves = std::any_of(scene_.objects.begin(), scene_.objects.end(),
                                   [](const scene::Object& object) { return !object.fixed; });
    Attributes option = {
        {"timestep", options_.step_s}, {"integrator", "implicit"}, {"cone", "elliptic"}};
    // Firmer friction, so that what is held does not creep out of the hand.
    if (moves) option.push_back({"impratio", 10.0});
    xml_.Open("option", option);
    // A cylinder stands on more than one point of its rim.
    if (moves) xml_.Empty("flag", {{"multiccd", "enable"}});
    xml_.Close();
    const double objects = static_cast<double>(scene_.objects.size());
    xml_.Empty("size", {{"njmax", 800 + 200 * objects}, {"nconmax", 200 + 40 * objects}});
  }

  void WriteVisual() {
    int width = 16;
    int height = 16;
    for (const scene::StereoCamera& camera : scene_.cameras) {
      width = std::max(width, camera.width);
      height = std::max(height, camera.height);
    }
    xml_.Open("visual");
    xml_.Empty("global",
               {{"offwidth", std::to_string(width)}, {"offheight", std::to_string(height)}});
    xml_.Empty("quality", {{"offsamples", 4.0}, {"numslices", 40.0}, {"numstacks", 24.0}});
    xml_.Empty("map", {{"znear", 0.02}, {"zfar", 20.0}});
    xml_.Empty("headlight", {{"ambient", {0.35, 0.35, 0.35}},
                             {"diffuse", {0.3, 0.3, 0.3}},
                             {"specular", {0.1, 0.1, 0.1}}});
    xml_.Close();
  }

  void WriteMaterials() {
    xml_.Empty("texture", {{"type", "skybox"},
                           {"builtin", "gradient"},
                           {"rgb1", {0.55, 0.62, 0.7}},
                           {"rgb2", {0.2, 0.22, 0.26}},
                           {"width", 64.0},
                           {"height", 384.0}});
    const auto material = [this](const char* name, const Eigen::Vector4d& rgba, double emission) {
      xml_.Empty("material", {{"name", name},
                              Colour(rgba),
                              {"emission", emission},
                              {"specular", 0.0},
                              {"shininess", 0.0}});
    };
    material("ink", {0.03, 0.03, 0.03, 1}, 0);
    material("paper", {0.95, 0.95, 0.95, 1}, 0.3);
    material("housing", {0.25, 0.27, 0.3, 1}, 0);
    material("cap", {0.8, 0.12, 0.1, 1}, 0.1);
    material("block", {0.2, 0.42, 0.75, 1}, 0);
    material("tray", {0.35, 0.55, 0.38, 1}, 0);
    material("obstacle", {0.62, 0.5, 0.37, 1}, 0);
  }

  void WriteLightAndCameras() {
    xml_.Empty("light", {{"directional", "true"},
                         {"castshadow", "false"},
                         {"pos", {0, 0, 3}},
                         {"dir", {0.3, 0.2, -1}},
                         {"diffuse", {0.45, 0.45, 0.45}},
                         {"specular", {0.1, 0.1, 0.1}}});
    // MuJoCo's cameras look along -z with y up; optical frames along z with y down.
    const geometry::Pose optical_T_mujoco{Eigen::Vector3d::Zero(), Eigen::Quaterniond(0, 1, 0, 0)};
    for (const scene::StereoCamera& camera : scene_.cameras) {
      for (const bool right : {false, true}) {
        const geometry::Pose left_T_eye =
            geometry::Pose::FromTranslation({right ? camera.baseline_m : 0.0, 0, 0});
        xml_.Empty("camera",
                   Attributes{{"name", EyeName(camera.name, right)},
                              {"fovy", camera.fovy_rad * 180 / std::numbers::pi}} +
                       PoseAttributes(camera.base_T_left * left_T_eye * optical_T_mujoco));
      }
    }
  }

  // ---- robot

  void WriteRobot() {
    std::vector<geometry::Pose> root_T_links;
    kinematics::LinkPoses(model_, kinematics::FullJointVector(model_, robot_.chain, robot_.home),
                          root_T_links);
    const int base = model_.FindLink(robot_.chain.base_link());
    const geometry::Pose base_T_root = root_T_links[static_cast<std::size_t>(base)].Inverse();
    WriteLink(0, base_T_root);
  }

  void WriteLink(int index, const geometry::Pose& parent_T_link) {
    const Link& link = model_.links[static_cast<std::size_t>(index)];
    xml_.Open("body", Attributes{{"name", LinkBody(link.name)}} + PoseAttributes(parent_T_link));
    if (link.inertial && link.inertial->mass_kg > 0) WriteInertial(*link.inertial);
    if (link.parent_joint >= 0) {
      WriteJoint(model_.joints[static_cast<std::size_t>(link.parent_joint)]);
    }
    const bool has_looks =
        std::any_of(link.visuals.begin(), link.visuals.end(),
                    [](const kinematics::Geometry& part) { return MeshIsReadable(part.shape); });
    const Attribute colour = Colour(link.colour.value_or(Eigen::Vector4d(0.75, 0.77, 0.8, 1)));
    for (const kinematics::Geometry& part : link.collisions) {
      xml_.Empty("geom", ShapeAttributes(part.shape, meshes_) + PoseAttributes(part.link_T_shape) +
                             LinkContact() +
                             Attributes{{"density", kRobotDensity},
                                        {"group", has_looks ? kHiddenGroup : kSeenGroup},
                                        colour});
    }
    for (const kinematics::Geometry& part : link.visuals) {
      if (!MeshIsReadable(part.shape)) continue;
      xml_.Empty("geom", ShapeAttributes(part.shape, meshes_) + PoseAttributes(part.link_T_shape) +
                             SeenOnly() + Attributes{{"group", kSeenGroup}, colour});
    }
    for (const Joint& joint : model_.joints) {
      if (joint.parent_link == index) WriteLink(joint.child_link, joint.parent_T_joint);
    }
    xml_.Close();
  }

  void WriteInertial(const kinematics::Inertial& inertial) {
    const Eigen::Matrix3d link_R_inertia = inertial.link_T_inertia.rotation.toRotationMatrix();
    const Eigen::Matrix3d i = link_R_inertia * inertial.inertia_kg_m2 * link_R_inertia.transpose();
    xml_.Empty("inertial",
               {{"pos", inertial.link_T_inertia.translation},
                {"mass", inertial.mass_kg},
                {"fullinertia", {i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2)}}});
  }

  void WriteJoint(const Joint& joint) {
    if (joint.type == JointType::kFixed) return;
    Attributes attributes = {{"name", RobotJoint(joint.name)},
                             {"type", joint.type == JointType::kPrismatic ? "slide" : "hinge"},
                             {"axis", joint.axis},
                             {"armature", options_.armature},
                             {"damping", options_.joint_damping}};
    if (joint.type == JointType::kContinuous) {
      attributes.emplace_back("limited", "false");
    } else {
      attributes.emplace_back("limited", "true");
      attributes.push_back({"range", {joint.limits.lower, joint.limits.upper}});
    }
    xml_.Empty("joint", attributes);
  }

  /// Links that a joint connects, fixed ones seen through: they overlap at the joint.
  void WriteExclusions() {
    std::set<std::pair<int, int>> pairs;
    for (const Joint& joint : model_.joints) {
      pairs.emplace(joint.parent_link, joint.child_link);
      // Up over the fixed joints above the parent, and down over those below the child.
      for (int up = joint.parent_link; up >= 0; up = FixedParent(up)) {
        pairs.emplace(up, joint.child_link);
        for (const int down : FixedDescendants(joint.child_link)) pairs.emplace(up, down);
      }
    }
    xml_.Open("contact");
    const auto exclude = [this](const std::string& a, const std::string& b) {
      xml_.Empty("exclude", {{"body1", a}, {"body2", b}});
    };
    for (const auto& pair : pairs) {
      exclude(LinkBody(model_.links[static_cast<std::size_t>(pair.first)].name),
              LinkBody(model_.links[static_cast<std::size_t>(pair.second)].name));
    }
    for (const auto& pair : options_.excluded_links) {
      exclude(LinkBody(pair.first), LinkBody(pair.second));
    }
    xml_.Close();
  }

  int FixedParent(int link) const {
    const int joint = model_.links[static_cast<std::size_t>(link)].parent_joint;
    if (joint < 0) return -1;
    const Joint& above = model_.joints[static_cast<std::size_t>(joint)];
    return above.type == JointType::kFixed ? above.parent_link : -1;
  }

  std::vector<int> FixedDescendants(int link) const {
    std::vector<int> found;
    for (const Joint& joint : model_.joints) {
      if (joint.parent_link != link || joint.type != JointType::kFixed) continue;
      found.push_back(joint.child_link);
      const std::vector<int> below = FixedDescendants(joint.child_link);
      found.insert(found.end(), below.begin(), below.end());
    }
    return found;
  }

  void WriteMimics() {
    xml_.Open("equality");
    for (const Joint& joint : model_.joints) {
      if (!joint.mimic || joint.type == JointType::kFixed) continue;
      const Joint& leader = model_.joints[static_cast<std::size_t>(joint.mimic->joint)];
      xml_.Empty("joint", {{"joint1", RobotJoint(joint.name)},
                           {"joint2", RobotJoint(leader.name)},
                           {"polycoef", {joint.mimic->offset, joint.mimic->multiplier, 0, 0, 0}},
                           {"solref", {kContactTime, 1}}});
    }
    xml_.Close();
  }

  /// force = stiffness (ctrl - q) - damping q', within the joint's effort: with
  /// ctrl = q_d + damping / stiffness q_d' a position and speed servo.
  void WriteServos() {
    xml_.Open("actuator");
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& joint = model_.joints[j];
      if (joint.type == JointType::kFixed || joint.mimic) continue;
      kinematics::ServoGains gains;
      const std::vector<int>& chain = robot_.chain.joint_indices();
      const auto it = std::find(chain.begin(), chain.end(), static_cast<int>(j));
      if (it != chain.end()) gains = robot_.servo[static_cast<std::size_t>(it - chain.begin())];
      if (model_.hand && model_.hand->joint == static_cast<int>(j)) gains = robot_.hand_servo;
      xml_.Empty("general", {{"name", RobotJoint(joint.name)},
                             {"joint", RobotJoint(joint.name)},
                             {"gaintype", "fixed"},
                             {"gainprm", gains.stiffness},
                             {"biastype", "affine"},
                             {"biasprm", {0, -gains.stiffness, -gains.damping}},
                             {"ctrllimited", "false"},
                             {"forcelimited", "true"},
                             {"forcerange", {-joint.limits.effort, joint.limits.effort}}});
    }
    xml_.Close();
  }

  // ---- scene

  void OpenThing(const std::string& name, const geometry::Pose& base_T_thing) {
    xml_.Open("body", Attributes{{"name", ThingBody(name)}, {"mocap", "true"}} +
                          PoseAttributes(base_T_thing));
  }

  void WriteObstacle(const scene::Obstacle& obstacle) {
    OpenThing(obstacle.name, obstacle.base_T_shape);
    xml_.Empty("geom", ShapeAttributes(obstacle.shape, meshes_) + ThingContact() +
                           Attributes{{"material", "obstacle"}, {"group", kSeenGroup}});
    xml_.Close();
  }

  void WriteButton(const scene::Button& button) {
    const ButtonMechanism mechanism = MechanismOf(button);
    const geometry::Pose object_T_contact{
        button.object_p_contact,
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), button.object_normal)};
    // Pressed to its end, the cap still stands out of the housing a little.
    const double protrusion = button.travel_m + 0.1 * (button.height_m - button.travel_m);
    const double housing = button.height_m - protrusion;
    const auto cylinder = [&](double length, double top) {
      return Attributes{{"type", "cylinder"},
                        {"size", {button.radius_m, 0.5 * length}},
                        {"group", kSeenGroup}} +
             ThingContact() +
             PoseAttributes(object_T_contact *
                            geometry::Pose::FromTranslation({0, 0, top - 0.5 * length}));
    };
    OpenThing(button.name, button.base_T_object);
    xml_.Empty("geom", cylinder(housing, -protrusion) + Attributes{{"material", "housing"}});
    if (button.marker) WriteMarker(*button.marker);
    xml_.Open("body", {{"name", CapBody(button.name)}});
    const geometry::Pose object_T_middle =
        object_T_contact * geometry::Pose::FromTranslation({0, 0, -0.5 * protrusion});
    const double turning = mechanism.cap_mass_kg * button.radius_m * button.radius_m;
    xml_.Empty("inertial", {{"pos", object_T_middle.translation},
                            {"mass", mechanism.cap_mass_kg},
                            {"diaginertia", {turning, turning, turning}}});
    xml_.Empty("joint", {{"name", CapJoint(button.name)},
                         {"type", "slide"},
                         {"axis", Eigen::Vector3d(-button.object_normal)},
                         {"limited", "true"},
                         {"range", {0, button.travel_m}},
                         {"stiffness", mechanism.stiffness_n_m},
                         {"springref", -mechanism.preload_n / mechanism.stiffness_n_m},
                         {"damping", mechanism.damping_n_s_m},
                         {"solreflimit", {kContactTime, 1}},
                         {"solimplimit", {0.95, 0.99, 0.0005}}});
    xml_.Empty("geom", cylinder(protrusion, 0) + Attributes{{"material", "cap"}});
    xml_.Close();
    xml_.Close();
  }

  void WriteObject(const scene::Object& object) {
    const Attributes shape =
        ShapeAttributes(object.shape, meshes_) + Attributes{{"group", kSeenGroup}};
    if (object.fixed) {
      OpenThing(object.name, object.base_T_object);
      xml_.Empty("geom", shape + ThingContact() + Attributes{{"material", "tray"}});
    } else {
      xml_.Open("body", Attributes{{"name", ThingBody(object.name)}} +
                            PoseAttributes(object.base_T_object));
      xml_.Empty("freejoint", {{"name", ThingBody(object.name)}});
      xml_.Empty("geom", shape + ObjectContact(object.friction) +
                             Attributes{{"mass", object.mass_kg}, {"material", "block"}});
    }
    if (object.marker) WriteMarker(*object.marker);
    xml_.Close();
  }

  /// The pattern as thin plates: paper with a quiet zone of one cell, the black square, the white
  /// cells. The black square's face lies in the marker's plane.
  void WriteMarker(const scene::Marker& marker) {
    constexpr double kStep = 1e-4;
    const double cell = marker.size_m / perception::kMarkerCells;
    const auto plate = [&](const Eigen::Vector2d& centre, const Eigen::Vector2d& size, double top,
                           const char* material) {
      constexpr double kHalf = 5e-4;
      xml_.Empty("geom", Attributes{{"type", "box"},
                                    {"size", {0.5 * size.x(), 0.5 * size.y(), kHalf}},
                                    {"material", material},
                                    {"group", kSeenGroup}} +
                             SeenOnly() +
                             PoseAttributes(marker.object_T_marker *
                                            geometry::Pose::FromTranslation(
                                                {centre.x(), centre.y(), top - kHalf})));
    };
    const double paper = marker.size_m + 2 * cell;
    plate({0, 0}, {paper, paper}, -2 * kStep, "paper");
    plate({0, 0}, {marker.size_m, marker.size_m}, 0, "ink");
    const Result<perception::MarkerCells> cells = perception::MarkerPattern(marker.id);
    if (!cells) return;  // The scene's reader allows known ids only.
    constexpr int kCells = perception::kMarkerCells;
    for (int row = 0; row < kCells; ++row) {
      for (int column = 0; column < kCells; ++column) {
        const auto white = [&](int c) {
          return c < kCells && (*cells)[static_cast<std::size_t>(row)][static_cast<std::size_t>(c)];
        };
        if (!white(column)) continue;
        const int first = column;
        while (white(column)) ++column;
        const double width = (column - first) * cell;
        plate({(first - 0.5 * kCells) * cell + 0.5 * width, (0.5 * kCells - row - 0.5) * cell},
              {width, cell}, kStep, "paper");
      }
    }
  }

  const kinematics::RobotDescription& robot_;
  const kinematics::RobotModel& model_;
  const scene::Description& scene_;
  const MjcfOptions& options_;
  MeshTable meshes_;
  XmlText xml_;
};

}  // namespace

ButtonMechanism MechanismOf(const scene::Button& button) {
  // A quarter of the click force preloads the spring; the rest is reached at three quarters of the
  // travel, where it clicks.
  ButtonMechanism mechanism;
  mechanism.stiffness_n_m = button.click_force_n / button.travel_m;
  mechanism.preload_n = 0.25 * button.click_force_n;
  mechanism.click_depth_m = 0.75 * button.travel_m;
  mechanism.release_depth_m = 0.4 * button.travel_m;
  mechanism.cap_mass_kg = 0.01;
  // Critically damped.
  mechanism.damping_n_s_m = 2 * std::sqrt(mechanism.stiffness_n_m * mechanism.cap_mass_kg);
  return mechanism;
}

std::string LinkBody(const std::string& link) { return "link/" + link; }
std::string RobotJoint(const std::string& joint) { return "joint/" + joint; }
std::string ThingBody(const std::string& thing) { return "thing/" + thing; }
std::string CapBody(const std::string& button) { return "cap/" + button; }
std::string CapJoint(const std::string& button) { return "press/" + button; }
std::string EyeName(const std::string& camera, bool right) {
  return (right ? "right/" : "left/") + camera;
}

Result<std::string> WriteMjcf(const kinematics::RobotDescription& robot,
                              const scene::Description& scene, const MjcfOptions& options) {
  return Writer(robot, scene, options).Write();
}

}  // namespace exemplar::simulator
