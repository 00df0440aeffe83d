#include "executor/teleoperation_suit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace exemplar::executor {
namespace {

/// A suit's own pace counts as long as it is about that of reception.
constexpr double kPaceRange = 2;
/// The pace of what comes in one go says nothing.
constexpr double kShortest_s = 0.002;

}  // namespace

SuitIntake::SuitIntake(JointMap map, std::vector<kinematics::JointLimits> limits,
                       const SuitLimits& suit_limits)
    : map_(std::move(map)), limits_(std::move(limits)), suit_limits_(suit_limits) {}

void SuitIntake::Begin(const std::string& suit) {
  suit_ = suit;
  writer_.clear();
  names_.clear();
  bindings_.clear();
  count_ = 0;
  least_delay_.reset();
  last_stamp_ = Duration(std::numeric_limits<std::int64_t>::min());
  forget_delay_.store(false, std::memory_order_relaxed);
  taken_.store(0, std::memory_order_relaxed);
  left_out_.store(0, std::memory_order_relaxed);
}

std::optional<SuitPosture> SuitIntake::Take(const ircp::SuitSample& sample, std::string_view writer,
                                            Duration steady) {
  const Duration stamp(sample.header.stamp.nanoseconds());
  if (!IsMine(sample, writer) || IsLate(stamp, steady) || stamp <= last_stamp_) {
    left_out_.fetch_add(1, std::memory_order_relaxed);
    return std::nullopt;
  }
  last_stamp_ = stamp;
  if (sample.names != names_) {
    names_ = sample.names;
    bindings_ = map_.Bind(names_);
    count_ = 0;
  }
  taken_.fetch_add(1, std::memory_order_relaxed);
  SuitPosture posture;
  posture.received = steady;
  Map(sample, posture);
  if (posture.fault != SuitFault::kNone) {
    count_ = 0;
    return posture;
  }
  FindJump(posture);
  if (posture.fault != SuitFault::kNone) count_ = 0;
  Keep(posture, stamp);
  AddVelocity(posture);
  return posture;
}

bool SuitIntake::IsMine(const ircp::SuitSample& sample, std::string_view writer) {
  if (suit_.empty()) suit_ = sample.header.source;
  if (sample.header.source != suit_) return false;
  if (writer_ == writer) return true;
  // A suit that was started again is another writer. It counts from the next press on.
  if (!writer_.empty() && !forget_delay_.load(std::memory_order_relaxed)) return false;
  writer_ = writer;
  forget_delay_.store(true, std::memory_order_relaxed);
  count_ = 0;
  return true;
}

bool SuitIntake::IsLate(Duration stamp, Duration steady) {
  if (forget_delay_.exchange(false, std::memory_order_relaxed)) {
    least_delay_.reset();
    last_stamp_ = Duration(std::numeric_limits<std::int64_t>::min());
  }
  const Duration delay = steady - stamp;
  least_delay_ = std::min(least_delay_.value_or(delay), delay);
  return delay - *least_delay_ > suit_limits_.lateness;
}

void SuitIntake::Map(const ircp::SuitSample& sample, SuitPosture& posture) const {
  if (bindings_.empty()) posture.fault = SuitFault::kUnknown;
  for (const JointMap::Binding& binding : bindings_) {
    const auto place = static_cast<std::size_t>(binding.place);
    const auto joint = static_cast<std::size_t>(binding.joint);
    const double value = place < sample.positions.size()
                             ? binding.scale * sample.positions[place] + binding.offset
                             : std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(value)) {
      posture.fault = SuitFault::kNotFinite;
      posture.joint = binding.joint;
      return;
    }
    posture.positions[joint] = value;
    posture.driven.set(joint);
  }
}

void SuitIntake::FindJump(SuitPosture& posture) const {
  if (count_ == 0) return;
  const double apart_s = std::max(ToSeconds(posture.received - kept(0).received), kShortest_s);
  for (const JointMap::Binding& binding : bindings_) {
    const auto joint = static_cast<std::size_t>(binding.joint);
    const double way = std::abs(posture.positions[joint] - kept(0).positions[joint]);
    const double most =
        suit_limits_.jump_factor * limits_[joint].velocity * apart_s + suit_limits_.jump_margin_rad;
    if (way <= most) continue;
    posture.fault = SuitFault::kJump;
    posture.joint = binding.joint;
    posture.way = way;
    return;
  }
}

void SuitIntake::Keep(const SuitPosture& posture, Duration stamp) {
  kept_[next_] = {posture.positions, posture.received, stamp};
  next_ = (next_ + 1) % kKept;
  count_ = std::min(count_ + 1, kKept);
}

void SuitIntake::AddVelocity(SuitPosture& posture) const {
  if (count_ < 2) return;
  const Kept& first = kept(count_ - 1);
  const double heard_s = ToSeconds(kept(0).received - first.received);
  const double said_s = ToSeconds(kept(0).stamp - first.stamp);
  const bool steady = said_s < kPaceRange * heard_s && heard_s < kPaceRange * said_s;
  const double apart_s = steady ? said_s : heard_s;
  const auto intervals = static_cast<double>(count_ - 1);
  if (apart_s < intervals * kShortest_s) return;
  posture.interval = FromSeconds(apart_s / intervals);
  for (const JointMap::Binding& binding : bindings_) {
    const auto joint = static_cast<std::size_t>(binding.joint);
    posture.velocities[joint] = (posture.positions[joint] - first.positions[joint]) / apart_s;
  }
}

}  // namespace exemplar::executor
