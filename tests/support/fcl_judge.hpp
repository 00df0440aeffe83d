#pragma once
// A robot and a scene as FCL sees them when everything is a mesh of triangles: the judge of our
// verdicts. And robots, states, scenes and motions to judge.

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "mesh_file.hpp"

namespace exemplar::testing {

using FclMesh = fcl::BVHModel<fcl::OBBRSSd>;
using Corners = std::vector<Eigen::Vector3d>;  ///< three a triangle

inline fcl::Transform3d ToFcl(const geometry::Pose& pose) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = pose.rotation.toRotationMatrix();
  transform.translation() = pose.translation;
  return transform;
}

inline std::shared_ptr<FclMesh> ToFclMesh(const Corners& corners) {
  auto mesh = std::make_shared<FclMesh>();
  mesh->beginModel();
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    mesh->addTriangle(corners[i], corners[i + 1], corners[i + 2]);
  }
  mesh->endModel();
  return mesh;
}

/// Triangles whose corners lie on the shape's surface.
inline std::shared_ptr<FclMesh> ToFclMesh(const kinematics::Shape& shape) {
  constexpr unsigned kAround = 24;
  auto mesh = std::make_shared<FclMesh>();
  const fcl::Transform3d here = fcl::Transform3d::Identity();
  if (const auto* box = std::get_if<kinematics::Box>(&shape)) {
    const fcl::Boxd of_fcl(box->size.x(), box->size.y(), box->size.z());
    fcl::generateBVHModel(*mesh, of_fcl, here);
  } else if (const auto* sphere = std::get_if<kinematics::Sphere>(&shape)) {
    fcl::generateBVHModel(*mesh, fcl::Sphered(sphere->radius), here, kAround, kAround / 2);
  } else if (const auto* cylinder = std::get_if<kinematics::Cylinder>(&shape)) {
    const fcl::Cylinderd of_fcl(cylinder->radius, cylinder->length);
    fcl::generateBVHModel(*mesh, of_fcl, here, kAround, 4);
  } else if (const auto* capsule = std::get_if<kinematics::Capsule>(&shape)) {
    // A ball, cut in the middle and drawn apart.
    Corners corners;
    const auto at = [&](int around, int up) -> Eigen::Vector3d {
      const double angle = 2 * std::numbers::pi * around / kAround;
      const double height = std::numbers::pi * (up / (kAround / 2.0 + 1) - 0.5);
      const double raised = 0.5 * capsule->length * (2 * up > int(kAround / 2 + 1) ? 1 : -1);
      return {capsule->radius * std::cos(height) * std::cos(angle),
              capsule->radius * std::cos(height) * std::sin(angle),
              capsule->radius * std::sin(height) + raised};
    };
    for (int around = 0; around < int(kAround); ++around) {
      for (int up = 0; up < int(kAround / 2 + 1); ++up) {
        corners.insert(corners.end(), {at(around, up), at(around + 1, up), at(around + 1, up + 1)});
        corners.insert(corners.end(), {at(around, up), at(around + 1, up + 1), at(around, up + 1)});
      }
    }
    return ToFclMesh(corners);
  } else {
    const auto& file = std::get<kinematics::Mesh>(shape);
    Corners corners = *collision::ReadStl(file.path);
    for (Eigen::Vector3d& corner : corners) corner = corner.cwiseProduct(file.scale);
    return ToFclMesh(corners);
  }
  return mesh;
}

class FclJudge {
 public:
  using LinkPairs = std::vector<std::pair<int, int>>;

  FclJudge(const kinematics::RobotModel& model, const collision::Scene& scene) : model_(model) {
    for (std::size_t link = 0; link < model.links.size(); ++link) {
      for (const kinematics::Geometry& geometry : model.links[link].collisions) {
        robot_.push_back({static_cast<int>(link), geometry.link_T_shape, ToFclMesh(geometry.shape),
                          geometry.shape});
        robot_.back().mesh->computeLocalAABB();
      }
    }
    for (const collision::SceneObject& object : scene.objects) {
      scene_.push_back({-1, object.base_T_shape, ToFclMesh(object.shape), object.shape});
      scene_.back().mesh->computeLocalAABB();
    }
  }

  /// Links whose meshes FCL finds in each other, among the pairs.
  std::set<std::pair<int, int>> TouchingLinks(const Eigen::VectorXd& q, const LinkPairs& pairs) {
    std::set<std::pair<int, int>> touching;
    ForEach(q, pairs,
            [&](const Part& a, const fcl::Transform3d& a_at, const Part& b,
                const fcl::Transform3d& b_at) {
              if (b.link < 0) return;
              if (Collide(a, a_at, b, b_at)) touching.insert(std::minmax(a.link, b.link));
            });
    return touching;
  }

