#include <algorithm>
#include <cmath>
#include <limits>

#include "exemplar/base/rng.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "pairs.hpp"

namespace exemplar::collision {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Bisection stops at this fraction of the interval.
constexpr double kSmallestInterval = 1e-4;

/// The robot's parts at one configuration, and the distances asked for so far.
struct Snapshot {
  double s = 0;
  std::vector<Placement> placements;
  std::vector<Bounds> bounds;
  std::vector<BoundingCapsule> capsules;
  std::vector<double> distances;  ///< one a pair, kUnknown until asked
};

}  // namespace

struct CollisionChecker::Impl {
  kinematics::RobotModel model;
  CheckerOptions options;
  Scene scene;
  std::vector<RobotPart> robot_parts;
  std::vector<ScenePart> scene_parts;
  std::vector<Pair> self_pairs;
  std::vector<Pair> pairs;  ///< self_pairs, then robot parts against scene parts
  // Scratch of one query: the class is thread-compatible.
  mutable std::vector<geometry::Pose> base_T_links;
  mutable Snapshot scratch;
  mutable std::vector<std::pair<double, int>> queue;

  void Place(const Eigen::Ref<const Eigen::VectorXd>& q, Snapshot& snapshot) const {
    kinematics::LinkPoses(model, q, base_T_links);
    snapshot.placements.resize(robot_parts.size());
    snapshot.bounds.resize(robot_parts.size());
    snapshot.capsules.resize(robot_parts.size());
    for (std::size_t i = 0; i < robot_parts.size(); ++i) {
      const RobotPart& part = robot_parts[i];
      snapshot.placements[i] = Placement::From(base_T_links[part.link] * part.link_T_shape);
      snapshot.bounds[i] = part.shape.BoundsAt(snapshot.placements[i]);
      snapshot.capsules[i] = part.capsule.At(Placement::From(base_T_links[part.link]));
    }
  }

  double Padding(const Pair& pair) const {
    return pair.scene ? options.padding_m : 2 * options.padding_m;
  }

  double LowerBound(const Pair& pair, const Snapshot& at) const {
    const Bounds& other = pair.scene ? scene_parts[pair.second].bounds : at.bounds[pair.second];
    return Distance(at.bounds[pair.first], other) - Padding(pair);
  }

  /// The better of the bounds by boxes and by capsules.
  double TightBound(const Pair& pair, const Snapshot& at) const {
    const BoundingCapsule& other =
        pair.scene ? scene_parts[pair.second].capsule : at.capsules[pair.second];
    Eigen::Vector3d on_first, on_second;
    const double apart = Distance(at.capsules[pair.first], other, on_first, on_second);
    return std::max(LowerBound(pair, at), apart - Padding(pair));
  }

  Separation Measure(const Pair& pair, const Snapshot& at) const {
    const ConvexShape& first = robot_parts[pair.first].shape;
    const Placement& first_at = at.placements[pair.first];
    Separation found = pair.scene ? SignedDistance(first, first_at, scene_parts[pair.second].shape,
                                                   scene_parts[pair.second].base_at)
                                  : SignedDistance(first, first_at, robot_parts[pair.second].shape,
                                                   at.placements[pair.second]);
    found.distance_m -= Padding(pair);
    return found;
  }

  /// The distance of a pair, measured once a snapshot.
  double Measured(int pair, Snapshot& at) const {
    double& known = at.distances[pair];
    if (std::isnan(known)) known = Measure(pairs[pair], at).distance_m;
    return known;
  }

  Clearance Describe(int index, const Snapshot& at) const {
    const Pair& pair = pairs[index];
    const Separation found = Measure(pair, at);
    const std::string& second = pair.scene ? scene.objects[scene_parts[pair.second].object].name
                                           : model.links[robot_parts[pair.second].link].name;
    return {model.links[robot_parts[pair.first].link].name, second, found.distance_m, found.p_first,
            found.p_second};
  }

  bool IsAllowed(const Pair& pair, const std::vector<AllowedTouch>& allowed) const {
    if (!pair.scene) return false;
    const std::string& link = model.links[robot_parts[pair.first].link].name;
    const std::string& object = scene.objects[scene_parts[pair.second].object].name;
    return std::any_of(allowed.begin(), allowed.end(), [&](const AllowedTouch& touch) {
      return touch.link == link && touch.object == object;
    });
  }

