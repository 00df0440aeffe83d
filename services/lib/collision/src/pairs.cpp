#include "pairs.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "exemplar/base/text.hpp"

namespace exemplar::collision {
namespace {

using kinematics::JointType;
using kinematics::RobotModel;

/// Indices of the joints from `link` up to the root.
std::vector<int> JointsAbove(const RobotModel& model, int link) {
  std::vector<int> joints;
  while (link >= 0 && model.links[link].parent_joint >= 0) {
    joints.push_back(model.links[link].parent_joint);
    link = model.joints[joints.back()].parent_link;
  }
  return joints;
}

bool Moves(const kinematics::Joint& joint) { return joint.type != JointType::kFixed; }

/// Joints between two links: those above one and not above the other.
std::vector<int> JointsBetween(const RobotModel& model, int first, int second) {
  const std::vector<int> a = JointsAbove(model, first);
  const std::vector<int> b = JointsAbove(model, second);
  std::vector<int> between;
  for (const int joint : a) {
    if (std::find(b.begin(), b.end(), joint) == b.end()) between.push_back(joint);
  }
  for (const int joint : b) {
    if (std::find(a.begin(), a.end(), joint) == a.end()) between.push_back(joint);
  }
  return between;
}

/// The nearest link above that has parts; -1 when there is none.
int ParentWithParts(const RobotModel& model, const std::vector<bool>& has_parts, int link) {
  for (const int joint : JointsAbove(model, link)) {
    const int parent = model.joints[joint].parent_link;
    if (has_parts[parent]) return parent;
  }
  return -1;
}

/// Whether the hand's joint, or one that follows it, moves the link: fingers, which close onto each
/// other.
bool IsFinger(const RobotModel& model, int link) {
  if (!model.hand) return false;
  const std::vector<int> above = JointsAbove(model, link);
  return std::any_of(above.begin(), above.end(), [&](int joint) {
    const std::optional<kinematics::Mimic>& mimic = model.joints[joint].mimic;
    return joint == model.hand->joint || (mimic && mimic->joint == model.hand->joint);
  });
}

/// `offset` without its component along a revolute joint's own axis, which turning cannot move.
double OffsetAcross(const kinematics::Joint& joint, const Eigen::Vector3d& offset) {
  return (offset - offset.dot(joint.axis) * joint.axis).norm();
}

void AddLevers(const RobotModel& model, const RobotPart& part, const std::vector<int>& joints,
               std::map<int, double>& levers) {
  for (const int index : joints) {
    const kinematics::Joint& joint = model.joints[index];
    if (!Moves(joint)) continue;
    double length = 1;
    if (joint.type != JointType::kPrismatic) {
      length = part.body.hull.reach();
      int link = part.link;
      Eigen::Vector3d offset = part.link_T_shape.translation;
      while (model.links[link].parent_joint != index) {
        length += offset.norm();
        const kinematics::Joint& above = model.joints[model.links[link].parent_joint];
        if (above.type == JointType::kPrismatic) {
          length += std::max(std::abs(above.limits.lower), std::abs(above.limits.upper));
        }
        offset = above.parent_T_joint.translation;
        link = above.parent_link;
      }
      length += OffsetAcross(joint, offset);
    }
    if (joint.mimic) {
      levers[joint.mimic->joint] += std::abs(joint.mimic->multiplier) * length;
    } else {
      levers[index] += length;
    }
  }
}

}  // namespace

Result<std::vector<RobotPart>> MakeRobotParts(const RobotModel& model) {
  std::vector<RobotPart> parts;
  for (std::size_t link = 0; link < model.links.size(); ++link) {
    const std::string& name = model.links[link].name;
    for (const kinematics::Geometry& geometry : model.links[link].collisions) {
      Result<Body> body = MakeBody(geometry.shape);
      if (!body.ok()) {
        return WithPlace(body.error(), "link \"" + name + "\": collision geometry");
      }
      const BoundingCapsule capsule =
          FitCapsule(body->hull).At(Placement::From(geometry.link_T_shape));
      parts.push_back(
          {name, static_cast<int>(link), geometry.link_T_shape, *std::move(body), capsule});
    }
  }
  return parts;
}

Result<std::vector<ScenePart>> MakeSceneParts(const Scene& scene) {
  std::vector<ScenePart> parts;
  const auto add = [&](const std::string& name, const geometry::Pose& base_T_body,
                       Result<Body> body) -> Status {
    if (!body.ok()) return WithPlace(body.error(), "object \"" + name + "\"");
    const Placement at = Placement::From(base_T_body);
    const Bounds bounds = body->hull.BoundsAt(at);
    const BoundingCapsule capsule = FitCapsule(body->hull).At(at);
    parts.push_back({name, at, bounds, *std::move(body), capsule});
    return {};
  };
  for (const SceneObject& object : scene.objects) {
    const Status added = add(object.name, object.base_T_shape, MakeBody(object.shape));
    if (!added.ok()) return added.error();
  }
  for (const PointCloud& cloud : scene.clouds) {
    const Status added = add(cloud.name, cloud.base_T_cloud,
                             MakeCloudBody(cloud.cloud_p_points, cloud.resolution_m));
    if (!added.ok()) return added.error();
  }
  return parts;
}

Result<std::vector<RobotPart>> MakeHeldParts(const RobotModel& model, const Scene& scene) {
  std::vector<RobotPart> parts;
  for (const HeldObject& held : scene.held) {
    const std::string place = "held object \"" + held.name + "\"";
    std::vector<std::string> links = held.touch_links;
    links.push_back(held.link);
    for (const std::string& link : links) {
      if (model.FindLink(link) >= 0) continue;
      return NotFound(place + ": the robot \"" + model.name + "\" has no link \"" + link + "\"");
    }
    Result<Body> body = MakeBody(held.shape);
    if (!body.ok()) return WithPlace(body.error(), place);
    const BoundingCapsule capsule = FitCapsule(body->hull).At(Placement::From(held.link_T_shape));
    parts.push_back(
        {held.name, model.FindLink(held.link), held.link_T_shape, *std::move(body), capsule});
  }
  return parts;
}

Status CheckNames(const RobotModel& model, const Scene& scene) {
  std::set<std::string> names;
  for (const kinematics::Link& link : model.links) names.insert(link.name);
  const auto claim = [&](const std::string& name) -> Status {
    if (names.insert(name).second) return {};
    return InvalidArgument("object \"" + name +
                           "\": a link of the robot or another object has this name");
  };
  for (const SceneObject& object : scene.objects) {
    if (Status free = claim(object.name); !free.ok()) return free;
  }
  for (const PointCloud& cloud : scene.clouds) {
    if (Status free = claim(cloud.name); !free.ok()) return free;
  }
  for (const HeldObject& held : scene.held) {
    if (Status free = claim(held.name); !free.ok()) return free;
  }
  return {};
}

Result<std::vector<std::pair<int, int>>> CheckedLinkPairs(
    const RobotModel& model, const std::vector<RobotPart>& parts,
    const std::vector<std::pair<std::string, std::string>>& allowed) {
  std::vector<std::pair<int, int>> allowed_links;
  for (const auto& [first, second] : allowed) {
    for (const std::string& name : {first, second}) {
      if (model.FindLink(name) < 0) {
        return NotFound("allowed pair: the robot \"" + model.name + "\" has no link \"" + name +
                        "\"");
      }
    }
    allowed_links.push_back(std::minmax(model.FindLink(first), model.FindLink(second)));
  }
  std::vector<bool> has_parts(model.links.size(), false);
  for (const RobotPart& part : parts) has_parts[part.link] = true;
  std::vector<std::pair<int, int>> pairs;
  const int links = static_cast<int>(model.links.size());
  for (int a = 0; a < links; ++a) {
    for (int b = a + 1; b < links; ++b) {
      if (!has_parts[a] || !has_parts[b]) continue;
      if (IsFinger(model, a) && IsFinger(model, b)) continue;
      if (std::find(allowed_links.begin(), allowed_links.end(), std::pair(a, b)) !=
          allowed_links.end()) {
        continue;
      }
      if (ParentWithParts(model, has_parts, a) == b || ParentWithParts(model, has_parts, b) == a) {
        continue;
      }
      if (MoveAgainstEachOther(model, a, b)) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

bool MoveAgainstEachOther(const RobotModel& model, int first, int second) {
  const std::vector<int> between = JointsBetween(model, first, second);
  return std::any_of(between.begin(), between.end(),
                     [&](int joint) { return Moves(model.joints[joint]); });
}

std::vector<Lever> LeversBetween(const RobotModel& model, const RobotPart& first,
                                 const RobotPart* second) {
  std::vector<int> above_first = JointsAbove(model, first.link);
  std::map<int, double> levers;
  if (second != nullptr) {
    std::vector<int> above_second = JointsAbove(model, second->link);
    const std::vector<int> between = JointsBetween(model, first.link, second->link);
    const auto outside = [&](int joint) {
      return std::find(between.begin(), between.end(), joint) == between.end();
    };
    std::erase_if(above_first, outside);
    std::erase_if(above_second, outside);
    AddLevers(model, *second, above_second, levers);
  }
  AddLevers(model, first, above_first, levers);
  std::vector<Lever> out;
  out.reserve(levers.size());
  for (const auto& [joint, length] : levers) out.push_back({joint, length});
  return out;
}

}  // namespace exemplar::collision
