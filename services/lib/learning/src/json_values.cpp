#include "json_values.hpp"

#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

namespace exemplar::learning {

using nlohmann::json;

std::vector<double> ToNumbers(const json& j) {
  if (!j.is_binary()) return j.get<std::vector<double>>();
  const json::binary_t& bytes = j.get_binary();
  if (bytes.size() % sizeof(double) != 0) {
    throw json::other_error::create(501, "bytes of numbers are no multiple of eight", &j);
  }
  std::vector<double> numbers(bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), bytes.data(), bytes.size());
  return numbers;
}

json FromVector(const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); }

Eigen::VectorXd ToVector(const json& j) {
  const std::vector<double> values = ToNumbers(j);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

json FromMatrix(const Eigen::MatrixXd& m) {
  return {{"rows", m.rows()},
          {"cols", m.cols()},
          {"values", std::vector<double>(m.data(), m.data() + m.size())}};
}

Eigen::MatrixXd ToMatrix(const json& j) {
  const auto rows = j.at("rows").get<Eigen::Index>();
  const auto cols = j.at("cols").get<Eigen::Index>();
  const std::vector<double> values = ToNumbers(j.at("values"));
  if (rows < 0 || cols < 0 || static_cast<std::size_t>(rows * cols) != values.size()) {
    throw json::other_error::create(501, "matrix size does not fit its values", &j);
  }
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), rows, cols);
}

json FromPose(const geometry::Pose& pose) {
  const Eigen::Vector3d& p = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  return {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
}

geometry::Pose ToPose(const json& j) {
  const auto v = j.get<std::array<double, 7>>();
  return {Eigen::Vector3d(v[0], v[1], v[2]), Eigen::Quaterniond(v[6], v[3], v[4], v[5])};
}

json FromPoses(const std::vector<geometry::Pose>& poses) {
  json flat = json::array();
  for (const geometry::Pose& pose : poses) {
    for (const json& value : FromPose(pose)) flat.push_back(value);
  }
  return flat;
}

std::vector<geometry::Pose> ToPoses(const json& j) {
  const std::vector<double> v = ToNumbers(j);
  if (v.size() % 7 != 0) throw json::other_error::create(501, "poses need 7 values each", &j);
  std::vector<geometry::Pose> poses;
  for (std::size_t i = 0; i < v.size(); i += 7) {
    poses.push_back({Eigen::Vector3d(v[i], v[i + 1], v[i + 2]),
                     Eigen::Quaterniond(v[i + 6], v[i + 3], v[i + 4], v[i + 5])});
  }
  return poses;
}

}  // namespace exemplar::learning
