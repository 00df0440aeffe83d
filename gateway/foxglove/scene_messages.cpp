#include "gateway/foxglove/scene_messages.hpp"

#include <algorithm>
#include <cstring>

namespace exemplar::gateway::foxglove {
namespace {

/// Members in their order, each aligned to its size, counted from behind the encapsulation header.
class CdrWriter {
 public:
  CdrWriter() : bytes_("\x00\x01\x00\x00", kHeader) {}

  template <class Number>
  void Put(Number number) {
    const std::size_t behind = (bytes_.size() - kHeader) % sizeof(Number);
    if (behind > 0) bytes_.append(sizeof(Number) - behind, '\0');
    char raw[sizeof(Number)];
    std::memcpy(raw, &number, sizeof(Number));
    bytes_.append(raw, sizeof(Number));
  }
  void Count(std::size_t count) { Put(static_cast<std::uint32_t>(count)); }
  void Flag(bool flag) { Put(static_cast<std::uint8_t>(flag ? 1 : 0)); }
  void Text(std::string_view text) {
    Count(text.size() + 1);
    bytes_.append(text);
    bytes_.push_back('\0');
  }
  void Octets(std::string_view octets) {
    Count(octets.size());
    bytes_.append(octets);
  }
  void Time(Stamp time) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    const std::int64_t ns = std::max<std::int64_t>(0, time.nanoseconds());
    Put(static_cast<std::uint32_t>(ns / kSecond));
    Put(static_cast<std::uint32_t>(ns % kSecond));
  }
  void Vector(const Eigen::Vector3d& v) {
    for (const double number : {v.x(), v.y(), v.z()}) Put(number);
  }
  void Rotation(const Eigen::Quaterniond& q) {
    for (const double number : {q.x(), q.y(), q.z(), q.w()}) Put(number);
  }
  void Pose(const geometry::Pose& pose) {
    Vector(pose.translation);
    Rotation(pose.rotation);
  }
  void Rgba(const Colour& colour) {
    for (const double number : {colour[0], colour[1], colour[2], colour[3]}) Put(number);
  }
  std::string Take() { return std::move(bytes_); }

 private:
  static constexpr std::size_t kHeader = 4;
  std::string bytes_;
};

void PutSolids(CdrWriter& cdr, const std::vector<Solid>& solids) {
  cdr.Count(solids.size());
  for (const Solid& solid : solids) {
    cdr.Pose(solid.pose);
    cdr.Vector(solid.size);
    cdr.Rgba(solid.colour);
  }
}

void PutCylinders(CdrWriter& cdr, const std::vector<Solid>& cylinders) {
  cdr.Count(cylinders.size());
  for (const Solid& cylinder : cylinders) {
    cdr.Pose(cylinder.pose);
    cdr.Vector(cylinder.size);
    cdr.Put(1.0);  // as wide below
    cdr.Put(1.0);  // and above
    cdr.Rgba(cylinder.colour);
  }
}

void PutLines(CdrWriter& cdr, const std::vector<LineStrip>& lines) {
  cdr.Count(lines.size());
  for (const LineStrip& line : lines) {
    cdr.Put(std::uint32_t{0});  // LINE_STRIP
    cdr.Pose({});
    cdr.Put(line.thickness_m);
    cdr.Flag(false);
    cdr.Count(line.points.size());
    for (const Eigen::Vector3d& point : line.points) cdr.Vector(point);
    cdr.Rgba(line.colour);
    cdr.Count(0);  // a colour each
    cdr.Count(0);  // indices
  }
}

void PutLabels(CdrWriter& cdr, const std::vector<Label>& labels) {
  cdr.Count(labels.size());
  for (const Label& label : labels) {
    cdr.Pose(label.pose);
    cdr.Flag(true);
    cdr.Put(label.height_m);
    cdr.Flag(false);
    cdr.Rgba(label.colour);
    cdr.Text(label.text);
  }
}

void PutModels(CdrWriter& cdr, const std::vector<Model>& models) {
  cdr.Count(models.size());
  for (const Model& model : models) {
    cdr.Pose(model.pose);
    cdr.Vector(model.scale);
    cdr.Rgba(model.colour);
    cdr.Flag(true);
    cdr.Text("");
    cdr.Text(model.media_type);
    cdr.Octets(model.data);
  }
}

void PutEntity(CdrWriter& cdr, const Entity& entity) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  cdr.Time(entity.time);
  cdr.Text(entity.frame);
  cdr.Text(entity.id);
  cdr.Put(static_cast<std::int32_t>(entity.lifetime.count() / kSecond));
  cdr.Put(static_cast<std::uint32_t>(entity.lifetime.count() % kSecond));
  cdr.Flag(entity.follows_frame);
  cdr.Count(0);  // metadata
  cdr.Count(0);  // arrows
  PutSolids(cdr, entity.cubes);
  PutSolids(cdr, entity.spheres);
  PutCylinders(cdr, entity.cylinders);
  PutLines(cdr, entity.lines);
  cdr.Count(0);  // triangles
  PutLabels(cdr, entity.labels);
  PutModels(cdr, entity.models);
}

}  // namespace

