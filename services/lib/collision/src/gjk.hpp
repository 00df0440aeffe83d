#pragma once
// The distance of two convex bodies from nothing but their support points (Gilbert, Johnson &
// Keerthi 1988).

#include <Eigen/Core>
#include <limits>

namespace exemplar::collision {

/// Up to four points of first - second, reduced to those that span the point nearest to the origin.
class Simplex {
 public:
  /// `p` and `q`: support points of first and second.
  void Add(const Eigen::Vector3d& p, const Eigen::Vector3d& q);
  bool Holds(const Eigen::Vector3d& difference) const;
  /// Keeps the points that matter. False when the simplex contains the origin.
  bool Reduce();
  /// Of first - second, after Reduce.
  const Eigen::Vector3d& nearest() const { return nearest_; }
  Eigen::Vector3d on_first() const;
  Eigen::Vector3d on_second() const;

 private:
  struct Face;
  void Keep(const Face& face);
  Face OnSegment(int a, int b) const;
  Face OnTriangle(int a, int b, int c) const;

  int size_ = 0;
  Eigen::Vector3d difference_[4], p_[4], q_[4];
  double weight_[4] = {1, 0, 0, 0};
  Eigen::Vector3d nearest_ = Eigen::Vector3d::Zero();
};

struct GjkAnswer {
  /// False: the bodies overlap, or are nearer than can be told.
  bool apart = false;
  /// So much is certain: parallel planes that far apart separate the bodies.
  double distance_m = 0;
  Eigen::Vector3d p_first = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_second = Eigen::Vector3d::Zero();
};

inline constexpr int kGjkRounds = 64;
inline constexpr double kGjkPrecision_m = 1e-7;
inline constexpr double kGjkTouch_m = 1e-9;

/// `first(d)` and `second(d)`: the point of the body farthest along d, which need not be of unit
/// length. `towards`: any direction from first to second, to begin with. Ends early, with what is
/// certain by then, once the distance is known to be `enough_m`.
template <class First, class Second>
GjkAnswer Gjk(const First& first, const Second& second, const Eigen::Vector3d& towards,
              double enough_m = std::numeric_limits<double>::infinity()) {
  Simplex simplex;
  GjkAnswer answer;
  Eigen::Vector3d v = towards.squaredNorm() > 0 ? Eigen::Vector3d(-towards)
                                                : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  double length = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kGjkRounds; ++round) {
    const Eigen::Vector3d p = first(-v);
    const Eigen::Vector3d q = second(v);
    const Eigen::Vector3d difference = p - q;
    const double certain = difference.dot(v) / v.norm();
    if (certain > answer.distance_m) {
      answer.apart = true;
      answer.distance_m = certain;
      if (certain >= enough_m) {
        answer.p_first = p;
        answer.p_second = q;
        return answer;
      }
    }
    if (length - certain <= kGjkPrecision_m || simplex.Holds(difference)) break;
    simplex.Add(p, q);
    if (!simplex.Reduce()) return {};
    v = simplex.nearest();
    const double now = v.norm();
    if (now < kGjkTouch_m) return {};
    if (now >= length) break;
    length = now;
  }
  answer.p_first = simplex.on_first();
  answer.p_second = simplex.on_second();
  return answer;
}

}  // namespace exemplar::collision
