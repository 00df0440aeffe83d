#pragma once
// Teleoperation: the robot follows ircp/suit while the dead-man on ircp/safety is held. A mode of
// the executor; not safety-rated.

#include <Eigen/Core>
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "executor/command_stream.hpp"
#include "executor/lateness.hpp"
#include "executor/planner.hpp"
#include "executor/robot_view.hpp"
#include "executor/state_machine.hpp"
#include "executor/teleoperation_dead_man.hpp"
#include "executor/teleoperation_motion.hpp"
#include "executor/teleoperation_ring.hpp"
#include "executor/teleoperation_watch.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/bus.hpp"

namespace exemplar::executor {

/// What teleoperation asks of the executor around it. All of them thread-safe.
struct TeleoperationHost {
  std::function<Status(Event event, std::string detail)> apply;
  std::function<State()> state;
  /// The state and the detail by which the mode ended.
  std::function<std::pair<State, std::string>()> ended;
  /// Publishes a detail within the present state.
  std::function<void(std::string detail)> tell;
  /// What was not heard that must be.
  std::function<std::optional<std::string>()> silence;
  std::function<double()> speed;
  /// The robot rests where it was commanded last; nothing is commanded any more.
  std::function<void(const Eigen::VectorXd& commanded)> over;
  /// After that: active() is false, the robot may belong to somebody else.
  std::function<void()> released;
  /// Told when all that came may have been dealt with.
  std::function<void()> on_settled;
};

struct TeleoperationSettings {
  TeleoperationOptions following = {};
  double rate_hz = 125;
  bool realtime = false;
  WatchLimits watch = {};
  double start_tolerance_rad = 0.05;  ///< begins at the last command where the robot is this near
};

struct TeleoperationFigures {
  std::string phase;  ///< empty: the mode is off
  std::uint64_t suit_samples = 0;
  std::uint64_t suit_left_out = 0;
  double latency_p99_s = 0;  ///< of this or the last time that it was on
  double latency_max_s = 0;
};

/// Thread-safe. Three threads: one that makes a step whenever a suit sample comes and at least once
/// a period, one that wakes it for the latter, and one that watches what the robot does and tells.
class Teleoperation {
 public:
  /// The arguments by reference outlive it.
  static Result<std::unique_ptr<Teleoperation>> Create(
      ircp::Bus& bus, const Clock& clock, Log& log, const kinematics::RobotDescription& robot,
      const scene::Description& scene, const RobotView& view, const Planner& planner,
      CommandStream& commands, JointMap map, TeleoperationHost host,
      TeleoperationSettings settings);
  ~Teleoperation();

  /// `last_command`: where the robot was told to be, where it was told anything.
  Result<api::TeleoperationResult> Run(
      const api::TeleoperationRequest& request,
      const std::function<void(const api::TeleoperationFeedback&)>& feedback,
      const std::stop_token& stop, const std::optional<Eigen::VectorXd>& last_command);
  Status End();
  /// The robot is commanded from here, also while it comes to rest after the mode was left.
  bool active() const { return session_.load() == kActive; }

  void Measure(const MeasuredState& state);
  void Take(const ircp::SafetySample& sample);
  /// Whether all that came has been followed and watched.
  bool IsSettled() const {
    return wake_.load() == stepped_.load() && work_.load() == watched_.load();
  }

  TeleoperationFigures figures() const;
  /// The stamp of the press that the robot moves by, on the presser's clock; nullopt while it
  /// holds.
  std::optional<Stamp> AnsweredPress() const;
  const ircp::Reader* suit_reader() const { return suit_reader_.get(); }

 private:
  static constexpr std::uint32_t kIdle = 0;
  static constexpr std::uint32_t kActive = 1;
  static constexpr std::uint32_t kClosing = 2;

  Teleoperation(const Clock& clock, Log& log, const kinematics::RobotDescription& robot,
                const scene::Description& scene, const RobotView& view, const Planner& planner,
                CommandStream& commands, JointMap map, TeleoperationHost host,
                TeleoperationSettings settings);

  /// What a session is made of before it begins.
  struct Session;
  Result<Session> Prepare(const api::TeleoperationRequest& request,
                          const std::optional<Eigen::VectorXd>& last_command) const;
  void Begin(Session session, const std::string& suit);
  api::TeleoperationFeedback Feedback() const;
  api::TeleoperationResult Report();

