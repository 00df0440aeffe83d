#include "pairs.hpp"

#include <algorithm>
#include <cmath>
#include <map>

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
      length = part.shape.reach();
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
    for (const kinematics::Geometry& geometry : model.links[link].collisions) {
      Result<ConvexShape> shape = ConvexShape::Create(geometry.shape);
      if (!shape.ok()) {
        return WithPlace(shape.error(),
                         "link \"" + model.links[link].name + "\": collision geometry");
      }
      const BoundingCapsule capsule = FitCapsule(*shape).At(Placement::From(geometry.link_T_shape));
      parts.push_back({static_cast<int>(link), geometry.link_T_shape, *std::move(shape), capsule});
    }
  }
  return parts;
}

Result<std::vector<ScenePart>> MakeSceneParts(const Scene& scene) {
  std::vector<ScenePart> parts;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    Result<ConvexShape> shape = ConvexShape::Create(scene.objects[i].shape);
    if (!shape.ok()) {
      return WithPlace(shape.error(), "object \"" + scene.objects[i].name + "\"");
    }
    const Placement at = Placement::From(scene.objects[i].base_T_shape);
    parts.push_back(
        {static_cast<int>(i), at, shape->BoundsAt(at), *shape, FitCapsule(*shape).At(at)});
  }
  return parts;
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
      if (std::find(allowed_links.begin(), allowed_links.end(), std::pair(a, b)) !=
          allowed_links.end()) {
        continue;
      }
      if (ParentWithParts(model, has_parts, a) == b || ParentWithParts(model, has_parts, b) == a) {
        continue;
      }
      const std::vector<int> between = JointsBetween(model, a, b);
      if (std::none_of(between.begin(), between.end(),
                       [&](int joint) { return Moves(model.joints[joint]); })) {
        continue;
      }
      pairs.emplace_back(a, b);
    }
  }
  return pairs;
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
  for (const auto& [joint, length] : levers) out.push_back({joint, length});
  return out;
}

}  // namespace exemplar::collision
