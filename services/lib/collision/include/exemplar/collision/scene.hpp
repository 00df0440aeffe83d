#pragma once
// What stands around a robot, and how far away it is. FCL stays inside collision/.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/kinematics/robot_model.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::collision {

/// A thing in the scene that does not belong to the robot.
struct SceneObject {
  std::string name;
  geometry::Pose base_T_shape;
  kinematics::Shape shape;
};

/// What a camera saw of things without a name: every point fills the cell of an octree that it
/// lies in. Nothing is known, so nothing is in the way, behind what was seen.
struct PointCloud {
  std::string name;
  geometry::Pose base_T_cloud;
  std::vector<Eigen::Vector3d> cloud_p_points;
  double resolution_m = 0.02;  ///< edge of the smallest cells
};

/// An object that moves with a link of the robot: a tool, or what a hand holds. It is checked
/// against the scene, and against the robot but for its link and the links named.
struct HeldObject {
  std::string name;
  std::string link;
  geometry::Pose link_T_shape;
  kinematics::Shape shape;
  std::vector<std::string> touch_links = {};
};

/// Names are unique, and are no names of links.
struct Scene {
  std::vector<SceneObject> objects;
  std::vector<PointCloud> clouds = {};
  std::vector<HeldObject> held = {};
};

/// The obstacles, objects, clouds, held objects and the buttons' housings of a description;
/// `objects` replaces the poses of objects and buttons of the same name (where they are seen now).
/// A button is one body of its own name.
Scene MakeScene(const scene::Description& description,
                const std::vector<geometry::NamedPose>& objects = {});

/// Two bodies and the room between them. Names of links, held objects or scene objects.
struct Clearance {
  std::string first;
  std::string second;
  double distance_m = 0;                                   ///< negative: penetration depth
  Eigen::Vector3d base_p_first = Eigen::Vector3d::Zero();  ///< nearest points
  Eigen::Vector3d base_p_second = Eigen::Vector3d::Zero();
};

/// The objects and clouds that are nearer than `within_m` to this object of the scene, as it
/// stands; Clearance::first is the object. Errors as CollisionChecker::SetScene's, and where there
/// is none.
Result<std::vector<Clearance>> Neighbours(const Scene& scene, const std::string& object,
                                          double within_m);

/// A link may touch an object (the button that is to be pressed).
struct AllowedTouch {
  std::string link;    ///< or a held object; empty: all of them
  std::string object;  ///< empty: everything, other links too where `link` is a held object
};

struct CheckerOptions {
  double padding_m = 0.0;  ///< added around every link of the robot and what it holds
  std::vector<std::pair<std::string, std::string>> allowed_pairs =
      {};  ///< links never checked, beside adjacent ones
  /// Link pairs that touch in every one of so many random states are left out; 0 turns it off.
  int sampled_allowed_states = 200;
  double sampled_touch_distance_m = 3e-3;  ///< nearer than this counts as touching there
};

/// With a robot's SRDF: its pairs, and no sampling. Without: by sampling.
CheckerOptions OptionsOf(const kinematics::RobotDescription& robot);

/// A motion of all joints along a parameter, for proofs.
class JointPath {
 public:
  virtual ~JointPath() = default;
  /// `q` by joint index of the model, as kinematics::LinkPoses takes it.
  virtual void Position(double s, Eigen::Ref<Eigen::VectorXd> q) const = 0;
  /// An upper bound of the way (rad or m, not net but travelled) that each joint makes between
  /// s0 <= s1.
  virtual void Travel(double s0, double s1, Eigen::Ref<Eigen::VectorXd> travel) const = 0;
};

/// Where on a path less than the clearance asked for was found, or could not be excluded.
struct Violation {
  double s = 0;
  Clearance clearance;
};

/// Checks a robot against itself and a scene. Left out are: links with no moving joint between
/// them, neighbours in the tree (links without collision geometry skipped), a hand's fingers
/// against each other, links that touch in
/// every sampled state, and links that no joint moves against the scene. Construction is slow,
/// queries fast. Thread-compatible: one instance a thread.
class CollisionChecker {
 public:
  static Result<CollisionChecker> Create(const kinematics::RobotModel& model, Scene scene,
                                         const CheckerOptions& options = {});
  CollisionChecker(CollisionChecker&&) noexcept;
  CollisionChecker& operator=(CollisionChecker&&) noexcept;
  ~CollisionChecker();

  const Scene& scene() const;
  /// Errors name the object and the size at fault; the scene then stays as it was.
  Status SetScene(Scene scene);
  /// Takes an object of the scene into the hand: from here on it keeps the place at `link` that it
  /// has at `q`. Errors name the object or link that there is not.
  Status Attach(const std::string& object, const std::string& link,
                const Eigen::Ref<const Eigen::VectorXd>& q,
                const std::vector<std::string>& touch_links = {});
  /// Leaves a held object where it is at `q`.
  Status Detach(const std::string& object, const Eigen::Ref<const Eigen::VectorXd>& q);

  /// The smallest clearance at `q` (by joint index of the model, as kinematics::LinkPoses), self
  /// and scene, pairs of `allowed` left out. Nothing to check: distance is infinite and the names
  /// are empty.
  Clearance SmallestClearance(const Eigen::Ref<const Eigen::VectorXd>& q,
                              const std::vector<AllowedTouch>& allowed = {}) const;

  /// The distance alone. Does not allocate after the first call (where FCL is not needed).
  double SmallestDistance(const Eigen::Ref<const Eigen::VectorXd>& q,
                          const std::vector<AllowedTouch>& allowed = {}) const;

  /// What nearness costs: the sum over all pairs of bodies of the square of what their distance
  /// lacks to `margin_m`; 0 where everything is farther apart. Bodies count by their convex shapes.
  /// `gradient` (by joint index of the model, as q), where wanted.
  double NearnessCost(const Eigen::Ref<const Eigen::VectorXd>& q, double margin_m,
                      const std::vector<AllowedTouch>& allowed = {},
                      Eigen::VectorXd* gradient = nullptr) const;

  /// The smallest distance of the robot to itself by capsules around its geometry: never more than
  /// the true one, and much quicker. `gradient` (by joint index of the model, as q), where wanted:
  /// how it changes with each joint; zero where the nearest capsules' axes meet. Does not allocate
  /// after the first call.
  double CapsuleSelfClearance(const Eigen::Ref<const Eigen::VectorXd>& q,
                              Eigen::VectorXd* gradient = nullptr) const;

  /// Proves that the clearance is at least `required_clearance_m` all along [begin, end], by the
  /// clearance at a few places and how far any point of a link can move from there (conservative
  /// bisection), or returns the first place where it is not. Nothing between the places can be
  /// missed, however thin. Where nothing is proved though no body moves by more than 0.1 mm between
  /// two places the motion counts as violating: so it does only within 0.1 mm of the clearance
  /// asked for.
  std::optional<Violation> FirstViolation(const JointPath& path, double begin, double end,
                                          double required_clearance_m,
                                          const std::vector<AllowedTouch>& allowed = {}) const;

  /// Whether there is no such place: for loops that may not allocate. After the first calls this
  /// does not (where FCL is not needed).
  bool KeepsClear(const JointPath& path, double begin, double end, double required_clearance_m,
                  const std::vector<AllowedTouch>& allowed = {}) const;

  /// For each joint of the model a bound of the way (m) that any point of the robot makes against
  /// any other body when that joint alone moves by 1 rad or m, wherever the robot stands. Ways of
  /// several joints add up.
  Eigen::VectorXd LongestLevers() const;

  struct Impl;  ///< opaque

 private:
  explicit CollisionChecker(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace exemplar::collision
