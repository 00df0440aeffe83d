#pragma once
// Which parts of a robot and a scene are checked against each other, and how far they can move
// relative to each other.

#include <string>
#include <utility>
#include <vector>

#include "body.hpp"
#include "bounding_capsule.hpp"
#include "exemplar/collision/scene.hpp"

namespace exemplar::collision {

/// One body of a link, or one that it holds.
struct RobotPart {
  std::string name;  ///< of the link, or of the held object
  int link = -1;
  geometry::Pose link_T_shape;
  Body body;
  BoundingCapsule capsule;  ///< around the body, in the link's frame
};

/// One body of the scene, where it stays.
struct ScenePart {
  std::string name;
  Placement base_at;
  Bounds bounds;
  Body body;
  BoundingCapsule capsule;  ///< around the body, in the base frame
};

/// How much a joint's travel (by index of the model; mimic joints count for their leader) can move
/// the two parts of a pair relative to each other, at most: metres per rad or per m.
struct Lever {
  int joint = -1;
  double length = 0;
};

struct Pair {
  int first = -1;   ///< a robot part
  int second = -1;  ///< a robot part, or a scene part
  bool scene = false;
  std::vector<Lever> levers;
};

/// Errors name link or object and the shape at fault.
Result<std::vector<RobotPart>> MakeRobotParts(const kinematics::RobotModel& model);
Result<std::vector<ScenePart>> MakeSceneParts(const Scene& scene);
/// The scene's held objects, as parts of their links.
Result<std::vector<RobotPart>> MakeHeldParts(const kinematics::RobotModel& model,
                                             const Scene& scene);
/// Kept apart: no two things of the scene, and no thing and link, have one name.
Status CheckNames(const kinematics::RobotModel& model, const Scene& scene);

/// Pairs of links (indices, ascending) that are worth checking: not rigidly connected, not
/// neighbours, not named in `allowed`. Errors name unknown links of `allowed`.
Result<std::vector<std::pair<int, int>>> CheckedLinkPairs(
    const kinematics::RobotModel& model, const std::vector<RobotPart>& parts,
    const std::vector<std::pair<std::string, std::string>>& allowed);

/// Whether any joint between the links moves.
bool MoveAgainstEachOther(const kinematics::RobotModel& model, int first, int second);

/// The levers between two parts; `second` null: between `first` and the base.
std::vector<Lever> LeversBetween(const kinematics::RobotModel& model, const RobotPart& first,
                                 const RobotPart* second);

}  // namespace exemplar::collision
