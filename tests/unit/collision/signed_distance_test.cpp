// Distances between single shapes, against alternating projections and sampled directions.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "body.hpp"
#include "convex_hull.hpp"
#include "convex_shape.hpp"
#include "exemplar/base/rng.hpp"
#include "mesh_file.hpp"

namespace exemplar::collision {
namespace {

using kinematics::Box;
using kinematics::Capsule;
using kinematics::Cylinder;
using kinematics::Mesh;
using kinematics::Shape;
using kinematics::Sphere;

Eigen::Vector3d RandomVector(Rng& rng) { return {rng.Normal(), rng.Normal(), rng.Normal()}; }

Eigen::Vector3d RandomDirection(Rng& rng) { return RandomVector(rng).normalized(); }

Placement RandomPlacement(Rng& rng, double spread_m) {
  geometry::Pose pose;
  pose.rotation =
      Eigen::Quaterniond(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal()).normalized();
  pose.translation = spread_m * RandomVector(rng);
  return Placement::From(pose);
}

Shape RandomShape(Rng& rng, int kind) {
  const auto size = [&] { return rng.Uniform(0.02, 0.4); };
  switch (kind) {
    case 0:
      return Box{{size(), size(), size()}};
    case 1:
      return Sphere{size()};
    case 2:
      return Cylinder{size(), size()};
    default:
      return Capsule{size(), size()};
  }
}

/// The nearest point of a primitive to `p`, both in the primitive's frame.
Eigen::Vector3d Project(const Shape& shape, const Eigen::Vector3d& p) {
  if (const auto* box = std::get_if<Box>(&shape)) {
    return p.cwiseMax(-0.5 * box->size).cwiseMin(0.5 * box->size);
  }
  if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    Eigen::Vector3d out = p;
    if (out.head<2>().norm() > cylinder->radius)
      out.head<2>() *= cylinder->radius / out.head<2>().norm();
    out.z() = std::clamp(p.z(), -0.5 * cylinder->length, 0.5 * cylinder->length);
    return out;
  }
  Eigen::Vector3d axis_point = Eigen::Vector3d::Zero();
  double radius = 0;
  if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    axis_point.z() = std::clamp(p.z(), -0.5 * capsule->length, 0.5 * capsule->length);
    radius = capsule->radius;
  } else {
    radius = std::get<Sphere>(shape).radius;
  }
  const Eigen::Vector3d out = p - axis_point;
  return out.norm() <= radius ? p : Eigen::Vector3d(axis_point + radius * out.normalized());
}

Eigen::Vector3d ProjectAt(const Shape& shape, const Placement& at, const Eigen::Vector3d& p) {
  return at * Project(shape, at.rotation.transpose() * (p - at.translation));
}

/// Distance by alternating projections (Cheney & Goldstein 1959), from above; 0 where they meet.
double ReferenceDistance(const Shape& a, const Placement& a_at, const Shape& b,
                         const Placement& b_at) {
  Eigen::Vector3d p = a_at.translation;
  Eigen::Vector3d q = p;
  for (int i = 0; i < 20000; ++i) {
    q = ProjectAt(b, b_at, p);
    const Eigen::Vector3d next = ProjectAt(a, a_at, q);
    const double moved = (next - p).norm();
    p = next;
    if (moved < 1e-13) break;
  }
  return (p - q).norm();
}

/// The least overlap over many directions: an upper bound of the depth that converges to it.
double SampledDepth(const ConvexShape& a, const Placement& a_at, const ConvexShape& b,
                    const Placement& b_at, Rng& rng) {
  const auto overlap = [&](const Eigen::Vector3d& n) {
    const Eigen::Vector3d p = a_at * a.Support(a_at.rotation.transpose() * n);
    const Eigen::Vector3d q = b_at * b.Support(b_at.rotation.transpose() * -n);
    return n.dot(p - q);
  };
  Eigen::Vector3d best = RandomDirection(rng);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d n = RandomDirection(rng);
    if (overlap(n) < overlap(best)) best = n;
  }
  for (double step = 0.1; step > 1e-5; step *= 0.7) {
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector3d n = (best + step * RandomVector(rng)).normalized();
      if (overlap(n) < overlap(best)) best = n;
    }
  }
  return overlap(best);
}

