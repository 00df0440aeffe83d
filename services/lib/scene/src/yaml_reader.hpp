#pragma once
// Reads YAML maps so that every error names file, line and key. The first error is kept; reading on
// after it is harmless and gives defaults, so callers check once at the end.

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::scene {

/// What a number must satisfy beside being finite.
enum class Range { kAny, kPositive, kNotNegative };

/// The first error of one document. Thread-compatible.
class Findings {
 public:
  explicit Findings(std::string source) : source_(std::move(source)) {}
  bool ok() const { return !error_.has_value(); }
  const Error& error() const { return *error_; }
  /// Keeps `message` with the place of `mark` unless there is an error already.
  void Add(const YAML::Mark& mark, const std::string& field, const std::string& message);

 private:
  std::string source_;
  std::optional<Error> error_;
};

/// One map of the document. Thread-compatible; refers to `findings`.
class MapReader {
 public:
  /// `path` names the map in errors ("buttons[0]"), empty for the document. Keys that are not in
  /// `known` are errors.
  MapReader(Findings& findings, YAML::Node node, std::string path, std::vector<std::string> known);

  bool Has(const std::string& key) const;
  std::string Text(const std::string& key) const;
  double Number(const std::string& key, std::optional<double> fallback,
                Range range = Range::kAny) const;
  bool Flag(const std::string& key, bool fallback) const;
  /// A list of texts; an absent one is empty.
  std::vector<std::string> Texts(const std::string& key) const;
  int Integer(const std::string& key, std::optional<int> fallback, int lowest, int highest) const;
  Eigen::Vector3d Vector(const std::string& key, const std::optional<Eigen::Vector3d>& fallback,
                         Range range = Range::kAny) const;
  /// As Vector, of unit length; zero is an error.
  Eigen::Vector3d Direction(const std::string& key, const Eigen::Vector3d& fallback) const;
  /// [x, y, z, w]; identity when absent. Its norm must be 1 to one part in a hundred.
  Eigen::Quaterniond Quaternion(const std::string& key) const;
  /// Calls `each` with every map of the list under `key` and its path; an absent list is empty.
  void List(const std::string& key,
            const std::function<void(const YAML::Node&, const std::string& path)>& each) const;
  YAML::Node Child(const std::string& key) const;
  std::string PathOf(const std::string& key) const;
  /// An error at `key`, or at the map when it has no such key.
  void Complain(const std::string& key, const std::string& message) const;
  const std::string& path() const { return path_; }

 private:
  std::vector<double> Numbers(const std::string& key, std::size_t count, Range range) const;
  /// False, with an error, when `key` is needed and absent.
  bool Present(const std::string& key, bool required) const;

  Findings& findings_;
  YAML::Node node_;
  std::string path_;
};

}  // namespace exemplar::scene
