#pragma once
// Executes skills on a robot: asks the learning service for the motion, plans it, streams it as
// joint commands and watches what the robot does. Not safety-rated.

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "executor/command_stream.hpp"
#include "executor/following.hpp"
#include "executor/motion_run.hpp"
#include "executor/planner.hpp"
#include "executor/robot_view.hpp"
#include "executor/state_machine.hpp"
#include "executor/teleoperation.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/ircp/metrics.hpp"
#include "exemplar/ircp/simulated_time.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::executor {

/// That `event` is not taken in `state`, and whom the robot belongs to.
Error Refused(State state, Event event, const std::string& holder);

struct ExecutorOptions {
  double rate_hz = 125;
  /// The threads that make and write commands go before ordinary ones, where this is permitted.
  bool realtime = false;
  PlannerOptions planner = {};  ///< touch links and comfortable posture come from the robot
  WatchLimits watch = {};       ///< the command period comes from the rate
  FollowingOptions following = {};
  /// Without ircp/safety for so long nothing begins and a motion is stopped; 0: not asked for.
  Duration safety_patience = Duration::zero();
  /// A plan or teleoperation asked for while the robot still slows down waits for so long, of real
  /// time.
  Duration rest_patience = std::chrono::seconds(3);
  /// Called on any thread when a joint state or an object's pose was taken in, and when a state was
  /// looked at: has_taken may say something else now.
  std::function<void()> on_taken = nullptr;
  TeleoperationOptions teleoperation = {};
  std::optional<JointMap> joint_map = {};  ///< absent: joints of the same names
};

/// How it goes, since the executor began.
struct ExecutorFigures {
  std::string state;
  double speed = 1;
  std::map<std::string, std::uint64_t> executions;  ///< by the state they ended in
  std::uint64_t plans_refused = 0;
  std::uint64_t commands_dropped = 0;
  std::uint64_t commands_failed = 0;
  int command_readers = 0;  ///< programs that hear the commands: the robot, a recorder
  std::uint64_t cycles = 0;
  double lateness_s = 0;  ///< summed over the cycles
  double lateness_max_s = 0;
  std::optional<double> state_age_s;  ///< of the last usable joint state
  TeleoperationFigures teleoperation;
};

