#include "simulator/session.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/ircp/clock_watch.hpp"
#include "exemplar/ircp/control.hpp"
#include "simulator/cameras.hpp"
#include "simulator/outbox.hpp"
#include "simulator/placing.hpp"

namespace exemplar::simulator {
namespace {

constexpr const char* kProgram = "simulator";
/// Behind by more than this, the world lets time pass rather than rush after it.
constexpr Duration kLargestLag = std::chrono::milliseconds(200);
constexpr std::size_t kStatesWaiting = 256;
constexpr std::size_t kObjectsWaiting = 256;
constexpr std::size_t kSamplesWaiting = 64;
/// Of real time, between two sayings of a time that stands.
constexpr Duration kSayAgain = std::chrono::milliseconds(50);

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

bool IsSound(const Arrival& arrival) {
  const auto finite = [](double v) { return std::isfinite(v); };
  return arrival.positions.size() == arrival.names.size() &&
         (arrival.velocities.empty() || arrival.velocities.size() == arrival.names.size()) &&
         std::all_of(arrival.positions.begin(), arrival.positions.end(), finite) &&
         std::all_of(arrival.velocities.begin(), arrival.velocities.end(), finite);
}

const char* NameOf(Follower::Mode mode) {
  switch (mode) {
    case Follower::Mode::kFollowing:
      return "following";
    case Follower::Mode::kGoingHome:
      return "going home";
    case Follower::Mode::kHolding:
      break;
  }
  return "holding";
}

class RunningSession final : public Session {
 public:
  RunningSession(const Clock& clock, Log& log, const kinematics::RobotDescription& robot,
                 const SessionOptions& options, World world)
      : clock_(clock),
        log_(log),
        options_(options),
        joint_names_(robot.chain.joint_names()),
        home_(robot.home),
        base_frame_(robot.chain.base_link()),
        world_(std::move(world)),
        follower_(robot.chain.limits(), robot.home, options.follower),
        noise_(options.noise.seed) {
    for (const ButtonState& button : world_.buttons()) clicks_.push_back(button.clicks);
  }

