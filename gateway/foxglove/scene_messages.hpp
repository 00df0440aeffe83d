#pragma once
// foxglove::SceneUpdate and foxglove::FrameTransforms: values and their bytes (CDR, little-endian).

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/stamp.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::gateway::foxglove {

struct FrameTransform {
  Stamp time;
  std::string parent;
  std::string child;
  geometry::Pose parent_T_child;
};

using Colour = Eigen::Vector4d;  ///< red, green, blue, opacity from 0 to 1

struct Solid {
  geometry::Pose pose;
  Eigen::Vector3d size;  ///< of the box around it; a cylinder's axis is z
  Colour colour;
};
struct LineStrip {
  double thickness_m = 0.005;
  std::vector<Eigen::Vector3d> points = {};
  Colour colour;
};
struct Label {
  geometry::Pose pose = {};
  double height_m = 0.03;
  Colour colour;
  std::string text;
};
struct Model {
  geometry::Pose pose;
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Colour colour;
  std::string media_type;  ///< "model/stl"
  std::string data;
};

struct Entity {
  Stamp time;
  std::string frame;
  std::string id;
  Duration lifetime{0};  ///< 0: until it is replaced or deleted
  bool follows_frame = true;
  std::vector<Solid> cubes = {};
  std::vector<Solid> spheres = {};
  std::vector<Solid> cylinders = {};
  std::vector<LineStrip> lines = {};
  std::vector<Label> labels = {};
  std::vector<Model> models = {};
};

struct SceneUpdate {
  std::vector<std::string> deletions;  ///< ids
  std::vector<Entity> entities;
};

std::string Encode(const std::vector<FrameTransform>& transforms);
std::string Encode(const SceneUpdate& update, Stamp now);

inline constexpr const char* kSceneUpdateType = "foxglove::SceneUpdate";
inline constexpr const char* kFrameTransformsType = "foxglove::FrameTransforms";
std::string_view SceneUpdateSchema();
std::string_view FrameTransformsSchema();

}  // namespace exemplar::gateway::foxglove
