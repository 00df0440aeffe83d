#pragma once
// The session as it runs: its parts, and who calls what.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/ircp/clock_watch.hpp"
#include "exemplar/ircp/control.hpp"
#include "simulator/cameras.hpp"
#include "simulator/outbox.hpp"
#include "simulator/session.hpp"

namespace exemplar::simulator {

/// A sample for the robot's joints, as it came.
struct Arrival {
  ircp::Header header;
  std::vector<std::string> names;
  std::vector<double> positions;
  std::vector<double> velocities;
  Duration validity{0};
  bool has_hand_open = false;
  double hand_open = 0;
};

/// What goes out at the robot's rate.
struct Outgoing {
  ircp::JointStateSample state;
  Follower::Mode mode = Follower::Mode::kHolding;
};

/// "following", "going home", "holding".
const char* NameOf(Follower::Mode mode);

/// Run belongs to one thread, which steps the world; what the network calls is safe beside it.
class RunningSession final : public Session {
 public:
  RunningSession(const Clock& clock, Log& log, const kinematics::RobotDescription& robot,
                 const SessionOptions& options, World world);

  /// Before Run: makes what talks to the network.
  Status Connect(ircp::Bus& bus, const scene::Description& scene);

  void Run(std::stop_token stop) override;

  Figures figures() const override;
  std::vector<ircp::TopicCount> sent() const override;
  std::string leader_topic() const override;
  const ircp::Reader& leader_reader() const override;

 private:
  // ---- the loop
  void RunInPace(const std::stop_token& stop);
  /// Where time is to stand while nobody commands the robot: until a command has come and its
  /// sender is in step again. False: `stop` came first.
  bool StandUntilCommanded(const std::function<bool()>& lead, const std::stop_token& stop);
  /// A beat is the period of the robot's state: others see no time between.
  void RunInStep(const std::stop_token& stop);
  void Tick(Stamp epoch);
  /// Where everything is that a skill may be about, with the tracker's noise.
  void Track(Stamp stamp);
  void TakeSamples();
  /// Joints that the sample does not name stay where they were told to be; names that the robot
  /// lacks do not matter, but one at least must fit.
  std::optional<Setpoint> MapOntoJoints(const Arrival& arrival) const;
  void SayClicks();
  /// On the thread that may wait for the network.
  void Publish(Outgoing&& outgoing);
  /// With the sensors' noise.
  ircp::JointStateSample State(Stamp stamp);

  // ---- what the network's threads call
  void Receive(Arrival arrival);
  void NoteArrival(const std::string& topic, const ircp::Header& header);
  ircp::Answer Obey(const ircp::CommandSample& command);
  ircp::Answer Place(const std::map<std::string, std::string>& arguments);
  std::map<std::string, std::string> Values() const;

  const Clock& clock_;
  Log& log_;
  const SessionOptions options_;
  const std::vector<std::string> joint_names_;
  const Eigen::VectorXd home_;
  const std::string base_frame_;

  mutable std::mutex mutex_;  ///< guards the world and what moves with it
  World world_;
  Follower follower_;
  Rng noise_;
  std::deque<std::pair<Duration, Arrival>> on_the_way_;  ///< by when the servos hear of it
  std::vector<std::uint64_t> clicks_;                    ///< said so far, by button
  double hand_open_ = 1;
  Duration last_arrival_{0};  ///< of a sample that the robot follows, by the world's time
  std::int64_t states_due_ = 0;
  std::int64_t looks_ = 0;  ///< of the tracker
  std::uint64_t refused_ = 0;
  std::uint64_t slips_ = 0;

  mutable std::mutex inbox_mutex_;
  std::condition_variable_any arrived_;
  std::deque<Arrival> inbox_;
  std::map<std::pair<std::string, std::string>, std::uint64_t> last_seq_;  ///< by topic and source
  std::uint64_t overrun_ = 0;

  std::unique_ptr<ircp::ClockResponder> picture_clock_;  ///< null: pictures go by the one bus
  std::unique_ptr<Cameras> cameras_;
  std::unique_ptr<ircp::Writer<ircp::JointStateSample>> state_writer_;
  std::unique_ptr<Outbox<Outgoing>> states_;
  std::unique_ptr<ircp::Writer<ircp::ObjectSample>> object_writer_;  ///< null: nothing is tracked
  std::unique_ptr<Outbox<ircp::ObjectSample>> tracked_;
  Follower::Mode said_mode_ = Follower::Mode::kHolding;  ///< of the outbox's thread
  std::unique_ptr<ircp::TimeLeader> time_;  ///< null: the world keeps pace with the clock
  std::atomic<bool> is_leading_{false};     ///< there is time_
  std::atomic<bool> stands_{false};
  // Last: their threads call into what stands above.
  std::unique_ptr<ircp::ControlServer> control_;
  std::unique_ptr<ircp::Reader> leader_reader_, glove_reader_;
};

}  // namespace exemplar::simulator