TEST(SignedDistance, EqualsAlternatingProjectionsForAllPrimitivePairs) {
  Rng rng(1);
  for (int kind_a = 0; kind_a < 4; ++kind_a) {
    for (int kind_b = 0; kind_b < 4; ++kind_b) {
      for (int i = 0; i < 60; ++i) {
        const Shape a = RandomShape(rng, kind_a);
        const Shape b = RandomShape(rng, kind_b);
        const Placement a_at = RandomPlacement(rng, 0.3);
        const Placement b_at = RandomPlacement(rng, 0.3);
        const double reference = ReferenceDistance(a, a_at, b, b_at);
        if (reference < 1e-3) continue;
        const Separation found =
            SignedDistance(*ConvexShape::Create(a), a_at, *ConvexShape::Create(b), b_at);
        EXPECT_NEAR(found.distance_m, reference, 2e-5) << kind_a << " and " << kind_b << ", " << i;
        EXPECT_NEAR((found.p_first - found.p_second).norm(), reference, 1e-4)
            << kind_a << " and " << kind_b << ", " << i;
      }
    }
  }
}

TEST(SignedDistance, PointsLieOnTheirBodies) {
  Rng rng(2);
  for (int i = 0; i < 600; ++i) {
    const Shape a = RandomShape(rng, static_cast<int>(rng.Below(4)));
    const Shape b = RandomShape(rng, static_cast<int>(rng.Below(4)));
    const Placement a_at = RandomPlacement(rng, 0.3);
    const Placement b_at = RandomPlacement(rng, 0.3);
    const Separation found =
        SignedDistance(*ConvexShape::Create(a), a_at, *ConvexShape::Create(b), b_at);
    EXPECT_LT((ProjectAt(a, a_at, found.p_first) - found.p_first).norm(), 1e-5);
    EXPECT_LT((ProjectAt(b, b_at, found.p_second) - found.p_second).norm(), 1e-5);
  }
}

TEST(SignedDistance, IsTheSameWithTheBodiesExchanged) {
  Rng rng(3);
  for (int i = 0; i < 400; ++i) {
    const ConvexShape a = *ConvexShape::Create(RandomShape(rng, static_cast<int>(rng.Below(4))));
    const ConvexShape b = *ConvexShape::Create(RandomShape(rng, static_cast<int>(rng.Below(4))));
    const Placement a_at = RandomPlacement(rng, 0.3);
    const Placement b_at = RandomPlacement(rng, 0.3);
    const double forth = SignedDistance(a, a_at, b, b_at).distance_m;
    const double back = SignedDistance(b, b_at, a, a_at).distance_m;
    if (forth > 0) {
      EXPECT_NEAR(forth, back, 2e-5);
    } else {
      EXPECT_LE(back, 1e-9);
    }
  }
}

TEST(SignedDistance, DepthIsNearTheLeastOverlapOverAllDirections) {
  Rng rng(4);
  for (int i = 0; i < 120; ++i) {
    const ConvexShape a = *ConvexShape::Create(RandomShape(rng, static_cast<int>(rng.Below(4))));
    const ConvexShape b = *ConvexShape::Create(RandomShape(rng, static_cast<int>(rng.Below(4))));
    const Placement a_at = RandomPlacement(rng, 0.08);
    const Placement b_at = RandomPlacement(rng, 0.08);
    const double sampled = SampledDepth(a, a_at, b, b_at, rng);
    if (sampled < 1e-3) continue;
    const double depth = -SignedDistance(a, a_at, b, b_at).distance_m;
    EXPECT_GE(depth, 0.98 * sampled - 1e-4) << i;
    EXPECT_LE(depth, 1.5 * sampled + 2e-3) << i;
  }
}

