#include "rotations.hpp"

#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"

namespace exemplar::learning {
namespace {

Eigen::Vector3d RandomVector(Rng& rng, double length) {
  const Eigen::Vector3d v(rng.Normal(), rng.Normal(), rng.Normal());
  return length * v.normalized();
}

Eigen::Quaterniond RandomRotation(Rng& rng) {
  return geometry::ExpSo3(RandomVector(rng, rng.Uniform(0, 3)));
}

Eigen::Quaterniond Row(const Eigen::MatrixX4d& q, Eigen::Index i) {
  return Eigen::Quaterniond(q(i, 3), q(i, 0), q(i, 1), q(i, 2));
}

// Lengths of rotation vectors from none to several turns, so that rows with and without need of
// the library's functions stand side by side.
double LengthOf(int i) {
  constexpr double kLengths[] = {0, 1e-9, 0.3, 3.1, 0.01, 3.2, 1, 7, 0.5, 20, 2, 1.5, 0.1};
  return kLengths[i % std::size(kLengths)];
}

TEST(Rotations, ManyAtATimeTurnAsEachDoes) {
  Rng rng(1);
  for (const int n : {1, 3, 4, 5, 8, 63}) {
    const Eigen::Quaterniond left = RandomRotation(rng);
    std::vector<Eigen::Quaterniond> rotations;
    Eigen::MatrixX3d vectors(n, 3);
    for (int i = 0; i < n; ++i) {
      rotations.push_back(RandomRotation(rng));
      vectors.row(i) = RandomVector(rng, LengthOf(i)).transpose();
    }
    const Eigen::MatrixX4d turned = Turned(left, FromQuaternions(rotations), vectors);
    ASSERT_EQ(turned.rows(), n);
    for (int i = 0; i < n; ++i) {
      const Eigen::Quaterniond expected = left * rotations[static_cast<std::size_t>(i)] *
                                          geometry::ExpSo3(vectors.row(i).transpose());
      EXPECT_LT(geometry::AngleBetween(Row(turned, i), expected), 1e-14) << LengthOf(i);
      EXPECT_NEAR(turned.row(i).norm(), 1, 1e-14);
    }
  }
}

TEST(Rotations, ManyAtATimeFollowTheGreatArcAsEachDoes) {
  Rng rng(2);
  for (const int n : {1, 4, 6, 62}) {
    std::vector<Eigen::Quaterniond> a, b;
    Eigen::VectorXd part(n);
    for (int i = 0; i < n; ++i) {
      a.push_back(RandomRotation(rng));
      b.push_back(a.back() * geometry::ExpSo3(RandomVector(rng, rng.Uniform(0, i < 30 ? 0.5 : 3))));
      if (i % 2 == 0) b.back().coeffs() = -b.back().coeffs();
      part[i] = i % 7 == 0 ? 0 : i % 7 == 1 ? 1 : rng.Uniform();
    }
    const Eigen::MatrixX4d between = Between(FromQuaternions(a), FromQuaternions(b), part);
    ASSERT_EQ(between.rows(), n);
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      EXPECT_LT(geometry::AngleBetween(Row(between, i), a[k].slerp(part[i], b[k])), 1e-13);
      EXPECT_NEAR(between.row(i).norm(), 1, 1e-13);
    }
  }
}

TEST(Rotations, WhatIsNoNumberStaysNone) {
  const std::vector<Eigen::Quaterniond> rotations(5, Eigen::Quaterniond::Identity());
  Eigen::MatrixX3d vectors = Eigen::MatrixX3d::Zero(5, 3);
  vectors(1, 2) = std::nan("");
  const Eigen::MatrixX4d turned =
      Turned(Eigen::Quaterniond::Identity(), FromQuaternions(rotations), vectors);
  EXPECT_FALSE(turned.row(1).allFinite());
  EXPECT_EQ(turned.row(0), Eigen::RowVector4d(0, 0, 0, 1));
  EXPECT_EQ(turned.row(4), Eigen::RowVector4d(0, 0, 0, 1));
}

}  // namespace
}  // namespace exemplar::learning
