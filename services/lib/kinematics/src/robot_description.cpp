#include "exemplar/kinematics/robot_description.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::kinematics {
namespace {

namespace fs = std::filesystem;

std::string Quoted(std::string_view text) { return '"' + std::string(text) + '"'; }

class DescriptionReader {
 public:
  explicit DescriptionReader(const fs::path& folder)
      : folder_(folder), file_(folder / "robot.yaml") {}

  Result<RobotDescription> Read() {
    YAML::Node root;
    try {
      root = YAML::LoadFile(file_.string());
    } catch (const YAML::BadFile&) {
      return NotFound(file_.string() + ": cannot be read", "robot");
    } catch (const YAML::Exception& e) {
      return InvalidArgument(file_.string() + ":" + std::to_string(e.mark.line + 1) + ": " + e.msg);
    }
    if (!root.IsMap()) return At(root, "must hold keys and values");
    if (Status status = CheckKeys(root, "", kKeys); !status) return status.error();

    Result<std::string> urdf = ReadText(root, "urdf");
    if (!urdf) return urdf.error();
    Result<RobotModel> model = ReadUrdf(folder_ / *urdf);
    if (!model) return model.error();
    for (const auto& [key, limit] : {std::pair("acceleration", &JointLimits::acceleration),
                                     std::pair("jerk", &JointLimits::jerk)}) {
      if (Status status = ReadLimit(root, key, limit, *model); !status) return status.error();
    }
    Result<Chain> chain = ReadChain(root, *model);
    if (!chain) return chain.error();
    Result<Eigen::VectorXd> home = ReadHome(root, *chain);
    if (!home) return home.error();
    Result<std::vector<ServoGains>> servo = ReadServo(root["servo"], *chain);
    if (!servo) return servo.error();
    Result<std::vector<std::string>> touch = ReadTouchLinks(root["touch_links"], *model, *chain);
    if (!touch) return touch.error();
    Result<std::optional<LinkPairs>> allowed = ReadAllowedPairs(root, *model);
    if (!allowed) return allowed.error();
    if (Status status = ReadConvexMeshes(root, *model); !status) return status.error();
    ServoGains hand_servo;
    if (Status status = ReadHand(root["hand"], *chain, *model, hand_servo); !status) {
      return status.error();
    }
    return RobotDescription{
        model->name,       folder_,          std::move(*model), std::move(*chain),
        std::move(*touch), std::move(*home), std::move(*servo), std::move(*allowed),
        hand_servo,        folder_ / *urdf};
  }

 private:
  static constexpr std::array<std::string_view, 11> kKeys = {
      "urdf",        "srdf", "convex_meshes", "base", "tip",  "hand",
      "touch_links", "home", "acceleration",  "jerk", "servo"};
  static constexpr std::array<std::string_view, 6> kHandKeys = {"joint", "closed",    "open",
                                                                "force", "stiffness", "damping"};
  static constexpr std::array<std::string_view, 2> kServoKeys = {"stiffness", "damping"};

  Error At(const YAML::Node& node, const std::string& what) const {
    const int line = node.Mark().line + 1;
    return InvalidArgument(file_.string() + (line > 0 ? ":" + std::to_string(line) : "") + ": " +
                           what);
  }

  template <std::size_t kCount>
  Status CheckKeys(const YAML::Node& map, const std::string& place,
                   const std::array<std::string_view, kCount>& known) const {
    for (const auto& entry : map) {
      const std::string key = entry.first.Scalar();
      if (std::find(known.begin(), known.end(), key) != known.end()) continue;
      const std::vector<std::string> names(known.begin(), known.end());
      const std::optional<std::string> near = NearestName(key, names);
      return At(entry.first, place + "unknown key " + Quoted(key) +
                                 (near ? "; did you mean " + Quoted(*near) + "?" : ""));
    }
    return {};
  }

  Result<std::string> ReadText(const YAML::Node& root, const char* key) const {
    const YAML::Node node = root[key];
    if (!node) return At(root, std::string(key) + " is missing");
    if (!node.IsScalar() || node.Scalar().empty()) {
      return At(node, std::string(key) + " must be a text");
    }
    return node.Scalar();
  }

  Result<double> ReadNumber(const YAML::Node& node, const std::string& key) const {
    const std::optional<double> number =
        node.IsScalar() ? ParseDouble(node.Scalar()) : std::nullopt;
    if (!number || !std::isfinite(*number)) {
      return At(node, key + (node.IsScalar() ? " is " + Quoted(node.Scalar()) + "," : "") +
                          " must be a finite number");
    }
    return *number;
  }

  Result<double> ReadPositive(const YAML::Node& node, const std::string& key) const {
    Result<double> number = ReadNumber(node, key);
    if (number && *number <= 0) {
      return At(node, key + " is " + FormatDouble(*number) + ", must be positive");
    }
    return number;
  }

  /// Where `name` stands among `names`, or an error that offers the nearest.
  Result<int> IndexOf(const YAML::Node& node, const std::string& place, const std::string& name,
                      const std::vector<std::string>& names) const {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end()) return static_cast<int>(found - names.begin());
    const std::optional<std::string> near = NearestName(name, names);
    return At(node, place + ": the robot has no " + Quoted(name) +
                        (near ? "; did you mean " + Quoted(*near) + "?" : ""));
  }

