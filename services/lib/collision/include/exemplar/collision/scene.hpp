#pragma once
// What stands around a robot, and how far away it is. FCL stays inside collision/.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/robot_model.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::collision {

/// A thing in the scene that does not belong to the robot.
struct SceneObject {
  std::string name;
  geometry::Pose base_T_shape;
  kinematics::Shape shape;
};

struct Scene {
  std::vector<SceneObject> objects;
};

/// The obstacles and the buttons' housings of a description; `objects` replaces the poses of
/// buttons of the same name (where they are seen now). A button is one body of its own name.
Scene MakeScene(const scene::Description& description,
                const std::vector<geometry::NamedPose>& objects = {});

/// Two bodies and the room between them. Names of links, or of scene objects.
struct Clearance {
  std::string first;
  std::string second;
  double distance_m = 0;                                   ///< negative: penetration depth
  Eigen::Vector3d base_p_first = Eigen::Vector3d::Zero();  ///< nearest points
  Eigen::Vector3d base_p_second = Eigen::Vector3d::Zero();
};

/// A link may touch an object (the button that is to be pressed).
struct AllowedTouch {
  std::string link;
  std::string object;
};

struct CheckerOptions {
  double padding_m = 0.0;  ///< added around the robot
  std::vector<std::pair<std::string, std::string>> allowed_pairs =
      {};  ///< links never checked, beside adjacent ones
  /// Link pairs that touch in every one of so many random states are left out; 0 turns it off.
  int sampled_allowed_states = 200;
};

/// Checks a robot against itself and a scene. Construction is slow, queries fast.
/// Thread-compatible: one instance a thread.
class CollisionChecker {
 public:
  static Result<CollisionChecker> Create(const kinematics::RobotModel& model, Scene scene,
                                         const CheckerOptions& options = {});
  CollisionChecker(CollisionChecker&&) noexcept;
  CollisionChecker& operator=(CollisionChecker&&) noexcept;
  ~CollisionChecker();

  const Scene& scene() const;
  void SetScene(Scene scene);

  /// The smallest clearance at `q` (by joint index of the model, as kinematics::LinkPoses), self
  /// and scene, pairs of `allowed` left out. Nothing to check: distance is infinite and the names
  /// are empty.
  Clearance SmallestClearance(const Eigen::Ref<const Eigen::VectorXd>& q,
                              const std::vector<AllowedTouch>& allowed = {}) const;

 private:
  struct Impl;
  explicit CollisionChecker(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace exemplar::collision
