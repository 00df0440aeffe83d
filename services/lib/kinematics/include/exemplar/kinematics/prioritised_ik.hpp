#pragma once
// Several tools at once, with priorities: both arms on a shared torso, and what they leave free.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/kinematics/chain.hpp"

namespace exemplar::kinematics {

/// The joints of several chains of one robot, each once. Immutable, so thread-safe.
class ChainGroup {
 public:
  /// kInvalidArgument when there is no chain, or two chains start from different links.
  static Result<ChainGroup> Create(std::vector<Chain> chains);

  int dof() const { return static_cast<int>(names_.size()); }
  const std::vector<std::string>& joint_names() const { return names_; }
  /// Of a joint in several chains, the narrowest.
  const std::vector<JointLimits>& limits() const { return limits_; }
  const std::vector<Chain>& chains() const { return chains_; }
  /// The chain's own joints out of the group's.
  Eigen::VectorXd Of(int chain, const Eigen::Ref<const Eigen::VectorXd>& q) const;
  /// For each joint of the chain its index in the group.
  const std::vector<int>& indices(int chain) const {
    return indices_[static_cast<std::size_t>(chain)];
  }

 private:
  ChainGroup() = default;
  std::vector<Chain> chains_;
  std::vector<std::vector<int>> indices_;
  std::vector<std::string> names_;
  std::vector<JointLimits> limits_;
};

/// What one tool has to do.
struct ToolTask {
  int chain = 0;  ///< of the group
  geometry::Pose base_T_tool = {};
  bool use_rotation = true;
  int priority = 0;  ///< smaller goes first; tasks of equal priority share what there is
};

struct PrioritisedOptions {
  double position_tolerance_m = 1e-5;
  double rotation_tolerance_rad = 1e-5;
  /// The posture (dof values) that joints tend to where all tasks leave them free; empty: none.
  Eigen::VectorXd preferred = {};
  int max_iterations = 200;  ///< of one descent
  int max_restarts = 20;     ///< from random postures, while the first priority is not met
  std::uint64_t random_seed = 1;
};

struct PrioritisedSolution {
  Eigen::VectorXd q;  ///< within limits
  /// A task each: what is left to do.
  std::vector<double> position_error_m, rotation_error_rad;
  int tasks_met = 0;
  int iterations = 0;
  int restarts = 0;
};

/// Meets the tasks in the order of their priorities: a task takes of the joints only what leaves
/// the tasks before it as they are (null-space projection, Siciliano & Slotine 1991), and joints
/// that come to a limit are held there while the others make up for them (Flacco, De Luca & Khatib
/// 2012). A descent to a local minimum, deterministic for a seed. Tasks that cannot be met are not
/// an error: the solution says what is left. kInvalidArgument for a task without its chain or a
/// pose that is not finite. Precondition: seed.size() == group.dof().
Result<PrioritisedSolution> SolvePrioritised(const ChainGroup& group,
                                             std::span<const ToolTask> tasks,
                                             const Eigen::Ref<const Eigen::VectorXd>& seed,
                                             const PrioritisedOptions& options = {});

}  // namespace exemplar::kinematics
