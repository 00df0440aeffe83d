#pragma once
// Where the fingertip of a person goes who presses targets, finely sampled in time.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/reaching/person.hpp"

namespace exemplar::reaching {

/// A target as the hand needs it, in the base frame.
struct HandTarget {
  Eigen::Vector3d base_p_contact;
  Eigen::Vector3d base_normal;    ///< outward, unit
  Eigen::Vector3d base_pointing;  ///< the finger's direction while it presses, unit
};

struct HandPath {
  double step_s = 0;
  std::vector<Eigen::Vector3d> base_p_tip;     ///< one a step, the first at time 0
  std::vector<Eigen::Vector3d> base_pointing;  ///< unit
  std::vector<double> open;                    ///< of the hand, 0 to 1
  std::vector<PressTruth> presses;
  CarryTruth carry;
  double end_s = 0;
};

/// From rest to every target and back near rest.
Result<HandPath> SimulateHand(const Eigen::Vector3d& base_p_rest,
                              const Eigen::Vector3d& base_rest_pointing,
                              std::span<const HandTarget> targets, const PersonOptions& options,
                              double step_s, Rng rng);

/// From rest to `from`, where the hand closes, over to `to`, where it opens, and back near rest. At
/// both it comes down along the normal and goes up again.
HandPath SimulateCarry(const Eigen::Vector3d& base_p_rest, const HandTarget& from,
                       const HandTarget& to, const PersonOptions& options, double step_s, Rng rng);

}  // namespace exemplar::reaching
