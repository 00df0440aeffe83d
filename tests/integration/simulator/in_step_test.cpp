#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>

#include "exemplar/ircp/in_step_bus.hpp"
#include "exemplar/ircp/memory_bus.hpp"
#include "pressing.hpp"
#include "robots.hpp"
#include "simulator/session.hpp"
#include "support/eventually.hpp"

namespace exemplar::simulator {
namespace {

using std::chrono::milliseconds;

constexpr double kBegin_s = 0.2;
constexpr Duration kBeat = milliseconds(8);

struct Pressed {
  double click_s = 0;
  std::vector<std::vector<double>> measured;  ///< joints, by state
  std::vector<double> touch_n;
};

/// A button is pressed by a controller that follows the simulated time.
class InStep : public ::testing::Test {
 protected:
  InStep() : scene_(Scene("press_table.yaml")), robot_(Robot("leonardo")) {
    const scene::Button& button = scene_.buttons.front();
    press_.emplace(robot_, button, button.base_T_object, 0.004);
  }

  /// Commands `kBegin_s` after the beginning: over the button in 1 s, down in 0.6 s.
  Eigen::VectorXd TargetAt(double time_s) const {
    const auto smooth = [](double s) { return s * s * s * (10 - 15 * s + 6 * s * s); };
    const double over = std::min(1.0, (time_s - kBegin_s) / 1.0);
    if (over < 1) return robot_.home + smooth(over) * (press_->above - robot_.home);
    const double down = std::min(1.0, (time_s - kBegin_s - 1) / 0.6);
    const double stretches = smooth(down) * static_cast<double>(press_->down.size());
    const std::size_t at =
        std::min(press_->down.size() - 1, static_cast<std::size_t>(std::floor(stretches)));
    const Eigen::VectorXd& from = at == 0 ? press_->above : press_->down[at - 1];
    return from + (stretches - static_cast<double>(at)) * (press_->down[at] - from);
  }

  Pressed PressOnce(const SensorNoise& noise, Duration command_delay = Duration(0)) {
    constexpr std::size_t kStates = 260;
    SessionOptions options;
    options.cameras = false;
    options.pace = 0;
    options.in_step_with = {"executor"};
    options.noise = noise;
    options.command_delay = command_delay;
    NullLog log;
    ircp::MemoryBus bus(real_);
    Pressed run;
    std::mutex mutex;
    const auto states = *bus.MakeReader<ircp::JointStateSample>(
        [&](const ircp::JointStateSample& sample, const ircp::Reception&) {
          const std::lock_guard lock(mutex);
          if (run.measured.size() >= kStates) return;
          run.measured.push_back(sample.positions);
          run.touch_n.push_back(sample.touch_n.front());
        });
    const auto clock = std::move(*ircp::NetworkClock::Create(bus, "executor"));
    ircp::InStepBus in_step(bus, bus, nullptr, *clock);
    const auto writer = *in_step.MakeWriter<ircp::JointCommandSample>("executor");
    std::jthread controller([&](const std::stop_token& stop) {
      for (Duration at = FromSeconds(kBegin_s); clock->SleepUntil(at, stop); at += kBeat) {
        const Eigen::VectorXd q = TargetAt(ToSeconds(at));
        ircp::JointCommandSample sample;
        sample.header.stamp = clock->Now();
        sample.names = robot_.chain.joint_names();
        sample.positions.assign(q.data(), q.data() + q.size());
        EXPECT_TRUE(writer->Write(sample).ok());
      }
    });
    EXPECT_TRUE(exemplar::testing::Eventually([&] { return clock->asleep() == 1; }));
    auto session = Session::Create(bus, real_, log, robot_, scene_, options);
    EXPECT_TRUE(session.ok());
    if (!session.ok()) return run;
    std::jthread running([&](const std::stop_token& stop) { (*session)->Run(stop); });
    EXPECT_TRUE(exemplar::testing::Eventually([&] {
      const std::lock_guard lock(mutex);
      return run.measured.size() >= kStates;
    }));
    running.request_stop();
    running.join();
    EXPECT_EQ((*session)->figures().clicks.at("target"), 1u);
    run.click_s = (*session)->figures().last_click_s.at("target");
    return run;
  }

  const SystemClock real_;
  const scene::Description scene_;
  const kinematics::RobotDescription robot_;
  std::optional<Press> press_;
};

TEST_F(InStep, TheSameRunGivesTheSameResult) {
  const SensorNoise noise{.position_rad = 1e-4, .velocity_rad_s = 1e-3, .touch_n = 0.05, .seed = 7};
  const Pressed first = PressOnce(noise);
  const Pressed second = PressOnce(noise);
  EXPECT_GT(first.click_s, kBegin_s + 1);
  EXPECT_EQ(first.click_s, second.click_s);
  EXPECT_TRUE(first.measured == second.measured);
  EXPECT_TRUE(first.touch_n == second.touch_n);
}

TEST_F(InStep, NoiseChangesWhatIsMeasuredAndNotWhatHappens) {
  const Pressed still = PressOnce({});
  const Pressed noisy = PressOnce({.position_rad = 1e-3, .seed = 2});
  EXPECT_EQ(still.click_s, noisy.click_s);
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < still.measured.size(); ++i) {
    for (std::size_t j = 0; j < still.measured[i].size(); ++j, ++count) {
      squares += std::pow(noisy.measured[i][j] - still.measured[i][j], 2);
    }
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 1e-3, 5e-5);
}

TEST_F(InStep, ADelayOfCommandsDelaysThePressByAsMuch) {
  const Pressed prompt = PressOnce({});
  const Pressed late = PressOnce({}, milliseconds(40));
  EXPECT_NEAR(late.click_s - prompt.click_s, 0.040, 1e-9);
}

TEST_F(InStep, RefusesOptionsWithoutSense) {
  const auto refused = [this](const SessionOptions& options) {
    NullLog log;
    ircp::MemoryBus bus(real_);
    const auto session = Session::Create(bus, real_, log, robot_, scene_, options);
    return session.ok() ? std::string() : session.error().message;
  };
  SessionOptions pace;
  pace.pace = -1;
  EXPECT_EQ(refused(pace), "pace is -1, must be 0 or more");
  SessionOptions delay;
  delay.command_delay = milliseconds(-3);
  EXPECT_EQ(refused(delay), "command delay is -0.003 s, must not be negative");
  SessionOptions noise;
  noise.noise.touch_n = -0.5;
  EXPECT_EQ(refused(noise), "noise-touch is -0.5, must be a standard deviation of 0 or more");
}

}  // namespace
}  // namespace exemplar::simulator
