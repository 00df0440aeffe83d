// From a suit's sample to the robot's command, over DDS, through the executor: beside a bare relay
// that reads the same samples and writes the same commands at once. Blocks in turn, in one process.
// Prints a JSON list of rows as tests/bench/run collects them; wants a network of its own
// (tests/system/run_isolated).

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "executor/executor.hpp"
#include "executor/realtime.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "press_skill.hpp"

namespace exemplar::executor {
namespace {

constexpr const char* kName = "bench_teleoperation";
constexpr int kSuitJoints = 42;
constexpr Duration kPatience = std::chrono::seconds(20);

Result<std::unique_ptr<bus::Participant>> Join(const std::string& station, const char* name) {
  return bus::Participant::Create({.domain = 96, .station = station, .name = name});
}

/// Suit, dead-man and robot of one station; takes the times from sample to command.
class Operator {
 public:
  Operator(ircp::Bus& bus, const kinematics::RobotDescription& robot)
      : robot_(robot),
        suit_(*bus.MakeWriter<ircp::SuitSample>("suit")),
        safety_(*bus.MakeWriter<ircp::SafetySample>("dead-man")),
        state_(*bus.MakeWriter<ircp::JointStateSample>("robot")) {
    sample_.names = robot.chain.joint_names();
    sample_.positions.assign(robot.home.begin(), robot.home.end());
    for (int extra = static_cast<int>(sample_.names.size()); extra < kSuitJoints; ++extra) {
      sample_.names.push_back("other_joint_" + std::to_string(extra));
      sample_.positions.push_back(0);
    }
    measured_.names = robot.chain.joint_names();
    measured_.positions.assign(robot.home.begin(), robot.home.end());
    reader_ = *bus.MakeReader<ircp::JointCommandSample>(
        [this](const ircp::JointCommandSample& command, const ircp::Reception&) {
          const Duration now = clock_.Steady();
          const std::lock_guard lock(mutex_);
          measured_.positions = command.positions;
          measured_.command_seq = command.header.seq;
          ++commands_;
          if (sent_at_ && now > *sent_at_) {
            if (taking_) latencies_.push_back(ToSeconds(now - *sent_at_));
            sent_at_.reset();
            came_.notify_all();
          }
        });
    robot_thread_ = std::jthread([this](const std::stop_token& stop) {
      for (int beat = 0; clock_.SleepFor(std::chrono::milliseconds(8), stop); ++beat) {
        ircp::JointStateSample state;
        {
          const std::lock_guard lock(mutex_);
          measured_.positions[0] += beat % 2 == 0 ? 1e-7 : -1e-7;  // no sensor stands still
          state = measured_;
        }
        (void)state_->Write(state);
        if (beat % 6 != 0) continue;
        ircp::SafetySample safety;
        safety.dead_man_held = held_.load();
        (void)safety_->Write(safety);
      }
    });
  }

  void Hold(bool held) { held_.store(held); }
  int readers() const { return suit_->matched_readers(); }
  int writers() const { return reader_->matched_writers(); }

  /// Sends samples until there were so many answers, a sample each `interval`.
  std::vector<double> Move(int samples, Duration interval, bool taking) {
    {
      const std::lock_guard lock(mutex_);
      taking_ = taking;
      latencies_.clear();
      commands_ = 0;
    }
    Duration next = clock_.Steady();
    for (int i = 0; i < samples; ++i) {
      next = std::max(next + interval, clock_.Steady());
      clock_.SleepUntil(next, {});
      time_s_ += ToSeconds(interval);
      sample_.positions[1] = robot_.home[1] + 0.1 * std::sin(3 * time_s_);
      sample_.header.stamp = clock_.Now();
      {
        const std::lock_guard lock(mutex_);
        sent_at_ = clock_.Steady();
      }
      (void)suit_->Write(sample_);
    }
    std::unique_lock lock(mutex_);
    came_.wait_for(lock, std::chrono::seconds(1), [this] { return !sent_at_; });
    sent_at_.reset();
    return latencies_;
  }
  int commands() {
    const std::lock_guard lock(mutex_);
    return commands_;
  }

