#include "executor/teleoperation_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace exemplar::executor {
namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();
/// After a press everything else has to be there within this.
constexpr Duration kArmed = std::chrono::milliseconds(500);
/// The operator's motion is guessed so many intervals of the suit beyond its last sample, and never
/// longer than that.
constexpr double kGuessIntervals = 1.5;
constexpr double kLongestGuess_s = 0.05;
/// The last of a joint's range is left to what rounds.
constexpr double kRangeMargin_rad = 1e-3;
/// Where something is in the way: each failure halves the speed down to this share, success lets it
/// grow again.
constexpr double kLeastShare = 0.02;
constexpr double kShareGrowth_per_s = 2;
/// So long without a way on, and with one again.
constexpr double kBlocked_s = 0.1;
constexpr double kFree_s = 0.1;
/// Bodies within so much more than the clearance turn the motion aside.
constexpr double kSlideWithin_m = 0.01;
constexpr double kStill_rad_s = 1e-3;
/// Who is at the clearance, or nearer already, may come so much nearer still: what proofs round,
/// who tell ways apart down to twice that.
constexpr double kRounding_m = 6e-5;

}  // namespace

/// The straight way to the next command (from 0 to 1), and the way to rest behind it (1 and its
/// seconds).
class TeleoperationMotion::StepPath final : public collision::JointPath {
 public:
  StepPath(const TeleoperationMotion& motion, const Motions& next,
           const std::array<Brake, kMaxJoints>& brakes)
      : motion_(motion), next_(next), brakes_(brakes) {}

  void Position(double s, Eigen::Ref<Eigen::VectorXd> q) const override {
    q = motion_.full_;
    ForEach([&](std::size_t j, int index) {
      q[index] = s < 1 ? From(j) + s * Way(j) : brakes_[j].At(s - 1).position;
    });
  }

  void Travel(double s0, double s1, Eigen::Ref<Eigen::VectorXd> travel) const override {
    ForEach([&](std::size_t j, int index) {
      double way = 0;
      if (s0 < 1) way += (std::min(s1, 1.0) - s0) * std::abs(Way(j));
      if (s1 > 1) way += brakes_[j].Travel(std::max(s0, 1.0) - 1, s1 - 1);
      travel[index] = way;
    });
  }

 private:
  double From(std::size_t j) const { return motion_.at_[j].position; }
  double Way(std::size_t j) const { return next_[j].position - From(j); }
  template <class Visit>
  void ForEach(Visit&& visit) const {
    const std::vector<int>& indices = motion_.robot_.chain.joint_indices();
    for (std::size_t j = 0; j < motion_.dof_; ++j) visit(j, indices[j]);
  }

  const TeleoperationMotion& motion_;
  const Motions& next_;
  const std::array<Brake, kMaxJoints>& brakes_;
};

TeleoperationMotion::TeleoperationMotion(const kinematics::RobotDescription& robot,
                                         std::unique_ptr<collision::CollisionChecker> checker,
                                         std::vector<collision::AllowedTouch> touches,
                                         TeleoperationOptions options)
    : robot_(robot),
      dof_(static_cast<std::size_t>(robot.chain.dof())),
      checker_(std::move(checker)),
      touches_(std::move(touches)),
      options_(options),
      nearest_m_(kNever),
      full_(kinematics::FullJointVector(robot.model, robot.chain, robot.home)),
      gradient_(full_) {
  for (const kinematics::JointLimits& joint : robot.chain.limits()) {
    limits_.push_back(LimitsFor(joint));
  }
}

void TeleoperationMotion::Begin(const Eigen::Ref<const Eigen::VectorXd>& start,
                                std::uint64_t presses) {
  phase_ = Phase::kHolding;
  reason_ = HoldReason::kNotPressed;
  change_count_ = 0;
  presses_ = presses;
  armed_at_.reset();
  heard_ = false;
  latest_ = {};
  fault_ = SuitFault::kNone;
  driven_.reset();
  nearest_m_ = kNever;
  share_ = 1;
  out_ = false;
  braked_s_ = longest_brake_s_ = 0;
  for (std::size_t j = 0; j < dof_; ++j) {
    at_[j] = {start[static_cast<Eigen::Index>(j)], 0, 0};
    brakes_[j] = Brake(at_[j], limits_[j]);
    rest_[j] = at_[j].position;
    setpoint_.positions[j] = at_[j].position;
    setpoint_.velocities[j] = 0;
  }
}

