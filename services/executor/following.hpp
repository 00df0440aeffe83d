#pragma once
// Following a moving target: the motion is planned to where the target will be, its path corrected
// each tick within what is proved to be clear, while a full plan is made anew beside it and blended
// in once it is checked.

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "executor/following_path.hpp"
#include "executor/following_target.hpp"
#include "executor/motion_run.hpp"
#include "executor/planner.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"

namespace exemplar::executor {

struct FollowingOptions {
  double fastest_m_s = 0.25;
  /// Not seen for so long: lost.
  Duration lost_patience = std::chrono::milliseconds(500);
  /// From one full plan's begin to the next one's, at least.
  Duration plan_again = std::chrono::milliseconds(150);
  /// At the contact the target may be so far from where the motion can be led.
  double largest_miss_m = 0.012;
  /// From a command to the robot's being there.
  Duration servo_lag = std::chrono::milliseconds(20);
  /// The motion begins so much later at most, so that the target does not turn back in the touch.
  double longest_wait_s = 8;
  /// A target that was seen to turn at one end is watched for so long at most until it turned at
  /// the other.
  double longest_watch_s = 12;
  /// A press of a moving target looks for touch no longer than this: it goes faster where needed.
  double longest_press_s = 0.4;
};

/// A plan that meets a moving target.
struct FollowingPlan {
  Planned planned;
  Duration start{0};  ///< when it has to begin, on the steady clock
  std::string target;
  Eigen::Vector3d object_p_contact =
      Eigen::Vector3d::Zero();  ///< base axes, from the target's origin
  TargetTimes times;
  double over_s = 0;                 ///< so long, on the motion's time, the target may not turn
  std::optional<TargetPress> press;  ///< where it ends by touch
  FollowedPath path;
  Eigen::VectorXd lever_m;  ///< of each joint of the chain, as CollisionChecker::LongestLevers
};

/// Makes plans for moving targets. Thread-safe.
class FollowingPlanner {
 public:
  /// The arguments outlive it.
  FollowingPlanner(const Clock& clock, const Planner& planner, const TargetTracks& tracks,
                   const kinematics::RobotDescription& robot, FollowingOptions options)
      : clock_(clock), planner_(planner), tracks_(tracks), robot_(robot), options_(options) {}

  /// Refuses what is not seen, too fast, or out of reach where it will be.
  Result<FollowingPlan> Plan(const api::ExecuteRequest& request,
                             const std::optional<Eigen::VectorXd>& last_command,
                             const std::stop_token& stop) const;

  /// The same motion to where the target will be as it is seen now, from where `first` began, as if
  /// that had begun at `start`, so that it meets the target at the same time.
  Result<FollowingPlan> Again(const api::ExecuteRequest& request, const std::string& target,
                              const motion::PlannedMotion& first, const TargetTimes& times,
                              bool guarded, Duration start, const std::stop_token& stop) const;

  Result<std::pair<TargetTrack, geometry::Pose>> Seen(const std::string& target) const;
  const FollowingOptions& options() const { return options_; }
  const TargetTracks& tracks() const { return tracks_; }
  double required_clearance_m() const { return planner_.options().plan.required_clearance_m; }

 private:
  Result<FollowingPlan> PlanFor(const api::ExecuteRequest& request, const std::string& target,
                                const TargetTrack& track, const geometry::Pose& seen,
                                Duration contact, const std::vector<double>& frame_time_s,
                                const std::optional<Eigen::VectorXd>& from,
                                std::optional<bool> guarded,
                                const std::optional<Eigen::VectorXd>& last_command,
                                const std::stop_token& stop) const;
  /// What belongs to the plan's path, and its proof; false where a touch would not find a way out.
  bool Complete(const TargetTrack& track, FollowingPlan& plan) const;

