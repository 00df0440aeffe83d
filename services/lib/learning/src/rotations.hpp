#pragma once
// Many rotations at a time, one a row: quaternions as x y z w, rotation vectors as x y z (rad).
// They use the processor's wide registers where it has them; results agree to rounding.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "exemplar/geometry/pose.hpp"

namespace exemplar::learning {

Eigen::MatrixX4d FromQuaternions(std::span<const Eigen::Quaterniond> rotations);

/// left * q_i * Exp(vector_i), each of unit length where left and q_i are.
Eigen::MatrixX4d Turned(const Eigen::Quaterniond& left, const Eigen::MatrixX4d& q,
                        const Eigen::Ref<const Eigen::MatrixX3d>& vectors);

/// Along the shorter great arc from a_i (part 0) to b_i (part 1).
Eigen::MatrixX4d Between(const Eigen::MatrixX4d& a, const Eigen::MatrixX4d& b,
                         const Eigen::VectorXd& part);

/// Poses of these positions (rows) and rotations.
std::vector<geometry::Pose> ToPoses(const Eigen::Ref<const Eigen::MatrixX3d>& positions,
                                    const Eigen::MatrixX4d& rotations);

}  // namespace exemplar::learning
