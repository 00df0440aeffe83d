#include <algorithm>
#include <cmath>

#include "checker_impl.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::VectorXd RandomState(const kinematics::RobotModel& model, Rng& rng) {
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

}  // namespace

void CollisionChecker::Impl::Take(Scene new_scene, std::vector<ScenePart> parts,
                                  std::vector<RobotPart> held) {
  scene = std::move(new_scene);
  scene_parts = std::move(parts);
  robot_parts.erase(robot_parts.begin() + static_cast<std::ptrdiff_t>(model_parts),
                    robot_parts.end());
  std::move(held.begin(), held.end(), std::back_inserter(robot_parts));
  MakePairs();
}

void CollisionChecker::Impl::MakePairs() {
  pairs = model_pairs;
  for (std::size_t h = model_parts; h < robot_parts.size(); ++h) {
    const HeldObject& held = scene.held[h - model_parts];
    const RobotPart& part = robot_parts[h];
    for (std::size_t other = 0; other < h; ++other) {
      const RobotPart& against = robot_parts[other];
      const bool may_touch = std::find(held.touch_links.begin(), held.touch_links.end(),
                                       against.name) != held.touch_links.end();
      if (may_touch || !MoveAgainstEachOther(model, part.link, against.link)) continue;
      pairs.push_back({static_cast<int>(other), static_cast<int>(h), false,
                       LeversBetween(model, against, &part)});
    }
  }
  self_pairs = pairs.size();
  for (std::size_t r = 0; r < robot_parts.size(); ++r) {
    const std::vector<Lever> levers = LeversBetween(model, robot_parts[r], nullptr);
    if (levers.empty()) continue;
    for (std::size_t s = 0; s < scene_parts.size(); ++s) {
      pairs.push_back({static_cast<int>(r), static_cast<int>(s), true, levers});
    }
  }
}

void CollisionChecker::Impl::LeaveOutTouching() {
  if (options.sampled_allowed_states <= 0) return;
  Rng rng(20261122);
  const auto links_of = [&](const Pair& pair) {
    return std::pair(robot_parts[pair.first].link, robot_parts[pair.second].link);
  };
  const double touch_m = options.sampled_touch_distance_m;
  std::vector<std::pair<int, int>> touching;
  for (const Pair& pair : model_pairs) touching.push_back(links_of(pair));
  std::sort(touching.begin(), touching.end());
  touching.erase(std::unique(touching.begin(), touching.end()), touching.end());
  for (int state = 0; state < options.sampled_allowed_states && !touching.empty(); ++state) {
    Place(RandomState(model, rng), scratch);
    std::vector<std::pair<int, int>> still;
    for (const Pair& pair : model_pairs) {
      const std::pair<int, int> links = links_of(pair);
      if (!std::binary_search(touching.begin(), touching.end(), links)) continue;
      if (!still.empty() && still.back() == links) continue;
      if (LowerBound(pair, scratch) > touch_m) continue;
      if (Measure(pair, scratch, 2 * touch_m).distance_m <= touch_m) still.push_back(links);
    }
    std::sort(still.begin(), still.end());
    touching = std::move(still);
  }
  std::erase_if(model_pairs, [&](const Pair& pair) {
    return std::binary_search(touching.begin(), touching.end(), links_of(pair));
  });
}

void CollisionChecker::Impl::Place(const Eigen::Ref<const Eigen::VectorXd>& q,
                                   Snapshot& snapshot) const {
  kinematics::LinkPoses(model, q, base_T_links);
  snapshot.placements.resize(robot_parts.size());
  snapshot.bounds.resize(robot_parts.size());
  snapshot.capsules.resize(robot_parts.size());
  for (std::size_t i = 0; i < robot_parts.size(); ++i) {
    const RobotPart& part = robot_parts[i];
    snapshot.placements[i] = Placement::From(base_T_links[part.link] * part.link_T_shape);
    snapshot.bounds[i] = part.body.hull.BoundsAt(snapshot.placements[i]);
    snapshot.capsules[i] = part.capsule.At(Placement::From(base_T_links[part.link]));
  }
}

bool CollisionChecker::Impl::IsAllowed(const Pair& pair,
                                       const std::vector<AllowedTouch>& allowed) const {
  const std::string& first = robot_parts[pair.first].name;
  if (!pair.scene) {
    if (static_cast<std::size_t>(pair.second) < model_parts) return false;
    const std::string& held = robot_parts[pair.second].name;
    return std::any_of(allowed.begin(), allowed.end(), [&](const AllowedTouch& touch) {
      return touch.object.empty() && (touch.link == held || touch.link == first);
    });
  }
  const std::string& object = scene_parts[pair.second].name;
  return std::any_of(allowed.begin(), allowed.end(), [&](const AllowedTouch& touch) {
    return (touch.link.empty() || touch.link == first) &&
           (touch.object.empty() || touch.object == object);
  });
}