std::string Encode(const std::vector<FrameTransform>& transforms) {
  CdrWriter cdr;
  cdr.Count(transforms.size());
  for (const FrameTransform& transform : transforms) {
    cdr.Time(transform.time);
    cdr.Text(transform.parent);
    cdr.Text(transform.child);
    cdr.Vector(transform.parent_T_child.translation);
    cdr.Rotation(transform.parent_T_child.rotation);
  }
  return cdr.Take();
}

std::string Encode(const SceneUpdate& update, Stamp now) {
  CdrWriter cdr;
  cdr.Count(update.deletions.size());
  for (const std::string& id : update.deletions) {
    cdr.Time(now);
    cdr.Put(std::uint32_t{0});  // MATCHING_ID
    cdr.Text(id);
  }
  cdr.Count(update.entities.size());
  for (const Entity& entity : update.entities) PutEntity(cdr, entity);
  return cdr.Take();
}

std::string_view SceneUpdateSchema() {
  return R"(module foxglove {
struct Time { unsigned long sec; unsigned long nsec; };
struct Duration { long sec; unsigned long nsec; };
struct Color { double r; double g; double b; double a; };
struct Vector3 { double x; double y; double z; };
struct Point3 { double x; double y; double z; };
struct Quaternion { double x; double y; double z; double w; };
struct Pose { Vector3 position; Quaternion orientation; };
struct KeyValuePair { string key; string value; };
enum SceneEntityDeletionType { MATCHING_ID, ALL };
enum LineType { LINE_STRIP, LINE_LOOP, LINE_LIST };
struct SceneEntityDeletion { Time timestamp; SceneEntityDeletionType type; string id; };
struct ArrowPrimitive {
  Pose pose; double shaft_length; double shaft_diameter; double head_length;
  double head_diameter; Color color;
};
struct CubePrimitive { Pose pose; Vector3 size; Color color; };
struct SpherePrimitive { Pose pose; Vector3 size; Color color; };
struct CylinderPrimitive {
  Pose pose; Vector3 size; double bottom_scale; double top_scale; Color color;
};
struct LinePrimitive {
  LineType type; Pose pose; double thickness; boolean scale_invariant; sequence<Point3> points;
  Color color; sequence<Color> colors; sequence<unsigned long> indices;
};
struct TriangleListPrimitive {
  Pose pose; sequence<Point3> points; Color color; sequence<Color> colors;
  sequence<unsigned long> indices;
};
struct TextPrimitive {
  Pose pose; boolean billboard; double font_size; boolean scale_invariant; Color color;
  string text;
};
struct ModelPrimitive {
  Pose pose; Vector3 scale; Color color; boolean override_color; string url; string media_type;
  sequence<octet> data;
};
struct SceneEntity {
  Time timestamp; string frame_id; string id; Duration lifetime; boolean frame_locked;
  sequence<KeyValuePair> metadata; sequence<ArrowPrimitive> arrows; sequence<CubePrimitive> cubes;
  sequence<SpherePrimitive> spheres; sequence<CylinderPrimitive> cylinders;
  sequence<LinePrimitive> lines; sequence<TriangleListPrimitive> triangles;
  sequence<TextPrimitive> texts; sequence<ModelPrimitive> models;
};
struct SceneUpdate {
  sequence<SceneEntityDeletion> deletions; sequence<SceneEntity> entities;
};
};
)";
}

std::string_view FrameTransformsSchema() {
  return R"(module foxglove {
struct Time { unsigned long sec; unsigned long nsec; };
struct Vector3 { double x; double y; double z; };
struct Quaternion { double x; double y; double z; double w; };
struct FrameTransform {
  Time timestamp; string parent_frame_id; string child_frame_id; Vector3 translation;
  Quaternion rotation;
};
struct FrameTransforms { sequence<FrameTransform> transforms; };
};
)";
}

}  // namespace exemplar::gateway::foxglove
