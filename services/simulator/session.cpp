#include "simulator/session.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/text.hpp"
#include "simulator/placing.hpp"
#include "simulator/running_session.hpp"

namespace exemplar::simulator {
namespace {

constexpr const char* kProgram = "simulator";
constexpr std::size_t kStatesWaiting = 256;
constexpr std::size_t kObjectsWaiting = 256;
constexpr std::size_t kSamplesWaiting = 64;

}  // namespace

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

RunningSession::RunningSession(const Clock& clock, Log& log,
                               const kinematics::RobotDescription& robot,
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

Status RunningSession::Connect(ircp::Bus& bus, const scene::Description& scene) {
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
      bus, clock_, kProgram, [this](const ircp::CommandSample& command) { return Obey(command); });
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

Figures RunningSession::figures() const {
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

std::vector<ircp::TopicCount> RunningSession::sent() const {
  std::vector<ircp::TopicCount> counts;
  if (cameras_) counts = cameras_->sent();
  counts.push_back({ircp::JointStateSample::kTopic, ircp::kRobotSource, state_writer_->sent()});
  if (object_writer_) {
    counts.push_back({ircp::ObjectSample::kTopic, ircp::kTrackerSource, object_writer_->sent()});
  }
  return counts;
}

std::string RunningSession::leader_topic() const {
  return options_.leader == Leader::kSuit ? ircp::SuitSample::kTopic
                                          : ircp::JointCommandSample::kTopic;
}

const ircp::Reader& RunningSession::leader_reader() const { return *leader_reader_; }

void RunningSession::Receive(Arrival arrival) {
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

void RunningSession::NoteArrival(const std::string& topic, const ircp::Header& header) {
  {
    const std::lock_guard lock(inbox_mutex_);
    last_seq_[{topic, header.source}] = header.seq;
  }
  if (is_leading_.load()) time_->Recheck();
}

ircp::Answer RunningSession::Obey(const ircp::CommandSample& command) {
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

ircp::Answer RunningSession::Place(const std::map<std::string, std::string>& arguments) {
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

std::map<std::string, std::string> RunningSession::Values() const {
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
