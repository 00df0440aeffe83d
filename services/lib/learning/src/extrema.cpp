#include <algorithm>
#include <cmath>

#include "exemplar/learning/segmentation.hpp"

namespace exemplar::learning {
namespace {

// Both ways, to the turn and from it, make at least this part of the joint's range.
constexpr double kLeastWay = 0.15;
// A joint whose range is below this part of the widest one's only follows.
constexpr double kLeastRange = 0.15;
// Within this part of the smaller way from the extremum a joint has not left it.
constexpr double kStillThere = 0.01;
// It rests there if it stays for this long; the marker is then the end of the rest.
constexpr double kRest_s = 0.35;
// Turns of several joints this near to each other are one.
constexpr double kTogether_s = 0.1;

struct Turn {
  int frame = 0;
  double part = 0;  // of the range
  Eigen::Index channel = 0;
};

// Turning points between which the series moves by at least `least`, the first and the last sample
// among them.
std::vector<int> ZigZag(const Eigen::Ref<const Eigen::VectorXd>& x, double least) {
  std::vector<int> turns = {0};
  int highest = 0;
  int lowest = 0;
  int direction = 0;  // of the way that is under way; 0: none yet
  for (int t = 1; t < static_cast<int>(x.size()); ++t) {
    if (direction >= 0 && x[t] > x[highest]) highest = t;
    if (direction <= 0 && x[t] < x[lowest]) lowest = t;
    if (direction <= 0 && x[t] - x[lowest] >= least) {
      if (direction < 0) turns.push_back(lowest);
      direction = 1;
      highest = t;
    } else if (direction >= 0 && x[highest] - x[t] >= least) {
      if (direction > 0) turns.push_back(highest);
      direction = -1;
      lowest = t;
    }
  }
  turns.push_back(static_cast<int>(x.size()) - 1);
  return turns;
}

Eigen::MatrixXd Channels(const UniformTrial& trial) {
  if (trial.joints.cols() > 0) return trial.joints;
  Eigen::MatrixXd positions(static_cast<Eigen::Index>(trial.base_T_tool.size()), 3);
  for (std::size_t k = 0; k < trial.base_T_tool.size(); ++k) {
    positions.row(static_cast<Eigen::Index>(k)) = trial.base_T_tool[k].translation.transpose();
  }
  return positions;
}

std::string ChannelName(const UniformTrial& trial, Eigen::Index channel) {
  if (trial.joints.cols() > 0) return trial.joint_names[static_cast<std::size_t>(channel)];
  return std::string("tool ") + "xyz"[channel];
}

}  // namespace

std::vector<Marker> FindExtrema(const UniformTrial& trial) {
  const Eigen::MatrixXd channels = Channels(trial);
  if (channels.rows() < 3) return {};
  const Eigen::RowVectorXd range = channels.colwise().maxCoeff() - channels.colwise().minCoeff();
  std::vector<Turn> turns;
  for (Eigen::Index c = 0; c < channels.cols(); ++c) {
    if (!(range[c] > 0) || range[c] < kLeastRange * range.maxCoeff()) continue;
    const Eigen::VectorXd x = channels.col(c);
    const std::vector<int> zigzag = ZigZag(x, kLeastWay * range[c]);
    for (std::size_t k = 1; k + 1 < zigzag.size(); ++k) {
      const int at = zigzag[k];
      const double way =
          std::min(std::abs(x[at] - x[zigzag[k - 1]]), std::abs(x[at] - x[zigzag[k + 1]]));
      const auto still = [&](int t) { return std::abs(x[t] - x[at]) <= kStillThere * way; };
      int first = at;
      int last = at;
      while (first > zigzag[k - 1] && still(first - 1)) --first;
      while (last < zigzag[k + 1] && still(last + 1)) ++last;
      const bool rests = trial.time_s[static_cast<std::size_t>(last)] -
                             trial.time_s[static_cast<std::size_t>(first)] >
                         kRest_s;
      turns.push_back({rests ? last : at, way / range[c], c});
    }
  }
  std::sort(turns.begin(), turns.end(), [](const Turn& a, const Turn& b) {
    return a.frame != b.frame ? a.frame < b.frame : a.part > b.part;
  });
  std::vector<Marker> markers;
  for (const Turn& turn : turns) {
    const Marker marker{trial.time_s[static_cast<std::size_t>(turn.frame)], turn.frame,
                        MarkerKind::kBeginning, "extremum of " + ChannelName(trial, turn.channel),
                        turn.part};
    if (!markers.empty() && marker.time_s - markers.back().time_s < kTogether_s) {
      if (marker.score > markers.back().score) markers.back() = marker;
      continue;
    }
    markers.push_back(marker);
  }
  return markers;
}

}  // namespace exemplar::learning
