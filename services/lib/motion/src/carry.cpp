#include "exemplar/motion/carry.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace exemplar::motion {
namespace {

using collision::Scene;
using collision::SceneObject;
using demonstration::SkillMotion;

/// A hand that opens and closes by more takes things.
constexpr double kGrasp = 0.2;
/// What the tool point is no farther from is between the fingers.
constexpr double kBetweenFingers_m = 0.02;
/// What is nearer to a thing that stands is touched by it: it is not known better where things are.
constexpr double kTouching_m = 0.008;
/// Things below it get farther away when it is lifted, those beside it do not.
constexpr double kLift_m = 0.005;
constexpr double kOfLift = 0.6;
/// Contacts that begin or end so near to the release are with what it is laid on.
constexpr double kAround_s = 0.5;

struct Grasp {
  int first = 0;
  int last = 0;
};

std::vector<Grasp> Grasps(const SkillMotion& motion) {
  std::vector<Grasp> grasps;
  if (motion.hand_open.empty()) return grasps;
  const auto [closed, open] = std::minmax_element(motion.hand_open.begin(), motion.hand_open.end());
  if (*open - *closed <= kGrasp) return grasps;
  const double middle = 0.5 * (*open + *closed);
  for (int k = 1; k < motion.frames(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    const bool was_open = motion.hand_open[at - 1] >= middle;
    const bool is_open = motion.hand_open[at] >= middle;
    if (was_open && !is_open) grasps.push_back({k, motion.frames()});
    if (!was_open && is_open && !grasps.empty()) grasps.back().last = k;
  }
  return grasps;
}

/// What of `movable` the tool point is in, or nearest to.
Result<std::optional<std::string>> Taken(Scene scene, const std::vector<std::string>& movable,
                                         const Eigen::Vector3d& base_p_tool) {
  const std::string point = "the point between the fingers";
  scene.objects.push_back(
      {point, geometry::Pose::FromTranslation(base_p_tool), kinematics::Sphere{1e-3}});
  const auto near = collision::Neighbours(scene, point, kBetweenFingers_m);
  if (!near.ok()) return near.error();
  const collision::Clearance* nearest = nullptr;
  for (const collision::Clearance& other : *near) {
    if (std::find(movable.begin(), movable.end(), other.second) == movable.end()) continue;
    if (nearest == nullptr || other.distance_m < nearest->distance_m) nearest = &other;
  }
  if (nearest == nullptr) return std::optional<std::string>();
  return std::optional<std::string>(nearest->second);
}

/// What stands below an object of the scene and bears it.
Result<std::vector<std::string>> Bearers(Scene scene, const std::string& object) {
  const auto before = collision::Neighbours(scene, object, kTouching_m);
  if (!before.ok()) return before.error();
  for (SceneObject& other : scene.objects) {
    if (other.name == object) other.base_T_shape.translation.z() += kLift_m;
  }
  const auto lifted = collision::Neighbours(scene, object, kTouching_m + 2 * kLift_m);
  if (!lifted.ok()) return lifted.error();
  std::vector<std::string> bearers;
  for (const collision::Clearance& below : *before) {
    const auto now = std::find_if(lifted->begin(), lifted->end(), [&](const auto& clearance) {
      return clearance.second == below.second;
    });
    if (now == lifted->end() || now->distance_m - below.distance_m > kOfLift * kLift_m) {
      bearers.push_back(below.second);
    }
  }
  return bearers;
}

}  // namespace

Result<std::vector<Carry>> FindCarries(const SkillMotion& motion, const Scene& scene,
                                       const std::vector<std::string>& movable,
                                       const std::string& tip,
                                       const std::vector<std::string>& touch_links) {
  std::vector<Carry> carries;
  if (motion.base_T_tool.empty() || !motion.has_orientation) return carries;
  Scene now = scene;
  std::vector<std::string> free = movable;
  for (const Grasp& grasp : Grasps(motion)) {
    const geometry::Pose& base_T_tip = motion.base_T_tool[static_cast<std::size_t>(grasp.first)];
    const auto taken = Taken(now, free, base_T_tip.translation);
    if (!taken.ok()) return taken.error();
    if (!*taken) continue;
    Carry carry;
    carry.object = **taken;
    carry.first = grasp.first;
    carry.last = grasp.last;
    const auto near = collision::Neighbours(now, carry.object, kTouching_m);
    if (!near.ok()) return near.error();
    for (const collision::Clearance& other : *near) carry.from.push_back(other.second);
    const auto found = std::find_if(now.objects.begin(), now.objects.end(),
                                    [&](const SceneObject& o) { return o.name == carry.object; });
    carry.held = {carry.object + " in the hand", tip, base_T_tip.Inverse() * found->base_T_shape,
                  found->shape, touch_links};
    carry.laid = {carry.object + " as laid", found->base_T_shape, found->shape};
    now.objects.erase(found);
    if (grasp.last < motion.frames()) {
      const geometry::Pose& base_T_open = motion.base_T_tool[static_cast<std::size_t>(grasp.last)];
      carry.laid.base_T_shape = base_T_open * carry.held.link_T_shape;
      now.objects.push_back(carry.laid);
      free.push_back(carry.laid.name);
      auto bearers = Bearers(now, carry.laid.name);
      if (!bearers.ok()) return bearers.error();
      carry.to = *std::move(bearers);
      const double release_s = motion.time_s[static_cast<std::size_t>(grasp.last)];
      for (const demonstration::Contact& contact : motion.contacts) {
        if (contact.object == carry.object) continue;
        if (motion.time_s[static_cast<std::size_t>(contact.first)] > release_s + kAround_s)
          continue;
        if (motion.time_s[static_cast<std::size_t>(contact.last)] < release_s - kAround_s) continue;
        carry.to.push_back(contact.object);
      }
    }
    carries.push_back(std::move(carry));
  }
  return carries;
}

void AddCarries(const std::vector<Carry>& carries, Scene& scene) {
  for (const Carry& carry : carries) {
    scene.held.push_back(carry.held);
    scene.objects.push_back(carry.laid);
  }
}

}  // namespace exemplar::motion