  const Clock& clock_;
  const Planner& planner_;
  const TargetTracks& tracks_;
  const kinematics::RobotDescription& robot_;
  const FollowingOptions options_;
};

/// One motion that follows. Take belongs to the network, Correct to the control loop; both are safe
/// beside the thread that plans anew.
class Following final : public PathFollower {
 public:
  /// Keeps references, but not to `plan` and the motion that it made.
  Following(const Clock& clock, Log& log, const FollowingPlanner& planner,
            const kinematics::RobotDescription& robot, api::ExecuteRequest request,
            const FollowingPlan& plan, const motion::PlannedMotion& first);
  ~Following() override;

  /// Plans anew beside the motion, whenever the target was seen, until it is destroyed.
  /// `on_settled`: called on that thread when IsSettled may say something else; may be null.
  void Start(std::function<void()> on_settled = nullptr);
  /// Whether no plan is being made, nor about to be, for what was seen: where time is simulated it
  /// waits for that.
  bool IsSettled() const;
  /// Plans anew once, as the thread of Start does; not beside it.
  void PlanOnce(const std::stop_token& stop);
  /// Something was seen.
  void Take(const std::string& object);

  void Correct(double path_time_s, double rate, double elapsed_s,
               Eigen::Ref<Eigen::VectorXd> position, Eigen::Ref<Eigen::VectorXd> velocity) override;
  void LiftOff(double path_time_s) override;
  std::optional<std::string> Problem() const override;

  /// Writes how near the measured tool came to the contact, as the target was seen.
  void Report(api::ExecutionResult& result) const;
  int plans_blended() const { return blended_.load(); }

 private:
  enum class Fault { kNone, kLost, kFast, kAway };
  struct Aim {
    Duration time{0};
    Eigen::Vector3d base_p = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  };
  void SetAim(const TargetTrack& track);
  void PlanLoop(const std::stop_token& stop);
  /// Waits until the target was seen anew; false when `stop` came first.
  bool AwaitSight(const std::stop_token& stop);
  void SetIdle(bool over);
  void Judge(double path_time_s, double residual_m, Duration now);
  Eigen::Vector3d Wanted(const FollowedPath& path, std::size_t frame, double part, Duration now);
  const TargetPress* press() const { return press_ ? &*press_ : nullptr; }

  const Clock& clock_;
  Log& log_;
  const FollowingPlanner& planner_;
  const kinematics::RobotDescription& robot_;
  const api::ExecuteRequest request_;
  const std::string target_;
  const Eigen::Vector3d object_p_contact_;
  const TargetTimes times_;
  const std::optional<TargetPress> press_;
  const motion::PlannedMotion first_;                       ///< the motion as it began
  const Eigen::VectorXd lever_m_;                           ///< of the chain's joints
  std::vector<std::unique_ptr<const FollowedPath>> paths_;  ///< all that were in use
  std::atomic<const FollowedPath*> path_{nullptr};          ///< the present one
  std::atomic<double> path_time_s_{0};
  std::atomic<double> rate_{0};
  std::atomic<std::int64_t> began_ns_{-1};
  std::atomic<int> blended_{0};
  std::atomic<Fault> fault_{Fault::kNone};
  std::atomic<double> fault_value_{0};

  mutable std::mutex aim_mutex_;  ///< the control loop only tries it
  Aim aim_;
  // Of the control loop.
  Aim used_aim_;
  std::optional<double> deepest_m_;  ///< the tool goes no deeper any more: it met its touch
  Eigen::VectorXd offset_, offset_rate_, wanted_, lift_, ahead_q_, ahead_v_, first_q_, first_v_;

  mutable std::mutex seen_mutex_;
  std::condition_variable_any seen_changed_;
  bool is_fresh_ = false;
  bool plans_ = false;  ///< the thread runs, and will look at what is fresh
  bool is_planning_ = false;
  std::function<void()> on_settled_;
  std::vector<std::pair<Duration, Eigen::Vector3d>> seen_;
  std::jthread thread_;  ///< last
};

}  // namespace exemplar::executor
