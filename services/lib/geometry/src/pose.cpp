#include "exemplar/geometry/pose.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace exemplar::geometry {

Pose Pose::FromIsometry(const Eigen::Isometry3d& isometry) {
  return {isometry.translation(), Eigen::Quaterniond(isometry.rotation()).normalized()};
}

Eigen::Isometry3d Pose::ToIsometry() const {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = rotation.toRotationMatrix();
  isometry.translation() = translation;
  return isometry;
}

Pose Pose::Inverse() const {
  const Eigen::Quaterniond inverse = rotation.conjugate();
  return {-(inverse * translation), inverse};
}

Eigen::Vector3d LogSo3(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double sine = v.norm();
  const double cosine = sign * rotation.w();
  // angle / sin(angle/2) tends to 2 / cos(angle/2) as the angle vanishes.
  if (sine < 1e-12) return 2.0 / cosine * v;
  return 2.0 * std::atan2(sine, cosine) / sine * v;
}

Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& rotation_vector) {
  const double half_squared = rotation_vector.squaredNorm() / 4;
  double cosine, sinc;  // of half the angle
  if (half_squared < 0.04) {
    // Their series; what is left out is below rounding.
    const double x = half_squared;
    cosine = 1 - x / 2 * (1 - x / 12 * (1 - x / 30 * (1 - x / 56 * (1 - x / 90 * (1 - x / 132)))));
    sinc = 1 - x / 6 * (1 - x / 20 * (1 - x / 42 * (1 - x / 72 * (1 - x / 110 * (1 - x / 156)))));
  } else {
    const double half = std::sqrt(half_squared);
    cosine = std::cos(half);
    sinc = std::sin(half) / half;
  }
  const Eigen::Vector3d v = sinc / 2 * rotation_vector;
  return Eigen::Quaterniond(cosine, v.x(), v.y(), v.z()).normalized();
}

double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return LogSo3(a.conjugate() * b).norm();
}

Pose Interpolate(const Pose& a, const Pose& b, double s) {
  return {a.translation + s * (b.translation - a.translation), a.rotation.slerp(s, b.rotation)};
}

Eigen::Quaterniond MeanRotation(std::span<const Eigen::Quaterniond> rotations,
                                std::span<const double> weights) {
  assert(!rotations.empty() && rotations.size() == weights.size());
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const Eigen::Vector4d q = rotations[i].coeffs();
    sum += weights[i] * q * q.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
  const Eigen::Vector4d dominant = solver.eigenvectors().col(3);
  Eigen::Quaterniond mean(dominant[3], dominant[0], dominant[1], dominant[2]);
  mean.normalize();
  if (mean.dot(rotations.front()) < 0) mean.coeffs() = -mean.coeffs();
  return mean;
}

Eigen::Quaterniond MeanRotation(std::span<const Eigen::Quaterniond> rotations) {
  const std::vector<double> ones(rotations.size(), 1.0);
  return MeanRotation(rotations, ones);
}

int MakeSignsContinuous(std::span<Pose> poses) {
  int flipped = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (poses[i].rotation.dot(poses[i - 1].rotation) < 0) {
      poses[i].rotation.coeffs() = -poses[i].rotation.coeffs();
      ++flipped;
    }
  }
  return flipped;
}

}  // namespace exemplar::geometry