  Status Connect(ircp::Bus& bus, const scene::Description& scene) {
    if (options_.track_hz > 0) {
      auto objects = bus.MakeWriter<ircp::ObjectSample>(ircp::kTrackerSource);
      if (!objects) return objects.error();
      object_writer_ = std::move(objects).value();
      tracked_ = std::make_unique<Outbox<ircp::ObjectSample>>(
          kObjectsWaiting, [this](ircp::ObjectSample&& sample) {
            if (Status status = object_writer_->Write(std::move(sample)); !status) {
              log_.Warning("object not sent", {{"cause", status.error().message}});
            }
          });
    }
    if (options_.cameras && !scene.cameras.empty()) {
      ircp::Bus& pictures = options_.picture_bus ? *options_.picture_bus : bus;
      if (options_.picture_bus) {
        auto clock = ircp::ClockResponder::Create(pictures, clock_, kProgram);
        if (!clock) return clock.error();
        picture_clock_ = std::move(*clock);
      }
      Result<std::unique_ptr<Cameras>> cameras = Cameras::Create(
          pictures, log_, world_, scene,
          {.encoding = options_.picture_encoding, .quality = options_.picture_quality});
      if (cameras) {
        cameras_ = std::move(cameras).value();
      } else if (cameras.error().code == ErrorCode::kUnavailable) {
        log_.Warning("no pictures: this machine cannot draw", {{"cause", cameras.error().message}});
      } else {
        return cameras.error();
      }
    }
    auto writer = bus.MakeWriter<ircp::JointStateSample>(ircp::kRobotSource);
    if (!writer) return writer.error();
    state_writer_ = std::move(writer).value();
    states_ = std::make_unique<Outbox<Outgoing>>(
        kStatesWaiting, [this](Outgoing&& outgoing) { Publish(std::move(outgoing)); });

    Result<std::unique_ptr<ircp::ControlServer>> control = ircp::ControlServer::Create(
        bus, clock_, kProgram,
        [this](const ircp::CommandSample& command) { return Obey(command); });
    if (!control) return control.error();
    control_ = std::move(control).value();
    control_->SetSentCounts([this] { return sent(); });
    control_->SetOnRival([this](const std::string& rival) {
      log_.Warning("another simulator runs in this station: both send joint states",
                   {{"writer", rival}});
    });
    control_->SetValues([this] { return Values(); });
    control_->SetState("running", NameOf(Follower::Mode::kHolding));

    Result<std::unique_ptr<ircp::Reader>> reader =
        options_.leader == Leader::kCommand
            ? bus.MakeReader<ircp::JointCommandSample>(
                  [this](const ircp::JointCommandSample& s, const ircp::Reception&) {
                    Receive({s.header, s.names, s.positions, s.velocities, s.validity,
                             s.has_hand_open, s.hand_open});
                  })
            : bus.MakeReader<ircp::SuitSample>(
                  [this](const ircp::SuitSample& s, const ircp::Reception&) {
                    Receive({s.header, s.names, s.positions, {}, Duration(0), false, 0});
                  });
    if (!reader) return reader.error();
    leader_reader_ = std::move(reader).value();
    if (options_.leader == Leader::kSuit && world_.has_hand()) {
      // A person's glove: what it says of the hand's opening.
      auto glove = bus.MakeReader<ircp::EndEffectorSample>(
          [this](const ircp::EndEffectorSample& s, const ircp::Reception&) {
            if (s.has_hand_open && std::isfinite(s.hand_open)) {
              const std::lock_guard lock(mutex_);
              hand_open_ = std::clamp(s.hand_open, 0.0, 1.0);
            }
            NoteArrival(ircp::EndEffectorSample::kTopic, s.header);
          });
      if (!glove) return glove.error();
      glove_reader_ = std::move(glove).value();
    }
    if (options_.pace == 1 && options_.in_step_with.empty()) return {};
    auto time =
        ircp::TimeLeader::Create(bus, clock_, kProgram, {.in_step_with = options_.in_step_with});
    if (!time) return time.error();
    time_ = std::move(time).value();
    is_leading_.store(true);
    return {};
  }

  void Run(std::stop_token stop) override {
    log_.Info("running", {{"joints", joint_names_.size()},
                          {"rate_hz", options_.rate_hz},
                          {"follows", options_.leader == Leader::kSuit ? "suit" : "command"},
                          {"cameras", cameras_ ? "on" : "off"},
                          {"in_step_with", Join(options_.in_step_with, " ")}});
    if (time_) {
      RunInStep(stop);
    } else {
      RunInPace(stop);
    }
    states_->Finish();
    if (tracked_) tracked_->Finish();
    control_->SetState("stopped", "asked to stop");
    log_.Info("stopped", {{"sim_time_s", ToSeconds(world_.time())}});
  }

 private:
  void RunInPace(const std::stop_token& stop) {
    Duration begin = clock_.Steady() - world_.time();
    Stamp epoch = clock_.Now() - world_.time();
    while (!stop.stop_requested()) {
      const Duration now = clock_.Steady() - begin;
      if (now - world_.time() > kLargestLag) {
        const Duration lag = now - world_.time();
        begin += lag;
        epoch = epoch + lag;
        {
          const std::lock_guard lock(mutex_);
          ++slips_;
        }
        log_.Warning("the world fell behind the clock", {{"by_s", ToSeconds(lag)}});
      }
      while (world_.time() + world_.step() <= clock_.Steady() - begin) Tick(epoch);
      if (!clock_.SleepUntil(begin + world_.time() + world_.step(), stop)) break;
    }
  }

