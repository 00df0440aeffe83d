#pragma once
// Whose motion is it, the robot's or the object's? PAPER.md section 5.4.

#include <Eigen/Core>
#include <optional>
#include <span>

namespace exemplar::learning {

/// Variance over the trials at each frame, summed over x, y, z and divided by the number of trials.
/// `paths`: one matrix a trial, frames x 3 (m); the result has one entry a frame (m^2).
Eigen::VectorXd PathVariance(std::span<const Eigen::MatrixXd> paths);

struct Objectivity {
  Eigen::VectorXd absolute_variance;  ///< sigma_absolute(t), m^2
  Eigen::VectorXd object_variance;    ///< sigma_object(t), m^2
  Eigen::VectorXd upsilon;            ///< in [0, 1]
  bool undefined = false;  ///< some frame was 0/0, or there is one trial: upsilon was assumed there
};

/// Upsilon(t) = sigma_absolute / (sigma_absolute + sigma_object). Where it is not defined (one
/// trial, 0/0) it is 1 from frame `first_contact` on, else 0.
/// `base_paths` and `object_paths`: one matrix a trial, frames x 3, in the base frame and in the
/// object's.
Objectivity ComputeObjectivity(std::span<const Eigen::MatrixXd> base_paths,
                               std::span<const Eigen::MatrixXd> object_paths,
                               std::optional<int> first_contact);

}  // namespace exemplar::learning