bool CollisionChecker::Impl::HasPieces(const Pair& pair) const {
  const Body& second = pair.scene ? scene_parts[pair.second].body : robot_parts[pair.second].body;
  return robot_parts[pair.first].body.pieces != nullptr || second.pieces != nullptr;
}

double CollisionChecker::Impl::LowerBound(const Pair& pair, const Snapshot& at) const {
  const Bounds& other = pair.scene ? scene_parts[pair.second].bounds : at.bounds[pair.second];
  return Distance(at.bounds[pair.first], other) - Padding(pair);
}

double CollisionChecker::Impl::TightBound(const Pair& pair, const Snapshot& at) const {
  const BoundingCapsule& other =
      pair.scene ? scene_parts[pair.second].capsule : at.capsules[pair.second];
  Eigen::Vector3d on_first, on_second;
  const double apart = Distance(at.capsules[pair.first], other, on_first, on_second);
  return std::max(LowerBound(pair, at), apart - Padding(pair));
}

Separation CollisionChecker::Impl::MeasureHulls(const Pair& pair, const Snapshot& at) const {
  const ConvexShape& first = robot_parts[pair.first].body.hull;
  const Placement& first_at = at.placements[pair.first];
  Separation found = pair.scene
                         ? SignedDistance(first, first_at, scene_parts[pair.second].body.hull,
                                          scene_parts[pair.second].base_at)
                         : SignedDistance(first, first_at, robot_parts[pair.second].body.hull,
                                          at.placements[pair.second]);
  found.distance_m -= Padding(pair);
  return found;
}

Separation CollisionChecker::Impl::Measure(const Pair& pair, const Snapshot& at,
                                           double ignore_beyond_m) const {
  const Body& second = pair.scene ? scene_parts[pair.second].body : robot_parts[pair.second].body;
  const Placement& second_at =
      pair.scene ? scene_parts[pair.second].base_at : at.placements[pair.second];
  Separation found = Distance(robot_parts[pair.first].body, at.placements[pair.first], second,
                              second_at, ignore_beyond_m + Padding(pair));
  found.distance_m -= Padding(pair);
  return found;
}

Clearance CollisionChecker::Impl::Describe(int index, const Snapshot& at) const {
  const Pair& pair = pairs[index];
  const Separation found = Measure(pair, at);
  return {robot_parts[pair.first].name, SecondName(pair), found.distance_m, found.p_first,
          found.p_second};
}

void CollisionChecker::Impl::AddMotion(int link, const Eigen::Vector3d& base_p,
                                       const Eigen::Vector3d& direction, double weight,
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
      gradient[joint.mimic->joint] += weight * joint.mimic->multiplier * speed;
    } else {
      gradient[index] += weight * speed;
    }
  }
}

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
  impl->model_parts = impl->robot_parts.size();
  Result<std::vector<std::pair<int, int>>> links =
      CheckedLinkPairs(model, impl->robot_parts, options.allowed_pairs);
  if (!links.ok()) return links.error();
  for (const auto& [first, second] : *links) {
    for (std::size_t a = 0; a < impl->robot_parts.size(); ++a) {
      if (impl->robot_parts[a].link != first) continue;
      for (std::size_t b = 0; b < impl->robot_parts.size(); ++b) {
        if (impl->robot_parts[b].link != second) continue;
        impl->model_pairs.push_back(
            {static_cast<int>(a), static_cast<int>(b), false,
             LeversBetween(model, impl->robot_parts[a], &impl->robot_parts[b])});
      }
    }
  }
  impl->LeaveOutTouching();
  CollisionChecker checker(std::move(impl));
  if (const Status set = checker.SetScene(std::move(scene)); !set.ok()) return set.error();
  return checker;
}

const Scene& CollisionChecker::scene() const { return impl_->scene; }

Status CollisionChecker::SetScene(Scene scene) {
  if (const Status names = CheckNames(impl_->model, scene); !names.ok()) return names;
  Result<std::vector<ScenePart>> parts = MakeSceneParts(scene);
  if (!parts.ok()) return parts.error();
  Result<std::vector<RobotPart>> held = MakeHeldParts(impl_->model, scene);
  if (!held.ok()) return held.error();
  impl_->Take(std::move(scene), *std::move(parts), *std::move(held));
  return {};
}

