#include <algorithm>

#include "exemplar/collision/scene.hpp"
#include "pairs.hpp"

namespace exemplar::collision {

Scene MakeScene(const scene::Description& description,
                const std::vector<geometry::NamedPose>& objects) {
  Scene scene;
  for (const scene::Obstacle& obstacle : description.obstacles) {
    scene.objects.push_back({obstacle.name, obstacle.base_T_shape, obstacle.shape});
  }
  const auto as_seen = [&](const std::string& name, geometry::Pose base_T_object) {
    for (const geometry::NamedPose& seen : objects) {
      if (seen.name != name) continue;
      base_T_object.translation = seen.base_T_object.translation;
      if (seen.has_orientation) base_T_object.rotation = seen.base_T_object.rotation;
    }
    return base_T_object;
  };
  for (const scene::Object& object : description.objects) {
    scene.objects.push_back(
        {object.name, as_seen(object.name, object.base_T_object), object.shape});
  }
  for (const scene::Button& button : description.buttons) {
    const geometry::Pose base_T_object = as_seen(button.name, button.base_T_object);
    // From the cap's upper face down to the foot of the housing.
    geometry::Pose object_T_shape;
    object_T_shape.translation =
        button.object_p_contact - 0.5 * button.height_m * button.object_normal;
    object_T_shape.rotation =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), button.object_normal);
    scene.objects.push_back({button.name, base_T_object * object_T_shape,
                             kinematics::Cylinder{button.radius_m, button.height_m}});
  }
  for (const scene::Cloud& cloud : description.clouds) {
    scene.clouds.push_back(
        {cloud.name, cloud.base_T_cloud, cloud.cloud_p_points, cloud.resolution_m});
  }
  for (const scene::Held& held : description.held) {
    scene.held.push_back({held.name, held.link, held.link_T_shape, held.shape, held.touch_links});
  }
  return scene;
}

Result<std::vector<Clearance>> Neighbours(const Scene& scene, const std::string& object,
                                          double within_m) {
  const Result<std::vector<ScenePart>> parts = MakeSceneParts(scene);
  if (!parts.ok()) return parts.error();
  const auto found = std::find_if(parts->begin(), parts->end(),
                                  [&](const ScenePart& part) { return part.name == object; });
  if (found == parts->end()) return NotFound("the scene has no object \"" + object + "\"");
  std::vector<Clearance> neighbours;
  for (const ScenePart& other : *parts) {
    if (&other == &*found) continue;
    const Separation apart =
        Distance(found->body, found->base_at, other.body, other.base_at, within_m);
    if (apart.distance_m >= within_m) continue;
    neighbours.push_back({object, other.name, apart.distance_m, apart.p_first, apart.p_second});
  }
  return neighbours;
}

CheckerOptions OptionsOf(const kinematics::RobotDescription& robot) {
  CheckerOptions options;
  if (!robot.allowed_pairs) return options;
  options.allowed_pairs = *robot.allowed_pairs;
  options.sampled_allowed_states = 0;
  return options;
}

}  // namespace exemplar::collision