  /// Hands every entry of a map by name to `set` as (node, "place.name", index); "default" goes
  /// first, to every name.
  template <class Set>
  Status ForEachNamed(const YAML::Node& map, const std::string& place,
                      const std::vector<std::string>& names, Set&& set) const {
    if (!map.IsMap()) return At(map, place + " must hold one value a joint");
    if (const YAML::Node all = map["default"]) {
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (Status status = set(all, place + ".default", static_cast<int>(i)); !status) {
          return status;
        }
      }
    }
    for (const auto& entry : map) {
      const std::string name = entry.first.Scalar();
      if (name == "default") continue;
      Result<int> index = IndexOf(entry.first, place, name, names);
      if (!index) return index.error();
      if (Status status = set(entry.second, place + "." + name, *index); !status) return status;
    }
    return {};
  }

  Status ReadLimit(const YAML::Node& root, const char* limit_name, double JointLimits::*limit,
                   RobotModel& model) const {
    const YAML::Node map = root[limit_name];
    if (!map) return {};
    std::vector<std::string> names;
    for (const Joint& joint : model.joints) names.push_back(joint.name);
    return ForEachNamed(map, limit_name, names,
                        [&](const YAML::Node& node, const std::string& key, int index) -> Status {
                          Result<double> value = ReadPositive(node, key);
                          if (!value) return value.error();
                          model.joints[index].limits.*limit = *value;
                          return {};
                        });
  }

  Result<Chain> ReadChain(const YAML::Node& root, const RobotModel& model) const {
    std::string ends[2];
    constexpr const char* kEnds[2] = {"base", "tip"};
    for (int i = 0; i < 2; ++i) {
      if (!root[kEnds[i]]) continue;
      Result<std::string> name = ReadText(root, kEnds[i]);
      if (!name) return name.error();
      ends[i] = *name;
    }
    Result<Chain> chain = Chain::Create(model, ends[0], ends[1]);
    if (chain) return chain;
    Error error = chain.error();
    const YAML::Node at = error.field.empty() || !root[error.field] ? root : root[error.field];
    error.message = At(at, error.message).message;
    return error;
  }

  Result<Eigen::VectorXd> ReadHome(const YAML::Node& root, const Chain& chain) const {
    const YAML::Node map = root["home"];
    if (!map) return At(root, "home is missing");
    Eigen::VectorXd home = Eigen::VectorXd::Constant(chain.dof(), std::nan(""));
    Status status = ForEachNamed(
        map, "home", chain.joint_names(),
        [&](const YAML::Node& node, const std::string& key, int index) -> Status {
          Result<double> value = ReadNumber(node, key);
          if (!value) return value.error();
          const JointLimits& limits = chain.limits()[index];
          if (*value < limits.lower || *value > limits.upper) {
            return At(node, key + " is " + FormatDouble(*value) + ", outside its limits " +
                                FormatDouble(limits.lower) + " to " + FormatDouble(limits.upper));
          }
          home[index] = *value;
          return {};
        });
    if (!status) return status.error();
    for (int i = 0; i < chain.dof(); ++i) {
      if (std::isnan(home[i])) {
        return At(map, "home: joint " + Quoted(chain.joint_names()[i]) + " is missing");
      }
    }
    return home;
  }

  Result<std::vector<ServoGains>> ReadServo(const YAML::Node& map, const Chain& chain) const {
    std::vector<ServoGains> servo(static_cast<std::size_t>(chain.dof()));
    if (!map) return servo;
    Status status = ForEachNamed(
        map, "servo", chain.joint_names(),
        [&](const YAML::Node& node, const std::string& key, int index) -> Status {
          if (!node.IsMap()) return At(node, key + " must hold stiffness and damping");
          if (Status known = CheckKeys(node, key + ": ", kServoKeys); !known) return known;
          for (const auto& entry : node) {
            const std::string name = entry.first.Scalar();
            Result<double> value = ReadPositive(entry.second, key + "." + name);
            if (!value) return value.error();
            (name == "stiffness" ? servo[index].stiffness : servo[index].damping) = *value;
          }
          return {};
        });
    if (!status) return status.error();
    return servo;
  }

  Status ReadHand(const YAML::Node& map, const Chain& chain, RobotModel& model,
                  ServoGains& servo) const {
    if (!map) return {};
    if (!map.IsMap()) return At(map, "hand must hold joint, closed and open");
    if (Status known = CheckKeys(map, "hand: ", kHandKeys); !known) return known;
    const YAML::Node joint = map["joint"];
    if (!joint || !joint.IsScalar()) return At(map, "hand.joint must name a joint");
    std::vector<std::string> names;
    for (const Joint& one : model.joints) names.push_back(one.name);
    Result<int> index = IndexOf(joint, "hand.joint", joint.Scalar(), names);
    if (!index) return index.error();
    Joint& moved = model.joints[static_cast<std::size_t>(*index)];
    const auto& in_chain = chain.joint_indices();
    if (moved.type == JointType::kFixed || moved.mimic ||
        std::find(in_chain.begin(), in_chain.end(), *index) != in_chain.end()) {
      return At(joint, "hand.joint: " + Quoted(moved.name) +
                           " must move, by itself, and not belong to the chain");
    }
    Hand hand{*index, 0, 0};
    for (const auto& [key, value] :
         {std::pair("closed", &Hand::closed), std::pair("open", &Hand::open)}) {
      const std::string place = std::string("hand.") + key;
      if (!map[key]) return At(map, place + " is missing");
      Result<double> position = ReadNumber(map[key], place);
      if (!position) return position.error();
      if (*position < moved.limits.lower || *position > moved.limits.upper) {
        return At(map[key], place + " is " + FormatDouble(*position) + ", outside its limits " +
                                FormatDouble(moved.limits.lower) + " to " +
                                FormatDouble(moved.limits.upper));
      }
      hand.*value = *position;
    }
    if (hand.open == hand.closed) return At(map, "hand.open must differ from hand.closed");
    for (const auto& [key, value] :
         {std::pair("force", &moved.limits.effort), std::pair("stiffness", &servo.stiffness),
          std::pair("damping", &servo.damping)}) {
      if (!map[key]) continue;
      Result<double> number = ReadPositive(map[key], std::string("hand.") + key);
      if (!number) return number.error();
      *value = *number;
    }
    model.hand = hand;
    return {};
  }

  Result<std::optional<LinkPairs>> ReadAllowedPairs(const YAML::Node& root,
                                                    const RobotModel& model) const {
    if (!root["srdf"]) return std::optional<LinkPairs>();
    Result<std::string> file = ReadText(root, "srdf");
    if (!file) return file.error();
    Result<LinkPairs> pairs = ReadSrdf(folder_ / *file, model);
    if (!pairs) return pairs.error();
    return std::optional<LinkPairs>(*std::move(pairs));
  }

  Status ReadConvexMeshes(const YAML::Node& root, RobotModel& model) const {
    const YAML::Node node = root["convex_meshes"];
    if (!node) return {};
    bool convex = false;
    if (!node.IsScalar() || !YAML::convert<bool>::decode(node, convex)) {
      return At(node, "convex_meshes must be true or false");
    }
    for (Link& link : model.links) {
      for (Geometry& geometry : link.collisions) {
        if (auto* mesh = std::get_if<Mesh>(&geometry.shape)) mesh->convex = convex;
      }
    }
    return {};
  }

  Result<std::vector<std::string>> ReadTouchLinks(const YAML::Node& list, const RobotModel& model,
                                                  const Chain& chain) const {
    std::vector<std::string> touch;
    if (!list) {
      int link = model.FindLink(chain.tip_link());
      while (model.links[link].collisions.empty() && model.links[link].parent_joint >= 0) {
        link = model.joints[model.links[link].parent_joint].parent_link;
      }
      if (!model.links[link].collisions.empty()) touch.push_back(model.links[link].name);
      return touch;
    }
    if (!list.IsSequence()) return At(list, "touch_links must be a list of links");
    std::vector<std::string> names;
    for (const Link& link : model.links) names.push_back(link.name);
    for (const YAML::Node& entry : list) {
      if (!entry.IsScalar()) return At(entry, "touch_links must be a list of links");
      Result<int> index = IndexOf(entry, "touch_links", entry.Scalar(), names);
      if (!index) return index.error();
      touch.push_back(entry.Scalar());
    }
    return touch;
  }

  fs::path folder_;
  fs::path file_;
};

}  // namespace

