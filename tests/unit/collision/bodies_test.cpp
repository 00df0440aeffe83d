// Bodies that are not convex: meshes as they are, point clouds as octrees.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "body.hpp"
#include "exemplar/base/rng.hpp"
#include "mesh_file.hpp"
#include "octree.hpp"
#include "solid_mesh.hpp"
#include "support/fcl_judge.hpp"

namespace exemplar::collision {
namespace {

using kinematics::Box;
using kinematics::Mesh;
using kinematics::Sphere;
using testing::Bone;
using testing::Corners;

std::string Written(const std::string& name, const Corners& corners) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / name;
  testing::WriteStl(file, corners);
  return file.string();
}

/// Adds a box; `inwards` turns its triangles round.
void AddBox(Corners& corners, const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
            bool inwards = false) {
  constexpr int kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& [a, b, c] : kFaces) {
    for (const int i : {a, inwards ? c : b, inwards ? b : c}) {
      corners.emplace_back((i & 1) != 0 ? upper.x() : lower.x(),
                           (i & 2) != 0 ? upper.y() : lower.y(),
                           (i & 4) != 0 ? upper.z() : lower.z());
    }
  }
}

/// A cup of 20 cm with walls of 2 cm, open above, as one closed surface.
Corners Cup() {
  constexpr double kOuter = 0.1;
  constexpr double kInner = 0.08;
  constexpr int kAround = 32;
  const std::vector<std::pair<double, double>> profile = {
      {0, -0.1}, {kOuter, -0.1}, {kOuter, 0.1}, {kInner, 0.1}, {kInner, -0.08}, {0, -0.08}};
  Corners corners;
  const auto at = [&](int u, std::size_t v) -> Eigen::Vector3d {
    const double angle = 2 * M_PI * (u % kAround) / kAround;
    return {profile[v].first * std::cos(angle), profile[v].first * std::sin(angle),
            profile[v].second};
  };
  for (int u = 0; u < kAround; ++u) {
    for (std::size_t v = 0; v + 1 < profile.size(); ++v) {
      if (v > 0) corners.insert(corners.end(), {at(u, v), at(u + 1, v), at(u + 1, v + 1)});
      if (v + 2 < profile.size()) {
        corners.insert(corners.end(), {at(u, v), at(u + 1, v + 1), at(u, v + 1)});
      }
    }
  }
  return corners;
}

double DistanceOf(const Body& a, const Body& b, const Eigen::Vector3d& b_at) {
  Placement at;
  at.translation = b_at;
  const double forth = Distance(a, {}, b, at, 1e9).distance_m;
  const double back = Distance(b, at, a, {}, 1e9).distance_m;
  EXPECT_NEAR(forth, back, 1e-6);
  return forth;
}

TEST(MeshBody, IsItsHullWhereItIsConvexAndKeepsItsHollowsElse) {
  Corners box;
  AddBox(box, {-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1});
  EXPECT_EQ(MakeBody(Mesh{Written("box.stl", box)})->pieces, nullptr);
  const std::string cup = Written("cup.stl", Cup());
  EXPECT_NE(MakeBody(Mesh{cup})->pieces, nullptr);
  EXPECT_EQ(MakeBody(Mesh{cup, Eigen::Vector3d::Ones(), true})->pieces, nullptr);
}

TEST(MeshBody, LetsABallIntoACup) {
  const Body cup = *MakeBody(Mesh{Written("cup.stl", Cup())});
  const Body ball = *MakeBody(Sphere{0.03});
  EXPECT_NEAR(DistanceOf(cup, ball, {0, 0, 0}), 0.05, 1e-3);
  EXPECT_NEAR(DistanceOf(cup, ball, {0.04, 0, 0}), 0.01, 1e-3);
  EXPECT_LT(DistanceOf(cup, ball, {0.06, 0, 0}), -0.005);
  EXPECT_NEAR(DistanceOf(cup, ball, {0, 0, -0.04}), 0.01, 1e-6);
  EXPECT_NEAR(DistanceOf(cup, ball, {0, 0, 0.2}), 0.07 + std::hypot(0.1, 0.08) - 0.1, 0.02);
}

TEST(MeshBody, LetsABoneIntoACup) {
  const Body cup = *MakeBody(Mesh{Written("cup.stl", Cup())});
  const Body bone = *MakeBody(Mesh{Written("bone.stl", Bone({0, 0, 0.1}, 0.03))});
  ASSERT_NE(bone.pieces, nullptr);
  EXPECT_GT(DistanceOf(cup, bone, {0, 0, -0.02}), 0.02);
  EXPECT_LT(DistanceOf(cup, bone, {0.065, 0, -0.02}), 0);
}