  void MakePairs() {
    pairs = self_pairs;
    for (std::size_t r = 0; r < robot_parts.size(); ++r) {
      const std::vector<Lever> levers = LeversBetween(model, robot_parts[r], nullptr);
      if (levers.empty()) continue;
      for (std::size_t s = 0; s < scene_parts.size(); ++s) {
        pairs.push_back({static_cast<int>(r), static_cast<int>(s), true, levers});
      }
    }
  }

  Eigen::VectorXd RandomState(Rng& rng) const {
    Eigen::VectorXd q = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()));
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      if (model.joints[j].type == kinematics::JointType::kFixed) continue;
      const kinematics::JointLimits& limits = model.joints[j].limits;
      const double lower = std::isfinite(limits.lower) ? limits.lower : -M_PI;
      const double upper = std::isfinite(limits.upper) ? limits.upper : M_PI;
      q[static_cast<Eigen::Index>(j)] = rng.Uniform(lower, upper);
    }
    return q;
  }

  /// Removes the link pairs that touch in every one of the sampled states.
  void LeaveOutTouching() {
    if (options.sampled_allowed_states <= 0) return;
    Rng rng(20261122);
    const auto links_of = [&](const Pair& pair) {
      return std::pair(robot_parts[pair.first].link, robot_parts[pair.second].link);
    };
    std::vector<std::pair<int, int>> touching;
    for (const Pair& pair : self_pairs) touching.push_back(links_of(pair));
    std::sort(touching.begin(), touching.end());
    touching.erase(std::unique(touching.begin(), touching.end()), touching.end());
    for (int state = 0; state < options.sampled_allowed_states && !touching.empty(); ++state) {
      Place(RandomState(rng), scratch);
      std::vector<std::pair<int, int>> still;
      for (const Pair& pair : self_pairs) {
        const std::pair<int, int> links = links_of(pair);
        if (!std::binary_search(touching.begin(), touching.end(), links)) continue;
        if (!still.empty() && still.back() == links) continue;
        if (LowerBound(pair, scratch) > options.sampled_touch_distance_m) continue;
        if (Measure(pair, scratch).distance_m <= options.sampled_touch_distance_m) {
          still.push_back(links);
        }
      }
      std::sort(still.begin(), still.end());
      touching = std::move(still);
    }
    std::erase_if(self_pairs, [&](const Pair& pair) {
      return std::binary_search(touching.begin(), touching.end(), links_of(pair));
    });
  }

  /// Adds how fast a point of a link moves along `direction` with each joint. base_T_links are set.
  void AddMotion(int link, const Eigen::Vector3d& base_p, const Eigen::Vector3d& direction,
                 Eigen::VectorXd& gradient) const {
    for (int index = model.links[link].parent_joint; index >= 0;
         index = model.links[model.joints[index].parent_link].parent_joint) {
      const kinematics::Joint& joint = model.joints[index];
      if (joint.type == kinematics::JointType::kFixed) continue;
      // A joint turns its child link about an axis that stays the same in that link.
      const geometry::Pose& at = base_T_links[joint.child_link];
      const Eigen::Vector3d axis = at.rotation * joint.axis;
      const double speed = joint.type == kinematics::JointType::kPrismatic
                               ? axis.dot(direction)
                               : axis.cross(base_p - at.translation).dot(direction);
      if (joint.mimic) {
        gradient[joint.mimic->joint] += joint.mimic->multiplier * speed;
      } else {
        gradient[index] += speed;
      }
    }
  }

  struct Search {
    const JointPath& path;
    double required_m;
    double smallest_interval;
    Eigen::VectorXd q;
    Eigen::VectorXd travel;
  };

  Snapshot SnapshotAt(Search& search, double s) const {
    Snapshot at;
    at.s = s;
    search.path.Position(s, search.q);
    Place(search.q, at);
    at.distances.assign(pairs.size(), kUnknown);
    return at;
  }

  std::optional<Violation> Prove(Search& search, Snapshot& low, Snapshot& high,
                                 const std::vector<int>& candidates) const {
    search.travel.setZero();
    search.path.Travel(low.s, high.s, search.travel);
    std::vector<int> unproved;
    double worst = kInfinity;
    int worst_pair = -1;
    bool worst_at_low = false;
    for (const int index : candidates) {
      const Pair& pair = pairs[index];
      double needed = 2 * search.required_m;
      for (const Lever& lever : pair.levers) needed += lever.length * search.travel[lever.joint];
      if (LowerBound(pair, low) + LowerBound(pair, high) >= needed) continue;
      if (TightBound(pair, low) + TightBound(pair, high) >= needed) continue;
      const double at_low = Measured(index, low);
      if (at_low < search.required_m) return Violation{low.s, Describe(index, low)};
      const double at_high = Measured(index, high);
      if (at_low + at_high >= needed && at_high >= search.required_m) continue;
      unproved.push_back(index);
      if (std::min(at_low, at_high) < worst) {
        worst = std::min(at_low, at_high);
        worst_pair = index;
        worst_at_low = at_low < at_high;
      }
    }
    if (unproved.empty()) return std::nullopt;
    if (high.s - low.s <= search.smallest_interval) {
      Snapshot& worst_end = worst_at_low ? low : high;
      return Violation{worst_end.s, Describe(worst_pair, worst_end)};
    }
    Snapshot middle = SnapshotAt(search, 0.5 * (low.s + high.s));
    if (std::optional<Violation> found = Prove(search, low, middle, unproved)) return found;
    return Prove(search, middle, high, unproved);
  }
};