  bool Collides(const Eigen::VectorXd& q, const LinkPairs& pairs) {
    bool found = false;
    ForEach(q, pairs,
            [&](const Part& a, const fcl::Transform3d& a_at, const Part& b,
                const fcl::Transform3d& b_at) { found = found || Collide(a, a_at, b, b_at); });
    return found;
  }

  /// The smallest distance of the surfaces, or `enough_m` where it is more; 0 where they cross, or
  /// where a thing encloses a part of the robot, which FCL does not see.
  double Distance(const Eigen::VectorXd& q, const LinkPairs& pairs, double enough_m) {
    double smallest = enough_m;
    ForEach(q, pairs,
            [&](const Part& a, const fcl::Transform3d& a_at, const Part& b,
                const fcl::Transform3d& b_at) {
              if (b.link < 0 && Encloses(b.shape, b_at.inverse() * (a_at * a.mesh->vertices[0]))) {
                smallest = 0;
              }
              if (smallest <= 0 || BoundsAt(a, a_at).distance(BoundsAt(b, b_at)) >= smallest)
                return;
              fcl::DistanceResultd result;
              smallest = std::min(smallest, fcl::distance(a.mesh.get(), a_at, b.mesh.get(), b_at,
                                                          fcl::DistanceRequestd(), result));
            });
    return std::max(0.0, smallest);
  }

 private:
  struct Part {
    int link = -1;  ///< -1: of the scene
    geometry::Pose at;
    std::shared_ptr<FclMesh> mesh;
    kinematics::Shape shape;
  };

  static bool Encloses(const kinematics::Shape& shape, const Eigen::Vector3d& p) {
    if (const auto* box = std::get_if<kinematics::Box>(&shape)) {
      return (p.cwiseAbs().array() <= 0.5 * box->size.array()).all();
    }
    if (const auto* sphere = std::get_if<kinematics::Sphere>(&shape)) {
      return p.norm() <= sphere->radius;
    }
    if (const auto* cylinder = std::get_if<kinematics::Cylinder>(&shape)) {
      return p.head<2>().norm() <= cylinder->radius && std::abs(p.z()) <= 0.5 * cylinder->length;
    }
    if (const auto* capsule = std::get_if<kinematics::Capsule>(&shape)) {
      const double half = 0.5 * capsule->length;
      const Eigen::Vector3d on_axis(0, 0, std::clamp(p.z(), -half, half));
      return (p - on_axis).norm() <= capsule->radius;
    }
    return false;
  }

  static fcl::AABBd BoundsAt(const Part& part, const fcl::Transform3d& at) {
    const Eigen::Vector3d extent =
        at.linear().cwiseAbs() * (part.mesh->aabb_local.max_ - part.mesh->aabb_local.min_) / 2;
    const Eigen::Vector3d centre = at * part.mesh->aabb_local.center();
    return fcl::AABBd(centre - extent, centre + extent);
  }

  static bool Collide(const Part& a, const fcl::Transform3d& a_at, const Part& b,
                      const fcl::Transform3d& b_at) {
    if (!BoundsAt(a, a_at).overlap(BoundsAt(b, b_at))) return false;
    fcl::CollisionResultd result;
    return fcl::collide(a.mesh.get(), a_at, b.mesh.get(), b_at, fcl::CollisionRequestd(), result) >
           0;
  }

  template <class Visit>
  void ForEach(const Eigen::VectorXd& q, const LinkPairs& pairs, Visit&& visit) {
    kinematics::LinkPoses(model_, q, poses_);
    std::vector<fcl::Transform3d> at;
    for (const Part& part : robot_) at.push_back(ToFcl(poses_[part.link] * part.at));
    for (std::size_t i = 0; i < robot_.size(); ++i) {
      for (std::size_t j = i + 1; j < robot_.size(); ++j) {
        const std::pair<int, int> links = std::minmax(robot_[i].link, robot_[j].link);
        if (std::find(pairs.begin(), pairs.end(), links) == pairs.end()) continue;
        visit(robot_[i], at[i], robot_[j], at[j]);
      }
      if (!Moves(robot_[i].link)) continue;
      for (const Part& thing : scene_) visit(robot_[i], at[i], thing, ToFcl(thing.at));
    }
  }

