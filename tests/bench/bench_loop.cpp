// How late the executor's control loop begins its cycles, beside a bare timer loop of the same
// period and priority: blocks in turn, in one process, the executor with all its threads. Prints a
// JSON list of rows as tests/bench/run collects them.

#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "executor/executor.hpp"
#include "executor/lateness.hpp"
#include "executor/realtime.hpp"
#include "exemplar/ircp/memory_bus.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "press_skill.hpp"

namespace exemplar::executor {
namespace {

constexpr const char* kName = "bench_loop";
constexpr int kBarePriority = 40;  // the executor's

struct Lateness {
  double p99_s = 0;
  double max_s = 0;
};

/// What any periodic loop must do: wait for an absolute time, look at the clock.
Lateness BareLoop(Duration period, std::uint64_t cycles) {
  LatenessHistogram histogram;
  std::thread loop([&] {
    (void)RaisePriority(kBarePriority);
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    const auto nanoseconds = [](const timespec& t) {
      return t.tv_sec * 1'000'000'000L + t.tv_nsec;
    };
    long deadline = nanoseconds(now);
    for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
      const timespec until{deadline / 1'000'000'000L, deadline % 1'000'000'000L};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      clock_gettime(CLOCK_MONOTONIC, &now);
      const long woken = nanoseconds(now);
      histogram.Add(Duration(woken - deadline));
      while (deadline + period.count() <= woken) deadline += period.count();
      deadline += period.count();
    }
  });
  loop.join();
  return {histogram.QuantileSeconds(0.99), histogram.max_s()};
}

/// A robot that is where it was last told to be, and says so 125 times a second.
class Robot {
 public:
  Robot(ircp::Bus& bus, const kinematics::RobotDescription& robot)
      : writer_(*bus.MakeWriter<ircp::JointStateSample>("robot")) {
    state_.names = robot.chain.joint_names();
    state_.positions.assign(robot.home.data(), robot.home.data() + robot.home.size());
    reader_ = *bus.MakeReader<ircp::JointCommandSample>(
        [this](const ircp::JointCommandSample& sample, const ircp::Reception&) {
          const std::lock_guard lock(mutex_);
          state_.positions = sample.positions;
          state_.command_seq = sample.header.seq;
        });
    thread_ = std::jthread([this](const std::stop_token& stop) {
      const SystemClock clock;
      while (clock.SleepFor(std::chrono::milliseconds(8), stop)) {
        ircp::JointStateSample state;
        {
          const std::lock_guard lock(mutex_);
          state = state_;
        }
        (void)writer_->Write(state);
      }
    });
  }

 private:
  std::unique_ptr<ircp::Writer<ircp::JointStateSample>> writer_;
  std::unique_ptr<ircp::Reader> reader_;
  std::mutex mutex_;
  ircp::JointStateSample state_;
  std::jthread thread_;
};

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

int Main(int argc, char** argv) {
  double rate_hz = 500;
  int blocks = 7;
  program::Options options(kName, "Lateness of the executor's control loop beside a bare timer's",
                           "bench_loop --rate-hz 500 --blocks 7", {});
  options.Add("--rate-hz", rate_hz, "of the loops").MinMax(60, 1000);
  options.Add("--blocks", blocks, "pairs of blocks").MinMax(1, 100);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  const SystemClock clock;
  NullLog log;
  ircp::MemoryBus bus(clock);
  const auto robot = kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) /
                                                      "deploy" / "models" / "arm7");
  if (!robot.ok()) return program::Fail(kName, robot.error());
  const scene::Description scene;
  test::PressSkill skill;
  ExecutorOptions settings;
  settings.rate_hz = rate_hz;
  settings.realtime = true;
  // The robot here is a thread of ordinary priority, which may well be late.
  settings.planner.state_patience = std::chrono::seconds(10);
  settings.watch.stream.frozen_patience = std::chrono::seconds(10);
  settings.watch.stream.delay_patience = std::chrono::seconds(10);
  settings.watch.stream.command_patience = std::chrono::seconds(10);
  settings.watch.stream.jump_margin_rad = 10;
  settings.watch.path.general = 10;
  auto executor = Executor::Create(bus, clock, log, skill, *robot, scene, settings);
  if (!executor.ok()) return program::Fail(kName, executor.error());
  Robot follower(bus, *robot);
  api::ExecuteRequest request;
  request.skill = "press";
  request.objects = {{"target", geometry::Pose::FromTranslation(test::kTarget), true}};

  bool realtime = false;
  std::thread([&realtime] { realtime = RaisePriority(kBarePriority); }).join();
  std::vector<double> ratios;
  std::vector<double> ours;
  std::vector<double> bare;
  for (int block = 0; block < blocks; ++block) {
    clock.SleepFor(std::chrono::milliseconds(100));
    const std::uint64_t before = (*executor)->figures().cycles;
    const auto result = (*executor)->Execute(request, {}, {});
    if (!result.ok()) return program::Fail(kName, result.error());
    if (result->state != "done") return program::Fail(kName, Internal(result->detail));
    const std::uint64_t cycles = (*executor)->figures().cycles - before;
    const Lateness floor = BareLoop(FromSeconds(1 / rate_hz), cycles);
    ours.push_back(result->lateness_p99_s);
    bare.push_back(floor.p99_s);
    ratios.push_back(result->lateness_p99_s / floor.p99_s);
    std::fprintf(stderr, "block %d: %llu cycles, p99 %.1f us, bare %.1f us, ratio %.2f\n",
                 block + 1, static_cast<unsigned long long>(cycles), 1e6 * ours.back(),
                 1e6 * bare.back(), ratios.back());
  }
  const nlohmann::json rows = {{{"name", "control_loop_lateness_p99"},
                                {"value", 1e6 * Median(ours)},
                                {"unit", "us"},
                                {"peer", realtime ? "bare timer loop, real-time priority"
                                                  : "bare timer loop, ordinary priority"},
                                {"peer_value", 1e6 * Median(bare)},
                                {"ratio", Median(ratios)}}};
  std::puts(rows.dump(2).c_str());
  return 0;
}

}  // namespace
}  // namespace exemplar::executor

int main(int argc, char** argv) { return exemplar::executor::Main(argc, argv); }