CollisionChecker::CollisionChecker(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CollisionChecker::CollisionChecker(CollisionChecker&&) noexcept = default;
CollisionChecker& CollisionChecker::operator=(CollisionChecker&&) noexcept = default;
CollisionChecker::~CollisionChecker() = default;

Result<CollisionChecker> CollisionChecker::Create(const kinematics::RobotModel& model, Scene scene,
                                                  const CheckerOptions& options) {
  if (!(options.padding_m >= 0) || !std::isfinite(options.padding_m)) {
    return InvalidArgument("padding must be zero or more metres", "padding_m");
  }
  auto impl = std::make_unique<Impl>();
  impl->model = model;
  impl->options = options;
  Result<std::vector<RobotPart>> parts = MakeRobotParts(model);
  if (!parts.ok()) return parts.error();
  impl->robot_parts = *std::move(parts);
  Result<std::vector<std::pair<int, int>>> links =
      CheckedLinkPairs(model, impl->robot_parts, options.allowed_pairs);
  if (!links.ok()) return links.error();
  for (const auto& [first, second] : *links) {
    for (std::size_t a = 0; a < impl->robot_parts.size(); ++a) {
      if (impl->robot_parts[a].link != first) continue;
      for (std::size_t b = 0; b < impl->robot_parts.size(); ++b) {
        if (impl->robot_parts[b].link != second) continue;
        impl->self_pairs.push_back(
            {static_cast<int>(a), static_cast<int>(b), false,
             LeversBetween(model, impl->robot_parts[a], &impl->robot_parts[b])});
      }
    }
  }
  impl->LeaveOutTouching();
  Result<std::vector<ScenePart>> scene_parts = MakeSceneParts(scene);
  if (!scene_parts.ok()) return scene_parts.error();
  impl->scene_parts = *std::move(scene_parts);
  impl->scene = std::move(scene);
  impl->MakePairs();
  return CollisionChecker(std::move(impl));
}

const Scene& CollisionChecker::scene() const { return impl_->scene; }

Status CollisionChecker::SetScene(Scene scene) {
  Result<std::vector<ScenePart>> parts = MakeSceneParts(scene);
  if (!parts.ok()) return parts.error();
  impl_->scene_parts = *std::move(parts);
  impl_->scene = std::move(scene);
  impl_->MakePairs();
  return {};
}

Clearance CollisionChecker::SmallestClearance(const Eigen::Ref<const Eigen::VectorXd>& q,
                                              const std::vector<AllowedTouch>& allowed) const {
  const Impl& impl = *impl_;
  impl.Place(q, impl.scratch);
  impl.queue.clear();
  for (std::size_t i = 0; i < impl.pairs.size(); ++i) {
    if (!allowed.empty() && impl.IsAllowed(impl.pairs[i], allowed)) continue;
    impl.queue.emplace_back(impl.TightBound(impl.pairs[i], impl.scratch), static_cast<int>(i));
  }
  std::make_heap(impl.queue.begin(), impl.queue.end(), std::greater<>());
  double smallest = kInfinity;
  int smallest_pair = -1;
  while (!impl.queue.empty()) {
    const auto [bound, index] = impl.queue.front();
    // Bounds that overlap say nothing about depth: all of those are measured.
    if (bound >= smallest && bound > -impl.Padding(impl.pairs[index])) break;
    std::pop_heap(impl.queue.begin(), impl.queue.end(), std::greater<>());
    impl.queue.pop_back();
    const double distance = impl.Measure(impl.pairs[index], impl.scratch).distance_m;
    if (distance < smallest) {
      smallest = distance;
      smallest_pair = index;
    }
  }
  if (smallest_pair < 0) return {{}, {}, kInfinity};
  return impl.Describe(smallest_pair, impl.scratch);
}

double CollisionChecker::CapsuleSelfClearance(const Eigen::Ref<const Eigen::VectorXd>& q,
                                              Eigen::VectorXd* gradient) const {
  const Impl& impl = *impl_;
  kinematics::LinkPoses(impl.model, q, impl.base_T_links);
  std::vector<BoundingCapsule>& capsules = impl.scratch.capsules;
  capsules.resize(impl.robot_parts.size());
  for (std::size_t i = 0; i < capsules.size(); ++i) {
    const RobotPart& part = impl.robot_parts[i];
    const geometry::Pose& base_T_link = impl.base_T_links[part.link];
    capsules[i] = {base_T_link * part.capsule.centre, base_T_link.rotation * part.capsule.axis,
                   part.capsule.half, part.capsule.radius};
  }
  double smallest = kInfinity;
  const Pair* nearest = nullptr;
  Eigen::Vector3d on_first, on_second, p_first, p_second;
  for (const Pair& pair : impl.self_pairs) {
    const BoundingCapsule& first = capsules[pair.first];
    const BoundingCapsule& second = capsules[pair.second];
    // Balls around the capsules decide most pairs.
    const double reach =
        smallest + first.radius + first.half + second.radius + second.half + impl.Padding(pair);
    if ((first.centre - second.centre).squaredNorm() > reach * reach && reach > 0) continue;
    const double apart = Distance(first, second, on_first, on_second) - impl.Padding(pair);
    if (apart >= smallest) continue;
    smallest = apart;
    nearest = &pair;
    p_first = on_first;
    p_second = on_second;
  }
  if (gradient == nullptr) return smallest;
  gradient->setZero(q.size());
  if (nearest == nullptr || (p_first - p_second).norm() < 1e-12) return smallest;
  const Eigen::Vector3d apart = (p_first - p_second).normalized();
  impl.AddMotion(impl.robot_parts[nearest->first].link, p_first, apart, *gradient);
  impl.AddMotion(impl.robot_parts[nearest->second].link, p_second, -apart, *gradient);
  return smallest;
}

std::optional<Violation> CollisionChecker::FirstViolation(
    const JointPath& path, double begin, double end, double required_clearance_m,
    const std::vector<AllowedTouch>& allowed) const {
  const Impl& impl = *impl_;
  std::vector<int> candidates;
  for (std::size_t i = 0; i < impl.pairs.size(); ++i) {
    if (!impl.IsAllowed(impl.pairs[i], allowed)) candidates.push_back(static_cast<int>(i));
  }
  const auto joints = static_cast<Eigen::Index>(impl.model.joints.size());
  Impl::Search search{path, required_clearance_m, kSmallestInterval * (end - begin),
                      Eigen::VectorXd::Zero(joints), Eigen::VectorXd::Zero(joints)};
  Snapshot low = impl.SnapshotAt(search, begin);
  Snapshot high = impl.SnapshotAt(search, end);
  return impl.Prove(search, low, high, candidates);
}

}  // namespace exemplar::collision