TEST(SignedDistance, KnowsSpheresAndCapsulesExactly) {
  const ConvexShape sphere = *ConvexShape::Create(Sphere{0.1});
  const ConvexShape capsule = *ConvexShape::Create(Capsule{0.05, 0.4});
  Placement apart;
  apart.translation = {0.3, 0, 0};
  EXPECT_NEAR(SignedDistance(sphere, {}, sphere, apart).distance_m, 0.1, 1e-15);
  EXPECT_NEAR(SignedDistance(sphere, {}, capsule, apart).distance_m, 0.15, 1e-15);
  apart.translation = {0, 0, 0.5};
  EXPECT_NEAR(SignedDistance(capsule, {}, capsule, apart).distance_m, 0.0, 1e-15);
  apart.translation = {0.06, 0, 0.1};
  EXPECT_NEAR(SignedDistance(capsule, {}, capsule, apart).distance_m, -0.04, 1e-15);
}

TEST(SignedDistance, SeesASphereWhollyInsideABox) {
  const ConvexShape box = *ConvexShape::Create(Box{{1, 1, 1}});
  const ConvexShape sphere = *ConvexShape::Create(Sphere{0.05});
  Placement at;
  at.translation = {0.3, 0.1, 0};
  const Separation found = SignedDistance(sphere, at, box, {});
  EXPECT_NEAR(found.distance_m, -0.25, 1e-12);
  EXPECT_NEAR(found.p_second.x(), 0.5, 1e-12);
  EXPECT_NEAR(found.p_first.x(), 0.25, 1e-12);
}

// ---------------------------------------------------------------- meshes

