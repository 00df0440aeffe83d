#include "gateway/ros2_bridge.hpp"

#include <atomic>
#include <condition_variable>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>

#include "exemplar/ros2/frames.hpp"
#include "exemplar/ros2/messages.hpp"
#include "gateway/ros2_node.hpp"

namespace exemplar::gateway {
namespace {

constexpr const char* kNodeName = "exemplar_gateway";
// As rclcpp's default quality, and as tf2 has it.
constexpr int kKeepLast = 10;
constexpr int kKeepLastTransforms = 100;
constexpr auto kTick = std::chrono::milliseconds(10);
/// More than these waiting, and the oldest go.
constexpr std::size_t kMaxWaiting = 64;
/// Names of objects; more are not told on.
constexpr std::size_t kMaxObjects = 256;

/// One topic of the graph.
template <class Message>
class Publisher {
 public:
  static Result<Publisher> Create(ircp::RawOutlet& outlet, const std::string& topic, bool latched,
                                  int keep_last) {
    auto writer = outlet.MakeRawWriter({.topic = ros2::DdsTopic(topic),
                                        .type = std::string(ros2::TypeNameOf<Message>()),
                                        .schema = ros2::SchemaOf<Message>(),
                                        .partition = {},
                                        .keyed = false,
                                        .reliable = true,
                                        .transient_local = latched,
                                        .keep_last = keep_last});
    if (!writer.ok()) return writer.error();
    return Publisher(std::move(*writer));
  }
  Status Publish(const Message& message, Stamp stamp) {
    return writer_->Write(ros2::Encode(message), stamp);
  }
  ircp::Guid guid() const { return writer_->guid(); }

 private:
  explicit Publisher(std::unique_ptr<ircp::RawWriter> writer) : writer_(std::move(writer)) {}
  std::unique_ptr<ircp::RawWriter> writer_;
};

Result<std::string> ReadWhole(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) return NotFound("cannot read " + file.string());
  return std::move(text).str();
}

class Bridge final : public Ros2Bridge {
 public:
  Bridge(const kinematics::RobotDescription* robot, Ros2Options options, Log& log)
      : robot_(robot), options_(std::move(options)), log_(log) {}

  ~Bridge() override {
    ticker_ = {};
    worker_ = {};
    readers_.clear();
    tap_.reset();
  }

  /// Once, before anything else.
  Status Start(ircp::Bus& station, ircp::RawOutlet& outlet, ircp::RawBus& taps) {
    outlet_ = &outlet;
    node_.emplace(outlet, kNodeName);
    if (Status made = MakePublishers(outlet); !made.ok()) return made;
    if (Status told = TellOnce(); !told.ok()) return told;
    worker_ = std::jthread([this](const std::stop_token& stop) { Work(stop); });
    if (clock_) ticker_ = std::jthread([this](const std::stop_token& stop) { Tick(stop); });
    if (Status read = Read(station); !read.ok()) return read;
    if (!options_.robot_from.empty()) {
      auto writer = station.MakeWriter<ircp::JointStateSample>("ros2");
      if (!writer.ok()) return writer.error();
      robot_states_ = std::move(*writer);
    }
    return ReadGraph(taps);
  }

  void Flush() override {
    std::unique_lock lock(mutex_);
    idle_.wait(lock, [&] { return waiting_.empty() && !working_; });
  }
  std::uint64_t published() const override { return published_; }
  std::uint64_t taken() const override { return taken_; }
  std::uint64_t refused() const override { return refused_; }

 private:
  /// What came since the worker looked last.
  struct Waiting {
    std::optional<ircp::JointStateSample> state;
    std::deque<ircp::JointCommandSample> commands;
    std::map<std::string, ircp::ObjectSample> objects;
    std::optional<ircp::PlanSample> plan;
    std::deque<std::vector<std::uint8_t>> robot_states;  ///< as ROS 2 sent them
    std::deque<std::vector<std::uint8_t>> nodes;         ///< likewise, ros_discovery_info

