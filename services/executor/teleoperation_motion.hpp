#pragma once
// One step of teleoperation: from the operator's posture to the next command, with a way to rest
// that is proved clear behind every command.

#include <Eigen/Core>
#include <array>
#include <bitset>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "executor/command_stream.hpp"
#include "executor/teleoperation_joint.hpp"
#include "executor/teleoperation_phase.hpp"
#include "executor/teleoperation_suit.hpp"
#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"

namespace exemplar::executor {

struct TeleoperationOptions {
  /// Room that the commanded robot keeps to itself and to everything that it may not touch.
  double clearance_m = 0.005;
  /// Share of the joints' speed limits on the way to the operator's posture.
  double approach_share = 0.2;
  /// Every joint this near to the operator's: the approach is over.
  double near_rad = 0.05;
  /// A joint further away from the operator's than this: nothing is approached.
  double approach_range_rad = 1.2;
  /// Without a usable sample on ircp/suit for so long the robot holds; the same of the dead-man on
  /// ircp/safety.
  Duration suit_patience = std::chrono::milliseconds(150);
  Duration dead_man_patience = std::chrono::milliseconds(250);
  SuitLimits suit = {};
};

/// Why a robot holds.
enum class HoldReason {
  kNotPressed,     ///< the dead-man was not pressed yet
  kReleased,       ///< the dead-man was released
  kDeadManSilent,  ///< nothing came from it
  kSuitSilent,     ///< nothing usable came from the suit
  kSuitUnknown,    ///< the suit has no joint that drives one of the robot's
  kSuitNotFinite,  ///< the suit asked `joint` for what is no position
  kSuitJumps,      ///< the suit jumped by `value` at `joint`
  kSuitLostJoint,  ///< `joint` is not in the suit's samples any more
  kTooFar,         ///< the operator's posture is `value` away at `joint`
  kEnded,          ///< the mode is over
};

/// What the robot does from now on, and why.
struct PhaseChange {
  Phase phase = Phase::kHolding;
  HoldReason reason = HoldReason::kNotPressed;
  int joint = 0;
  double value = 0;
  int driven = 0;  ///< joints that the suit drives
};

/// What a step is made of beside the suit.
struct StepInput {
  Duration now{0};       ///< steady time
  double elapsed_s = 0;  ///< since the step before
  bool on = false;       ///< the mode goes on; else the robot comes to rest
  bool dead_man_held = false;
  bool dead_man_heard = false;
  std::uint64_t presses = 0;  ///< of the dead-man so far
  double speed = 1;           ///< share of the joints' speed limits
};

/// Thread-compatible. After the first steps neither Take nor Step allocates. Every command and the
/// way to rest behind it were proved to keep the clearance, from the robot itself and from the
/// scene, along straight ways between commanded postures; where the robot is nearer already, as
/// when something was put beside it, it comes no nearer.
class TeleoperationMotion {
 public:
  /// The robot outlives this. `touches` are left out of the proofs.
  TeleoperationMotion(const kinematics::RobotDescription& robot,
                      std::unique_ptr<collision::CollisionChecker> checker,
                      std::vector<collision::AllowedTouch> touches, TeleoperationOptions options);

  /// At rest at `start` (n = chain.dof()); the dead-man counts from the next press on.
  void Begin(const Eigen::Ref<const Eigen::VectorXd>& start, std::uint64_t presses);
  void Take(const SuitPosture& posture);
  /// The next command. Changes of phase are in changes() until the next step.
  const Setpoint& Step(const StepInput& input);

  Phase phase() const { return phase_; }
  std::span<const PhaseChange> changes() const { return {changes_.data(), change_count_}; }
  /// At rest, and coming to nothing else by itself.
  bool resting() const { return phase_ == Phase::kHolding && braked_s_ >= longest_brake_s_; }
  /// The largest way that a driven joint has to go to the operator's posture, and which joint that
  /// is; nothing is heard from the suit: 0.
  double behind_rad() const { return behind_rad_; }
  int behind_joint() const { return behind_joint_; }
  /// Between the suit's samples of late; 0 where it is not known.
  Duration suit_interval() const { return heard_ ? latest_.interval : Duration::zero(); }
  /// Takes another checker (another scene) and gives the one before back.
  std::unique_ptr<collision::CollisionChecker> Exchange(
      std::unique_ptr<collision::CollisionChecker> checker);

 private:
  using Motions = std::array<JointMotion, kMaxJoints>;
  class StepPath;
  struct Aim {
    std::array<double, kMaxJoints> position{};
    std::array<double, kMaxJoints> velocity{};
  };

  std::optional<PhaseChange> WhyHold(const StepInput& input) const;
  std::optional<PhaseChange> WhyNoPosture(Duration now) const;
  void Change(PhaseEvent event, PhaseChange change);
  void TryEngage(const StepInput& input);
  void MeasureBehind();
  Aim AimAt(Duration now) const;
  void Pursue(const StepInput& input);
  /// Goes on to what Follow makes of `aim`, if that is proved. `together`: the joints' limits in
  /// the ratio of their ways, so that from rest they go straight.
  bool Try(const Aim& aim, const StepInput& input, bool together = false);
  bool KeepsLimits(const Motions& next, const std::array<Brake, kMaxJoints>& brakes) const;
  bool KeepsClear(const Motions& next, const std::array<Brake, kMaxJoints>& brakes,
                  double longest_brake_s);
  /// Whether the straight way to the aim leads away from what is near.
  bool LeadsOut(const Aim& aim);
  /// Turns the aim along what is near, where there is anything.
  bool Slide(Aim& aim);
  void Coast(double elapsed_s);
  bool AtRest() const;
  void NoteBlocked(bool blocked, double elapsed_s);

  const kinematics::RobotDescription& robot_;
  const std::size_t dof_;
  std::unique_ptr<collision::CollisionChecker> checker_;
  const std::vector<collision::AllowedTouch> touches_;
  const TeleoperationOptions options_;
  std::vector<FollowLimits> limits_;

  Phase phase_ = Phase::kHolding;
  std::array<PhaseChange, 4> changes_{};
  std::size_t change_count_ = 0;
  HoldReason reason_ = HoldReason::kNotPressed;
  std::uint64_t presses_ = 0;               ///< the last one that was answered
  std::optional<Duration> armed_at_;        ///< pressed, and not engaged yet
  Motions at_{};                            ///< as commanded last
  std::array<Brake, kMaxJoints> brakes_{};  ///< the way to rest from where it was proved last
  double braked_s_ = 0;                     ///< gone along it
  double longest_brake_s_ = 0;
  double nearest_m_;  ///< that the robot has been allowed to come, less than asked
  double share_ = 1;  ///< of the speed, near to what is in the way
  bool out_ = false;  ///< on a straight way out of what is near
  double blocked_s_ = 0;
  double free_s_ = 0;

  SuitPosture latest_;
  bool heard_ = false;
  SuitFault fault_ = SuitFault::kNone;  ///< of any sample since the last step
  int fault_joint_ = 0;
  double fault_way_ = 0;
  std::bitset<kMaxJoints> driven_;         ///< since it was engaged
  std::array<double, kMaxJoints> rest_{};  ///< where joints stay that nothing drives
  double behind_rad_ = 0;
  int behind_joint_ = 0;

  Setpoint setpoint_;
  Motions next_{};
  std::array<Brake, kMaxJoints> next_brakes_{};
  Eigen::VectorXd full_;  ///< joints by index of the model
  Eigen::VectorXd gradient_;
};

}  // namespace exemplar::executor
