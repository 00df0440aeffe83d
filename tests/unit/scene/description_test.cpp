#include "exemplar/scene/description.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>

namespace exemplar::scene {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kScene = R"(obstacles:
  - {name: table, shape: box, size: [1.2, 0.8, 0.04], position: [0.7, 0, -0.02]}
  - {name: lamp, shape: capsule, radius: 0.03, length: 0.2, position: [0.2, 0.5, 0.4],
     quaternion: [0, 0.7071, 0, 0.7071]}
buttons:
  - name: target
    position: [0.6, -0.2, 0.05]
    contact: [0, 0, 0.01]
    normal: [0, 0, 2]
    radius: 0.015
    marker: {id: 7, size: 0.05, position: [0.05, 0, -0.02]}
cameras:
  - {name: stereo, position: [0.6, 0, 1.2], look_at: [0.6, 0, 0], up: [1, 0, 0], fovy_deg: 60}
)";

std::string ErrorOf(std::string_view yaml) {
  const Result<Description> read = ParseDescription(yaml, "scene.yaml");
  return read.ok() ? "no error" : read.error().message;
}

TEST(Description, ReadsObstaclesButtonsAndCameras) {
  const Result<Description> read = ParseDescription(kScene, "scene.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->obstacles.size(), 2u);
  EXPECT_EQ(std::get<kinematics::Box>(read->obstacles[0].shape).size,
            Eigen::Vector3d(1.2, 0.8, 0.04));
  EXPECT_EQ(std::get<kinematics::Capsule>(read->obstacles[1].shape).length, 0.2);
  EXPECT_NEAR(read->obstacles[1].base_T_shape.rotation.norm(), 1, 1e-15);
  ASSERT_EQ(read->buttons.size(), 1u);
  const Button& button = read->buttons[0];
  EXPECT_EQ(button.name, "target");
  EXPECT_EQ(button.base_T_object.translation, Eigen::Vector3d(0.6, -0.2, 0.05));
  EXPECT_EQ(button.object_p_contact, Eigen::Vector3d(0, 0, 0.01));
  EXPECT_EQ(button.object_normal, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(button.radius_m, 0.015);
  EXPECT_EQ(button.travel_m, 0.004);
  ASSERT_TRUE(button.marker.has_value());
  EXPECT_EQ(button.marker->id, 7);
  EXPECT_EQ(button.marker->object_T_marker.translation, Eigen::Vector3d(0.05, 0, -0.02));
  ASSERT_EQ(read->cameras.size(), 1u);
  EXPECT_NEAR(read->cameras[0].fovy_rad, std::numbers::pi / 3, 1e-15);
}

TEST(Description, LookingDownPutsTheOpticalAxesAsAPhotographerWould) {
  const Result<Description> read = ParseDescription(kScene, "scene.yaml");
  ASSERT_TRUE(read.ok());
  const Eigen::Matrix3d base_R_left = read->cameras[0].base_T_left.rotation.toRotationMatrix();
  EXPECT_TRUE(base_R_left.col(2).isApprox(-Eigen::Vector3d::UnitZ(), 1e-12)) << base_R_left;
  EXPECT_TRUE(base_R_left.col(1).isApprox(-Eigen::Vector3d::UnitX(), 1e-12)) << base_R_left;
  EXPECT_TRUE(base_R_left.col(0).isApprox(-Eigen::Vector3d::UnitY(), 1e-12)) << base_R_left;
}

TEST(Description, FocalLengthMapsTheFieldOfViewOntoThePicturesHeight) {
  StereoCamera camera;
  camera.height = 480;
  camera.fovy_rad = std::numbers::pi / 2;
  EXPECT_NEAR(camera.focal_px(), 240, 1e-9);
}

TEST(Description, ReadsTheRailOfACart) {
  const std::string button = "buttons:\n  - name: a\n    position: [0, 0, 0]\n";
  const Result<Description> read = ParseDescription(
      button + "    rail: {direction: [0, 2, 0], length: 0.3, speed: 0.1}\n", "scene.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_TRUE(read->buttons[0].rail.has_value());
  EXPECT_EQ(read->buttons[0].rail->base_direction, Eigen::Vector3d::UnitY());
  EXPECT_EQ(read->buttons[0].rail->length_m, 0.3);
  EXPECT_EQ(read->buttons[0].rail->speed_m_s, 0.1);
  EXPECT_THAT(ErrorOf(button + "    rail: {length: 0.3, speed: 0.25}\n"),
              AllOf(HasSubstr("scene.yaml:4"), HasSubstr("speed"),
                    HasSubstr("0.25 m/s is too fast, at most 0.2 are allowed")));
  EXPECT_THAT(ErrorOf(button + "    rail: {length: 0, speed: 0.1}\n"),
              AllOf(HasSubstr("length"), HasSubstr("must be positive")));
  EXPECT_THAT(ErrorOf(button + "    rail: {length: 0.3, speed: -0.1}\n"),
              AllOf(HasSubstr("speed"), HasSubstr("must not be negative")));
  EXPECT_THAT(ErrorOf(button + "    rail: {lenght: 0.3, speed: 0.1}\n"), HasSubstr("lenght"));
}

TEST(Rail, GoesToItsEndAndBack) {
  const Rail rail{.length_m = 0.3, .speed_m_s = 0.1};
  EXPECT_EQ(rail.WayAt(0), 0);
  EXPECT_NEAR(rail.WayAt(2), 0.2, 1e-12);
  EXPECT_NEAR(rail.WayAt(4), 0.2, 1e-12);
  EXPECT_NEAR(rail.WayAt(6.5), 0.05, 1e-12);
  EXPECT_EQ((Rail{.length_m = 0.3, .speed_m_s = 0}).WayAt(100), 0);
}

TEST(Description, AnEmptyFileIsAnEmptyScene) {
  const Result<Description> read = ParseDescription("# nothing yet\n", "scene.yaml");
  ASSERT_TRUE(read.ok());
  EXPECT_TRUE(read->obstacles.empty() && read->buttons.empty() && read->cameras.empty());
}

TEST(Description, AnUnknownKeyIsAnErrorWithTheNearestName) {
  EXPECT_THAT(
      ErrorOf("buttons:\n  - name: a\n    positon: [0, 0, 0]\n"),
      AllOf(HasSubstr("scene.yaml:3"), HasSubstr("buttons[0].positon"), HasSubstr("\"position\"")));
}

TEST(Description, ErrorsNameFileLineAndKey) {
  EXPECT_THAT(ErrorOf("buttons:\n  - name: a\n    position: [0, 0, 0]\n    radius: -0.02\n"),
              AllOf(HasSubstr("scene.yaml:4"), HasSubstr("buttons[0].radius"),
                    HasSubstr("-0.02 must be positive")));
  EXPECT_THAT(ErrorOf("obstacles:\n  - {name: a, shape: box, position: [0, nan, 0]}\n"),
              AllOf(HasSubstr("scene.yaml:2"), HasSubstr("obstacles[0].position[1]"),
                    HasSubstr("not finite")));
  EXPECT_THAT(ErrorOf("obstacles:\n  - {name: a, shape: box, position: [0, 0]}\n"),
              HasSubstr("list of 3 numbers"));
  EXPECT_THAT(ErrorOf("obstacles:\n  - {name: a, shape: box, position: [0, 0, 0]}\n"),
              AllOf(HasSubstr("obstacles[0].size"), HasSubstr("missing")));
  EXPECT_THAT(ErrorOf("cameras: 5\n"), AllOf(HasSubstr("cameras"), HasSubstr("must be a list")));
  EXPECT_THAT(ErrorOf("buttons: [1]\n"), HasSubstr("buttons[0]"));
  EXPECT_THAT(ErrorOf("buttons: [\n"), HasSubstr("scene.yaml:"));
}

TEST(Description, RefusesWhatCannotBe) {
  const std::string button = "buttons:\n  - name: a\n    position: [0, 0, 0]\n";
  EXPECT_THAT(ErrorOf(button + "    quaternion: [0, 0, 0, 0]\n"), HasSubstr("norm 0.0000"));
  EXPECT_THAT(ErrorOf(button + "    normal: [0, 0, 0]\n"), HasSubstr("zero vector"));
  EXPECT_THAT(ErrorOf(button + "    travel: 0.05\n"), HasSubstr("less than"));
  EXPECT_THAT(ErrorOf(button + "    marker: {id: 50, position: [0, 0, 0]}\n"),
              AllOf(HasSubstr("buttons[0].marker.id"), HasSubstr("from 0 to 49")));
  EXPECT_THAT(ErrorOf(button + "  - name: a\n    position: [1, 0, 0]\n"), HasSubstr("taken"));
  EXPECT_THAT(ErrorOf(button + "    name: b\n"), HasSubstr("twice"));
  EXPECT_THAT(ErrorOf("obstacles:\n  - {name: a, shape: ball, position: [0, 0, 0]}\n"),
              HasSubstr("\"ball\" is none of"));
  EXPECT_THAT(ErrorOf("obstacles:\n  - {name: a, shape: sphere, radius: 1, length: 2, position: "
                      "[0, 0, 0]}\n"),
              HasSubstr("does not belong to a sphere"));
  EXPECT_THAT(ErrorOf("cameras:\n  - {name: c, position: [0, 0, 1], look_at: [0, 0, 0]}\n"),
              HasSubstr("up"));
}

TEST(Description, TwoButtonsCannotShareAMarker) {
  EXPECT_THAT(ErrorOf("buttons:\n"
                      "  - {name: a, position: [0, 0, 0], marker: {id: 3, position: [0, 0, 0]}}\n"
                      "  - {name: b, position: [1, 0, 0], marker: {id: 3, position: [0, 0, 0]}}\n"),
              AllOf(HasSubstr("marker id 3"), HasSubstr("\"b\"")));
}

TEST(Description, MeshPathsStartAtTheFile) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "exemplar_scene_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "scene.yaml")
      << "obstacles:\n  - {name: a, shape: mesh, mesh: meshes/a.stl, position: [0, 0, 0]}\n";
  const Result<Description> read = ReadDescription(folder / "scene.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(std::get<kinematics::Mesh>(read->obstacles[0].shape).path,
            (folder / "meshes/a.stl").string());
  std::filesystem::remove_all(folder);
}

TEST(Description, ReadsWhatTheRobotHoldsInItsLinksFrame) {
  const Result<Description> read = ParseDescription(
      "held:\n"
      "  - {name: peg, link: hand, shape: cylinder, radius: 0.01, length: 0.1,\n"
      "     position: [0, 0, 0.1], touch: [finger, palm]}\n"
      "  - {name: plate, link: hand, shape: mesh, mesh: a.stl, convex: true, position: [0, 0, "
      "0]}\n",
      "scene.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->held.size(), 2u);
  EXPECT_EQ(read->held[0].link, "hand");
  EXPECT_EQ(read->held[0].link_T_shape.translation.z(), 0.1);
  EXPECT_THAT(read->held[0].touch_links, ::testing::ElementsAre("finger", "palm"));
  EXPECT_TRUE(std::get<kinematics::Mesh>(read->held[1].shape).convex);
  EXPECT_THAT(ErrorOf("held:\n  - {name: a, shape: sphere, radius: 1, position: [0, 0, 0]}\n"),
              AllOf(HasSubstr("held[0].link"), HasSubstr("missing")));
  EXPECT_THAT(
      ErrorOf("held:\n  - {name: a, link: b, shape: sphere, radius: 1, position: [0, 0, 0],\n"
              "     touch: [[c]]}\n"),
      AllOf(HasSubstr("scene.yaml:3"), HasSubstr("held[0].touch[0]")));
  EXPECT_THAT(ErrorOf("obstacles:\n  - {name: a, shape: mesh, mesh: b.stl, convex: maybe, "
                      "position: [0, 0, 0]}\n"),
              AllOf(HasSubstr("obstacles[0].convex"), HasSubstr("true or false")));
}

TEST(Description, ReadsPointCloudsFromTheirFiles) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "exemplar_cloud_test";
  std::filesystem::create_directories(folder);
  const auto read_with = [&](const std::string& points) {
    std::ofstream(folder / "shelf.xyz") << points;
    std::ofstream(folder / "scene.yaml")
        << "clouds:\n  - {name: shelf, file: shelf.xyz, resolution: 0.01, position: [1, 0, 0]}\n";
    return ReadDescription(folder / "scene.yaml");
  };
  const Result<Description> read = read_with("# seen\n0 0 1\n\n  0.5   -1e-1 2 255 0 0\r\n");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->clouds.size(), 1u);
  EXPECT_EQ(read->clouds[0].resolution_m, 0.01);
  ASSERT_EQ(read->clouds[0].cloud_p_points.size(), 2u);
  EXPECT_EQ(read->clouds[0].cloud_p_points[1], Eigen::Vector3d(0.5, -0.1, 2));
  for (const char* wrong : {"0 0 1\n0 0\n", "0 0 1\n0 x 0\n", "0 0 1\n0 nan 0\n"}) {
    EXPECT_THAT(read_with(wrong).error().message,
                AllOf(HasSubstr("scene.yaml:2"), HasSubstr("shelf.xyz:2")));
  }
  EXPECT_THAT(read_with("# nothing\n").error().message, HasSubstr("no points"));
  std::filesystem::remove(folder / "shelf.xyz");
  EXPECT_THAT(ReadDescription(folder / "scene.yaml").error().message,
              AllOf(HasSubstr("clouds[0].file"), HasSubstr("cannot be read")));
  std::filesystem::remove_all(folder);
}

TEST(Description, AMissingFileIsNotFound) {
  const Result<Description> read = ReadDescription("/nowhere/scene.yaml");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(read.error().message, HasSubstr("/nowhere/scene.yaml"));
}

TEST(Description, ReadsObjects) {
  const Result<Description> read = ParseDescription(
      "objects:\n"
      "  - {name: block, shape: box, size: [0.04, 0.05, 0.06], position: [0.5, 0, 0.03],\n"
      "     mass: 0.3, friction: 0.5, marker: {id: 3, size: 0.03, position: [0, 0, 0.03]}}\n"
      "  - {name: tray, shape: cylinder, radius: 0.1, length: 0.004, position: [0.5, 0.2, 0.002],\n"
      "     fixed: true}\n",
      "scene.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->objects.size(), 2u);
  EXPECT_EQ(read->objects[0].mass_kg, 0.3);
  EXPECT_EQ(read->objects[0].friction, 0.5);
  EXPECT_FALSE(read->objects[0].fixed);
  EXPECT_TRUE(read->objects[1].fixed);
  const std::vector<Marked> marked = MarkedThings(*read);
  ASSERT_EQ(marked.size(), 1u);
  EXPECT_EQ(marked[0].name, "block");
}

TEST(Description, RefusesObjectsThatCannotBe) {
  const std::string object =
      "objects:\n  - {name: block, shape: box, size: [1, 1, 1], position: [0, 0, 0], ";
  EXPECT_THAT(ErrorOf(object + "mass: 0}"), AllOf(HasSubstr("scene.yaml:2"), HasSubstr("mass")));
  EXPECT_THAT(ErrorOf(object + "friction: -1}"), HasSubstr("friction"));
  EXPECT_THAT(ErrorOf(object + "fixed: true, mass: 1}"), HasSubstr("fixed object"));
  EXPECT_THAT(ErrorOf(object + "weight: 1}"), HasSubstr("unknown key"));
  EXPECT_THAT(
      ErrorOf("objects:\n  - {name: bowl, shape: mesh, mesh: bowl.stl, position: [0, 0, 0]}"),
      HasSubstr("only a fixed object may be a mesh"));
  EXPECT_THAT(
      ErrorOf("obstacles:\n  - {name: block, shape: sphere, radius: 1, position: [0, 0, 0]}\n" +
              object + "mass: 1}"),
      HasSubstr("taken already"));
}

}  // namespace
}  // namespace exemplar::scene
