// Between places: the proof that a motion keeps clear, or where it does not.

#include <algorithm>
#include <cmath>

#include "checker_impl.hpp"

namespace exemplar::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A pair that moves by no more than this between two places is not looked at more finely.
constexpr double kSmallestMotion_m = 1e-4;
/// From metres to that.
constexpr std::size_t kUsualDepth = 24;

/// A pair that is too near at a place of the path.
struct Place {
  const Snapshot* at = nullptr;
  int pair = -1;
};

/// Works with the scratch of the checker, so that proofs one after the other do not allocate.
class Proof {
 public:
  Proof(const CollisionChecker::Impl& impl, const JointPath& path, double required_m)
      : impl_(impl), path_(path), required_m_(required_m) {
    impl_.proof_q.setZero(static_cast<Eigen::Index>(impl.model.joints.size()));
    impl_.proof_travel.setZero(impl_.proof_q.size());
  }

  /// All between two places.
  std::optional<Place> Search(double begin, double end, const std::vector<AllowedTouch>& allowed) {
    impl_.proof_pairs.clear();
    for (std::size_t i = 0; i < impl_.pairs.size(); ++i) {
      if (impl_.IsAllowed(impl_.pairs[i], allowed)) continue;
      impl_.proof_pairs.push_back(static_cast<int>(i));
    }
    PlaceAt(begin, impl_.proof_low);
    PlaceAt(end, impl_.proof_high);
    Prepare();
    return Search(impl_.proof_low, impl_.proof_high, impl_.proof_pairs, 0);
  }

 private:
  void PlaceAt(double s, Snapshot& at) {
    at.s = s;
    path_.Position(s, impl_.proof_q);
    impl_.Place(impl_.proof_q, at);
    at.distances.assign(impl_.pairs.size(), {});
  }

  /// Makes room at once for all depths that halving comes to, whatever the first proofs need.
  void Prepare() {
    const std::size_t pairs = impl_.pairs.size();
    if (!impl_.proof_levels.empty() && impl_.proof_levels.back()->unproved.capacity() >= pairs) {
      return;
    }
    while (impl_.proof_levels.size() < kUsualDepth) {
      impl_.proof_levels.push_back(std::make_unique<ProofLevel>());
    }
    for (const std::unique_ptr<ProofLevel>& level : impl_.proof_levels) {
      level->middle = impl_.proof_low;
      level->unproved.reserve(pairs);
    }
  }

  ProofLevel& Level(std::size_t depth) {
    if (depth == impl_.proof_levels.size()) {
      impl_.proof_levels.push_back(std::make_unique<ProofLevel>());
    }
    return *impl_.proof_levels[depth];
  }

  /// The first place between two where one of the pairs is too near, or may be.
  std::optional<Place> Search(Snapshot& low, Snapshot& high, const std::vector<int>& candidates,
                              std::size_t depth) {
    impl_.proof_travel.setZero();
    path_.Travel(low.s, high.s, impl_.proof_travel);
    ProofLevel& level = Level(depth);
    std::vector<int>& unproved = level.unproved;
    unproved.clear();
    double worst = kInfinity;
    int worst_pair = -1;
    bool worst_at_low = false;
    bool still_moves = false;
    for (const int index : candidates) {
      const Pair& pair = impl_.pairs[index];
      double motion = 0;
      for (const Lever& lever : pair.levers) {
        motion += lever.length * impl_.proof_travel[lever.joint];
      }
      const double needed = 2 * required_m_ + motion;
      if (Suffice(impl_.LowerBound(pair, low), impl_.LowerBound(pair, high), needed)) continue;
      if (Suffice(impl_.TightBound(pair, low), impl_.TightBound(pair, high), needed)) continue;
      const double at_low = Measured(index, low, needed);
      if (at_low < required_m_) return Place{&low, index};
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
      return Place{worst_at_low ? &low : &high, worst_pair};
    }
    PlaceAt(middle_s, level.middle);
    if (const std::optional<Place> found = Search(low, level.middle, unproved, depth + 1)) {
      return found;
    }
    return Search(level.middle, high, unproved, depth + 1);
  }

  /// Bounds of what overlaps are 0, however deep it overlaps: where that may be, they say nothing.
  bool Suffice(double at_low, double at_high, double needed) const {
    return at_low + at_high >= needed && (required_m_ >= 0 || std::min(at_low, at_high) > 0);
  }

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
};

}  // namespace

std::optional<Violation> CollisionChecker::FirstViolation(
    const JointPath& path, double begin, double end, double required_clearance_m,
    const std::vector<AllowedTouch>& allowed) const {
  const std::optional<Place> place =
      Proof(*impl_, path, required_clearance_m).Search(begin, end, allowed);
  if (!place) return std::nullopt;
  return Violation{place->at->s, impl_->Describe(place->pair, *place->at)};
}

bool CollisionChecker::KeepsClear(const JointPath& path, double begin, double end,
                                  double required_clearance_m,
                                  const std::vector<AllowedTouch>& allowed) const {
  return !Proof(*impl_, path, required_clearance_m).Search(begin, end, allowed);
}

}  // namespace exemplar::collision
