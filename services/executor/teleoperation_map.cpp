#include "executor/teleoperation_map.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::executor {
namespace {

/// Reads one file; the first error is kept.
class MapFile {
 public:
  MapFile(std::string source, const std::vector<std::string>& robot_joints)
      : source_(std::move(source)), robot_joints_(robot_joints) {}

  void Read(const YAML::Node& root) {
    if (!root.IsDefined() || root.IsNull()) return;
    if (!CheckKeys(root, "", {"same_names", "joints"})) return;
    if (const YAML::Node flag = root["same_names"]) {
      if (!YAML::convert<bool>::decode(flag, same_names)) {
        Complain(flag, "same_names", "\"" + flag.as<std::string>("") + "\" is not true or false");
      }
    }
    const YAML::Node list = root["joints"];
    if (!list) return;
    if (!list.IsSequence()) return Complain(list, "joints", "must be a list of entries");
    for (std::size_t i = 0; i < list.size(); ++i) {
      ReadEntry(list[i], "joints[" + std::to_string(i) + "]");
    }
  }

  std::vector<JointMapEntry> entries;
  bool same_names = true;
  std::optional<Error> error;

 private:
  void ReadEntry(const YAML::Node& node, const std::string& place) {
    if (!CheckKeys(node, place, {"suit", "robot", "scale", "offset"})) return;
    JointMapEntry entry;
    entry.suit = Text(node, place, "suit");
    const std::string robot = Text(node, place, "robot");
    entry.scale = Number(node, place, "scale", 1);
    entry.offset = Number(node, place, "offset", 0);
    if (error) return;
    const std::string named = place + " (\"" + entry.suit + "\")";
    if (entry.scale == 0) return Complain(node["scale"], named + ".scale", "must not be 0");
    const auto found = std::find(robot_joints_.begin(), robot_joints_.end(), robot);
    if (found == robot_joints_.end()) {
      const std::optional<std::string> near = NearestName(robot, robot_joints_);
      return Complain(node["robot"], named + ".robot",
                      "the robot has no joint \"" + robot + '"' +
                          (near ? "; did you mean \"" + *near + "\"?"
                                : "; it has " + Join(robot_joints_, ", ")));
    }
    entry.joint = static_cast<int>(found - robot_joints_.begin());
    for (const JointMapEntry& other : entries) {
      if (other.joint != entry.joint) continue;
      return Complain(node["robot"], named + ".robot",
                      "joint \"" + robot + "\" is driven by \"" + other.suit + "\" already");
    }
    entries.push_back(std::move(entry));
  }

  bool CheckKeys(const YAML::Node& node, const std::string& place,
                 const std::vector<std::string>& known) {
    if (!node.IsMap()) {
      Complain(node, place, "must be a map with " + Join(known, ", "));
      return false;
    }
    for (const auto& item : node) {
      const std::string key = item.first.as<std::string>("");
      if (std::find(known.begin(), known.end(), key) != known.end()) continue;
      Complain(item.first, place, "unknown key \"" + key + "\"; known are " + Join(known, ", "));
      return false;
    }
    return true;
  }

  std::string Text(const YAML::Node& node, const std::string& place, const char* key) {
    const YAML::Node value = node[key];
    std::string text = value && value.IsScalar() ? value.Scalar() : "";
    if (text.empty()) {
      Complain(value ? value : node, place, std::string("\"") + key + "\" must name a joint");
    }
    return text;
  }

  double Number(const YAML::Node& node, const std::string& place, const char* key,
                double fallback) {
    const YAML::Node value = node[key];
    if (!value) return fallback;
    const std::string text = value.IsScalar() ? value.Scalar() : "";
    const std::optional<double> number = ParseDouble(text);
    if (number && std::isfinite(*number)) return *number;
    Complain(value, place + "." + key, "\"" + text + "\" is not a finite number");
    return fallback;
  }

  void Complain(const YAML::Node& node, const std::string& place, const std::string& message) {
    if (error) return;
    const YAML::Mark mark = node.Mark();
    const std::string line = mark.is_null() ? "" : ":" + std::to_string(mark.line + 1);
    error = InvalidArgument(source_ + line + ": " + (place.empty() ? "" : place + ": ") + message,
                            place);
  }

  const std::string source_;
  const std::vector<std::string>& robot_joints_;
};

}  // namespace

JointMap::JointMap(std::vector<std::string> robot_joints)
    : robot_joints_(std::move(robot_joints)) {}

Result<JointMap> JointMap::Parse(std::string_view yaml, const std::string& source,
                                 std::vector<std::string> robot_joints) {
  JointMap map(std::move(robot_joints));
  MapFile file(source, map.robot_joints_);
  try {
    file.Read(YAML::Load(std::string(yaml)));
  } catch (const YAML::Exception& e) {
    return InvalidArgument(source + ":" + std::to_string(e.mark.line + 1) + ": " + e.msg);
  }
  if (file.error) return *file.error;
  map.entries_ = std::move(file.entries);
  map.same_names_ = file.same_names;
  return map;
}

Result<JointMap> JointMap::Read(const std::filesystem::path& file,
                                std::vector<std::string> robot_joints) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) {
    return NotFound(file.string() + ": cannot be read, or is empty", "joint map");
  }
  return Parse(text.str(), file.string(), std::move(robot_joints));
}

std::vector<JointMap::Binding> JointMap::Bind(const std::vector<std::string>& suit_joints) const {
  std::vector<Binding> bindings;
  const auto bind = [&](const std::string& suit, int joint, double scale, double offset) {
    const auto found = std::find(suit_joints.begin(), suit_joints.end(), suit);
    if (found == suit_joints.end()) return false;
    bindings.push_back({static_cast<int>(found - suit_joints.begin()), joint, scale, offset});
    return true;
  };
  for (int joint = 0; joint < static_cast<int>(robot_joints_.size()); ++joint) {
    const auto entry =
        std::find_if(entries_.begin(), entries_.end(),
                     [joint](const JointMapEntry& each) { return each.joint == joint; });
    if (entry != entries_.end() && bind(entry->suit, joint, entry->scale, entry->offset)) continue;
    if (same_names_) bind(robot_joints_[static_cast<std::size_t>(joint)], joint, 1, 0);
  }
  return bindings;
}

}  // namespace exemplar::executor