    bool empty() const {
      return !state && commands.empty() && objects.empty() && !plan && robot_states.empty() &&
             nodes.empty();
    }
  };

  Status MakePublishers(ircp::RawOutlet& outlet) {
    const auto make = [this, &outlet](auto& publisher, const std::string& topic, bool latched,
                                      int keep_last) -> Status {
      auto made =
          std::remove_reference_t<decltype(*publisher)>::Create(outlet, topic, latched, keep_last);
      if (!made.ok()) return made.error();
      publisher = std::move(*made);
      node_->AddWriter(publisher->guid());
      return {};
    };
    if (options_.robot_from.empty()) {
      if (Status made = make(states_, "/joint_states", false, kKeepLast); !made.ok()) return made;
    }
    for (const Status& made : {make(commands_, "/joint_command", false, kKeepLast),
                               make(transforms_, "/tf", false, kKeepLastTransforms),
                               make(fixed_transforms_, "/tf_static", true, 1),
                               make(description_, "/robot_description", true, 1),
                               make(plan_, "/planned_trajectory", true, 1)}) {
      if (!made.ok()) return made;
    }
    if (options_.clock == nullptr) return {};
    return make(clock_, "/clock", false, 1);
  }

  /// The simulated time, which alone may end a sleep by it.
  void Tick(const std::stop_token& stop) {
    do {
      const Stamp now = options_.clock->Now();
      Count(clock_->Publish({now}, now));
    } while (options_.clock->SleepFor(kTick, stop));
  }

  /// What does not change.
  Status TellOnce() {
    if (robot_ == nullptr) return {};
    const Result<std::string> urdf = ReadWhole(robot_->urdf);
    if (!urdf.ok()) return urdf.error();
    Count(description_->Publish({*urdf}, Stamp()));
    const Eigen::VectorXd full =
        kinematics::FullJointVector(robot_->model, robot_->chain, robot_->home);
    Count(fixed_transforms_->Publish(
        ros2::JointTransforms(robot_->model, full, /*moving=*/false, Stamp()), Stamp()));
    return {};
  }

  // Callbacks run on threads of the network: they copy and return.
  template <class Sample, class Keep>
  Status ReadInto(ircp::Bus& station, Keep keep) {
    auto reader =
        station.MakeReader<Sample>([this, keep](const Sample& sample, const ircp::Reception&) {
          {
            const std::lock_guard lock(mutex_);
            keep(waiting_, sample);
          }
          wake_.notify_one();
        });
    if (!reader.ok()) return reader.error();
    readers_.push_back(std::move(*reader));
    return {};
  }

  Status Read(ircp::Bus& station) {
    for (const Status& read :
         {ReadInto<ircp::JointStateSample>(
              station, [](Waiting&w, const ircp::JointStateSample&s) { w.state = s; }),
          ReadInto<ircp::JointCommandSample>(station,
                                             [](Waiting&w, const ircp::JointCommandSample&s) {
                                               if (w.commands.size() == kMaxWaiting)
                                                 w.commands.pop_front();
                                               w.commands.push_back(s);
                                             }),
          ReadInto<ircp::ObjectSample>(station,
                                       [](Waiting&w, const ircp::ObjectSample&s) {
                                         if (w.objects.size() < kMaxObjects ||
                                             w.objects.contains(s.name)) {
                                           w.objects[s.name] = s;
                                         }
                                       }),
          ReadInto<ircp::PlanSample>(station,
                                     [](Waiting&w, const ircp::PlanSample&s) { w.plan = s; })}) {
      if (!read.ok()) return read;
    }
    return {};
  }

