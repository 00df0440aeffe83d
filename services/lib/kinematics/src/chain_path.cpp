#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <vector>

#include "exemplar/geometry/wide.hpp"
#include "exemplar/kinematics/chain.hpp"

namespace exemplar::kinematics {
namespace {

using geometry::AllAtMost;
using geometry::CosineAndSinc;
using geometry::Four;
using geometry::FourQuaternions;
using geometry::Load;
using geometry::Multiply;
using geometry::Store;

/// A step of the chain, as its joint's values are met.
struct Segment {
  Eigen::Quaterniond before;
  Eigen::Vector3d before_p;
  bool prismatic = false;
  double multiplier = 1, offset = 0;
  const double* values = nullptr;  ///< one a row
};

struct Point {
  Four x, y, z;
};

// Whole turns are taken off angles (rad) up to here without loss.
constexpr double kFarAngle = 1e4;

EXEMPLAR_INLINE void Spread(const Eigen::Quaterniond& q, FourQuaternions& to) {
  to = {Four{} + q.x(), Four{} + q.y(), Four{} + q.z(), Four{} + q.w()};
}

// p += scale * (q's rotation of v)
EXEMPLAR_INLINE void Advance(const FourQuaternions& q, const Eigen::Vector3d& v, const Four& scale,
                             Point& p) {
  const Four tx = 2 * (q.y * v.z() - q.z * v.y());
  const Four ty = 2 * (q.z * v.x() - q.x * v.z());
  const Four tz = 2 * (q.x * v.y() - q.y * v.x());
  p.x += scale * (v.x() + q.w * tx + q.y * tz - q.z * ty);
  p.y += scale * (v.y() + q.w * ty + q.z * tx - q.x * tz);
  p.z += scale * (v.z() + q.w * tz + q.x * ty - q.y * tx);
}

// q * (rotation by `angle` about z), but for the sign: q and -q are one rotation.
EXEMPLAR_INLINE void TurnAboutZ(const Four& angle, FourQuaternions& q) {
  // Adding and subtracting this rounds to whole numbers.
  constexpr double kRound = 6755399441055744.0;
  constexpr double kTurn = 0.15915494309189535;
  // pi in three parts, the first two with so many zeros at their ends that products are exact.
  constexpr double kFirst = 3.141592502593994;
  constexpr double kSecond = 1.5099578831723193e-07;
  constexpr double kThird = 1.0780605716316238e-14;
  const Four turns = (angle * kTurn + kRound) - kRound;
  const Four half = ((angle * 0.5 - turns * kFirst) - turns * kSecond) - turns * kThird;
  Four c, s;
  CosineAndSinc(half * half, c, s);
  s *= half;
  const FourQuaternions from = q;
  q.x = from.x * c + from.y * s;
  q.y = from.y * c - from.x * s;
  q.z = from.z * c + from.w * s;
  q.w = from.w * c - from.z * s;
}

struct Output {
  double* positions;
  double* rotations;
  Eigen::Index rows;
};

// Four rows from `at`; false where an angle is too far, or no number.
EXEMPLAR_INLINE bool WalkFour(const std::vector<Segment>& links, Eigen::Index at,
                              const Output& to) {
  FourQuaternions q;
  Spread(Eigen::Quaterniond::Identity(), q);
  Point p = {};
  const Four one = Four{} + 1.0;
  for (const Segment& link : links) {
    Advance(q, link.before_p, one, p);
    FourQuaternions before, turned;
    Spread(link.before, before);
    Multiply(q, before, turned);
    q = turned;
    if (link.values == nullptr) continue;
    Four value;
    Load(link.values + at, value);
    value = value * link.multiplier + link.offset;
    if (link.prismatic) {
      Advance(q, Eigen::Vector3d::UnitZ(), value, p);
      continue;
    }
    if (!AllAtMost(value * value, kFarAngle * kFarAngle)) return false;
    TurnAboutZ(value, q);
  }
  // A step of Newton's takes off what rounding did to the length.
  const Four squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  const Four length = 1.5 - 0.5 * squared;
  const Four scale = q.w < 0 ? -length : length;
  Store(p.x, to.positions + at);
  Store(p.y, to.positions + to.rows + at);
  Store(p.z, to.positions + 2 * to.rows + at);
  Store(q.x * scale, to.rotations + at);
  Store(q.y * scale, to.rotations + to.rows + at);
  Store(q.z * scale, to.rotations + 2 * to.rows + at);
  Store(q.w * scale, to.rotations + 3 * to.rows + at);
  return true;
}

EXEMPLAR_INLINE Eigen::Index WalkMany(const std::vector<Segment>& links, Eigen::Index at,
                                      const Output& to) {
  while (at + 4 <= to.rows && WalkFour(links, at, to)) at += 4;
  return at;
}
EXEMPLAR_WIDE Eigen::Index WalkManyWide(const std::vector<Segment>& links, Eigen::Index at,
                                        const Output& to) {
  return WalkMany(links, at, to);
}

}  // namespace

demonstration::ToolKinematics::Path Chain::ToolPath(const Eigen::MatrixXd& joints) const {
  assert(joints.cols() == dof());
  const Eigen::Index n = joints.rows();
  std::vector<Segment> links;
  for (const Step& step : steps_) {
    links.push_back({.before = Eigen::Quaterniond(step.before_R_z),
                     .before_p = step.before_p,
                     .prismatic = step.prismatic,
                     .multiplier = step.multiplier,
                     .offset = step.offset,
                     .values = joints.data() + step.variable * n});
  }
  links.push_back({.before = Eigen::Quaterniond(last_R_tip_), .before_p = last_p_tip_});
  Path path = {Eigen::MatrixX3d(n, 3), Eigen::MatrixX4d(n, 4)};
  const Output to = {path.positions.data(), path.rotations.data(), n};
  for (Eigen::Index at = 0; at < n;) {
    at = (geometry::HasWide() ? WalkManyWide : WalkMany)(links, at, to);
    // What is left over, or cannot be done four at a time.
    for (const Eigen::Index end = std::min(at + 4, n); at < end; ++at) {
      const geometry::Pose pose = ToolPose(joints.row(at).transpose());
      path.positions.row(at) = pose.translation.transpose();
      path.rotations.row(at) = pose.rotation.coeffs().transpose();
    }
  }
  return path;
}

}  // namespace exemplar::kinematics