void TeleoperationMotion::Take(const SuitPosture& posture) {
  if (posture.fault != SuitFault::kNone) {
    fault_ = posture.fault;
    fault_joint_ = posture.joint;
    fault_way_ = posture.way;
  }
  latest_ = posture;
  heard_ = posture.fault == SuitFault::kNone || posture.fault == SuitFault::kJump;
}

std::unique_ptr<collision::CollisionChecker> TeleoperationMotion::Exchange(
    std::unique_ptr<collision::CollisionChecker> checker) {
  checker_.swap(checker);
  return checker;
}

const Setpoint& TeleoperationMotion::Step(const StepInput& input) {
  change_count_ = 0;
  if (phase_ != Phase::kHolding) {
    if (const std::optional<PhaseChange> hold = WhyHold(input)) Change(PhaseEvent::kHold, *hold);
  } else {
    TryEngage(input);
  }
  fault_ = SuitFault::kNone;
  MeasureBehind();
  if (phase_ == Phase::kHolding) {
    Coast(input.elapsed_s);
  } else {
    if (phase_ == Phase::kApproaching && behind_rad_ <= options_.near_rad) {
      Change(PhaseEvent::kArrive, {});
    }
    Pursue(input);
  }
  for (std::size_t j = 0; j < dof_; ++j) {
    setpoint_.positions[j] = at_[j].position;
    setpoint_.velocities[j] = at_[j].velocity;
  }
  return setpoint_;
}

void TeleoperationMotion::Change(PhaseEvent event, PhaseChange change) {
  const std::optional<Phase> next = Next(phase_, event);
  if (!next) return;
  phase_ = *next;
  change.phase = phase_;
  change.driven = static_cast<int>(driven_.count());
  if (phase_ == Phase::kHolding) reason_ = change.reason;
  blocked_s_ = free_s_ = 0;
  if (change_count_ < changes_.size()) changes_[change_count_++] = change;
}

std::optional<PhaseChange> TeleoperationMotion::WhyNoPosture(Duration now) const {
  const auto because = [](HoldReason reason, int joint = 0, double value = 0) {
    return PhaseChange{Phase::kHolding, reason, joint, value, 0};
  };
  const bool unusable = !heard_ && now - latest_.received <= options_.suit_patience;
  const SuitFault fault = fault_ == SuitFault::kNone && unusable ? latest_.fault : fault_;
  if (fault == SuitFault::kUnknown) return because(HoldReason::kSuitUnknown);
  if (fault == SuitFault::kNotFinite) return because(HoldReason::kSuitNotFinite, fault_joint_);
  if (fault_ == SuitFault::kJump) return because(HoldReason::kSuitJumps, fault_joint_, fault_way_);
  if (!heard_ || now - latest_.received > options_.suit_patience) {
    return because(HoldReason::kSuitSilent);
  }
  return std::nullopt;
}

std::optional<PhaseChange> TeleoperationMotion::WhyHold(const StepInput& input) const {
  const auto because = [](HoldReason reason, int joint = 0) {
    return PhaseChange{Phase::kHolding, reason, joint, 0, 0};
  };
  if (!input.on) return because(HoldReason::kEnded);
  if (!input.dead_man_heard) return because(HoldReason::kDeadManSilent);
  if (!input.dead_man_held || input.presses != presses_) return because(HoldReason::kReleased);
  if (const std::optional<PhaseChange> wrong = WhyNoPosture(input.now)) return wrong;
  const std::bitset<kMaxJoints> lost = driven_ & ~latest_.driven;
  for (std::size_t j = 0; lost.any() && j < dof_; ++j) {
    if (lost[j]) return because(HoldReason::kSuitLostJoint, static_cast<int>(j));
  }
  return std::nullopt;
}

void TeleoperationMotion::TryEngage(const StepInput& input) {
  const auto refuse = [this](PhaseChange why) {
    armed_at_.reset();
    Change(PhaseEvent::kHold, why);
  };
  if (!input.on) {
    if (reason_ != HoldReason::kEnded) refuse({Phase::kHolding, HoldReason::kEnded, 0, 0, 0});
    return;
  }
  if (input.presses != presses_) {
    presses_ = input.presses;
    armed_at_ = input.now;
  }
  if (!armed_at_) return;
  if (!input.dead_man_held) return refuse({Phase::kHolding, HoldReason::kReleased, 0, 0, 0});
  // Where the operator stands counts from the press on: an earlier sample may be that of a suit
  // which is gone.
  const bool fresh = latest_.received >= *armed_at_;
  const std::optional<PhaseChange> wrong = WhyNoPosture(input.now);
  if (wrong || !fresh || !resting()) {
    if (input.now - *armed_at_ <= kArmed) return;
    const HoldReason otherwise = fresh ? reason_ : HoldReason::kSuitSilent;
    return refuse(wrong.value_or(PhaseChange{Phase::kHolding, otherwise, 0, 0, 0}));
  }
  driven_ = latest_.driven;
  MeasureBehind();
  if (behind_rad_ > options_.approach_range_rad) {
    driven_.reset();
    return refuse({Phase::kHolding, HoldReason::kTooFar, behind_joint_, behind_rad_, 0});
  }
  for (std::size_t j = 0; j < dof_; ++j) rest_[j] = at_[j].position;
  armed_at_.reset();
  share_ = 1;
  Change(PhaseEvent::kEngage, {});
}

