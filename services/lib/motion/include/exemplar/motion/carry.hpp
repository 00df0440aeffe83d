#pragma once
// What a hand takes, carries and lays down in a motion: a body that moves with the hand from the
// grasp on, and stands where it was laid from the release on.

#include <string>
#include <vector>

#include "exemplar/collision/scene.hpp"
#include "exemplar/demonstration/motion.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::motion {

/// One object from its grasp to its release. A checker of the whole motion knows it three times, as
/// three bodies, of which each counts in its own time (AllowedAt).
struct Carry {
  std::string object;                  ///< of the scene, as it stands before
  collision::HeldObject held;          ///< "<object> in the hand"
  collision::SceneObject laid;         ///< "<object> as laid"
  int first = 0;                       ///< frame of the skill's motion at which the hand closes
  int last = 0;                        ///< frame at which it opens; the number of frames: never
  std::vector<std::string> from = {};  ///< bodies that it touches where it stands before
  std::vector<std::string> to = {};    ///< bodies that it may touch where it is laid
};

/// The hand takes what of `movable` (objects of the scene) is between its fingers when it closes:
/// its opening passes the middle between the motion's widest and narrowest. `tip`: the link of the
/// motion's tool poses. None where the motion has no hand, no tool path or no orientation. Errors
/// as CollisionChecker::SetScene's.
Result<std::vector<Carry>> FindCarries(const demonstration::SkillMotion& motion,
                                       const collision::Scene& scene,
                                       const std::vector<std::string>& movable,
                                       const std::string& tip,
                                       const std::vector<std::string>& touch_links);

/// Adds their bodies to the scene.
void AddCarries(const std::vector<Carry>& carries, collision::Scene& scene);

}  // namespace exemplar::motion
