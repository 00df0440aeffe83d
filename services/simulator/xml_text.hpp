#pragma once
// Writes indented XML. Thread-compatible.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/geometry/pose.hpp"

namespace exemplar::simulator {

/// An attribute; numbers are written so that they read back exactly.
struct Attribute {
  Attribute(std::string_view attribute_name, std::string_view text)
      : name(attribute_name), value(text) {}
  Attribute(std::string_view attribute_name, const std::string& text)
      : name(attribute_name), value(text) {}
  Attribute(std::string_view attribute_name, const char* text)
      : name(attribute_name), value(text) {}
  Attribute(std::string_view attribute_name, double number);
  Attribute(std::string_view attribute_name, std::initializer_list<double> numbers);
  Attribute(std::string_view attribute_name, const Eigen::Vector3d& vector)
      : Attribute(attribute_name, {vector.x(), vector.y(), vector.z()}) {}
  /// In MuJoCo's order: w, x, y, z.
  Attribute(std::string_view attribute_name, const Eigen::Quaterniond& rotation)
      : Attribute(attribute_name, {rotation.w(), rotation.x(), rotation.y(), rotation.z()}) {}

  std::string name;
  std::string value;
};
using Attributes = std::vector<Attribute>;

/// pos and quat of a pose.
Attributes PoseAttributes(const geometry::Pose& pose);
Attributes operator+(Attributes a, const Attributes& b);

class XmlText {
 public:
  void Open(std::string_view element, const Attributes& attributes = {});
  void Close();
  void Empty(std::string_view element, const Attributes& attributes = {});
  /// Precondition: every element is closed.
  std::string Take() &&;

 private:
  void Start(std::string_view element, const Attributes& attributes, std::string_view end);

  std::string text_;
  std::vector<std::string> open_;
};

}  // namespace exemplar::simulator