  bool Moves(int link) const {
    for (int joint = model_.links[link].parent_joint; joint >= 0;
         joint = model_.links[model_.joints[joint].parent_link].parent_joint) {
      if (model_.joints[joint].type != kinematics::JointType::kFixed) return true;
    }
    return false;
  }

  const kinematics::RobotModel& model_;
  std::vector<Part> robot_;
  std::vector<Part> scene_;
  std::vector<geometry::Pose> poses_;
};

// ---------------------------------------------------------------- what is judged

inline Eigen::VectorXd RandomState(const kinematics::RobotModel& model, Rng& rng) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()));
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].type == kinematics::JointType::kFixed) continue;
    q[static_cast<Eigen::Index>(j)] = rng.Uniform(std::max(-3.1, model.joints[j].limits.lower),
                                                  std::min(3.1, model.joints[j].limits.upper));
  }
  return q;
}

inline Eigen::Vector3d RandomDirection(Rng& rng) {
  return Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal()).normalized();
}

/// A closed surface around the way from 0 to `to`: thick at both ends and narrow between, so not
/// convex.
inline Corners Bone(const Eigen::Vector3d& to, double radius, int around = 16, int along = 12) {
  const double length = to.norm();
  const Eigen::Vector3d z = length > 1e-6 ? Eigen::Vector3d(to / length) : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d x = z.unitOrthogonal();
  const Eigen::Vector3d y = z.cross(x);
  const auto at = [&](int u, int v) -> Eigen::Vector3d {
    const double share = static_cast<double>(v) / along;
    const double height = -radius + share * (length + 2 * radius);
    const double waist = 1 - 0.45 * std::sin(std::numbers::pi * share);
    const double wide = v == 0 || v == along ? 0 : radius * waist;
    const double angle = 2 * std::numbers::pi * (u % around) / around;
    return height * z + wide * (std::cos(angle) * x + std::sin(angle) * y);
  };
  Corners corners;
  for (int u = 0; u < around; ++u) {
    for (int v = 0; v < along; ++v) {
      if (v > 0) corners.insert(corners.end(), {at(u, v), at(u + 1, v), at(u + 1, v + 1)});
      if (v + 1 < along) {
        corners.insert(corners.end(), {at(u, v), at(u + 1, v + 1), at(u, v + 1)});
      }
    }
  }
  return corners;
}

inline void WriteStl(const std::filesystem::path& file, const Corners& corners) {
  std::string bytes(80, ' ');
  const auto put = [&](const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  const auto triangles = static_cast<std::uint32_t>(corners.size() / 3);
  put(&triangles, 4);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i % 3 == 0) bytes.append(12, '\0');
    const Eigen::Vector3f corner = corners[i].cast<float>();
    put(corner.data(), 12);
    if (i % 3 == 2) bytes.append(2, '\0');
  }
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Replaces the collision meshes of a robot whose files are not at hand by bones from each link's
/// origin to where its joints lead, written into `folder`. Returns how many.
inline int GiveBones(kinematics::RobotModel& model, const std::filesystem::path& folder) {
  int given = 0;
  for (std::size_t l = 0; l < model.links.size(); ++l) {
    std::vector<kinematics::Geometry>& collisions = model.links[l].collisions;
    const bool missing = std::any_of(collisions.begin(), collisions.end(), [](const auto& g) {
      const auto* mesh = std::get_if<kinematics::Mesh>(&g.shape);
      return mesh != nullptr && !std::filesystem::exists(mesh->path);
    });
    if (!missing) continue;
    Eigen::Vector3d to = Eigen::Vector3d::Zero();
    for (const kinematics::Joint& joint : model.joints) {
      if (joint.parent_link != static_cast<int>(l)) continue;
      if (joint.parent_T_joint.translation.norm() > to.norm())
        to = joint.parent_T_joint.translation;
    }
    const std::filesystem::path file = folder / (model.links[l].name + ".stl");
    WriteStl(file, Bone(to, std::clamp(0.22 * to.norm(), 0.02, 0.06)));
    collisions = {{{}, kinematics::Mesh{file.string()}}};
    ++given;
  }
  return given;
}

