#include "static_pose.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/signal/statistics.hpp"

namespace exemplar::learning {
namespace {

constexpr int kBlocks = 6;
/// What stands still may move by this part of the motion's extent.
constexpr double kPartOfExtent = 0.005;

// Medians of each column over `kBlocks` stretches of the samples, and the deviation that noise
// gives them.
struct BlockMedians {
  Eigen::MatrixXd medians;  // blocks x columns
  double noise = 0;         // of one median, all columns together
};

BlockMedians MediansOf(const Eigen::MatrixXd& samples) {
  const Eigen::Index blocks = std::min<Eigen::Index>(kBlocks, samples.rows());
  BlockMedians result;
  result.medians.resize(blocks, samples.cols());
  double variance = 0;
  for (Eigen::Index c = 0; c < samples.cols(); ++c) {
    for (Eigen::Index b = 0; b < blocks; ++b) {
      const Eigen::Index first = b * samples.rows() / blocks;
      const Eigen::Index last = (b + 1) * samples.rows() / blocks;
      result.medians(b, c) = signal::Median(samples.col(c).segment(first, last - first));
    }
    const double noise = signal::NoiseDeviation(samples.col(c));
    variance += noise * noise;
  }
  // The median of n normal values has pi / 2 times the variance of their mean.
  const double per_block = static_cast<double>(samples.rows()) / static_cast<double>(blocks);
  result.noise = std::sqrt(variance * 1.5707963267948966 / per_block);
  return result;
}

double LargestDistance(const Eigen::MatrixXd& points) {
  double largest = 0;
  for (Eigen::Index a = 0; a < points.rows(); ++a) {
    for (Eigen::Index b = a + 1; b < points.rows(); ++b) {
      largest = std::max(largest, (points.row(a) - points.row(b)).norm());
    }
  }
  return largest;
}

Eigen::RowVectorXd ColumnMedians(const Eigen::MatrixXd& samples) {
  Eigen::RowVectorXd medians(samples.cols());
  for (Eigen::Index c = 0; c < samples.cols(); ++c) medians[c] = signal::Median(samples.col(c));
  return medians;
}

/// Whether the positions go one way by more than noise and `most_m` explain. In a few samples a
/// steady motion looks like noise to differences; to what a straight line leaves over it does not.
bool Drifts(const demonstration::PoseSeries& series, double most_m) {
  constexpr double kDeviations = 4;
  const auto n = static_cast<double>(series.size());
  double mean_time = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < series.size(); ++k) {
    mean_time += series.time_s[k] / n;
    mean += series.base_T_frame[k].translation / n;
  }
  double spread = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < series.size(); ++k) {
    const double t = series.time_s[k] - mean_time;
    spread += t * t;
    slope += t * (series.base_T_frame[k].translation - mean);
  }
  if (spread <= 0) return false;
  slope /= spread;
  double rest = 0;
  for (std::size_t k = 0; k < series.size(); ++k) {
    const double t = series.time_s[k] - mean_time;
    rest += (series.base_T_frame[k].translation - mean - t * slope).squaredNorm();
  }
  const double duration_s = series.time_s.back() - series.time_s.front();
  const double deviation = std::sqrt(rest / std::max(1.0, n - 2) / spread) * duration_s;
  return slope.norm() * duration_s > std::max(most_m, kDeviations * deviation);
}

}  // namespace

std::optional<geometry::Pose> StaticPose(const demonstration::PoseSeries& series, double extent_m) {
  constexpr double kNoiseDeviations = 6;
  constexpr double kLeastTurn_rad = 0.02;
  const auto n = static_cast<Eigen::Index>(series.size());
  Eigen::MatrixXd positions(n, 3);
  Eigen::MatrixXd quaternions(n, 4);
  for (Eigen::Index k = 0; k < n; ++k) {
    const geometry::Pose& pose = series.base_T_frame[static_cast<std::size_t>(k)];
    positions.row(k) = pose.translation;
    quaternions.row(k) = pose.rotation.coeffs();
  }
  const BlockMedians position = MediansOf(positions);
  if (LargestDistance(position.medians) >
      std::max(kNoiseDeviations * position.noise, kPartOfExtent * extent_m)) {
    return std::nullopt;
  }
  geometry::Pose pose = geometry::Pose::FromTranslation(ColumnMedians(positions));
  if (!series.has_orientation) return pose;
  const BlockMedians rotation = MediansOf(quaternions);
  // A quaternion moves half as far as the rotation turns.
  if (LargestDistance(rotation.medians) >
      std::max(kNoiseDeviations * rotation.noise, kLeastTurn_rad / 2)) {
    return std::nullopt;
  }
  pose.rotation.coeffs() = ColumnMedians(quaternions).transpose().normalized();
  return pose;
}

std::optional<geometry::Pose> TakenFrom(const demonstration::PoseSeries& series, double extent_m) {
  constexpr double kLeastStill_s = 0.5;
  constexpr std::size_t kLeastSamples = 4;
  const auto part = [&](std::size_t first, std::size_t last) {
    demonstration::PoseSeries cut;
    cut.has_orientation = series.has_orientation;
    const auto begin = static_cast<std::ptrdiff_t>(first);
    const auto end = static_cast<std::ptrdiff_t>(last);
    cut.time_s.assign(series.time_s.begin() + begin, series.time_s.begin() + end);
    cut.base_T_frame.assign(series.base_T_frame.begin() + begin, series.base_T_frame.begin() + end);
    return cut;
  };
  const std::vector<double>& time = series.time_s;
  std::size_t head = 0;
  while (head < time.size() && time[head] < time.front() + kLeastStill_s) ++head;
  std::size_t tail = time.size();
  while (tail > 0 && time[tail - 1] > time.back() - kLeastStill_s) --tail;
  if (head < kLeastSamples || time.size() - tail < kLeastSamples || head > tail) {
    return std::nullopt;
  }
  const demonstration::PoseSeries before = part(0, head);
  const demonstration::PoseSeries after = part(tail, time.size());
  if (Drifts(before, kPartOfExtent * extent_m) || Drifts(after, kPartOfExtent * extent_m) ||
      !StaticPose(after, extent_m)) {
    return std::nullopt;
  }
  return StaticPose(before, extent_m);
}

}  // namespace exemplar::learning
