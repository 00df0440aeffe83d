#pragma once
// Values of other libraries as JSON, with enough digits to read back the same. The readers throw
// nlohmann::json::exception.

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "exemplar/geometry/pose.hpp"

namespace exemplar::learning {

/// From an array, or from the bytes of doubles that skill_bytes.cpp makes of one.
std::vector<double> ToNumbers(const nlohmann::json& j);

nlohmann::json FromVector(const Eigen::VectorXd& v);
Eigen::VectorXd ToVector(const nlohmann::json& j);

nlohmann::json FromMatrix(const Eigen::MatrixXd& m);
Eigen::MatrixXd ToMatrix(const nlohmann::json& j);

/// x y z qx qy qz qw.
nlohmann::json FromPose(const geometry::Pose& pose);
geometry::Pose ToPose(const nlohmann::json& j);

nlohmann::json FromPoses(const std::vector<geometry::Pose>& poses);
std::vector<geometry::Pose> ToPoses(const nlohmann::json& j);

}  // namespace exemplar::learning