void TeleoperationMotion::MeasureBehind() {
  behind_rad_ = 0;
  const std::bitset<kMaxJoints>& driven = driven_.any() ? driven_ : latest_.driven;
  for (std::size_t j = 0; heard_ && j < dof_; ++j) {
    if (!driven[j]) continue;
    const kinematics::JointLimits& range = robot_.chain.limits()[j];
    const double target = std::clamp(latest_.positions[j], range.lower, range.upper);
    const double way = std::abs(target - at_[j].position);
    if (way <= behind_rad_) continue;
    behind_rad_ = way;
    behind_joint_ = static_cast<int>(j);
  }
}

TeleoperationMotion::Aim TeleoperationMotion::AimAt(Duration now) const {
  const double age_s = std::max(0.0, ToSeconds(now - latest_.received));
  const double most_s = std::min(kLongestGuess_s, kGuessIntervals * ToSeconds(latest_.interval));
  Aim aim;
  for (std::size_t j = 0; j < dof_; ++j) {
    if (!driven_[j]) {
      aim.position[j] = rest_[j];
      continue;
    }
    aim.position[j] = latest_.positions[j] + std::min(age_s, most_s) * latest_.velocities[j];
    aim.velocity[j] = age_s < most_s ? latest_.velocities[j] : 0.0;
    const kinematics::JointLimits& range = robot_.chain.limits()[j];
    const double inside =
        std::clamp(aim.position[j], range.lower + kRangeMargin_rad, range.upper - kRangeMargin_rad);
    if (inside != aim.position[j]) aim.velocity[j] = 0;
    aim.position[j] = inside;
  }
  return aim;
}

void TeleoperationMotion::Pursue(const StepInput& input) {
  Aim aim = AimAt(input.now);
  if (out_) {
    out_ = LeadsOut(aim) && Try(aim, input, /*together=*/true);
    if (out_) {
      share_ = std::min(1.0, share_ + kShareGrowth_per_s * input.elapsed_s);
      return NoteBlocked(false, input.elapsed_s);
    }
  }
  if (Try(aim, input)) {
    share_ = std::min(1.0, share_ + kShareGrowth_per_s * input.elapsed_s);
    return NoteBlocked(false, input.elapsed_s);
  }
  // Joints that set off each as quickly as it may begin with coming nearer; together they go
  // straight.
  if (AtRest() && LeadsOut(aim) && Try(aim, input, /*together=*/true)) {
    out_ = true;
    return NoteBlocked(false, input.elapsed_s);
  }
  NoteBlocked(true, input.elapsed_s);
  if (Slide(aim) && Try(aim, input)) return;
  share_ = std::max(kLeastShare, share_ / 2);
  Coast(input.elapsed_s);
}

bool TeleoperationMotion::Try(const Aim& aim, const StepInput& input, bool together) {
  const bool slow = phase_ != Phase::kFollowing;
  const double share = share_ * input.speed * (slow ? options_.approach_share : 1.0);
  double longest_way = 0;
  for (std::size_t j = 0; together && j < dof_; ++j) {
    longest_way = std::max(longest_way, std::abs(aim.position[j] - at_[j].position));
  }
  double longest_s = 0;
  for (std::size_t j = 0; j < dof_; ++j) {
    FollowLimits limits = limits_[j];
    limits.velocity *= share;
    if (longest_way > 0) {
      const double part = std::abs(aim.position[j] - at_[j].position) / longest_way;
      limits.velocity *= part;
      limits.acceleration *= part;
      limits.jerk *= part;
    }
    next_[j] = Follow(at_[j], aim.position[j], aim.velocity[j], limits, input.elapsed_s);
    next_brakes_[j] = Brake(next_[j], limits_[j]);
    longest_s = std::max(longest_s, next_brakes_[j].duration_s());
  }
  if (!KeepsLimits(next_, next_brakes_) || !KeepsClear(next_, next_brakes_, longest_s)) {
    return false;
  }
  at_ = next_;
  brakes_ = next_brakes_;
  braked_s_ = 0;
  longest_brake_s_ = longest_s;
  return true;
}