  /// What other nodes say: of themselves, and the robot's joint states where one has them.
  Status ReadGraph(ircp::RawBus& taps) {
    const std::string robot =
        options_.robot_from.empty() ? std::string() : ros2::DdsTopic(options_.robot_from);
    auto tap = taps.MakeTap({.wanted =
                                 [robot](const ircp::RawTopic& offered) {
                                   if (offered.topic == ros2::kGraphTopic) {
                                     return offered.type == ros2::kGraphType;
                                   }
                                   return offered.topic == robot &&
                                          offered.type == ros2::TypeNameOf<ros2::JointState>();
                                 },
                             .on_sample =
                                 [this](ircp::RawSample&& sample) {
                                   if (!sample.valid) return;
                                   {
                                     const std::lock_guard lock(mutex_);
                                     auto& queue = sample.topic == ros2::kGraphTopic
                                                       ? waiting_.nodes
                                                       : waiting_.robot_states;
                                     if (queue.size() == kMaxWaiting) queue.pop_front();
                                     queue.push_back(std::move(sample.cdr));
                                   }
                                   wake_.notify_one();
                                 }});
    if (!tap.ok()) return tap.error();
    const std::lock_guard lock(mutex_);
    tap_ = std::move(*tap);
    return {};
  }

  void Work(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (wake_.wait(lock, stop, [&] { return !waiting_.empty(); })) {
      const Waiting work = std::exchange(waiting_, {});
      working_ = true;
      lock.unlock();
      Do(work);
      lock.lock();
      working_ = false;
      idle_.notify_all();
    }
  }

  void Do(const Waiting& work) {
    for (const std::vector<std::uint8_t>& bytes : work.nodes) node_->Hear(bytes);
    for (const std::vector<std::uint8_t>& bytes : work.robot_states) TakeState(bytes);
    for (const ircp::JointCommandSample& command : work.commands) {
      Count(commands_->Publish(ros2::ToJointState(command), command.header.stamp));
    }
    if (work.state && IsDue(work.state->header.stamp)) TellState(*work.state);
    for (const auto& [name, object] : work.objects) TellObject(object);
    if (work.plan) {
      Count(plan_->Publish(ros2::ToJointTrajectory(*work.plan, base_frame()),
                           work.plan->header.stamp));
    }
    if (const Status told = node_->Tell(); !told.ok()) Complain(told);
  }

  bool IsDue(Stamp stamp) {
    // A clock that went back is a new run.
    const bool due = !last_state_ || stamp < *last_state_ ||
                     ToSeconds(stamp - *last_state_) * options_.max_rate_hz > 0.999;
    if (due) last_state_ = stamp;
    return due;
  }

  void TellState(const ircp::JointStateSample& state) {
    if (states_) Count(states_->Publish(ros2::ToJointState(state), state.header.stamp));
    if (robot_ == nullptr) return;
    const Eigen::VectorXd full = ros2::JointsOf(*robot_, state);
    Count(transforms_->Publish(
        ros2::JointTransforms(robot_->model, full, /*moving=*/true, state.header.stamp),
        state.header.stamp));
  }

  void TellObject(const ircp::ObjectSample& object) {
    const std::string token = ros2::NameToken(object.name);
    auto known = poses_.find(token);
    if (known == poses_.end()) {
      auto made = Publisher<ros2::PoseStamped>::Create(*outlet_, "/objects/" + token + "/pose",
                                                       false, kKeepLast);
      if (!made.ok()) return Count(made.error());
      known = poses_.emplace(token, std::move(*made)).first;
      node_->AddWriter(known->second.guid());
    }
    const Stamp stamp = object.header.stamp;
    const ros2::Header header{.stamp = stamp, .frame_id = base_frame()};
    Count(known->second.Publish({.header = header, .pose = object.base_T_object}, stamp));
    Count(transforms_->Publish(
        {{{.header = header, .child_frame_id = object.name, .transform = object.base_T_object}}},
        stamp));
  }

