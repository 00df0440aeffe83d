#include "executor/following_target.hpp"

#include <algorithm>
#include <cmath>

namespace exemplar::executor {
namespace {

/// Of the stretch by which speed is told.
constexpr double kWindow_s = 0.6;
constexpr std::size_t kMostSamples = 120;
/// A sample strays that is further off than noise and this.
constexpr double kStray_m = 1.5e-3;
constexpr double kStraySigmas = 4;
/// Farther from where it was it did not turn: it was put there.
constexpr double kLeap_m = 0.05;
/// So many in a row are a turn.
constexpr int kStrays = 3;
constexpr double kLeastSigma_m = 1e-4;
/// Without so long a stretch nothing is said of the speed.
constexpr double kLeastStretch_s = 0.1;
/// Slower is standing still.
constexpr double kStill_m_s = 2e-3;
/// A speed counts where it is more than so many of its standard deviations.
constexpr double kSpeedSigmas = 4;

double Stray(double sigma_m) { return kStraySigmas * sigma_m + kStray_m; }

}  // namespace

Eigen::Vector3d TargetTrack::StraightAt(Duration time) const {
  return position_ + ToSeconds(time - origin_) * velocity_;
}

void TargetTrack::Add(Duration time, const Eigen::Vector3d& base_p_object, double sigma_m) {
  if (!samples_.empty() && time <= samples_.back().time) return;
  const double sigma = std::max(sigma_m, kLeastSigma_m);
  if (is_known_) {
    const double off = (base_p_object - StraightAt(time)).norm();
    strays_ = off > Stray(sigma) ? strays_ + 1 : 0;
  }
  samples_.push_back({time, base_p_object, sigma});
  if (strays_ >= kStrays) NoteTurn();
  while (samples_.size() > kMostSamples || ToSeconds(time - samples_.front().time) > kWindow_s) {
    samples_.pop_front();
  }
  // While it may be turning the stretch before says where it is.
  if (strays_ == 0) Fit();
}

void TargetTrack::NoteTurn() {
  const Eigen::Vector3d before = velocity_;
  const double speed = before.norm();
  while (samples_.size() > static_cast<std::size_t>(kStrays)) samples_.pop_front();
  strays_ = 0;
  // Had it turned back, it would be twice its way since then off the way on.
  const Eigen::Vector3d direction = before.stableNormalized();
  const Sample& last = samples_.back();
  const double off_m = direction.dot(StraightAt(last.time) - last.base_p);
  const Duration turn = last.time - FromSeconds(speed > 0 ? off_m / (2 * speed) : 0);
  const Eigen::Vector3d corner = StraightAt(turn);
  const bool turned =
      speed >= kStill_m_s && off_m < kLeap_m &&
      std::all_of(samples_.begin(), samples_.end(), [&](const Sample& sample) {
        const Eigen::Vector3d back = corner - ToSeconds(sample.time - turn) * before;
        return sample.time < turn || (sample.base_p - back).norm() < Stray(sample.sigma_m);
      });
  if (!turned) {
    // It was put elsewhere, stops, or begins to move: nothing is known of it but where it is.
    position_ = last.base_p;
    origin_ = last.time;
    velocity_.setZero();
    is_known_ = false;
    along_.setZero();
    low_.reset();
    high_.reset();
    return;
  }
  if (std::abs(along_.dot(direction)) < 0.99) {
    along_ = direction;
    base_p_line_ = corner;
    low_.reset();
    high_.reset();
  }
  (before.dot(along_) > 0 ? high_ : low_) = Along(corner);
  velocity_ = -before;
  position_ = corner;
  origin_ = turn;
}

void TargetTrack::Fit() {
  const std::size_t n = samples_.size();
  const double stretch_s = ToSeconds(samples_.back().time - samples_.front().time);
  if (n < 3 || stretch_s < kLeastStretch_s) {
    if (!is_known_) {
      origin_ = samples_.back().time;
      position_ = samples_.back().base_p;
    }
    return;
  }
  is_known_ = true;
  const Duration middle =
      samples_.front().time + (samples_.back().time - samples_.front().time) / 2;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double mean_t = 0;
  for (const Sample& sample : samples_) {
    mean += sample.base_p / static_cast<double>(n);
    mean_t += ToSeconds(sample.time - middle) / static_cast<double>(n);
  }
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  double spread = 0;
  for (const Sample& sample : samples_) {
    const double t = ToSeconds(sample.time - middle) - mean_t;
    slope += t * (sample.base_p - mean);
    spread += t * t;
  }
  slope /= spread;
  const double slope_sigma = samples_.back().sigma_m / std::sqrt(spread);
  origin_ = middle + FromSeconds(mean_t);
  position_ = mean;
  const bool moves = slope.norm() > std::max(kStill_m_s, kSpeedSigmas * slope_sigma);
  velocity_ = moves ? slope : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

double TargetTrack::Along(const Eigen::Vector3d& base_p) const {
  return along_.dot(base_p - base_p_line_);
}

double TargetTrack::Folded(double along, bool* backwards) const {
  *backwards = false;
  for (int turns = 0; turns < 64; ++turns) {
    if (high_ && along > *high_) {
      along = 2 * *high_ - along;
    } else if (low_ && along < *low_) {
      along = 2 * *low_ - along;
    } else {
      break;
    }
    *backwards = !*backwards;
  }
  return along;
}

Eigen::Vector3d TargetTrack::PositionAt(Duration time) const {
  Eigen::Vector3d straight = StraightAt(time);
  if (turning_points() == 0) return straight;
  const double along = Along(straight);
  bool backwards = false;
  return straight + (Folded(along, &backwards) - along) * along_;
}

Eigen::Vector3d TargetTrack::VelocityAt(Duration time) const {
  if (turning_points() == 0) return velocity_;
  bool backwards = false;
  (void)Folded(Along(StraightAt(time)), &backwards);
  return backwards ? Eigen::Vector3d(-velocity_) : velocity_;
}

bool TargetTrack::TurnsWithin(Duration begin, Duration end) const {
  if (turning_points() == 0) return false;
  constexpr int kLooks = 40;
  const Eigen::Vector3d first = VelocityAt(begin);
  for (int i = 1; i <= kLooks; ++i) {
    if (VelocityAt(begin + (end - begin) * i / kLooks).dot(first) < 0) return true;
  }
  return false;
}

void TargetTracks::Add(const std::string& name, Duration time, const geometry::Pose& base_T_object,
                       double sigma_m) {
  const std::lock_guard lock(mutex_);
  auto& [track, pose] = tracks_[name];
  track.Add(time, base_T_object.translation, sigma_m);
  pose = base_T_object;
}

std::optional<std::pair<TargetTrack, geometry::Pose>> TargetTracks::Find(
    const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = tracks_.find(name);
  if (found == tracks_.end()) return std::nullopt;
  return found->second;
}

}  // namespace exemplar::executor
