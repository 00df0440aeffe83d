// The URDF reader. It stands on a plain XML parser rather than on urdfdom, because errors have to
// name the line and urdfdom keeps none; urdfdom is the peer that the tests compare with.

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <sstream>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::kinematics {
namespace {

using tinyxml2::XMLElement;

/// Files written by programs hold inertias such as -5e-20.
constexpr double kRounding = 1e-12;

std::string Quoted(std::string_view text) { return '"' + std::string(text) + '"'; }

std::vector<std::string_view> SplitWords(std::string_view text) {
  std::vector<std::string_view> words;
  constexpr std::string_view kBlank = " \t\r\n";
  for (std::size_t at = text.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const std::size_t end = text.find_first_of(kBlank, at);
    words.push_back(text.substr(at, end - at));
    at = end == std::string_view::npos ? end : text.find_first_not_of(kBlank, end);
  }
  return words;
}

/// Where package://NAME/... and relative paths point: the folder of the URDF or one above it, that
/// holds (or is) the package, also under another name. The file need not exist: kinematics does
/// without meshes.
std::string ResolveMeshPath(std::string path, const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  if (path.starts_with("file://")) return path.substr(7);
  constexpr std::string_view kPackage = "package://";
  if (!path.starts_with(kPackage)) return (folder / path).lexically_normal().string();
  const fs::path inside = path.substr(kPackage.size());
  const fs::path package = inside.empty() ? fs::path() : *inside.begin();
  const fs::path rest = inside.lexically_relative(package);
  std::error_code ignored;
  const fs::path start = fs::absolute(folder.empty() ? fs::path(".") : folder, ignored);
  for (fs::path at = start.lexically_normal();; at = at.parent_path()) {
    if (fs::exists(at / inside, ignored)) return (at / inside).string();
    if (at.filename() == package && fs::exists(at / rest, ignored)) return (at / rest).string();
    if (at == at.parent_path()) break;
  }
  for (fs::path at = start.lexically_normal(); at != at.parent_path(); at = at.parent_path()) {
    if (fs::exists(at / rest, ignored)) return (at / rest).string();
  }
  return (folder / inside).lexically_normal().string();
}

class UrdfReader {
 public:
  UrdfReader(std::string_view source, std::filesystem::path folder)
      : source_(source), folder_(std::move(folder)) {}

  Result<RobotModel> Read(std::string_view text) {
    tinyxml2::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      return InvalidArgument(source_ + ":" + std::to_string(document.ErrorLineNum()) +
                             ": not well-formed XML (" + document.ErrorName() + ")");
    }
    const XMLElement* robot = document.RootElement();
    if (robot == nullptr) return InvalidArgument(source_ + ":1: there is no <robot> element");
    if (std::string_view(robot->Name()) != "robot") {
      return At(*robot, "the root element is <" + std::string(robot->Name()) +
                            ">, a URDF starts with <robot>");
    }
    Result<std::string> name = ReadName(*robot, "robot");
    if (!name) return name.error();
    model_.name = *name;
    if (Status status = ReadMaterials(*robot); !status) return status.error();
    if (Status status = ReadLinks(*robot); !status) return status.error();
    if (Status status = ReadJoints(*robot); !status) return status.error();
    if (Status status = ResolveMimics(); !status) return status.error();
    return Ordered(*robot);
  }

 private:
  Error At(const XMLElement& element, const std::string& what) const {
    return InvalidArgument(source_ + ":" + std::to_string(element.GetLineNum()) + ": " +
                           (place_.empty() ? "" : place_ + ": ") + what);
  }

  Result<std::string> ReadName(const XMLElement& element, const std::string& what) const {
    const char* name = element.Attribute("name");
    if (name == nullptr || *name == '\0') return At(element, "<" + what + "> has no name");
    return std::string(name);
  }

  /// `count` finite numbers of an attribute; all of them `otherwise` where the attribute is absent.
  Result<std::vector<double>> ReadNumbers(const XMLElement& element, const char* attribute,
                                          std::size_t count,
                                          std::optional<double> otherwise) const {
    const char* text = element.Attribute(attribute);
    const std::string what = std::string(element.Name()) + " " + attribute;
    if (text == nullptr) {
      if (otherwise) return std::vector<double>(count, *otherwise);
      return At(element, what + " is missing");
    }
    std::vector<double> numbers;
    for (const std::string_view word : SplitWords(text)) {
      const std::optional<double> number = ParseDouble(word);
      if (!number || !std::isfinite(*number)) {
        return At(element, what + ": " + Quoted(word) + " is not a finite number");
      }
      numbers.push_back(*number);
    }
    if (numbers.size() != count) {
      return At(element, what + " is " + Quoted(text) + ", must hold " + std::to_string(count) +
                             (count == 1 ? " number" : " numbers"));
    }
    return numbers;
  }

  Result<double> ReadNumber(const XMLElement& element, const char* attribute,
                            std::optional<double> otherwise = std::nullopt) const {
    Result<std::vector<double>> numbers = ReadNumbers(element, attribute, 1, otherwise);
    if (!numbers) return numbers.error();
    return numbers->front();
  }

  Result<double> ReadExtent(const XMLElement& element, const char* attribute) const {
    Result<double> number = ReadNumber(element, attribute);
    if (number && *number < 0) {
      return At(element, std::string(element.Name()) + " " + attribute + " is " +
                             FormatDouble(*number) + ", must not be negative");
    }
    return number;
  }

  Result<double> ReadPositive(const XMLElement& element, const char* attribute,
                              std::optional<double> otherwise = std::nullopt) const {
    Result<double> number = ReadNumber(element, attribute, otherwise);
    if (number && *number <= 0) {
      return At(element, std::string(element.Name()) + " " + attribute + " is " +
                             FormatDouble(*number) + ", must be positive");
    }
    return number;
  }

  Result<Eigen::Vector3d> ReadVector(const XMLElement& element, const char* attribute,
                                     std::optional<double> otherwise = std::nullopt) const {
    Result<std::vector<double>> numbers = ReadNumbers(element, attribute, 3, otherwise);
    if (!numbers) return numbers.error();
    return Eigen::Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2]);
  }

  Result<geometry::Pose> ReadOrigin(const XMLElement& parent) const {
    const XMLElement* origin = parent.FirstChildElement("origin");
    if (origin == nullptr) return geometry::Pose::Identity();
    Result<Eigen::Vector3d> xyz = ReadVector(*origin, "xyz", 0.0);
    if (!xyz) return xyz.error();
    Result<Eigen::Vector3d> rpy = ReadVector(*origin, "rpy", 0.0);
    if (!rpy) return rpy.error();
    const Eigen::Quaterniond rotation = Eigen::AngleAxisd(rpy->z(), Eigen::Vector3d::UnitZ()) *
                                        Eigen::AngleAxisd(rpy->y(), Eigen::Vector3d::UnitY()) *
                                        Eigen::AngleAxisd(rpy->x(), Eigen::Vector3d::UnitX());
    return geometry::Pose{*xyz, rotation.normalized()};
  }

  // ---- Materials ----

  Result<std::optional<Eigen::Vector4d>> ReadColour(const XMLElement& material) const {
    const XMLElement* colour = material.FirstChildElement("color");
    if (colour == nullptr) return std::optional<Eigen::Vector4d>();
    Result<std::vector<double>> rgba = ReadNumbers(*colour, "rgba", 4, std::nullopt);
    if (!rgba) return rgba.error();
    return std::optional<Eigen::Vector4d>(
        Eigen::Vector4d((*rgba)[0], (*rgba)[1], (*rgba)[2], (*rgba)[3]));
  }

  Status ReadMaterials(const XMLElement& robot) {
    for (const XMLElement* e = robot.FirstChildElement("material"); e != nullptr;
         e = e->NextSiblingElement("material")) {
      Result<std::string> name = ReadName(*e, "material");
      if (!name) return name.error();
      Result<std::optional<Eigen::Vector4d>> colour = ReadColour(*e);
      if (!colour) return colour.error();
      if (*colour) materials_[*name] = **colour;
    }
    return {};
  }

  Result<std::optional<Eigen::Vector4d>> ReadVisualColour(const XMLElement& visual) {
    const XMLElement* material = visual.FirstChildElement("material");
    if (material == nullptr) return std::optional<Eigen::Vector4d>();
    Result<std::optional<Eigen::Vector4d>> own = ReadColour(*material);
    if (!own) return own.error();
    const char* name = material->Attribute("name");
    if (*own) {
      if (name != nullptr) materials_.emplace(name, **own);
      return own;
    }
    const auto found = materials_.find(name == nullptr ? "" : name);
    return found == materials_.end() ? std::optional<Eigen::Vector4d>()
                                     : std::optional<Eigen::Vector4d>(found->second);
  }

  // ---- Links ----

  /// Nothing for a shape without extent, with which some files mark a place.
  Result<std::optional<Shape>> ReadShape(const XMLElement& parent) const {
    const XMLElement* geometry = parent.FirstChildElement("geometry");
    if (geometry == nullptr) {
      return At(parent, "<" + std::string(parent.Name()) + "> has no <geometry>");
    }
    const XMLElement* shape = geometry->FirstChildElement();
    if (shape == nullptr) return At(*geometry, "<geometry> is empty");
    const std::string_view kind = shape->Name();
    if (kind == "box") return ReadBox(*shape);
    if (kind == "sphere") {
      Result<double> radius = ReadExtent(*shape, "radius");
      if (!radius) return radius.error();
      return *radius == 0 ? std::nullopt : std::optional<Shape>(Sphere{*radius});
    }
    if (kind == "cylinder") {
      Result<double> radius = ReadExtent(*shape, "radius");
      if (!radius) return radius.error();
      Result<double> length = ReadExtent(*shape, "length");
      if (!length) return length.error();
      return *radius == 0 || *length == 0 ? std::nullopt
                                          : std::optional<Shape>(Cylinder{*radius, *length});
    }
    if (kind == "mesh") return ReadMesh(*shape);
    return At(*shape, "<" + std::string(kind) + "> is not a shape: box, sphere, cylinder or mesh");
  }

  Result<std::optional<Shape>> ReadBox(const XMLElement& shape) const {
    Result<Eigen::Vector3d> size = ReadVector(shape, "size");
    if (!size) return size.error();
    if (size->minCoeff() < 0) {
      return At(shape,
                "box size is " + Quoted(shape.Attribute("size")) + ", no edge may be negative");
    }
    return size->minCoeff() == 0 ? std::nullopt : std::optional<Shape>(Box{*size});
  }

  Result<std::optional<Shape>> ReadMesh(const XMLElement& shape) const {
    const char* file = shape.Attribute("filename");
    if (file == nullptr || *file == '\0') return At(shape, "mesh filename is missing");
    Result<Eigen::Vector3d> scale = ReadVector(shape, "scale", 1.0);
    if (!scale) return scale.error();
    if ((scale->array() == 0).any()) {
      return At(shape,
                "mesh scale is " + Quoted(shape.Attribute("scale")) + ", no part may be zero");
    }
    return std::optional<Shape>(Mesh{ResolveMeshPath(file, folder_), *scale});
  }

  Result<std::vector<Geometry>> ReadGeometries(const XMLElement& link, const char* kind) const {
    std::vector<Geometry> geometries;
    for (const XMLElement* e = link.FirstChildElement(kind); e != nullptr;
         e = e->NextSiblingElement(kind)) {
      Result<geometry::Pose> origin = ReadOrigin(*e);
      if (!origin) return origin.error();
      Result<std::optional<Shape>> shape = ReadShape(*e);
      if (!shape) return shape.error();
      if (*shape) geometries.push_back({*origin, std::move(**shape)});
    }
    return geometries;
  }

  Result<std::optional<Inertial>> ReadInertial(const XMLElement& link) const {
    const XMLElement* element = link.FirstChildElement("inertial");
    if (element == nullptr) return std::optional<Inertial>();
    Inertial inertial;
    Result<geometry::Pose> origin = ReadOrigin(*element);
    if (!origin) return origin.error();
    inertial.link_T_inertia = *origin;
    const XMLElement* mass = element->FirstChildElement("mass");
    if (mass == nullptr) return At(*element, "<inertial> has no <mass>");
    Result<double> kilograms = ReadNumber(*mass, "value");
    if (!kilograms) return kilograms.error();
    if (*kilograms < 0) {
      return At(*mass, "mass is " + FormatDouble(*kilograms) + " kg, must not be negative");
    }
    inertial.mass_kg = *kilograms;
    const XMLElement* inertia = element->FirstChildElement("inertia");
    if (inertia == nullptr) return At(*element, "<inertial> has no <inertia>");
    constexpr std::pair<const char*, std::pair<int, int>> kEntries[] = {
        {"ixx", {0, 0}}, {"ixy", {0, 1}}, {"ixz", {0, 2}},
        {"iyy", {1, 1}}, {"iyz", {1, 2}}, {"izz", {2, 2}}};
    for (const auto& [attribute, cell] : kEntries) {
      const bool diagonal = cell.first == cell.second;
      Result<double> value =
          ReadNumber(*inertia, attribute, diagonal ? std::optional<double>() : std::optional(0.0));
      if (!value) return value.error();
      if (diagonal && *value < -kRounding) {
        return At(*inertia, "inertia " + std::string(attribute) + " is " + FormatDouble(*value) +
                                ", must not be negative");
      }
      inertial.inertia_kg_m2(cell.first, cell.second) = *value;
      inertial.inertia_kg_m2(cell.second, cell.first) = *value;
    }
    return std::optional<Inertial>(inertial);
  }

  Status ReadLinks(const XMLElement& robot) {
    for (const XMLElement* e = robot.FirstChildElement("link"); e != nullptr;
         e = e->NextSiblingElement("link")) {
      place_.clear();
      Link link;
      Result<std::string> name = ReadName(*e, "link");
      if (!name) return name.error();
      link.name = *name;
      place_ = "link " + Quoted(link.name);
      if (!link_index_.emplace(link.name, static_cast<int>(model_.links.size())).second) {
        return At(*e, "there are two links of this name");
      }
      Result<std::optional<Inertial>> inertial = ReadInertial(*e);
      if (!inertial) return inertial.error();
      link.inertial = *inertial;
      Result<std::vector<Geometry>> collisions = ReadGeometries(*e, "collision");
      if (!collisions) return collisions.error();
      link.collisions = std::move(*collisions);
      Result<std::vector<Geometry>> visuals = ReadGeometries(*e, "visual");
      if (!visuals) return visuals.error();
      link.visuals = std::move(*visuals);
      if (const XMLElement* visual = e->FirstChildElement("visual")) {
        Result<std::optional<Eigen::Vector4d>> colour = ReadVisualColour(*visual);
        if (!colour) return colour.error();
        link.colour = *colour;
      }
      model_.links.push_back(std::move(link));
    }
    place_.clear();
    if (model_.links.empty()) return At(robot, "the robot has no links");
    return {};
  }

  // ---- Joints ----

  Result<int> ReadLinkOf(const XMLElement& joint, const char* side) const {
    const XMLElement* element = joint.FirstChildElement(side);
    const char* name = element == nullptr ? nullptr : element->Attribute("link");
    if (name == nullptr) return At(joint, "has no <" + std::string(side) + " link=...>");
    const auto found = link_index_.find(name);
    if (found != link_index_.end()) return found->second;
    std::vector<std::string> known;
    for (const Link& link : model_.links) known.push_back(link.name);
    const std::optional<std::string> near = NearestName(name, known);
    return At(*element, std::string(side) + " link " + Quoted(name) + " does not exist" +
                            (near ? "; did you mean " + Quoted(*near) + "?" : ""));
  }

  Result<JointType> ReadType(const XMLElement& joint) const {
    const char* type = joint.Attribute("type");
    if (type == nullptr) return At(joint, "has no type");
    const std::string_view name = type;
    if (name == "fixed") return JointType::kFixed;
    if (name == "revolute") return JointType::kRevolute;
    if (name == "continuous") return JointType::kContinuous;
    if (name == "prismatic") return JointType::kPrismatic;
    return At(joint, "type " + Quoted(name) +
                         " is not supported: fixed, revolute, continuous or prismatic");
  }

  Result<JointLimits> ReadLimits(const XMLElement& joint, JointType type) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    JointLimits limits;
    limits.acceleration = kDefaultAcceleration;
    const XMLElement* element = joint.FirstChildElement("limit");
    if (element == nullptr) {
      if (type != JointType::kContinuous) return At(joint, "has no <limit>");
      limits.lower = -kInfinity;
      limits.upper = kInfinity;
      limits.velocity = kDefaultVelocity;
      limits.effort = kDefaultEffort;
      return limits;
    }
    Result<double> lower = ReadNumber(*element, "lower", 0.0);
    if (!lower) return lower.error();
    Result<double> upper = ReadNumber(*element, "upper", 0.0);
    if (!upper) return upper.error();
    Result<double> velocity = ReadPositive(*element, "velocity");
    if (!velocity) return velocity.error();
    Result<double> effort = ReadPositive(*element, "effort");
    if (!effort) return effort.error();
    if (*lower > *upper) {
      return At(*element,
                "limit lower " + FormatDouble(*lower) + " is above upper " + FormatDouble(*upper));
    }
    const bool endless = type == JointType::kContinuous;
    limits.lower = endless ? -kInfinity : *lower;
    limits.upper = endless ? kInfinity : *upper;
    limits.velocity = *velocity;
    limits.effort = *effort;
    return limits;
  }

  Status ReadJoints(const XMLElement& robot) {
    for (const XMLElement* e = robot.FirstChildElement("joint"); e != nullptr;
         e = e->NextSiblingElement("joint")) {
      place_.clear();
      Joint joint;
      Result<std::string> name = ReadName(*e, "joint");
      if (!name) return name.error();
      joint.name = *name;
      place_ = "joint " + Quoted(joint.name);
      const int index = static_cast<int>(model_.joints.size());
      if (!joint_index_.emplace(joint.name, index).second) {
        return At(*e, "there are two joints of this name");
      }
      Result<JointType> type = ReadType(*e);
      if (!type) return type.error();
      joint.type = *type;
      Result<int> parent = ReadLinkOf(*e, "parent");
      if (!parent) return parent.error();
      joint.parent_link = *parent;
      Result<int> child = ReadLinkOf(*e, "child");
      if (!child) return child.error();
      joint.child_link = *child;
      int& above = model_.links[static_cast<std::size_t>(joint.child_link)].parent_joint;
      if (above >= 0) {
        return At(*e, "child link " + Quoted(model_.links[joint.child_link].name) +
                          " already has a parent by joint " + Quoted(model_.joints[above].name));
      }
      above = index;
      Result<geometry::Pose> origin = ReadOrigin(*e);
      if (!origin) return origin.error();
      joint.parent_T_joint = *origin;
      if (joint.type != JointType::kFixed) {
        if (Status status = ReadMotion(*e, joint); !status) return status.error();
      }
      model_.joints.push_back(std::move(joint));
      elements_.push_back(e);
    }
    place_.clear();
    return {};
  }

  /// Axis, limits and the name of the joint that leads.
  Status ReadMotion(const XMLElement& element, Joint& joint) {
    joint.axis = Eigen::Vector3d::UnitX();
    if (const XMLElement* axis = element.FirstChildElement("axis")) {
      Result<Eigen::Vector3d> xyz = ReadVector(*axis, "xyz");
      if (!xyz) return xyz.error();
      const double length = xyz->norm();
      if (!(length > 1e-9) || !std::isfinite(length)) {
        return At(*axis, "axis xyz is " + Quoted(axis->Attribute("xyz")) + ", has no direction");
      }
      joint.axis = *xyz / length;
    }
    Result<JointLimits> limits = ReadLimits(element, joint.type);
    if (!limits) return limits.error();
    joint.limits = *limits;
    if (const XMLElement* mimic = element.FirstChildElement("mimic")) {
      if (mimic->Attribute("joint") == nullptr) return At(*mimic, "<mimic> has no joint");
      Result<double> multiplier = ReadNumber(*mimic, "multiplier", 1.0);
      if (!multiplier) return multiplier.error();
      Result<double> offset = ReadNumber(*mimic, "offset", 0.0);
      if (!offset) return offset.error();
      joint.mimic = Mimic{-1, *multiplier, *offset};
    }
    return {};
  }

  /// Points every mimic joint at the joint that leads in the end.
  Status ResolveMimics() {
    for (std::size_t i = 0; i < model_.joints.size(); ++i) {
      Joint& joint = model_.joints[i];
      if (!joint.mimic) continue;
      place_ = "joint " + Quoted(joint.name);
      const XMLElement& mimic = *elements_[i]->FirstChildElement("mimic");
      const auto found = joint_index_.find(mimic.Attribute("joint"));
      if (found == joint_index_.end()) {
        return At(mimic,
                  "mimics joint " + Quoted(mimic.Attribute("joint")) + ", which does not exist");
      }
      joint.mimic->joint = found->second;
    }
    for (std::size_t i = 0; i < model_.joints.size(); ++i) {
      Joint& joint = model_.joints[i];
      if (!joint.mimic) continue;
      place_ = "joint " + Quoted(joint.name);
      const XMLElement& element = *elements_[i]->FirstChildElement("mimic");
      Mimic total = *joint.mimic;
      for (std::size_t step = 0; model_.joints[total.joint].mimic; ++step) {
        if (step > model_.joints.size()) return At(element, "joints mimic each other in a circle");
        const Mimic& next = *model_.joints[total.joint].mimic;
        total = {next.joint, total.multiplier * next.multiplier,
                 total.multiplier * next.offset + total.offset};
      }
      if (model_.joints[total.joint].type == JointType::kFixed) {
        return At(element,
                  "mimics joint " + Quoted(model_.joints[total.joint].name) + ", which is fixed");
      }
      joint.mimic = total;
    }
    place_.clear();
    return {};
  }

  /// The model with parents before children (depth first, in the file's order).
  Result<RobotModel> Ordered(const XMLElement& robot) {
    std::vector<std::vector<int>> joints_below(model_.links.size());
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      joints_below[model_.joints[j].parent_link].push_back(static_cast<int>(j));
    }
    int root = -1;
    for (std::size_t i = 0; i < model_.links.size(); ++i) {
      if (model_.links[i].parent_joint >= 0) continue;
      if (root >= 0) {
        return At(robot, "links " + Quoted(model_.links[root].name) + " and " +
                             Quoted(model_.links[i].name) +
                             " both have no parent: a robot is one tree");
      }
      root = static_cast<int>(i);
    }
    if (root < 0) return At(robot, "every link has a parent: the joints form a circle");

    RobotModel ordered;
    ordered.name = model_.name;
    std::vector<int> new_link(model_.links.size(), -1);
    std::vector<int> new_joint(model_.joints.size(), -1);
    std::vector<int> open = {root};
    while (!open.empty()) {
      const int link = open.back();
      open.pop_back();
      new_link[link] = static_cast<int>(ordered.links.size());
      if (const int above = model_.links[link].parent_joint; above >= 0) {
        new_joint[above] = static_cast<int>(ordered.joints.size());
        Joint joint = model_.joints[above];
        joint.parent_link = new_link[joint.parent_link];
        joint.child_link = new_link[link];
        ordered.joints.push_back(std::move(joint));
      }
      ordered.links.push_back(model_.links[link]);
      ordered.links.back().parent_joint = static_cast<int>(ordered.joints.size()) - 1;
      const std::vector<int>& below = joints_below[link];
      for (auto j = below.rbegin(); j != below.rend(); ++j) {
        open.push_back(model_.joints[*j].child_link);
      }
    }
    for (std::size_t i = 0; i < model_.links.size(); ++i) {
      if (new_link[i] < 0) {
        return At(robot, "link " + Quoted(model_.links[i].name) +
                             " hangs in a circle of joints, apart from root " +
                             Quoted(model_.links[root].name));
      }
    }
    for (Joint& joint : ordered.joints) {
      if (joint.mimic) joint.mimic->joint = new_joint[joint.mimic->joint];
    }
    return ordered;
  }

  std::string source_;
  std::filesystem::path folder_;
  std::string place_;
  RobotModel model_;
  std::map<std::string, Eigen::Vector4d> materials_;
  std::map<std::string, int, std::less<>> link_index_;
  std::map<std::string, int, std::less<>> joint_index_;
  std::vector<const XMLElement*> elements_;
};

}  // namespace

Result<RobotModel> ParseUrdf(std::string_view text, std::string_view source,
                             const std::filesystem::path& folder) {
  return UrdfReader(source, folder).Read(text);
}

Result<RobotModel> ReadUrdf(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  if (!stream || !(text << stream.rdbuf())) {
    return NotFound(file.string() + ": cannot be read");
  }
  return ParseUrdf(text.str(), file.string(), file.parent_path());
}

}  // namespace exemplar::kinematics