/// Thread-safe. The command over ircp/executor/command does the same as the methods: pause, resume,
/// cancel, stop, reset, speed{factor}, end_teleoperation; each transition goes out on
/// ircp/executor/status.
class Executor final : public api::ExecutorApi {
 public:
  /// The arguments by reference outlive the executor.
  static Result<std::unique_ptr<Executor>> Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                  api::SkillApi& skills,
                                                  const kinematics::RobotDescription& robot,
                                                  const scene::Description& scene,
                                                  ExecutorOptions options = {});
  /// Precondition: no call runs any more. A motion that still runs ends without a ramp: see
  /// Shutdown.
  ~Executor() override;

  Result<api::PlanSummary> Plan(const api::ExecuteRequest& request) override;
  Result<api::ExecutionResult> Execute(
      const api::ExecuteRequest& request,
      const std::function<void(const api::ExecutionFeedback&)>& feedback,
      std::stop_token stop) override;
  Result<api::RobotStatus> GetStatus() override;
  Status Pause() override;
  Status Resume() override;
  Status Cancel() override;
  Status Stop() override;
  Status Reset() override;
  Status SetSpeed(double factor) override;
  Result<api::TeleoperationResult> Teleoperate(
      const api::TeleoperationRequest& request,
      const std::function<void(const api::TeleoperationFeedback&)>& feedback,
      std::stop_token stop) override;
  Status EndTeleoperation() override;

  ExecutorFigures figures() const;
  std::vector<ircp::TopicCount> sent() const;
  /// Whether all that came was looked at and all commands have left; not before the robot is there.
  bool IsSettled() const;
  std::vector<ircp::TopicReader> readers() const;

  /// Brings a motion to rest on its path and returns when it rests; nothing is executed afterwards.
  void Shutdown();

 private:
  Executor(const Clock& clock, Log& log, api::SkillApi& skills,
           const kinematics::RobotDescription& robot, const scene::Description& scene,
           ExecutorOptions options);
  Status Connect(ircp::Bus& bus);
  Status ConnectTeleoperation(ircp::Bus& bus);

  /// Takes the event, or refuses it. `run`: what begins with kStart.
  Status Apply(Event event, std::string detail, std::shared_ptr<MotionRun> run = nullptr);
  Status Begin(const api::ExecuteRequest& request);
  /// Waits where the robot only has to come to rest before `event` can be taken.
  Status AwaitRest(Event event);
  /// Asks for the motion and plans it; leaves kReady, or goes back to kIdle where there is none.
  /// `followed` gets what a motion that follows its target needs beside, but for the plan itself.
  Result<Planned> MakePlan(const api::ExecuteRequest& request,
                           std::optional<FollowingPlan>* followed = nullptr);
  /// On ircp/plan.
  void ShowPlan(const std::string& skill, const motion::JointTrajectory& trajectory);

  void OnJointState(const ircp::JointStateSample& sample);
  void OnObject(const ircp::ObjectSample& sample);
  void OnSafety(const ircp::SafetySample& sample);
  ircp::Answer OnCommand(const ircp::CommandSample& command);
  std::optional<Duration> StateAge() const;
  /// What is wrong now that no joint state would show.
  std::optional<std::string> Silence() const;
  std::optional<std::string> SafetySilence() const;
  void EndMotion(MotionRun& run);

  void ControlLoop(const std::stop_token& stop);
  /// False when `stop` came first.
  bool RunMotion(MotionRun& run, const std::stop_token& stop);
  void CountCycle(Duration lateness);
  void WatchLoop(const std::stop_token& stop);
  void PublishLoop(const std::stop_token& stop);
  void WakeAll();

  const Clock& clock_;
  Log& log_;
  const kinematics::RobotDescription& robot_;
  const scene::Description& scene_;
  const ExecutorOptions options_;
  RobotView view_;
  const Planner planner_;
  TargetTracks tracks_;
  const FollowingPlanner following_planner_;
  std::atomic<std::int64_t> state_received_ns_;
  std::atomic<std::int64_t> safety_received_ns_;
  std::atomic<bool> has_state_{false};  ///< a joint state has come
  std::atomic<double> speed_{1.0};
  std::atomic<State> state_{State::kIdle};  ///< written under mutex_
  std::atomic<std::uint64_t> plans_refused_{0};
  std::atomic<std::uint64_t> cycles_{0};  ///< these three are written by the control loop only
  std::atomic<std::int64_t> lateness_ns_{0};
  std::atomic<std::int64_t> lateness_max_ns_{0};

  /// A leaf: the network's threads wait for nothing else. Guards who is measured.
  mutable std::mutex measuring_mutex_;
  std::condition_variable_any measured_;
  std::shared_ptr<MotionRun> measuring_;  ///< run_, also for the network and the watch

  /// What was gone through, to be logged and published.
  struct Transition {
    State state;
    std::string detail;
    std::optional<std::pair<State, Event>> from = {};  ///< absent: another detail only
  };

  mutable std::mutex mutex_;  ///< guards what follows
  std::condition_variable_any changed_;
  std::string detail_;
  std::string holder_;  ///< the request that planning or motion belongs to
  std::stop_source planning_stop_;
  std::shared_ptr<MotionRun> run_;           ///< shared with the threads that run and watch it
  std::shared_ptr<Following> following_;     ///< of run_, where its target is followed
  std::vector<geometry::NamedPose> fixed_;   ///< what run_ is about
  std::vector<geometry::NamedPose> placed_;  ///< where everything was taken to be
  std::vector<motion::Carry> carries_;       ///< of run_
  bool run_over_ = true;                     ///< the control loop is through with run_
  State run_end_ = State::kIdle;             ///< the state that ended its motion, and why
  std::string run_detail_;
  std::uint64_t beats_ = 0;  ///< a tenth of a second of motion each
  std::optional<Eigen::VectorXd> last_command_;
  std::deque<Transition> transitions_;
  bool is_publishing_ = false;  ///< one that was among them
  std::map<std::string, std::uint64_t> executions_;
  bool closing_ = false;

  std::unique_ptr<CommandStream> commands_;
  std::unique_ptr<ircp::Writer<ircp::PlanSample>> plans_;
  std::unique_ptr<ircp::ControlServer> control_;
  std::unique_ptr<Teleoperation> teleoperation_;
  std::unique_ptr<ircp::Reader> state_reader_, object_reader_, safety_reader_;
  std::jthread control_thread_, watch_thread_, publish_thread_;
};

}  // namespace exemplar::executor