 private:
  const SystemClock clock_;
  const kinematics::RobotDescription& robot_;
  std::unique_ptr<ircp::Writer<ircp::SuitSample>> suit_;
  std::unique_ptr<ircp::Writer<ircp::SafetySample>> safety_;
  std::unique_ptr<ircp::Writer<ircp::JointStateSample>> state_;
  ircp::SuitSample sample_;
  double time_s_ = 0;
  std::atomic<bool> held_{false};
  std::mutex mutex_;
  std::condition_variable came_;
  ircp::JointStateSample measured_;
  std::optional<Duration> sent_at_;
  std::vector<double> latencies_;
  bool taking_ = false;
  int commands_ = 0;
  std::unique_ptr<ircp::Reader> reader_;
  std::jthread robot_thread_;
};

/// Two hops and nothing between them.
class Relay {
 public:
  Relay(ircp::Bus& bus, const std::vector<std::string>& joints)
      : writer_(*bus.MakeWriter<ircp::JointCommandSample>("relay")) {
    command_.names = joints;
    command_.positions.resize(joints.size());
    command_.velocities.resize(joints.size());
    command_.validity = std::chrono::milliseconds(100);
    reader_ = *bus.MakeReader<ircp::SuitSample>([this](const ircp::SuitSample& sample,
                                                       const ircp::Reception&) {
      std::copy_n(sample.positions.begin(), command_.positions.size(), command_.positions.begin());
      (void)writer_->Write(command_);
    });
  }