/// What an SRDF of a robot with bones would say: the pairs that FCL finds in each other in more
/// than 95 of 100 random states, as MoveIt's assistant leaves them out.
inline kinematics::LinkPairs AlmostAlwaysTouching(const kinematics::RobotModel& model,
                                                  const FclJudge::LinkPairs& pairs) {
  constexpr int kStates = 400;
  Rng rng(17);
  FclJudge judge(model, {});
  std::map<std::pair<int, int>, int> touched;
  for (int i = 0; i < kStates; ++i) {
    for (const auto& links : judge.TouchingLinks(RandomState(model, rng), pairs)) {
      ++touched[links];
    }
  }
  kinematics::LinkPairs often;
  for (const auto& [links, count] : touched) {
    if (count <= 0.95 * kStates) continue;
    often.emplace_back(model.links[static_cast<std::size_t>(links.first)].name,
                       model.links[static_cast<std::size_t>(links.second)].name);
  }
  return often;
}

inline geometry::Pose RandomPlace(Rng& rng, const Eigen::Vector3d& centre, double within_m) {
  geometry::Pose pose = geometry::Pose::FromTranslation(
      centre +
      within_m * Eigen::Vector3d(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(-1, 1)));
  pose.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(rng.Uniform(0, std::numbers::pi), RandomDirection(rng)));
  return pose;
}

/// Boxes, balls, cylinders and capsules of 4 to 20 cm, and `bone` where it names a file.
inline collision::Scene RandomScene(Rng& rng, int objects, const Eigen::Vector3d& centre,
                                    double within_m, const std::string& bone = {}) {
  collision::Scene scene;
  const auto size = [&] { return rng.Uniform(0.04, 0.2); };
  for (int i = 0; i < objects; ++i) {
    kinematics::Shape shape;
    switch (i % (bone.empty() ? 4 : 5)) {
      case 0:
        shape = kinematics::Box{{size(), size(), size()}};
        break;
      case 1:
        shape = kinematics::Sphere{0.5 * size()};
        break;
      case 2:
        shape = kinematics::Cylinder{0.5 * size(), size()};
        break;
      case 3:
        shape = kinematics::Capsule{0.3 * size(), size()};
        break;
      default:
        shape = kinematics::Mesh{bone};
    }
    scene.objects.push_back(
        {"thing" + std::to_string(i), RandomPlace(rng, centre, within_m), shape});
  }
  return scene;
}

/// Through states at equal times, straight between them; s from 0 to frames() - 1.
class SampledPath final : public collision::JointPath {
 public:
  explicit SampledPath(std::vector<Eigen::VectorXd> states) : states_(std::move(states)) {
    way_.push_back(Eigen::VectorXd::Zero(states_.front().size()));
    for (std::size_t i = 0; i + 1 < states_.size(); ++i) {
      way_.push_back(way_.back() + (states_[i + 1] - states_[i]).cwiseAbs());
    }
  }

  std::size_t frames() const { return states_.size(); }
  const Eigen::VectorXd& operator[](std::size_t i) const { return states_[i]; }

  void Position(double s, Eigen::Ref<Eigen::VectorXd> q) const override {
    const auto [i, share] = At(s);
    q = states_[i] + share * (states_[i + 1] - states_[i]);
  }
  void Travel(double s0, double s1, Eigen::Ref<Eigen::VectorXd> travel) const override {
    const auto [i, a] = At(s0);
    const auto [j, b] = At(s1);
    travel = way_[j] + b * (way_[j + 1] - way_[j]) - way_[i] - a * (way_[i + 1] - way_[i]);
  }

 private:
  std::pair<std::size_t, double> At(double s) const {
    const double last = static_cast<double>(states_.size() - 2);
    const double piece = std::clamp(std::floor(s), 0.0, last);
    return {static_cast<std::size_t>(piece), s - piece};
  }

  std::vector<Eigen::VectorXd> states_;
  std::vector<Eigen::VectorXd> way_;
};

/// `legs` eased legs between random states that lie within `share` of the limits of `home`.
inline SampledPath RandomMotion(const kinematics::RobotModel& model, const Eigen::VectorXd& home,
                                Rng& rng, int legs, int frames_a_leg, double share) {
  std::vector<Eigen::VectorXd> states;
  Eigen::VectorXd from = home + share * (RandomState(model, rng) - home);
  for (int leg = 0; leg < legs; ++leg) {
    const Eigen::VectorXd to = home + share * (RandomState(model, rng) - home);
    for (int k = 0; k < frames_a_leg; ++k) {
      const double x = static_cast<double>(k) / frames_a_leg;
      states.push_back(from + x * x * x * (10 - 15 * x + 6 * x * x) * (to - from));
    }
    from = to;
  }
  states.push_back(from);
  return SampledPath(std::move(states));
}

}  // namespace exemplar::testing