  /// Where time is to stand while nobody commands the robot: until a command has come and its
  /// sender is in step again. False: `stop` came first.
  bool StandUntilCommanded(const std::function<bool()>& lead, const std::stop_token& stop) {
    if (options_.stand_after == Duration(0)) return true;
    if (world_.time() - last_arrival_ < options_.stand_after) return true;
    std::unique_lock lock(inbox_mutex_);
    stands_.store(true);
    while (!arrived_.wait_for(lock, stop, kSayAgain, [this] { return !inbox_.empty(); })) {
      lock.unlock();
      if (!lead()) return false;  // who came later hears the time as well
      lock.lock();
    }
    stands_.store(false);
    lock.unlock();
    return lead();
  }

  /// A beat is the period of the robot's state: others see no time between.
  void RunInStep(const std::stop_token& stop) {
    const Stamp epoch = options_.epoch.value_or(clock_.Now()) - world_.time();
    const Duration begin = clock_.Steady();
    const auto has_come = [this](const ircp::TopicCount& count) {
      const std::lock_guard lock(inbox_mutex_);
      const bool is_read = count.topic == leader_topic() ||
                           (glove_reader_ && count.topic == ircp::EndEffectorSample::kTopic);
      if (!is_read) return true;
      const auto it = last_seq_.find({count.topic, count.source});
      return it != last_seq_.end() && it->second >= count.sent;
    };
    const auto lead = [&] {
      states_->Flush();
      if (cameras_) cameras_->Flush();
      const Stamp now = epoch + world_.time();
      if (options_.leader_clock) options_.leader_clock->Set(now);
      return time_->Lead(world_.time(), now, sent(), has_come, stop);
    };
    for (double beats = 1; lead(); ++beats) {
      if (!StandUntilCommanded(lead, stop)) return;
      for (const std::string& program : time_->TakeLost()) {
        log_.Warning("time goes on without a program that is silent", {{"program", program}});
      }
      const Duration until = FromSeconds(beats / options_.rate_hz) - world_.step() / 2;
      while (world_.time() < until) Tick(epoch);
      if (options_.pace == 0) continue;
      const Duration real = FromSeconds(ToSeconds(world_.time()) / options_.pace);
      if (!clock_.SleepUntil(begin + real, stop)) return;
    }
  }

 public:
  // ---- how it goes

  Figures figures() const override {
    Figures now;
    {
      const std::lock_guard lock(inbox_mutex_);
      now.overrun = overrun_;
    }
    const std::lock_guard lock(mutex_);
    now.time_s = ToSeconds(world_.time());
    now.stands = stands_.load();
    now.mode = NameOf(follower_.mode());
    now.touch_n = world_.touch_n();
    now.hand_open = world_.has_hand() ? world_.hand_open() : hand_open_;
    now.refused = refused_;
    now.stale = static_cast<std::uint64_t>(follower_.stale_count());
    now.slips = slips_;
    now.faults = static_cast<std::uint64_t>(world_.faults());
    now.states_dropped = states_->dropped();
    now.pictures_skipped = cameras_ ? cameras_->skipped() : 0;
    for (const ButtonState& button : world_.buttons()) {
      now.clicks[button.name] = button.clicks;
      if (button.clicks > 0) now.last_click_s[button.name] = ToSeconds(button.last_click);
    }
    return now;
  }

  std::vector<ircp::TopicCount> sent() const override {
    std::vector<ircp::TopicCount> counts;
    if (cameras_) counts = cameras_->sent();
    counts.push_back({ircp::JointStateSample::kTopic, ircp::kRobotSource, state_writer_->sent()});
    if (object_writer_) {
      counts.push_back({ircp::ObjectSample::kTopic, ircp::kTrackerSource, object_writer_->sent()});
    }
    return counts;
  }

  std::string leader_topic() const override {
    return options_.leader == Leader::kSuit ? ircp::SuitSample::kTopic
                                            : ircp::JointCommandSample::kTopic;
  }
  const ircp::Reader& leader_reader() const override { return *leader_reader_; }

 private:
  // ---- the loop

