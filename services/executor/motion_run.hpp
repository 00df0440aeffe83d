#pragma once
// One execution: the path being run through, and what is measured on the way.

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "executor/command_stream.hpp"
#include "executor/guard.hpp"
#include "executor/lateness.hpp"
#include "executor/monitor.hpp"
#include "executor/path_player.hpp"
#include "executor/robot_view.hpp"
#include "executor/state_machine.hpp"

namespace exemplar::executor {

/// From full speed to rest along the path, and back, where the joints' limits allow it; else as
/// soon as they do. Faults, stops and emergencies: the shorter.
inline constexpr double kPauseRamp_s = 0.3;
inline constexpr double kStopRamp_s = 0.12;
/// The last posture goes on being commanded for so long, so that the robot arrives in it.
inline constexpr double kSettle_s = 0.3;
/// And so much longer at the end of the path, where it has not arrived by then.
inline constexpr double kArrivalPatience_s = 0.7;

/// Leads a motion away from its path while it is run through. Correct belongs to the control loop:
/// it neither allocates nor waits.
class PathFollower {
 public:
  virtual ~PathFollower() = default;
  /// Changes what the path asks for at `path_time_s` of the plan, run through at `rate`,
  /// `elapsed_s` after the call before.
  virtual void Correct(double path_time_s, double rate, double elapsed_s,
                       Eigen::Ref<Eigen::VectorXd> position,
                       Eigen::Ref<Eigen::VectorXd> velocity) = 0;
  /// The press at this place of the path met its touch: it is to lift off. Of the control loop.
  virtual void LiftOff(double path_time_s) = 0;
  /// What is wrong, if anything.
  virtual std::optional<std::string> Problem() const = 0;
};

/// Three threads meet here: Tick and AddLateness belong to the control loop, Measure to the
/// network, Watch and Report to whoever watches. Each is safe beside the others.
class MotionRun {
 public:
  /// `zones`: presses that end by touch, in the order of their time.
  MotionRun(const kinematics::RobotDescription& robot, motion::PlannedMotion plan,
            collision::CollisionChecker checker, const WatchLimits& limits,
            std::vector<GuardZone> zones = {});
  MotionRun(const MotionRun&) = delete;
  MotionRun& operator=(const MotionRun&) = delete;

  /// Before the first Tick, if at all. It outlives the ticks.
  void SetFollower(PathFollower* follower) { follower_ = follower; }
  const PathFollower* follower() const { return follower_; }
  const motion::PlannedMotion& plan() const { return plan_; }
  /// One cycle of the control loop, `elapsed_s` after the one before. Does not allocate.
  const Setpoint& Tick(double elapsed_s, State state, double speed);
  void AddLateness(Duration lateness) { lateness_.Add(lateness); }
  /// The end is reached, or rest after a stop, and the robot had time to arrive. Set by Tick.
  bool finished() const { return finished_.load(std::memory_order_acquire); }
  double path_time_s() const { return path_time_s_.load(std::memory_order_relaxed); }
  double duration_s() const { return plan_.trajectory.duration_s(); }
  Eigen::VectorXd commanded() const;

  /// The first press that met no touch, once it is past; else null.
  const GuardZone* missed() const;
  /// Whether the robot was measured where the motion ends, or which joint was not.
  std::optional<std::string> not_arrived() const;

  /// `sent`: commands, of all motions.
  void Measure(const MeasuredState& state, std::uint64_t sent = 0);

  /// Takes what was measured since into the figures; says what is wrong, if anything.
  std::optional<std::string> Watch();
  /// Objects are elsewhere now; beside Watch on the same thread.
  Status SetScene(collision::Scene scene) { return monitor_.SetScene(std::move(scene)); }
  bool has_unwatched() const;
  double tracking_error_rad() const { return tracking_rad_.load(std::memory_order_relaxed); }
  double touch_n() const { return touch_n_.load(std::memory_order_relaxed); }
  /// Precondition: finished() and nothing unwatched.
  void Report(api::ExecutionResult& result) const;

 private:
  static constexpr std::size_t kMaxUnwatched = 1024;

  /// What leads over from the way in to the way out of a press that met its touch, on the plan's
  /// time from begin_s on: added to the path.
  struct Splice {
    double begin_s = 0;
    double duration_s = 0;  ///< 0: none
    Eigen::VectorXd offset, slope_per_s;
  };
  void FollowGuard(State state);
  void BeginSplice(double leave_s);
  void AddSplice();

  const motion::PlannedMotion plan_;
  const std::vector<GuardZone> zones_;
  PathPlayer player_;
  PathFollower* follower_ = nullptr;
  std::size_t zone_ = 0;  ///< the next one
  Splice splice_;
  Setpoint setpoint_;
  Eigen::VectorXd position_, velocity_;
  double settled_s_ = 0;
  double elapsed_s_ = 0;
  LatenessHistogram lateness_;

  std::atomic<bool> finished_{false};
  std::atomic<bool> arrived_{true};
  std::atomic<double> speed_share_{1};
  std::atomic<int> missed_{-1};
  std::atomic<double> path_time_s_{0};
  std::atomic<double> tracking_rad_{0};
  std::atomic<double> touch_n_{0};

  mutable std::mutex mutex_;  ///< guards what follows
  Eigen::VectorXd commanded_;
  double commanded_elapsed_s_ = 0;
  std::vector<Measurement> measured_;
  bool watching_ = false;
  std::optional<std::string> not_arrived_;

  Monitor monitor_;  ///< Watch and Report only
};

}  // namespace exemplar::executor