TEST(MeshBody, HoldsWhatIsWhollyInsideIt) {
  Corners shells;
  AddBox(shells, {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  AddBox(shells, {-0.2, -0.2, -0.2}, {0.2, 0.2, 0.2}, true);  // a hollow in the middle
  const Body body = *MakeBody(Mesh{Written("hollow.stl", shells)});
  ASSERT_NE(body.pieces, nullptr);
  const Body ball = *MakeBody(Sphere{0.05});
  const Body bone = *MakeBody(Mesh{Written("bone.stl", Bone({0, 0, 0.05}, 0.02))});
  EXPECT_LT(DistanceOf(body, ball, {0.35, 0.02, 0.01}), -0.05);
  EXPECT_LT(DistanceOf(body, bone, {0.35, 0.02, 0.01}), -0.05);
  EXPECT_NEAR(DistanceOf(body, ball, {0, 0, 0}), 0.15, 1e-6);
  EXPECT_GT(DistanceOf(body, bone, {0, 0, 0}), 0.1);
}

TEST(MeshBody, CountsOverlappingShellsAndThoseTurnedInsideOut) {
  Corners shells;
  AddBox(shells, {-0.5, -0.5, -0.5}, {0.2, 0.5, 0.5});
  AddBox(shells, {-0.2, -0.5, -0.5}, {0.5, 0.5, 0.5});
  AddBox(shells, {1, -0.5, -0.5}, {2, 0.5, 0.5}, true);
  const Body body = *MakeBody(Mesh{Written("shells.stl", shells)});
  const Body ball = *MakeBody(Sphere{0.05});
  EXPECT_LT(DistanceOf(body, ball, {0.01, 0.02, 0.03}), 0);
  EXPECT_LT(DistanceOf(body, ball, {1.5, 0.02, 0.03}), 0);
  EXPECT_NEAR(DistanceOf(body, ball, {0.75, 0, 0}), 0.2, 1e-6);
}

TEST(MeshBody, IsAsFarFromAnotherAsFclMeasures) {
  Rng rng(1);
  const Corners first_corners = Bone({0.05, 0.1, 0.1}, 0.06);
  const Corners second_corners = Cup();
  const Body first = *MakeBody(Mesh{Written("first.stl", first_corners)});
  const Body second = *MakeBody(Mesh{Written("second.stl", second_corners)});
  const auto first_fcl = testing::ToFclMesh(*ReadStl(Written("first.stl", first_corners)));
  const auto second_fcl = testing::ToFclMesh(*ReadStl(Written("second.stl", second_corners)));
  int apart = 0;
  int crossing = 0;
  for (int i = 0; i < 400; ++i) {
    const geometry::Pose a = testing::RandomPlace(rng, {0, 0, 0}, 0.15);
    const geometry::Pose b = testing::RandomPlace(rng, {0, 0, 0}, 0.15);
    const double ours =
        Distance(first, Placement::From(a), second, Placement::From(b), 1e9).distance_m;
    fcl::CollisionResultd hit;
    if (fcl::collide(first_fcl.get(), testing::ToFcl(a), second_fcl.get(), testing::ToFcl(b),
                     fcl::CollisionRequestd(), hit) > 0) {
      ++crossing;
      EXPECT_LE(ours, 0) << i;
      continue;
    }
    fcl::DistanceResultd result;
    const double theirs = fcl::distance(first_fcl.get(), testing::ToFcl(a), second_fcl.get(),
                                        testing::ToFcl(b), fcl::DistanceRequestd(), result);
    if (ours < 0) continue;  // one inside the other: FCL sees surfaces only
    ++apart;
    EXPECT_NEAR(ours, theirs, 1e-6) << i;
  }
  EXPECT_GT(apart, 50);
  EXPECT_GT(crossing, 50);
}

TEST(MeshBody, IsAsFarFromAConvexBodyAsFromItsMesh) {
  Rng rng(2);
  Corners box_corners;
  AddBox(box_corners, {-0.05, -0.03, -0.02}, {0.05, 0.03, 0.02});
  const Body cup = *MakeBody(Mesh{Written("cup.stl", Cup())});
  const Body box = *MakeBody(Box{{0.1, 0.06, 0.04}});
  const auto cup_fcl = testing::ToFclMesh(*ReadStl(Written("cup.stl", Cup())));
  const auto box_fcl = testing::ToFclMesh(box_corners);
  for (int i = 0; i < 300; ++i) {
    const geometry::Pose at = testing::RandomPlace(rng, {0, 0, 0}, 0.2);
    const double ours = Distance(cup, {}, box, Placement::From(at), 1e9).distance_m;
    fcl::DistanceResultd result;
    const double theirs = fcl::distance(cup_fcl.get(), fcl::Transform3d::Identity(), box_fcl.get(),
                                        testing::ToFcl(at), fcl::DistanceRequestd(), result);
    if (theirs > 1e-9) {
      EXPECT_NEAR(ours, theirs, 1e-6) << i;
    } else {
      EXPECT_LE(ours, 1e-7) << i;
    }
  }
}

// ---------------------------------------------------------------- files that are wrong

struct BadMesh {
  std::string name;
  std::string said;  ///< what the error must say, beside the file's name
};

class BadMeshes : public ::testing::TestWithParam<BadMesh> {};

std::string Make(const std::string& name) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / name;
  Corners corners = Bone({0, 0, 0.1}, 0.03);
  if (name == "missing.stl") return "/nowhere/missing.stl";
  if (name == "a_folder.stl") {
    std::filesystem::create_directories(file);
  } else if (name == "empty.stl") {
    std::ofstream(file, std::ios::binary) << "";
  } else if (name == "no_triangles.stl") {
    testing::WriteStl(file, {});
  } else if (name == "open.stl") {
    corners.resize(corners.size() - 3);
    testing::WriteStl(file, corners);
  } else if (name == "flat.stl") {
    for (Eigen::Vector3d& corner : corners) corner.z() = 0;
    testing::WriteStl(file, corners);
  } else if (name == "one_point.stl") {
    testing::WriteStl(file, Corners(30, Eigen::Vector3d(1, 2, 3)));
  } else if (name == "needles.stl") {  // every triangle is a line
    for (std::size_t i = 2; i < corners.size(); i += 3) corners[i] = corners[i - 1];
    testing::WriteStl(file, corners);
  } else if (name == "nan.stl") {
    corners[7].y() = std::nan("");
    testing::WriteStl(file, corners);
  } else if (name == "infinite.stl") {
    corners[4].x() = INFINITY;
    testing::WriteStl(file, corners);
  } else if (name == "cut.stl") {
    testing::WriteStl(file, corners);
    std::filesystem::resize_file(file, std::filesystem::file_size(file) - 7);
  } else if (name == "many_triangles.stl" || name == "huge.stl") {
    // Sparse: the length alone says it.
    const std::uint32_t triangles = name == "huge.stl" ? 20'000'000 : 1'000'001;
    std::ofstream out(file, std::ios::binary);
    out << std::string(80, ' ');
    out.write(reinterpret_cast<const char*>(&triangles), 4);
    out.close();
    std::filesystem::resize_file(file, 84 + 50ULL * triangles);
  } else if (name == "collada.dae") {
    std::ofstream(file) << "<?xml version=\"1.0\"?><COLLADA/>";
  }
  return file.string();
}

TEST_P(BadMeshes, AreRefusedWithTheirFileAndWhatIsWrong) {
  const std::string file = Make(GetParam().name);
  const Result<Body> body = MakeBody(Mesh{file});
  ASSERT_FALSE(body.ok());
  EXPECT_NE(body.error().message.find(file), std::string::npos) << body.error().message;
  EXPECT_NE(body.error().message.find(GetParam().said), std::string::npos) << body.error().message;
  std::filesystem::remove_all(file);
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadMeshes,
    ::testing::Values(
        BadMesh{"missing.stl", "cannot be opened"}, BadMesh{"a_folder.stl", "cannot be"},
        BadMesh{"empty.stl", "is empty"}, BadMesh{"no_triangles.stl", "no triangles"},
        BadMesh{"open.stl", "is open: 3 edges"}, BadMesh{"flat.stl", "span no volume"},
        BadMesh{"one_point.stl", "span no volume"},
        BadMesh{"needles.stl", "no triangle of the mesh has an area"},
        BadMesh{"nan.stl", "triangle 2 has a corner that is not finite"},
        BadMesh{"infinite.stl", "triangle 1 has a corner that is not finite"},
        BadMesh{"cut.stl", "neither a text STL"},
        BadMesh{"many_triangles.stl", "1000001 triangles"}, BadMesh{"huge.stl", "1000000084 bytes"},
        BadMesh{"collada.dae", "neither a text STL"}),
    [](const ::testing::TestParamInfo<BadMesh>& bad) {
      std::string name = bad.param.name;
      std::replace(name.begin(), name.end(), '.', '_');
      return name;
    });

TEST(MeshBody, PassesOverDegenerateTrianglesOfAClosedMesh) {
  Corners corners = Cup();
  const Eigen::Vector3d corner = corners[5];
  const Eigen::Vector3d other = corners[4];
  corners.insert(corners.end(), {corner, other, corner});
  corners.insert(corners.end(), {corner, corner, corner});
  const Result<SolidMesh> mesh = MakeSolidMesh(corners);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), Cup().size() / 3);
}