  void OnSuit(const ircp::SuitSample& sample, const ircp::Reception& reception);
  void WakeStep();
  void StepLoop(const std::stop_token& stop);
  void TickLoop(const std::stop_token& stop);
  void WatchLoop(const std::stop_token& stop);
  void Step();
  void PlanNextTick(Duration now, bool sample_came);
  void FinishSession();
  /// All that came since; under watch_mutex_.
  void Drain();
  void TellChanges();
  std::string Describe(const PhaseChange& change);
  void WatchMeasured();
  void FollowScene();
  Eigen::VectorXd Commanded() const;

  const Clock& clock_;
  Log& log_;
  const kinematics::RobotDescription& robot_;
  const scene::Description& scene_;
  const RobotView& view_;
  const Planner& planner_;
  CommandStream& commands_;
  const TeleoperationHost host_;
  const TeleoperationSettings settings_;
  const Duration period_;

  std::timed_mutex run_mutex_;  ///< held by the call that the mode belongs to
  std::mutex intake_mutex_;
  SuitIntake intake_;  ///< the network's thread, under intake_mutex_
  DeadMan dead_man_;

  HandOver<SuitPosture, 64> postures_;                           ///< from the network to the step
  HandOver<PhaseChange, 64> changes_;                            ///< from the step to the watch
  HandOver<Duration, 1024> latencies_;                           ///< likewise
  std::atomic<collision::CollisionChecker*> incoming_{nullptr};  ///< another scene, for the step
  std::atomic<collision::CollisionChecker*> retired_{nullptr};   ///< the one before, from the step

  std::atomic<std::uint32_t> session_{kIdle};
  std::atomic<std::uint32_t> wake_{0};     ///< grows when there is something for the step
  std::atomic<std::uint32_t> stepped_{0};  ///< the wake_ that was answered last
  std::atomic<std::uint32_t> work_{0};     ///< grows when there is something for the watch
  std::atomic<std::uint32_t> watched_{0};  ///< the work_ that was done last
  std::atomic<std::uint32_t> due_{0};      ///< grows when something is to be told
  std::atomic<std::uint32_t> beat_{0};     ///< grows when there is something to feed back
  std::atomic<std::int64_t> next_tick_ns_{0};
  std::array<std::atomic<double>, kMaxJoints> commanded_{};
  std::atomic<Phase> phase_{Phase::kHolding};
  std::atomic<double> behind_rad_{0};
  std::atomic<int> behind_joint_{0};
  std::atomic<std::int64_t> suit_interval_ns_{0};
  std::atomic<std::int64_t> begun_ns_{0};
  std::atomic<std::int64_t> over_ns_{0};
  std::atomic<std::int64_t> following_ns_{0};

  // The step's own.
  std::unique_ptr<TeleoperationMotion> motion_;
  Duration last_step_{0};
  Duration last_sample_{0};
  int ticks_ = 0;  ///< since the last sample
  double settled_s_ = 0;
  double since_beat_s_ = 0;

  mutable std::mutex figures_mutex_;  ///< guards what follows
  std::vector<TeleoperationMeasurement> measured_;
  std::string detail_;
  std::uint64_t sent_before_ = 0;
  std::uint64_t holds_ = 0;
  std::uint64_t blocks_ = 0;
  double tracking_rad_ = 0;
  double largest_tracking_rad_ = 0;
  double touch_n_ = 0;
  double touch_max_n_ = 0;
  std::optional<double> clearance_m_;
  std::optional<double> smallest_clearance_m_;
  LatenessHistogram latency_;

  // The watch's own.
  mutable std::mutex watch_mutex_;  ///< guards what follows between sessions
  std::unique_ptr<TeleoperationWatch> watch_;
  std::unique_ptr<collision::CollisionChecker> spare_;
  std::vector<geometry::NamedPose> placed_;
  std::optional<collision::Scene> moved_;
  Phase told_ = Phase::kHolding;

  std::unique_ptr<ircp::Reader> suit_reader_;
  std::jthread step_thread_, tick_thread_, watch_thread_;
};

}  // namespace exemplar::executor