bool TeleoperationMotion::KeepsLimits(const Motions& next,
                                      const std::array<Brake, kMaxJoints>& brakes) const {
  for (std::size_t j = 0; j < dof_; ++j) {
    const kinematics::JointLimits& range = robot_.chain.limits()[j];
    // Who is outside comes back, or stays.
    if (brakes[j].lowest() < std::min(range.lower, at_[j].position) ||
        brakes[j].highest() > std::max(range.upper, at_[j].position) ||
        !std::isfinite(next[j].position)) {
      return false;
    }
  }
  return true;
}

bool TeleoperationMotion::KeepsClear(const Motions& next,
                                     const std::array<Brake, kMaxJoints>& brakes,
                                     double longest_brake_s) {
  const StepPath path(*this, next, brakes);
  const double end = 1 + longest_brake_s;
  if (checker_->KeepsClear(path, 0, end, options_.clearance_m, touches_)) {
    nearest_m_ = kNever;
    return true;
  }
  path.Position(0, full_);
  const double now_m = checker_->SmallestDistance(full_, touches_);
  // At the clearance itself nothing could be proved, not even the way out.
  if (now_m >= options_.clearance_m + 2 * kRounding_m) return false;
  nearest_m_ = std::max(nearest_m_, std::min(now_m, options_.clearance_m));
  if (checker_->KeepsClear(path, 0, end, nearest_m_ - kRounding_m, touches_)) return true;
  // Who has come that much nearer could not prove even the way out. It is free where command and
  // rest behind it are no nearer than now.
  for (const double s : {1.0, end}) {
    path.Position(s, full_);
    if (checker_->SmallestDistance(full_, touches_) < now_m) return false;
  }
  return checker_->KeepsClear(path, 0, end, now_m - 2 * kRounding_m, touches_);
}

bool TeleoperationMotion::LeadsOut(const Aim& aim) {
  const std::vector<int>& indices = robot_.chain.joint_indices();
  for (std::size_t j = 0; j < dof_; ++j) full_[indices[j]] = at_[j].position;
  const double cost =
      checker_->NearnessCost(full_, options_.clearance_m + kSlideWithin_m, touches_, &gradient_);
  double along = 0;
  for (std::size_t j = 0; j < dof_; ++j) {
    along += gradient_[indices[j]] * (aim.position[j] - at_[j].position);
  }
  return cost > 0 && along < 0;
}

bool TeleoperationMotion::Slide(Aim& aim) {
  const std::vector<int>& indices = robot_.chain.joint_indices();
  for (std::size_t j = 0; j < dof_; ++j) full_[indices[j]] = at_[j].position;
  const double cost =
      checker_->NearnessCost(full_, options_.clearance_m + kSlideWithin_m, touches_, &gradient_);
  if (cost <= 0) return false;
  double along = 0;
  double moving = 0;
  double size = 0;
  for (std::size_t j = 0; j < dof_; ++j) {
    const double slope = gradient_[indices[j]];
    along += slope * (aim.position[j] - at_[j].position);
    moving += slope * aim.velocity[j];
    size += slope * slope;
  }
  if (size < 1e-18 || along <= 0) return false;
  for (std::size_t j = 0; j < dof_; ++j) {
    const double slope = gradient_[indices[j]];
    aim.position[j] -= along / size * slope;
    if (moving > 0) aim.velocity[j] -= moving / size * slope;
  }
  return true;
}

void TeleoperationMotion::Coast(double elapsed_s) {
  braked_s_ += elapsed_s;
  for (std::size_t j = 0; j < dof_; ++j) at_[j] = brakes_[j].At(braked_s_);
}

bool TeleoperationMotion::AtRest() const {
  return std::all_of(
      at_.begin(), at_.begin() + static_cast<std::ptrdiff_t>(dof_),
      [](const JointMotion& joint) { return std::abs(joint.velocity) < kStill_rad_s; });
}

void TeleoperationMotion::NoteBlocked(bool blocked, double elapsed_s) {
  blocked_s_ = blocked ? blocked_s_ + elapsed_s : std::max(0.0, blocked_s_ - elapsed_s);
  free_s_ = blocked ? 0 : free_s_ + elapsed_s;
  if (phase_ == Phase::kBlocked) {
    if (free_s_ >= kFree_s) Change(PhaseEvent::kFree, {});
  } else if (blocked_s_ >= kBlocked_s && AtRest()) {
    Change(PhaseEvent::kBlock, {});
  }
}

}  // namespace exemplar::executor