  void Tick(Stamp epoch) {
    const std::lock_guard lock(mutex_);
    TakeSamples();
    const Follower::Output target = follower_.At(world_.time() + world_.step());
    world_.SetTarget(target.positions, target.velocities);
    world_.SetHand(hand_open_);
    world_.Step();
    SayClicks();
    const Stamp stamp = epoch + world_.time();
    if (tracked_ && ToSeconds(world_.time()) * options_.track_hz >= static_cast<double>(looks_)) {
      ++looks_;
      Track(stamp);
      if (time_) tracked_->Flush();  // the state that follows finds them
    }
    if (ToSeconds(world_.time()) * options_.rate_hz >= static_cast<double>(states_due_)) {
      ++states_due_;
      states_->Put({State(stamp), follower_.mode()});
    }
    if (cameras_) cameras_->Look(world_, stamp);
  }

  /// Where everything is that a skill may be about, with the tracker's noise.
  void Track(Stamp stamp) {
    const auto noise = [this](double deviation) {
      const double x = noise_.Normal(0, deviation);
      const double y = noise_.Normal(0, deviation);
      return Eigen::Vector3d(x, y, noise_.Normal(0, deviation));
    };
    for (const ThingState& thing : world_.things()) {
      ircp::ObjectSample sample;
      sample.header.stamp = stamp;
      sample.name = thing.name;
      sample.frame = base_frame_;
      sample.base_T_object = thing.base_T_object;
      sample.base_T_object.translation += noise(options_.noise.object_m);
      sample.base_T_object.rotation =
          sample.base_T_object.rotation * geometry::ExpSo3(noise(options_.noise.object_rad));
      sample.position_variance_m2.fill(options_.noise.object_m * options_.noise.object_m);
      sample.rotation_variance_rad2 = options_.noise.object_rad * options_.noise.object_rad;
      tracked_->Put(std::move(sample));
    }
  }

  void TakeSamples() {
    std::deque<Arrival> arrivals;
    {
      const std::lock_guard lock(inbox_mutex_);
      arrivals.swap(inbox_);
    }
    if (!arrivals.empty()) last_arrival_ = world_.time();
    for (Arrival& arrival : arrivals) {
      on_the_way_.emplace_back(world_.time() + options_.command_delay, std::move(arrival));
    }
    for (; !on_the_way_.empty() && on_the_way_.front().first <= world_.time();
         on_the_way_.pop_front()) {
      const Arrival& arrival = on_the_way_.front().second;
      std::optional<Setpoint> setpoint = MapOntoJoints(arrival);
      if (!setpoint) {
        ++refused_;
        continue;
      }
      if (arrival.has_hand_open) hand_open_ = std::clamp(arrival.hand_open, 0.0, 1.0);
      if (options_.leader == Leader::kSuit) {
        follower_.Stream(world_.time(), std::move(*setpoint));
      } else {
        follower_.Command(world_.time(), std::move(*setpoint), arrival.validity);
      }
    }
  }

  /// Joints that the sample does not name stay where they were told to be; names that the robot
  /// lacks do not matter, but one at least must fit.
  std::optional<Setpoint> MapOntoJoints(const Arrival& arrival) const {
    if (!IsSound(arrival)) return std::nullopt;
    Setpoint setpoint;
    setpoint.positions = follower_.last().positions;
    setpoint.stamp = arrival.header.stamp;
    setpoint.seq = arrival.header.seq;
    if (!arrival.velocities.empty()) {
      setpoint.velocities = Eigen::VectorXd::Zero(setpoint.positions.size());
    }
    bool fits = false;
    for (std::size_t i = 0; i < arrival.names.size(); ++i) {
      const auto it = std::find(joint_names_.begin(), joint_names_.end(), arrival.names[i]);
      if (it == joint_names_.end()) continue;
      fits = true;
      const Eigen::Index joint = it - joint_names_.begin();
      setpoint.positions[joint] = arrival.positions[i];
      if (!arrival.velocities.empty()) setpoint.velocities[joint] = arrival.velocities[i];
    }
    if (!fits) return std::nullopt;
    return setpoint;
  }

