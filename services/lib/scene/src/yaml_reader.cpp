#include "yaml_reader.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "exemplar/base/text.hpp"

namespace exemplar::scene {
namespace {

std::string Quoted(std::string_view text) { return '"' + std::string(text) + '"'; }

std::string KindOf(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Map:
      return "a map";
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Scalar:
      return Quoted(node.Scalar());
    default:
      return "empty";
  }
}

/// Why `text` is no number in `range`, or nothing.
std::optional<std::string> Fault(const std::string& text, Range range) {
  const std::optional<double> value = ParseDouble(text);
  if (!value) return Quoted(text) + " is not a number";
  if (!std::isfinite(*value)) return Quoted(text) + " is not finite";
  if (range == Range::kPositive && *value <= 0) return text + " must be positive";
  if (range == Range::kNotNegative && *value < 0) return text + " must not be negative";
  return std::nullopt;
}

}  // namespace

void Findings::Add(const YAML::Mark& mark, const std::string& field, const std::string& message) {
  if (error_) return;
  std::string place = source_;
  if (!mark.is_null()) place += ":" + std::to_string(mark.line + 1);
  if (!field.empty()) place += ": " + field;
  error_ = InvalidArgument(place + ": " + message, field);
}

MapReader::MapReader(Findings& findings, YAML::Node node, std::string path,
                     std::vector<std::string> known)
    : findings_(findings), node_(std::move(node)), path_(std::move(path)) {
  if (!node_.IsMap()) {
    findings_.Add(node_.Mark(), path_, "must be a map of keys and values, not " + KindOf(node_));
    node_ = YAML::Node(YAML::NodeType::Map);
    return;
  }
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      const std::optional<std::string> nearest = NearestName(key, known);
      findings_.Add(entry.first.Mark(), PathOf(key),
                    nearest ? "unknown key, did you mean " + Quoted(*nearest) + "?"
                            : "unknown key; known are " + Join(known, ", "));
    } else if (!seen.insert(key).second) {
      findings_.Add(entry.first.Mark(), PathOf(key), "stands here twice");
    }
  }
}

