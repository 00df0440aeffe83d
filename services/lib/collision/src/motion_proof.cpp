// Between places: the proof that a motion keeps clear, or where it does not.

#include <algorithm>
#include <cmath>

#include "checker_impl.hpp"

namespace exemplar::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A pair that moves by no more than this between two places is not looked at more finely.
constexpr double kSmallestMotion_m = 1e-4;

class Proof {
 public:
  Proof(const CollisionChecker::Impl& impl, const JointPath& path, double required_m)
      : impl_(impl),
        path_(path),
        required_m_(required_m),
        q_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(impl.model.joints.size()))),
        travel_(q_) {}

  Snapshot At(double s) {
    Snapshot at;
    at.s = s;
    path_.Position(s, q_);
    impl_.Place(q_, at);
    at.distances.resize(impl_.pairs.size());
    return at;
  }

  /// The first violation by one of the pairs between two places.
  std::optional<Violation> Search(Snapshot& low, Snapshot& high,
                                  const std::vector<int>& candidates) {
    travel_.setZero();
    path_.Travel(low.s, high.s, travel_);
    std::vector<int> unproved;
    double worst = kInfinity;
    int worst_pair = -1;
    bool worst_at_low = false;
    bool still_moves = false;
    for (const int index : candidates) {
      const Pair& pair = impl_.pairs[index];
      double motion = 0;
      for (const Lever& lever : pair.levers) motion += lever.length * travel_[lever.joint];
      const double needed = 2 * required_m_ + motion;
      if (impl_.LowerBound(pair, low) + impl_.LowerBound(pair, high) >= needed) continue;
      if (impl_.TightBound(pair, low) + impl_.TightBound(pair, high) >= needed) continue;
      const double at_low = Measured(index, low, needed);
      if (at_low < required_m_) return Violation{low.s, impl_.Describe(index, low)};
      const double at_high = Measured(index, high, needed);
      if (at_low + at_high >= needed && at_high >= required_m_) continue;
      unproved.push_back(index);
      still_moves = still_moves || motion > kSmallestMotion_m;
      if (std::min(at_low, at_high) < worst) {
        worst = std::min(at_low, at_high);
        worst_pair = index;
        worst_at_low = at_low < at_high;
      }
    }
    if (unproved.empty()) return std::nullopt;
    const double middle_s = 0.5 * (low.s + high.s);
    if (!still_moves || !(low.s < middle_s && middle_s < high.s)) {
      Snapshot& worst_end = worst_at_low ? low : high;
      return Violation{worst_end.s, impl_.Describe(worst_pair, worst_end)};
    }
    Snapshot middle = At(middle_s);
    if (std::optional<Violation> found = Search(low, middle, unproved)) return found;
    return Search(middle, high, unproved);
  }

 private:
  /// A lower bound of the distance of a pair, exact unless it is `enough_m` or more.
  double Measured(int index, Snapshot& at, double enough_m) const {
    Snapshot::Known& known = at.distances[index];
    if (known.asked && (known.exact || known.distance_m >= enough_m)) return known.distance_m;
    const double distance = impl_.Measure(impl_.pairs[index], at, enough_m).distance_m;
    known = {true, distance < enough_m || !impl_.HasPieces(impl_.pairs[index]), distance};
    return distance;
  }

  const CollisionChecker::Impl& impl_;
  const JointPath& path_;
  double required_m_;
  Eigen::VectorXd q_;
  Eigen::VectorXd travel_;
};

}  // namespace

std::optional<Violation> CollisionChecker::FirstViolation(
    const JointPath& path, double begin, double end, double required_clearance_m,
    const std::vector<AllowedTouch>& allowed) const {
  std::vector<int> candidates;
  for (std::size_t i = 0; i < impl_->pairs.size(); ++i) {
    if (!impl_->IsAllowed(impl_->pairs[i], allowed)) candidates.push_back(static_cast<int>(i));
  }
  Proof proof(*impl_, path, required_clearance_m);
  Snapshot low = proof.At(begin);
  Snapshot high = proof.At(end);
  return proof.Search(low, high, candidates);
}

}  // namespace exemplar::collision
