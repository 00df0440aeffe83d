#include "exemplar/perception/markers.hpp"

#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "edge_refinement.hpp"

namespace exemplar::perception {
namespace {

cv::Ptr<cv::aruco::Dictionary> Dictionary() {
  return cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50);
}

}  // namespace

Result<MarkerCells> MarkerPattern(int id) {
  if (id < 0 || id >= kMarkerIds) {
    return InvalidArgument(
        "marker id " + std::to_string(id) + " is not in 0 to " + std::to_string(kMarkerIds - 1),
        "marker.id");
  }
  cv::Mat cells_px;  // one pixel a cell
  Dictionary()->drawMarker(id, kMarkerCells, cells_px, 1);
  MarkerCells cells{};
  for (int row = 0; row < kMarkerCells; ++row) {
    for (int column = 0; column < kMarkerCells; ++column) {
      cells[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] =
          cells_px.at<std::uint8_t>(row, column) > 127;
    }
  }
  return cells;
}

std::vector<DetectedMarker> DetectMarkers(const Picture& picture) {
  if (!picture.valid()) return {};
  const cv::Mat rgb(picture.height, picture.width, CV_8UC3,
                    const_cast<std::uint8_t*>(picture.rgb.data()));
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);

  const cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  parameters->cornerRefinementWinSize = 4;
  parameters->cornerRefinementMaxIterations = 50;
  parameters->cornerRefinementMinAccuracy = 0.005;
  parameters->minMarkerPerimeterRate = 0.02;

  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, Dictionary(), corners, ids, parameters);

  const GreyView view{grey.cols, grey.rows, {grey.data, grey.total()}};
  std::map<int, int> seen;
  for (const int id : ids) ++seen[id];
  std::vector<DetectedMarker> markers;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (seen[ids[i]] != 1) continue;
    DetectedMarker marker;
    marker.id = ids[i];
    for (std::size_t c = 0; c < 4; ++c) {
      marker.corners_px[c] = {static_cast<double>(corners[i][c].x),
                              static_cast<double>(corners[i][c].y)};
    }
    RefineCorners(view, kMarkerCells, marker.corners_px);
    markers.push_back(marker);
  }
  return markers;
}

std::array<Eigen::Vector3d, 4> MarkerCorners(double size_m) {
  const double h = 0.5 * size_m;
  return {Eigen::Vector3d(-h, h, 0), Eigen::Vector3d(h, h, 0), Eigen::Vector3d(h, -h, 0),
          Eigen::Vector3d(-h, -h, 0)};
}

}  // namespace exemplar::perception
