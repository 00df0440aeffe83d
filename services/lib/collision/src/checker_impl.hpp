#pragma once
// What a CollisionChecker is made of.

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "pairs.hpp"

namespace exemplar::collision {

/// The robot's parts at one configuration, and the distances asked for so far.
struct Snapshot {
  /// A lower bound of a pair's distance; `exact` where it is the distance.
  struct Known {
    bool asked = false;
    bool exact = false;
    double distance_m = 0;
  };

  double s = 0;
  std::vector<Placement> placements;
  std::vector<Bounds> bounds;
  std::vector<BoundingCapsule> capsules;
  std::vector<Known> distances;  ///< one a pair
};

/// What a proof works with at one depth of its bisection.
struct ProofLevel {
  Snapshot middle;
  std::vector<int> unproved;  ///< pairs
};

struct CollisionChecker::Impl {
  kinematics::RobotModel model;
  CheckerOptions options;
  Scene scene;
  std::vector<RobotPart> robot_parts;  ///< of the model, then what is held
  std::vector<ScenePart> scene_parts;
  std::size_t model_parts = 0;
  std::vector<Pair> model_pairs;  ///< of the model's parts among themselves
  std::vector<Pair> pairs;        ///< model_pairs, held against robot, robot against scene
  std::size_t self_pairs = 0;     ///< those of `pairs` without the scene
  // Scratch of one query: the class is thread-compatible.
  mutable std::vector<geometry::Pose> base_T_links;
  mutable Snapshot scratch;
  mutable std::vector<std::pair<double, int>> queue;
  mutable Snapshot proof_low, proof_high;
  mutable std::vector<int> proof_pairs;
  mutable std::vector<std::unique_ptr<ProofLevel>> proof_levels;
  mutable Eigen::VectorXd proof_q, proof_travel;

  /// Puts a scene and its parts, made of it, in place.
  void Take(Scene new_scene, std::vector<ScenePart> parts, std::vector<RobotPart> held);
  void MakePairs();
  /// Removes the link pairs that touch in every one of the sampled states.
  void LeaveOutTouching();

  void Place(const Eigen::Ref<const Eigen::VectorXd>& q, Snapshot& snapshot) const;
  double Padding(const Pair& pair) const {
    return pair.scene ? options.padding_m : 2 * options.padding_m;
  }
  const std::string& SecondName(const Pair& pair) const {
    return pair.scene ? scene_parts[pair.second].name : robot_parts[pair.second].name;
  }
  bool IsAllowed(const Pair& pair, const std::vector<AllowedTouch>& allowed) const;
  bool HasPieces(const Pair& pair) const;

  /// Lower bounds of a pair's distance, by boxes, and by the better of boxes and capsules.
  double LowerBound(const Pair& pair, const Snapshot& at) const;
  double TightBound(const Pair& pair, const Snapshot& at) const;
  /// By convex shapes alone: a lower bound too where one of the bodies is not convex.
  Separation MeasureHulls(const Pair& pair, const Snapshot& at) const;
  /// Exact where less than `ignore_beyond_m`, else a lower bound of at least that.
  Separation Measure(const Pair& pair, const Snapshot& at,
                     double ignore_beyond_m = std::numeric_limits<double>::infinity()) const;
  /// The pair that is nearest to itself as placed at `scratch`, and its distance; -1: none.
  std::pair<int, double> Nearest(const std::vector<AllowedTouch>& allowed) const;
  Clearance Describe(int index, const Snapshot& at) const;

  /// Adds how fast a point of a link moves along `direction` with each joint. base_T_links are set.
  void AddMotion(int link, const Eigen::Vector3d& base_p, const Eigen::Vector3d& direction,
                 double weight, Eigen::VectorXd& gradient) const;
};

}  // namespace exemplar::collision
