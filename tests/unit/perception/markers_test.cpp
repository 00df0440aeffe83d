#include "exemplar/perception/markers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drawing.hpp"

namespace exemplar::perception {
namespace {

/// Facing the camera, its x to the right of the picture.
geometry::Pose Upright(double z) { return {{0.02, 0.01, z}, Eigen::Quaterniond(0, 1, 0, 0)}; }

TEST(Markers, EveryPatternIsRecognisedUprightAndTurned) {
  scene::StereoCamera camera = TestCamera();
  for (int id = 0; id < kMarkerIds; ++id) {
    geometry::Pose pose = Upright(0.8);
    pose.rotation = pose.rotation * geometry::ExpSo3({0, 0, 0.13 * id});
    const std::vector<DetectedMarker> found =
        DetectMarkers(DrawMarker(camera, false, pose, id, 0.12, 2));
    ASSERT_EQ(found.size(), 1u) << "id " << id;
    EXPECT_EQ(found[0].id, id);
    const DetectedMarker expected = CornersSeen(camera, false, pose, id, 0.12);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT((found[0].corners_px[i] - expected.corners_px[i]).norm(), 0.5)
          << "id " << id << " corner " << i;
    }
  }
}

TEST(Markers, PatternsHaveABlackBorder) {
  for (int id = 0; id < kMarkerIds; ++id) {
    const MarkerCells cells = *MarkerPattern(id);
    for (std::size_t i = 0; i < kMarkerCells; ++i) {
      EXPECT_FALSE(cells[0][i] || cells[5][i] || cells[i][0] || cells[i][5]);
    }
  }
}

TEST(Markers, AnIdOutsideTheDictionaryIsAnError) {
  EXPECT_FALSE(MarkerPattern(-1).ok());
  EXPECT_FALSE(MarkerPattern(kMarkerIds).ok());
}

TEST(Markers, CornersAreFoundToATwentiethOfAPixel) {
  const scene::StereoCamera camera = TestCamera();
  Rng rng(3);
  double sum_of_squares = 0;
  int corners = 0;
  for (int i = 0; i < 20; ++i) {
    const geometry::Pose pose = RandomMarkerPose(rng, 0.5);
    const std::vector<DetectedMarker> found =
        DetectMarkers(DrawMarker(camera, false, pose, 7, 0.12));
    ASSERT_EQ(found.size(), 1u) << "picture " << i;
    const DetectedMarker expected = CornersSeen(camera, false, pose, 7, 0.12);
    for (std::size_t c = 0; c < 4; ++c) {
      const double error = (found[0].corners_px[c] - expected.corners_px[c]).norm();
      EXPECT_LT(error, 0.15);
      sum_of_squares += error * error;
      ++corners;
    }
  }
  EXPECT_LT(std::sqrt(sum_of_squares / corners), 0.05);
}

TEST(Markers, AMarkerSeenTwiceIsNotReported) {
  const scene::StereoCamera camera = TestCamera();
  Picture picture =
      DrawMarker(camera, false, {{-0.12, 0, 0.9}, Eigen::Quaterniond(0, 1, 0, 0)}, 5, 0.1, 2);
  const Picture other =
      DrawMarker(camera, false, {{0.12, 0, 0.9}, Eigen::Quaterniond(0, 1, 0, 0)}, 5, 0.1, 2);
  ASSERT_EQ(DetectMarkers(other).size(), 1u);
  for (int y = 0; y < picture.height; ++y) {
    const std::size_t row = 3 * static_cast<std::size_t>(y * picture.width);
    const std::size_t half = 3 * static_cast<std::size_t>(picture.width) / 2;
    std::copy_n(other.rgb.begin() + static_cast<std::ptrdiff_t>(row + half), half,
                picture.rgb.begin() + static_cast<std::ptrdiff_t>(row + half));
  }
  EXPECT_TRUE(DetectMarkers(picture).empty());
}

TEST(Markers, ABlankOrBrokenPictureShowsNothing) {
  EXPECT_TRUE(DetectMarkers(Picture{}).empty());
  EXPECT_TRUE(DetectMarkers(Picture{40, 30, std::vector<std::uint8_t>(3600, 128)}).empty());
  EXPECT_TRUE(DetectMarkers(Picture{1, 1, {0, 0, 0}}).empty());
}

}  // namespace
}  // namespace exemplar::perception