TEST(MeshBody, JoinsCornersThatDifferByRoundingOnly) {
  Rng rng(3);
  Corners corners = Cup();
  for (Eigen::Vector3d& corner : corners) corner += 2e-8 * testing::RandomDirection(rng);
  EXPECT_TRUE(MakeSolidMesh(corners).ok());
  for (Eigen::Vector3d& corner : corners) corner += 1e-4 * testing::RandomDirection(rng);
  EXPECT_FALSE(MakeSolidMesh(corners).ok());
}

TEST(MeshBody, AnOpenMeshMarkedConvexIsItsHull) {
  Corners corners = Bone({0, 0, 0.1}, 0.03);
  corners.resize(corners.size() - 30);
  const Result<Body> body =
      MakeBody(Mesh{Written("open_convex.stl", corners), Eigen::Vector3d::Ones(), true});
  ASSERT_TRUE(body.ok()) << body.error().message;
}

TEST(MeshBody, OfVeryManyTrianglesIsContainedInItsHull) {
  const Corners corners = Bone({0, 0, 0.3}, 0.1, 150, 100);
  const Result<Body> body = MakeBody(Mesh{Written("fine.stl", corners)});
  ASSERT_TRUE(body.ok()) << body.error().message;
  EXPECT_LT(body->hull.vertices().size(), 4000U);
  Rng rng(4);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d n = testing::RandomDirection(rng);
    double farthest = -1;
    for (const Eigen::Vector3d& corner : corners) farthest = std::max(farthest, corner.dot(n));
    const double reached = body->hull.Support(n).dot(n);
    EXPECT_GE(reached, farthest - 1e-7);
    EXPECT_LE(reached, farthest + 2e-4);
  }
}