  void TakeState(std::span<const std::uint8_t> bytes) {
    const Result<ros2::JointState> message = ros2::DecodeJointState(bytes);
    const Result<ircp::JointStateSample> sample =
        message.ok() ? ros2::ToSample(*message) : Result<ircp::JointStateSample>(message.error());
    const Status written = sample.ok() ? robot_states_->Write(*sample) : Status(sample.error());
    if (written.ok()) {
      ++taken_;
      AddReaders();
    } else if (refused_++ == 0) {
      log_.Warning("joint state of ROS 2 refused",
                   {{"topic", options_.robot_from}, {"reason", written.error().message}});
    }
  }

  /// The tap has opened its reader by the first message.
  void AddReaders() {
    const std::lock_guard lock(mutex_);
    if (tap_ == nullptr || readers_told_) return;
    for (const ircp::Guid& reader : tap_->reader_guids(ros2::DdsTopic(options_.robot_from))) {
      node_->AddReader(reader);
    }
    readers_told_ = true;
  }

  void Count(const Status& published) {
    if (published.ok()) {
      ++published_;
    } else {
      Complain(published);
    }
  }

  void Complain(const Status& failed) {
    if (complained_.exchange(true)) return;
    log_.Warning("not told to ROS 2", {{"reason", failed.error().message}});
  }

  std::string base_frame() const {
    return robot_ == nullptr ? "base" : std::string(robot_->chain.base_link());
  }

  const kinematics::RobotDescription* const robot_;
  const Ros2Options options_;
  Log& log_;
  ircp::RawOutlet* outlet_ = nullptr;
  std::optional<Ros2Node> node_;  ///< of the worker alone, once it runs
  bool readers_told_ = false;     ///< likewise
  std::optional<Publisher<ros2::JointState>> states_, commands_;
  std::optional<Publisher<ros2::TransformMessage>> transforms_, fixed_transforms_;
  std::optional<Publisher<ros2::String>> description_;
  std::optional<Publisher<ros2::JointTrajectory>> plan_;
  std::optional<Publisher<ros2::Clock>> clock_;
  std::map<std::string, Publisher<ros2::PoseStamped>> poses_;
  std::unique_ptr<ircp::Writer<ircp::JointStateSample>> robot_states_;
  std::optional<Stamp> last_state_;
  std::atomic<bool> complained_ = false;
  std::atomic<std::uint64_t> published_{0}, taken_{0}, refused_{0};

  std::mutex mutex_;
  std::condition_variable_any wake_, idle_;
  Waiting waiting_;       ///< guarded by mutex_
  bool working_ = false;  ///< guarded by mutex_
  std::jthread worker_;
  std::jthread ticker_;
  std::unique_ptr<ircp::RawTap> tap_;  ///< guarded by mutex_ while the worker runs
  std::vector<std::unique_ptr<ircp::Reader>> readers_;
};

}  // namespace

Result<std::unique_ptr<Ros2Bridge>> Ros2Bridge::Create(ircp::Bus& station, ircp::RawOutlet& outlet,
                                                       ircp::RawBus& taps,
                                                       const kinematics::RobotDescription* robot,
                                                       Ros2Options options, Log& log) {
  if (!(options.max_rate_hz > 0)) {
    return InvalidArgument("the rate for ROS 2 must be above 0 Hz", "ros2-rate-hz");
  }
  auto bridge = std::make_unique<Bridge>(robot, std::move(options), log);
  if (const Status started = bridge->Start(station, outlet, taps); !started.ok()) {
    return started.error();
  }
  return std::unique_ptr<Ros2Bridge>(std::move(bridge));
}

std::vector<Metric> MetricsOf(const Ros2Bridge& bridge) {
  return {
      CounterOf("exemplar_gateway_ros2_published_total", "Messages published for ROS 2",
                [&bridge] { return bridge.published(); }),
      CounterOf("exemplar_gateway_ros2_taken_total",
                "Joint states of ROS 2 that became the robot's",
                [&bridge] { return bridge.taken(); }),
      CounterOf("exemplar_gateway_ros2_refused_total", "Joint states of ROS 2 that were refused",
                [&bridge] { return bridge.refused(); })};
}

}  // namespace exemplar::gateway