  void SayClicks() {
    const std::vector<ButtonState> buttons = world_.buttons();
    for (std::size_t i = 0; i < buttons.size(); ++i) {
      if (buttons[i].clicks == clicks_[i]) continue;
      clicks_[i] = buttons[i].clicks;
      log_.Info("button clicked", {{"button", buttons[i].name},
                                   {"clicks", buttons[i].clicks},
                                   {"sim_time_s", ToSeconds(buttons[i].last_click)},
                                   {"touch_n", world_.touch_n()}});
    }
  }

  /// On the thread that may wait for the network.
  void Publish(Outgoing&& outgoing) {
    if (outgoing.mode != said_mode_) {
      said_mode_ = outgoing.mode;
      control_->SetState("running", NameOf(said_mode_));
    }
    if (Status status = state_writer_->Write(std::move(outgoing.state)); !status) {
      log_.Warning("joint state not sent", {{"cause", status.error().message}});
    }
  }

  /// With the sensors' noise.
  ircp::JointStateSample State(Stamp stamp) {
    ircp::JointStateSample sample;
    sample.header.stamp = stamp;
    sample.names = joint_names_;
    const auto list = [](const Eigen::VectorXd& v) {
      return std::vector<double>(v.data(), v.data() + v.size());
    };
    sample.positions = list(world_.positions());
    for (double& q : sample.positions) q += noise_.Normal(0, options_.noise.position_rad);
    sample.velocities = list(world_.velocities());
    for (double& v : sample.velocities) v += noise_.Normal(0, options_.noise.velocity_rad_s);
    sample.efforts = list(world_.efforts());
    sample.hand_open = world_.has_hand() ? world_.hand_open() : hand_open_;
    sample.touch_sensors = {kTouchSensor};
    sample.touch_n = {world_.touch_n() + noise_.Normal(0, options_.noise.touch_n)};
    sample.command_seq = follower_.acted_seq();
    return sample;
  }

  // ---- what the network's threads call

  void Receive(Arrival arrival) {
    {
      const std::lock_guard lock(inbox_mutex_);
      if (inbox_.size() >= kSamplesWaiting) {
        inbox_.pop_front();  // The newest matters.
        ++overrun_;
      }
      last_seq_[{leader_topic(), arrival.header.source}] = arrival.header.seq;
      inbox_.push_back(std::move(arrival));
    }
    arrived_.notify_one();
    if (is_leading_.load()) time_->Recheck();
  }

  void NoteArrival(const std::string& topic, const ircp::Header& header) {
    {
      const std::lock_guard lock(inbox_mutex_);
      last_seq_[{topic, header.source}] = header.seq;
    }
    if (is_leading_.load()) time_->Recheck();
  }

  ircp::Answer Obey(const ircp::CommandSample& command) {
    const std::lock_guard lock(mutex_);
    if (command.action == "place") return Place(command.arguments);
    if (command.action == "home") {
      const Duration length = follower_.GoTo(world_.time(), home_);
      return {true, "on the way home", {{"seconds", FormatDouble(ToSeconds(length))}}};
    }
    if (command.action == "reset_clicks") {
      world_.ResetClicks();
      std::fill(clicks_.begin(), clicks_.end(), 0);
      return {true, "clicks are 0", {}};
    }
    return {false, "\"" + command.action + "\" is no action; place, home and reset_clicks are", {}};
  }

  ircp::Answer Place(const std::map<std::string, std::string>& arguments) {
    const auto object = arguments.find("object");
    if (object == arguments.end()) return {false, "object is missing", {}};
    const Result<geometry::Pose> before = world_.ThingPose(object->second);
    if (!before) return {false, before.error().message, {}};
    const Result<geometry::Pose> pose = ReadPose(arguments, *before);
    if (!pose) return {false, pose.error().message, {}};
    if (Status status = world_.Place(object->second, *pose); !status) {
      return {false, status.error().message, {}};
    }
    log_.Info("placed", {{"object", object->second}, {"pose", PoseText(*pose)}});
    return {true, "placed", {{"pose", PoseText(*pose)}}};
  }