Status CollisionChecker::Attach(const std::string& object, const std::string& link,
                                const Eigen::Ref<const Eigen::VectorXd>& q,
                                const std::vector<std::string>& touch_links) {
  Scene scene = impl_->scene;
  const auto found = std::find_if(scene.objects.begin(), scene.objects.end(),
                                  [&](const SceneObject& o) { return o.name == object; });
  if (found == scene.objects.end()) {
    return NotFound("the scene has no object \"" + object + "\" to take");
  }
  const int index = impl_->model.FindLink(link);
  if (index < 0) {
    return NotFound("the robot \"" + impl_->model.name + "\" has no link \"" + link +
                    "\" to hold \"" + object + "\"");
  }
  kinematics::LinkPoses(impl_->model, q, impl_->base_T_links);
  const geometry::Pose link_T_shape =
      impl_->base_T_links[static_cast<std::size_t>(index)].Inverse() * found->base_T_shape;
  scene.held.push_back({object, link, link_T_shape, found->shape, touch_links});
  scene.objects.erase(found);
  return SetScene(std::move(scene));
}

Status CollisionChecker::Detach(const std::string& object,
                                const Eigen::Ref<const Eigen::VectorXd>& q) {
  Scene scene = impl_->scene;
  const auto found = std::find_if(scene.held.begin(), scene.held.end(),
                                  [&](const HeldObject& h) { return h.name == object; });
  if (found == scene.held.end()) return NotFound("the robot holds no \"" + object + "\"");
  kinematics::LinkPoses(impl_->model, q, impl_->base_T_links);
  const auto link = static_cast<std::size_t>(impl_->model.FindLink(found->link));
  scene.objects.push_back({object, impl_->base_T_links[link] * found->link_T_shape, found->shape});
  scene.held.erase(found);
  return SetScene(std::move(scene));
}

std::pair<int, double> CollisionChecker::Impl::Nearest(
    const std::vector<AllowedTouch>& allowed) const {
  queue.clear();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!allowed.empty() && IsAllowed(pairs[i], allowed)) continue;
    queue.emplace_back(TightBound(pairs[i], scratch), static_cast<int>(i));
  }
  std::make_heap(queue.begin(), queue.end(), std::greater<>());
  double smallest = kInfinity;
  int smallest_pair = -1;
  while (!queue.empty()) {
    const auto [bound, index] = queue.front();
    // Bounds that overlap say nothing about depth: all of those are measured.
    if (bound >= smallest && bound > -Padding(pairs[index])) break;
    std::pop_heap(queue.begin(), queue.end(), std::greater<>());
    queue.pop_back();
    const double distance = Measure(pairs[index], scratch, smallest).distance_m;
    if (distance < smallest) {
      smallest = distance;
      smallest_pair = index;
    }
  }
  return {smallest_pair, smallest};
}

Clearance CollisionChecker::SmallestClearance(const Eigen::Ref<const Eigen::VectorXd>& q,
                                              const std::vector<AllowedTouch>& allowed) const {
  impl_->Place(q, impl_->scratch);
  const int pair = impl_->Nearest(allowed).first;
  if (pair < 0) return {{}, {}, kInfinity};
  return impl_->Describe(pair, impl_->scratch);
}

double CollisionChecker::SmallestDistance(const Eigen::Ref<const Eigen::VectorXd>& q,
                                          const std::vector<AllowedTouch>& allowed) const {
  impl_->Place(q, impl_->scratch);
  return impl_->Nearest(allowed).second;
}

double CollisionChecker::NearnessCost(const Eigen::Ref<const Eigen::VectorXd>& q, double margin_m,
                                      const std::vector<AllowedTouch>& allowed,
                                      Eigen::VectorXd* gradient) const {
  const Impl& impl = *impl_;
  impl.Place(q, impl.scratch);
  if (gradient != nullptr) gradient->setZero(q.size());
  double cost = 0;
  for (const Pair& pair : impl.pairs) {
    if (impl.TightBound(pair, impl.scratch) >= margin_m || impl.IsAllowed(pair, allowed)) continue;
    const Separation found = impl.MeasureHulls(pair, impl.scratch);
    const double lack = margin_m - found.distance_m;
    if (lack <= 0) continue;
    cost += lack * lack;
    if (gradient == nullptr) continue;
    impl.AddMotion(impl.robot_parts[pair.first].link, found.p_first, found.normal, 2 * lack,
                   *gradient);
    if (pair.scene) continue;
    impl.AddMotion(impl.robot_parts[pair.second].link, found.p_second, found.normal, -2 * lack,
                   *gradient);
  }
  return cost;
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
  for (std::size_t i = 0; i < impl.self_pairs; ++i) {
    const Pair& pair = impl.pairs[i];
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
  impl.AddMotion(impl.robot_parts[nearest->first].link, p_first, apart, 1, *gradient);
  impl.AddMotion(impl.robot_parts[nearest->second].link, p_second, apart, -1, *gradient);
  return smallest;
}

Eigen::VectorXd CollisionChecker::LongestLevers() const {
  Eigen::VectorXd levers =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(impl_->model.joints.size()));
  for (const Pair& pair : impl_->pairs) {
    for (const Lever& lever : pair.levers) {
      levers[lever.joint] = std::max(levers[lever.joint], lever.length);
    }
  }
  return levers;
}

}  // namespace exemplar::collision