std::string MapReader::PathOf(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

YAML::Node MapReader::Child(const std::string& key) const {
  const YAML::Node& node = node_;  // A const node does not grow by being asked.
  return node[key];
}

bool MapReader::Has(const std::string& key) const {
  const YAML::Node& node = node_;
  return node[key].IsDefined();
}

void MapReader::Complain(const std::string& key, const std::string& message) const {
  findings_.Add(Has(key) ? Child(key).Mark() : node_.Mark(), PathOf(key), message);
}

bool MapReader::Present(const std::string& key, bool required) const {
  if (Has(key)) return true;
  if (required) Complain(key, "is missing");
  return false;
}

std::string MapReader::Text(const std::string& key) const {
  if (!Present(key, true)) return {};
  const YAML::Node child = Child(key);
  if (!child.IsScalar() || Trim(child.Scalar()).empty()) {
    Complain(key, "must be a text, not " + KindOf(child));
    return {};
  }
  return child.Scalar();
}

double MapReader::Number(const std::string& key, std::optional<double> fallback,
                         Range range) const {
  if (!Present(key, !fallback.has_value())) return fallback.value_or(1);
  const YAML::Node child = Child(key);
  if (!child.IsScalar()) {
    Complain(key, "must be a number, not " + KindOf(child));
    return 1;
  }
  if (const std::optional<std::string> fault = Fault(child.Scalar(), range)) {
    Complain(key, *fault);
    return 1;
  }
  return *ParseDouble(child.Scalar());
}

bool MapReader::Flag(const std::string& key, bool fallback) const {
  if (!Has(key)) return fallback;
  const YAML::Node child = Child(key);
  bool flag = fallback;
  if (!child.IsScalar() || !YAML::convert<bool>::decode(child, flag)) {
    Complain(key, "must be true or false, not " + KindOf(child));
  }
  return flag;
}

std::vector<std::string> MapReader::Texts(const std::string& key) const {
  std::vector<std::string> texts;
  List(key, [&](const YAML::Node& node, const std::string& path) {
    if (node.IsScalar() && !node.Scalar().empty()) {
      texts.push_back(node.Scalar());
    } else {
      findings_.Add(node.Mark(), path, "must be a text, not " + KindOf(node));
    }
  });
  return texts;
}

int MapReader::Integer(const std::string& key, std::optional<int> fallback, int lowest,
                       int highest) const {
  if (!Present(key, !fallback.has_value())) return fallback.value_or(lowest);
  const YAML::Node child = Child(key);
  const std::optional<long long> value =
      child.IsScalar() ? ParseInteger(child.Scalar()) : std::nullopt;
  if (!value || *value < lowest || *value > highest) {
    Complain(key, "must be a whole number from " + std::to_string(lowest) + " to " +
                      std::to_string(highest) + ", not " + KindOf(child));
    return lowest;
  }
  return static_cast<int>(*value);
}

std::vector<double> MapReader::Numbers(const std::string& key, std::size_t count,
                                       Range range) const {
  std::vector<double> values(count, 1.0);
  const YAML::Node child = Child(key);
  if (!child.IsSequence() || child.size() != count) {
    Complain(key, "must be a list of " + std::to_string(count) + " numbers, not " +
                      (child.IsSequence() ? "of " + std::to_string(child.size()) : KindOf(child)));
    return values;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const YAML::Node element = child[i];
    const std::string place = PathOf(key) + "[" + std::to_string(i) + "]";
    if (!element.IsScalar()) {
      findings_.Add(element.Mark(), place, "must be a number, not " + KindOf(element));
    } else if (const std::optional<std::string> fault = Fault(element.Scalar(), range)) {
      findings_.Add(element.Mark(), place, *fault);
    } else {
      values[i] = *ParseDouble(element.Scalar());
    }
  }
  return values;
}

Eigen::Vector3d MapReader::Vector(const std::string& key,
                                  const std::optional<Eigen::Vector3d>& fallback,
                                  Range range) const {
  if (!Present(key, !fallback.has_value())) return fallback.value_or(Eigen::Vector3d::Ones());
  const std::vector<double> values = Numbers(key, 3, range);
  return {values[0], values[1], values[2]};
}

Eigen::Vector3d MapReader::Direction(const std::string& key,
                                     const Eigen::Vector3d& fallback) const {
  const Eigen::Vector3d direction = Vector(key, fallback);
  if (direction.norm() < 1e-9) {
    Complain(key, "must not be the zero vector");
    return fallback;
  }
  return direction.normalized();
}

Eigen::Quaterniond MapReader::Quaternion(const std::string& key) const {
  if (!Has(key)) return Eigen::Quaterniond::Identity();
  const std::vector<double> v = Numbers(key, 4, Range::kAny);
  const Eigen::Quaterniond rotation(v[3], v[0], v[1], v[2]);
  if (!findings_.ok()) return Eigen::Quaterniond::Identity();
  if (std::abs(rotation.norm() - 1) > 0.01) {
    Complain(key, "has norm " + FormatFixed(rotation.norm(), 4) + ", must be 1 (x, y, z, w)");
    return Eigen::Quaterniond::Identity();
  }
  return rotation.normalized();
}

void MapReader::List(
    const std::string& key,
    const std::function<void(const YAML::Node&, const std::string& path)>& each) const {
  if (!Has(key)) return;
  const YAML::Node list = Child(key);
  if (list.IsNull()) return;
  if (!list.IsSequence()) {
    Complain(key, "must be a list, not " + KindOf(list));
    return;
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    each(list[i], PathOf(key) + "[" + std::to_string(i) + "]");
  }
}

}  // namespace exemplar::scene
