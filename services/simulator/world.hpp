#pragma once
// The simulated world: a servo-driven robot, what stands around it, buttons that click. Physics by
// MuJoCo in fixed steps; the same calls in the same order give the same result to the last bit.

#include <Eigen/Core>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/geometry/pose.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/scene/description.hpp"

struct mjModel_;

namespace exemplar::simulator {

struct WorldOptions {
  Duration step = std::chrono::milliseconds(1);
};

/// Everything that moves, at one time: enough to draw it.
struct Snapshot {
  Duration time{0};
  std::vector<double> positions;    ///< MuJoCo's qpos
  std::vector<double> thing_poses;  ///< x y z qw qx qy qz of each thing that stays where it is put
};

struct ButtonState {
  std::string name;
  geometry::Pose base_T_object;
  double depth_m = 0;   ///< of the cap, 0 released
  double spring_n = 0;  ///< with which the spring pushes back
  std::uint64_t clicks = 0;
  Duration last_click{0};  ///< simulated time; 0: never
};

/// A button or an object of the scene, where it is.
struct ThingState {
  std::string name;
  geometry::Pose base_T_object;
};

/// Thread-compatible. Vectors are by chain joint, n = dof().
class World {
 public:
  /// The robot stands at its home posture. Links that overlap there never touch each other.
  static Result<World> Create(const kinematics::RobotDescription& robot,
                              const scene::Description& scene, const WorldOptions& options = {});
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;
  ~World();

  int dof() const;
  Duration step() const;
  /// Simulated time since creation.
  Duration time() const;

  /// What the servos follow from the next step on: positions (rad or m) and speeds.
  void SetTarget(const Eigen::Ref<const Eigen::VectorXd>& positions,
                 const Eigen::Ref<const Eigen::VectorXd>& velocities);
  /// Where the hand goes, from 0 (closed) to 1 (open), as fast and as strong as its joint's limits
  /// allow. Without a hand nothing happens.
  void SetHand(double opening);
  /// One step of options.step.
  void Step();
  /// Puts the robot to rest at `positions` at once, the servos holding it there.
  void MoveTo(const Eigen::Ref<const Eigen::VectorXd>& positions);

  bool has_hand() const;
  /// As measured, 0 to 1; 1 without a hand.
  double hand_open() const;
  Eigen::VectorXd positions() const;
  Eigen::VectorXd velocities() const;
  /// Torques or forces of the drives, gravity's part included.
  Eigen::VectorXd efforts() const;
  /// base_T_link; the link must exist.
  geometry::Pose LinkPose(std::string_view link) const;
  /// Sum of the normal contact forces on the robot's touch links from outside the robot, N.
  double touch_n() const;
  /// Deepest contact between the robot and the scene, or of the robot with itself, m; 0: none.
  double deepest_contact_m() const;

  std::vector<ButtonState> buttons() const;
  void ResetClicks();
  /// Moves an obstacle, a button or an object; where it stands on a rail, that begins there. A
  /// movable object comes to rest. kNotFound; kFailedPrecondition: it would stand in the robot, or
  /// a movable object in something else.
  Status Place(std::string_view thing, const geometry::Pose& base_T_thing);

  /// What a skill may be about: buttons, then objects.
  std::vector<ThingState> things() const;
  /// base_T_thing of an obstacle, a button or an object. kNotFound.
  Result<geometry::Pose> ThingPose(std::string_view thing) const;

  Snapshot snapshot() const;
  /// For drawing (renderer.hpp).
  const mjModel_* model() const;
  /// Times MuJoCo had to give up a state that went out of bounds. 0 in a sound world.
  int faults() const;

 private:
  struct Impl;
  explicit World(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace exemplar::simulator
