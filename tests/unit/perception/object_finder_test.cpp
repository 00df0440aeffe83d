#include "exemplar/perception/object_finder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drawing.hpp"

namespace exemplar::perception {
namespace {

using ::testing::HasSubstr;

constexpr int kId = 7;
constexpr double kSize = 0.1;

scene::Button MarkedButton() {
  scene::Button button;
  button.name = "target";
  button.marker =
      scene::Marker{.id = kId,
                    .size_m = kSize,
                    .object_T_marker = {{0.07, 0.01, -0.02}, geometry::ExpSo3({0.1, 0.0, 0.4})}};
  return button;
}

ObjectFinder MakeFinder(FinderOptions options = {}) {
  return *ObjectFinder::Create(TestCamera(), {MarkedButton()}, options);
}

geometry::Pose ObjectOf(const geometry::Pose& left_T_marker) {
  return TestCamera().base_T_left * left_T_marker *
         MarkedButton().marker->object_T_marker.Inverse();
}

std::vector<DetectedMarker> Seen(bool right, const geometry::Pose& left_T_marker) {
  return {CornersSeen(TestCamera(), right, left_T_marker, kId, kSize)};
}

TEST(ObjectFinder, ExactCornersGiveTheExactPose) {
  const ObjectFinder finder = MakeFinder();
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const geometry::Pose left_T_marker = RandomMarkerPose(rng, 0.8);
    const Findings found =
        finder.FindFromCorners(Seen(false, left_T_marker), Seen(true, left_T_marker));
    ASSERT_EQ(found.objects.size(), 1u);
    const geometry::Pose expected = ObjectOf(left_T_marker);
    EXPECT_EQ(found.objects[0].name, "target");
    EXPECT_LT((found.objects[0].base_T_object.translation - expected.translation).norm(), 1e-9);
    EXPECT_LT(geometry::AngleBetween(found.objects[0].base_T_object.rotation, expected.rotation),
              1e-7);
    EXPECT_LT(found.objects[0].residual_px, 1e-8);
  }
}

TEST(ObjectFinder, VariancesTellHowFarOffItIs) {
  constexpr double kNoise = 0.2;
  const ObjectFinder finder = MakeFinder({.corner_sigma_px = kNoise});
  Rng rng(2);
  Eigen::Vector3d normalised = Eigen::Vector3d::Zero();
  constexpr int kRuns = 2000;
  const geometry::Pose left_T_marker = RandomMarkerPose(rng, 0.3);
  const geometry::Pose expected = ObjectOf(left_T_marker);
  int found_count = 0;
  for (int i = 0; i < kRuns; ++i) {
    std::vector<DetectedMarker> left = Seen(false, left_T_marker);
    std::vector<DetectedMarker> right = Seen(true, left_T_marker);
    for (DetectedMarker* marker : {&left[0], &right[0]}) {
      for (Eigen::Vector2d& corner : marker->corners_px) {
        corner += Eigen::Vector2d(rng.Normal(0, kNoise), rng.Normal(0, kNoise));
      }
    }
    const Findings found = finder.FindFromCorners(left, right);
    if (found.objects.empty()) continue;
    ++found_count;
    const Eigen::Vector3d error = found.objects[0].base_T_object.translation - expected.translation;
    normalised += error.cwiseAbs2().cwiseQuotient(found.objects[0].position_variance_m2);
  }
  ASSERT_EQ(found_count, kRuns);
  normalised /= kRuns;
  // 1 when the variances are right; they never count below the option, so a little less here.
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(normalised[axis], 0.7);
    EXPECT_LT(normalised[axis], 1.1);
  }
}

TEST(ObjectFinder, FindsTheObjectInPictures) {
  const ObjectFinder finder = MakeFinder();
  Rng rng(3);
  for (int i = 0; i < 5; ++i) {
    const geometry::Pose left_T_marker = RandomMarkerPose(rng, 0.4);
    const Result<Findings> found =
        finder.Find(DrawMarker(TestCamera(), false, left_T_marker, kId, kSize),
                    DrawMarker(TestCamera(), true, left_T_marker, kId, kSize));
    ASSERT_TRUE(found.ok());
    ASSERT_EQ(found->objects.size(), 1u);
    const geometry::Pose expected = ObjectOf(left_T_marker);
    EXPECT_LT((found->objects[0].base_T_object.translation - expected.translation).norm(), 2e-3);
    EXPECT_LT(geometry::AngleBetween(found->objects[0].base_T_object.rotation, expected.rotation),
              0.03);
  }
}

TEST(ObjectFinder, WhatOneEyeSeesIsCountedAndLeftOut) {
  Rng rng(4);
  const geometry::Pose pose = RandomMarkerPose(rng, 0.3);
  const Findings found = MakeFinder().FindFromCorners(Seen(false, pose), {});
  EXPECT_TRUE(found.objects.empty());
  EXPECT_EQ(found.one_eyed, 1);
  EXPECT_EQ(found.implausible, 0);
}

TEST(ObjectFinder, RowsThatDisagreeAreImplausible) {
  Rng rng(5);
  const geometry::Pose pose = RandomMarkerPose(rng, 0.3);
  std::vector<DetectedMarker> right = Seen(true, pose);
  for (Eigen::Vector2d& corner : right[0].corners_px) corner.y() += 10;
  const Findings found = MakeFinder().FindFromCorners(Seen(false, pose), right);
  EXPECT_TRUE(found.objects.empty());
  EXPECT_EQ(found.implausible, 1);
}

TEST(ObjectFinder, AMarkerOfTheWrongSizeIsImplausible) {
  Rng rng(6);
  const geometry::Pose pose = RandomMarkerPose(rng, 0.3);
  const Findings found =
      MakeFinder().FindFromCorners({CornersSeen(TestCamera(), false, pose, kId, 0.7 * kSize)},
                                   {CornersSeen(TestCamera(), true, pose, kId, 0.7 * kSize)});
  EXPECT_TRUE(found.objects.empty());
  EXPECT_EQ(found.implausible, 1);
}

TEST(ObjectFinder, SwappedPicturesAreImplausible) {
  Rng rng(7);
  const geometry::Pose pose = RandomMarkerPose(rng, 0.3);
  const Findings found = MakeFinder().FindFromCorners(Seen(true, pose), Seen(false, pose));
  EXPECT_TRUE(found.objects.empty());
  EXPECT_EQ(found.implausible, 1);
}

TEST(ObjectFinder, MarkersOfNobodyAreIgnored) {
  Rng rng(8);
  const geometry::Pose pose = RandomMarkerPose(rng, 0.3);
  const Findings found =
      MakeFinder().FindFromCorners({CornersSeen(TestCamera(), false, pose, 9, kSize)},
                                   {CornersSeen(TestCamera(), true, pose, 9, kSize)});
  EXPECT_TRUE(found.objects.empty());
  EXPECT_EQ(found.one_eyed + found.implausible, 0);
}

TEST(ObjectFinder, PicturesOfAnotherSizeAreAnError) {
  const Picture small{16, 16, std::vector<std::uint8_t>(768, 0)};
  const Result<Findings> found = MakeFinder().Find(small, small);
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(found.error().message, HasSubstr("16 x 16"));
  EXPECT_EQ(found.error().field, "left");
}

TEST(ObjectFinder, ASceneWithoutMarkersIsAnError) {
  scene::Button plain;
  plain.name = "plain";
  const Result<ObjectFinder> finder = ObjectFinder::Create(TestCamera(), {plain});
  ASSERT_FALSE(finder.ok());
  EXPECT_THAT(finder.error().message, HasSubstr("no button"));
}

}  // namespace
}  // namespace exemplar::perception