 private:
  std::unique_ptr<ircp::Writer<ircp::JointCommandSample>> writer_;
  ircp::JointCommandSample command_;
  std::unique_ptr<ircp::Reader> reader_;
};

double Quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto place = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  return values[place];
}

template <class Condition>
bool Await(const Clock& clock, Condition&& condition) {
  const Duration deadline = clock.Steady() + kPatience;
  while (!condition()) {
    if (clock.Steady() > deadline || !clock.SleepFor(std::chrono::milliseconds(20))) return false;
  }
  return true;
}

int Main(int argc, char** argv) {
  double suit_hz = 250;
  int blocks = 9;
  int samples = 750;
  program::Options options(kName,
                           "From a suit's sample to the robot's command, beside a bare relay",
                           "bench_teleoperation --blocks 9", {});
  options.Add("--suit-hz", suit_hz, "of ircp/suit; over 125, so that each command has its sample")
      .MinMax(130, 1000);
  options.Add("--blocks", blocks, "pairs of blocks").MinMax(1, 100);
  options.Add("--samples", samples, "of a block").MinMax(100, 100000);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  const SystemClock clock;
  NullLog log;
  const auto robot = kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) /
                                                      "deploy" / "models" / "arm7");
  if (!robot.ok()) return program::Fail(kName, robot.error());
  scene::Description scene;
  scene.obstacles.push_back({"table", geometry::Pose::FromTranslation({0.5, 0, -0.02}),
                             kinematics::Box{{1.4, 1.4, 0.03}}});
  std::vector<std::unique_ptr<bus::Participant>> network;
  for (const auto& [station, name] : {std::pair{"ours", "executor"}, std::pair{"ours", "operator"},
                                      std::pair{"bare", "relay"}, std::pair{"bare", "operator"}}) {
    auto joined = Join(station, name);
    if (!joined.ok()) return program::Fail(kName, joined.error());
    network.push_back(*std::move(joined));
  }
  test::PressSkill skill;
  ExecutorOptions settings;
  settings.rate_hz = 125;
  settings.realtime = true;
  // The robot here is a thread of ordinary priority, which may well be late.
  settings.planner.state_patience = kPatience;
  settings.watch.stream.frozen_patience = kPatience;
  settings.watch.stream.delay_patience = kPatience;
  settings.watch.stream.command_patience = kPatience;
  settings.watch.stream.jump_margin_rad = 10;
  settings.watch.path.general = 10;
  settings.teleoperation.suit_patience = std::chrono::seconds(2);
  settings.teleoperation.suit.lateness = std::chrono::seconds(2);
  settings.teleoperation.dead_man_patience = std::chrono::seconds(2);
  auto executor = Executor::Create(*network[0], clock, log, skill, *robot, scene, settings);
  if (!executor.ok()) return program::Fail(kName, executor.error());
  Operator ours(*network[1], *robot);
  const Relay relay(*network[2], robot->chain.joint_names());
  Operator bare(*network[3], *robot);
  const bool met = Await(clock, [&] {
    return ours.readers() > 0 && bare.readers() > 0 && ours.writers() > 0 && bare.writers() > 0 &&
           (*executor)->figures().state_age_s.has_value();
  });
  if (!met) return program::Fail(kName, Unavailable("the parts do not hear each other"));

  const Duration interval = FromSeconds(1 / suit_hz);
  std::vector<double> ratios, value_us, peer_us, value_p50_us, peer_p50_us;
  for (int block = 0; block < blocks; ++block) {
    bare.Move(50, interval, false);
    const std::vector<double> floor = bare.Move(samples, interval, true);

    std::atomic<bool> following{false};
    Result<api::TeleoperationResult> result = Internal("not run");
    std::jthread mode([&] {
      result = (*executor)->Teleoperate(
          {}, [&](const api::TeleoperationFeedback& now) { following = now.phase == "following"; },
          {});
    });
    ours.Hold(false);
    ours.Move(static_cast<int>(0.3 * suit_hz), interval, false);
    ours.Hold(true);
    const bool followed = Await(clock, [&] {
      ours.Move(20, interval, false);
      return following.load();
    });
    std::vector<double> through;
    if (followed) through = ours.Move(samples, interval, true);
    const int commands = ours.commands();
    ours.Hold(false);
    (void)(*executor)->EndTeleoperation();
    mode.join();
    if (!result.ok()) return program::Fail(kName, result.error());
    if (!followed) return program::Fail(kName, Internal("the robot does not follow"));

    const double floor_us = 1e6 * Quantile(floor, 0.99);
    const double our_us = 1e6 * Quantile(through, 0.99);
    std::fprintf(
        stderr,
        "block %d: %zu of %d answered by %d commands, p50 %.0f us, p99 %.0f us; bare relay "
        "p50 %.0f us, p99 %.0f us; ratio %.2f; in the executor p50 %.0f us, p99 %.0f us\n",
        block + 1, through.size(), samples, commands, 1e6 * Quantile(through, 0.5), our_us,
        1e6 * Quantile(floor, 0.5), floor_us, our_us / floor_us, 1e6 * result->latency_p50_s,
        1e6 * result->latency_p99_s);
    ratios.push_back(our_us / floor_us);
    value_us.push_back(our_us);
    peer_us.push_back(floor_us);
    value_p50_us.push_back(1e6 * Quantile(through, 0.5));
    peer_p50_us.push_back(1e6 * Quantile(floor, 0.5));
  }
  bool realtime = false;
  std::thread([&realtime] { realtime = RaisePriority(40); }).join();
  const std::string peer = std::string("bare two-hop relay over the same DDS") +
                           (realtime ? "" : "; no real-time priority here");
  const nlohmann::json rows = {
      {{"name", "teleoperation_suit_to_command_p99"},
       {"value", Quantile(value_us, 0.5)},
       {"unit", "us"},
       {"peer", peer},
       {"peer_value", Quantile(peer_us, 0.5)},
       {"ratio", Quantile(ratios, 0.5)}},
      {{"name", "teleoperation_suit_to_command_p50"},
       {"value", Quantile(value_p50_us, 0.5)},
       {"unit", "us"},
       {"peer", peer},
       {"peer_value", Quantile(peer_p50_us, 0.5)},
       {"ratio", Quantile(value_p50_us, 0.5) / Quantile(peer_p50_us, 0.5)}}};
  std::puts(rows.dump(2).c_str());
  return 0;
}

}  // namespace
}  // namespace exemplar::executor

int main(int argc, char** argv) { return exemplar::executor::Main(argc, argv); }