// ---------------------------------------------------------------- clouds

TEST(Octree, HoldsEveryPointInACell) {
  Rng rng(5);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 3000; ++i) points.push_back(0.2 * testing::RandomDirection(rng));
  const std::vector<Bounds> cells = *OctreeCells(points, 0.01);
  EXPECT_LE(cells.size(), points.size());
  for (const Eigen::Vector3d& p : points) {
    const auto holds = [&](const Bounds& cell) {
      return (p.array() >= cell.lower.array()).all() && (p.array() <= cell.upper.array()).all();
    };
    EXPECT_EQ(std::count_if(cells.begin(), cells.end(), holds), 1);
  }
}

TEST(Octree, JoinsEightFullCells) {
  std::vector<Eigen::Vector3d> points;
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      for (int z = 0; z < 8; ++z)
        points.emplace_back(0.1 * x - 0.35, 0.1 * y + 0.05, 0.1 * z + 0.05);
    }
  }
  // x from -0.4 to 0.4: two cubes of 0.4 wide, four high and deep halves.
  EXPECT_EQ(OctreeCells(points, 0.1)->size(), 8U);
}

TEST(Octree, NamesThePointThatCannotBe) {
  const auto error = [](const std::vector<Eigen::Vector3d>& points, double resolution_m) {
    const Result<Body> body = MakeCloudBody(points, resolution_m);
    return body.ok() ? std::string("no error") : body.error().message;
  };
  EXPECT_NE(error({{0, 0, 0}, {0, std::nan(""), 0}}, 0.01).find("point 1"), std::string::npos);
  EXPECT_NE(error({{0, 0, 1e9}}, 0.01).find("within"), std::string::npos);
  EXPECT_NE(error({{0, 0, 0}}, 0).find("resolution is 0"), std::string::npos);
  EXPECT_NE(error({}, 0.01).find("empty"), std::string::npos);
}

TEST(CloudBody, IsAsFarAsTheNearestCell) {
  Rng rng(6);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 400; ++i) {
    points.emplace_back(rng.Uniform(-0.3, 0.3), rng.Uniform(-0.3, 0.3), rng.Uniform(-0.3, 0.3));
  }
  const double edge_m = 0.02;
  const Body cloud = *MakeCloudBody(points, edge_m);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d centre = 0.5 * testing::RandomDirection(rng) * rng.Uniform();
    const double radius = 0.01;
    double nearest = 1e9;
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d lower = (p / edge_m).array().floor() * edge_m;
      const Eigen::Vector3d inside =
          centre.cwiseMax(lower).cwiseMin((lower.array() + edge_m).matrix());
      nearest = std::min(nearest, (centre - inside).norm() - radius);
    }
    const double ours = DistanceOf(cloud, *MakeBody(Sphere{radius}), centre);
    if (nearest > -radius + 1e-9) {
      EXPECT_NEAR(ours, nearest, 1e-6) << i;
    } else {
      EXPECT_LE(ours, -radius + 1e-9) << i;
    }
  }
}

}  // namespace
}  // namespace exemplar::collision