  std::map<std::string, std::string> Values() const {
    const Figures now = figures();
    std::map<std::string, std::string> values;
    values["samples_overrun"] = std::to_string(now.overrun);
    values["sim_time_s"] = FormatFixed(now.time_s, 3);
    values["mode"] = now.mode;
    values["touch_n"] = FormatFixed(now.touch_n, 3);
    values["hand_open"] = FormatFixed(now.hand_open, 3);
    values["samples_refused"] = std::to_string(now.refused);
    values["stale"] = std::to_string(now.stale);
    values["slips"] = std::to_string(now.slips);
    values["faults"] = std::to_string(now.faults);
    values["states_dropped"] = std::to_string(now.states_dropped);
    values["pictures_skipped"] = std::to_string(now.pictures_skipped);
    const std::lock_guard lock(mutex_);
    for (const ButtonState& button : world_.buttons()) {
      values["clicks." + button.name] = std::to_string(button.clicks);
      if (button.clicks > 0) {
        values["last_click_s." + button.name] = FormatFixed(ToSeconds(button.last_click), 3);
      }
    }
    for (const ThingState& thing : world_.things()) {
      values["position." + thing.name] = PoseText(thing.base_T_object);
    }
    return values;
  }

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

}  // namespace

Result<std::unique_ptr<Session>> Session::Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                 const kinematics::RobotDescription& robot,
                                                 const scene::Description& scene,
                                                 const SessionOptions& options) {
  if (!(options.rate_hz > 0) || options.rate_hz > 1 / ToSeconds(options.world.step)) {
    return InvalidArgument(
        "rate is " + FormatDouble(options.rate_hz) + " Hz, must be above 0 and at most one a step",
        "rate-hz");
  }
  if (!(options.pace >= 0) || !std::isfinite(options.pace)) {
    return InvalidArgument("pace is " + FormatDouble(options.pace) + ", must be 0 or more", "pace");
  }
  if (!(options.track_hz >= 0) || options.track_hz > 1 / ToSeconds(options.world.step)) {
    return InvalidArgument(
        "track rate is " + FormatDouble(options.track_hz) + " Hz, must be 0 to one a step",
        "track-hz");
  }
  if (options.stand_after < Duration(0)) {
    return InvalidArgument("time is to stand after " +
                               FormatDouble(ToSeconds(options.stand_after)) +
                               " s, must not be negative",
                           "stand-after-s");
  }
  if (options.stand_after > Duration(0) && options.in_step_with.empty()) {
    return InvalidArgument("time can stand still only for programs in step", "stand-after-s");
  }
  if (options.command_delay < Duration(0)) {
    return InvalidArgument("command delay is " + FormatDouble(ToSeconds(options.command_delay)) +
                               " s, must not be negative",
                           "command-delay-ms");
  }
  const std::pair<const char*, double> noises[] = {{"noise-position", options.noise.position_rad},
                                                   {"noise-velocity", options.noise.velocity_rad_s},
                                                   {"noise-touch", options.noise.touch_n},
                                                   {"noise-object", options.noise.object_m},
                                                   {"noise-object-turn", options.noise.object_rad}};
  for (const auto& noise : noises) {
    if (noise.second >= 0 && std::isfinite(noise.second)) continue;
    return InvalidArgument(std::string(noise.first) + " is " + FormatDouble(noise.second) +
                               ", must be a standard deviation of 0 or more",
                           noise.first);
  }
  Result<World> world = World::Create(robot, scene, options.world);
  if (!world) return world.error();
  auto session =
      std::make_unique<RunningSession>(clock, log, robot, options, std::move(world).value());
  if (Status status = session->Connect(bus, scene); !status) return status.error();
  return std::unique_ptr<Session>(std::move(session));
}

}  // namespace exemplar::simulator