Result<RobotDescription> ReadRobotDescription(const fs::path& folder) {
  return DescriptionReader(folder).Read();
}

Eigen::VectorXd FullJointVector(const RobotModel& model, const Chain& chain,
                                const Eigen::Ref<const Eigen::VectorXd>& q) {
  Eigen::VectorXd full(static_cast<Eigen::Index>(model.joints.size()));
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& joint = model.joints[i];
    full[static_cast<Eigen::Index>(i)] =
        joint.type == JointType::kFixed
            ? 0.0
            : std::max(joint.limits.lower, std::min(0.0, joint.limits.upper));
  }
  for (int i = 0; i < chain.dof(); ++i) full[chain.joint_indices()[i]] = q[i];
  if (model.hand) full[model.hand->joint] = model.hand->open;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    if (const std::optional<Mimic>& mimic = model.joints[i].mimic) {
      full[static_cast<Eigen::Index>(i)] = mimic->multiplier * full[mimic->joint] + mimic->offset;
    }
  }
  return full;
}

void SetHandOpening(const RobotModel& model, double opening, Eigen::Ref<Eigen::VectorXd> full) {
  if (!model.hand) return;
  const int hand = model.hand->joint;
  full[hand] = model.hand->PositionAt(std::clamp(opening, 0.0, 1.0));
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const std::optional<Mimic>& mimic = model.joints[i].mimic;
    if (!mimic || mimic->joint != hand) continue;
    full[static_cast<Eigen::Index>(i)] = mimic->multiplier * full[hand] + mimic->offset;
  }
}

}  // namespace exemplar::kinematics