std::vector<Eigen::Vector3d> BoxCorners(const Eigen::Vector3d& half) {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(
        half.cwiseProduct(Eigen::Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  }
  return corners;
}

std::string TextStl(const std::vector<Eigen::Vector3d>& vertices,
                    const std::vector<std::array<int, 3>>& faces) {
  std::string text = "solid test\n";
  for (const std::array<int, 3>& face : faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int i : face) {
      text += "  vertex " + std::to_string(vertices[i].x()) + " " +
              std::to_string(vertices[i].y()) + " " + std::to_string(vertices[i].z()) + "\n";
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid test\n";
}

std::string BinaryStl(const std::vector<Eigen::Vector3d>& corners) {
  std::string bytes(80, ' ');
  bytes.replace(0, 5, "solid");  // as careless writers do
  const auto put = [&](const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  const auto triangles = static_cast<std::uint32_t>(corners.size() / 3);
  put(&triangles, 4);
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const float normal[3] = {0, 0, 0};
    put(normal, sizeof normal);
    for (std::uint32_t i = 0; i < 3; ++i) {
      const Eigen::Vector3f corner = corners[3 * t + i].cast<float>();
      put(corner.data(), 12);
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

std::filesystem::path WriteTemporary(const std::string& name, const std::string& bytes) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / name;
  std::ofstream(file, std::ios::binary) << bytes;
  return file;
}

TEST(ConvexHull, ContainsEveryPointOfACloud) {
  Rng rng(5);
  std::vector<Eigen::Vector3d> cloud;
  for (int i = 0; i < 500; ++i) cloud.push_back(RandomVector(rng));
  const Result<Hull> hull = ConvexHull(cloud);
  ASSERT_TRUE(hull.ok());
  // Euler: a closed triangulated surface.
  EXPECT_EQ(hull->faces.size(), 2 * hull->vertices.size() - 4);
  for (const std::array<int, 3>& face : hull->faces) {
    const Eigen::Vector3d& a = hull->vertices[face[0]];
    const Eigen::Vector3d normal =
        (hull->vertices[face[1]] - a).cross(hull->vertices[face[2]] - a).normalized();
    for (const Eigen::Vector3d& p : cloud) EXPECT_LE(normal.dot(p - a), 1e-8);
  }
}

TEST(ConvexHull, RefusesPointsInAPlane) {
  Rng rng(6);
  std::vector<Eigen::Vector3d> cloud;
  for (int i = 0; i < 50; ++i) cloud.emplace_back(rng.Normal(), rng.Normal(), 0.5);
  EXPECT_FALSE(ConvexHull(cloud).ok());
  cloud.assign(10, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(ConvexHull(cloud).ok());
}

TEST(Mesh, OfABoxMeasuresLikeTheBox) {
  Rng rng(7);
  const Eigen::Vector3d half(0.1, 0.2, 0.05);
  const Result<Hull> hull = ConvexHull(BoxCorners(half));
  ASSERT_TRUE(hull.ok());
  const std::string text = TextStl(hull->vertices, hull->faces);
  const ConvexShape mesh =
      MakeBody(Mesh{WriteTemporary("box.stl", text).string(), {1, 1, 1}})->hull;
  const ConvexShape box = *ConvexShape::Create(Box{2 * half});
  for (int i = 0; i < 200; ++i) {
    const ConvexShape other = *ConvexShape::Create(RandomShape(rng, i % 4));
    const Placement mesh_at = RandomPlacement(rng, 0.25);
    const Placement other_at = RandomPlacement(rng, 0.25);
    const double by_mesh = SignedDistance(mesh, mesh_at, other, other_at).distance_m;
    const double by_box = SignedDistance(box, mesh_at, other, other_at).distance_m;
    if (by_box > 1e-4) {
      EXPECT_NEAR(by_mesh, by_box, 2e-5) << i;
    } else {
      EXPECT_LT(by_mesh, 2e-4) << i;
    }
  }
}

TEST(Mesh, IsScaled) {
  const Result<Hull> hull = ConvexHull(BoxCorners({100, 100, 100}));
  const std::string text = TextStl(hull->vertices, hull->faces);
  const ConvexShape mesh =
      MakeBody(Mesh{WriteTemporary("millimetres.stl", text).string(), {0.001, 0.001, 0.001}})->hull;
  EXPECT_NEAR(mesh.Support(Eigen::Vector3d::UnitX()).x(), 0.1, 1e-12);
}

TEST(Stl, ReadsBinaryThatBeginsWithSolid) {
  const std::vector<Eigen::Vector3d> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0},
                                                {0, 0, 0}, {0, 0, 1}, {0, 1, 0}};
  const Result<std::vector<Eigen::Vector3d>> read = ParseStl(BinaryStl(corners), "b.stl");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(*read, corners);
}

TEST(Stl, NamesFileAndLineOfABadVertex) {
  const Result<std::vector<Eigen::Vector3d>> read =
      ParseStl("solid x\n facet normal 0 0 1\n outer loop\n vertex 1 2 three\n", "bad.stl");
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("bad.stl:4"), std::string::npos) << read.error().message;
}

TEST(Stl, RefusesCutEmptyAndForeignFiles) {
  const std::string whole = BinaryStl(std::vector<Eigen::Vector3d>(6, Eigen::Vector3d::Ones()));
  EXPECT_FALSE(ParseStl("", "empty.stl").ok());
  EXPECT_FALSE(ParseStl(whole.substr(0, 60), "cut.stl").ok());
  EXPECT_FALSE(ParseStl(whole.substr(0, whole.size() - 7), "cut.stl").ok());
  EXPECT_FALSE(ParseStl("ply\nformat ascii 1.0\n", "other.stl").ok());
  EXPECT_FALSE(ReadStl("/nonexistent/none.stl").ok());
}

TEST(Shape, OfImpossibleSizeIsRefusedWithTheSize) {
  const Result<ConvexShape> shape = ConvexShape::Create(Box{{0.1, -0.2, 0.1}});
  ASSERT_FALSE(shape.ok());
  EXPECT_NE(shape.error().message.find("-0.2"), std::string::npos) << shape.error().message;
  EXPECT_FALSE(ConvexShape::Create(Sphere{0}).ok());
  EXPECT_FALSE(ConvexShape::Create(Cylinder{0.1, std::nan("")}).ok());
}

}  // namespace
}  // namespace exemplar::collision
