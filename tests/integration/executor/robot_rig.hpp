#pragma once
// An executor on a network within the process, a robot that does what it is told, and time that
// moves by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>

#include "executor/executor.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/memory_bus.hpp"
#include "press_skill.hpp"

namespace exemplar::executor::test {

/// A log that nobody reads; writing waits while it is shut, as to a terminal that was stopped.
class GateLog final : public Log {
 public:
  void Write(LogLevel, std::string_view, Fields) override {
    std::unique_lock lock(mutex_);
    ++writing_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !shut_; });
    --writing_;
  }
  void Shut(bool shut) {
    const std::lock_guard lock(mutex_);
    shut_ = shut;
    changed_.notify_all();
  }
  void AwaitWriter() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return writing_ > 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool shut_ = false;
  int writing_ = 0;
};

/// The rig of most tests. Time moves only in Step.
class RobotRig : public ::testing::Test {
 protected:
  explicit RobotRig(const ExecutorOptions& options = {})
      : robot_(*kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) /
                                                 "deploy" / "models" / "arm7")) {
    measured_ = robot_.home;
    scene_.obstacles.push_back({"table", geometry::Pose::FromTranslation({0.5, 0, -0.02}),
                                kinematics::Box{{1.4, 1.4, 0.03}}});
    scene::Button button;
    button.name = "target";
    button.base_T_object.translation = {0.4, 0.3, 0.04};
    scene_.buttons.push_back(button);
    button.name = "block";
    button.base_T_object.translation = {-0.5, 0.5, 0.1};
    button.radius_m = 0.03;
    button.height_m = 0.1;
    scene_.buttons.push_back(button);
    ExecutorOptions told = options;
    told.on_taken = [this, also = options.on_taken] {
      if (also) also();
      { const std::lock_guard lock(mutex_); }
      heard_.notify_all();
    };
    executor_ = *Executor::Create(bus_, clock_, log_, skills_, robot_, scene_, told);
    state_writer_ = *bus_.MakeWriter<ircp::JointStateSample>("robot");
    object_writer_ = *bus_.MakeWriter<ircp::ObjectSample>("vision");
    safety_writer_ = *bus_.MakeWriter<ircp::SafetySample>("panel");
    command_reader_ = *bus_.MakeReader<ircp::JointCommandSample>(
        [this](const ircp::JointCommandSample& sample, const ircp::Reception&) {
          const std::lock_guard lock(mutex_);
          commanded_ = Eigen::Map<const Eigen::VectorXd>(
              sample.positions.data(), static_cast<Eigen::Index>(sample.positions.size()));
          speed_ =
              Eigen::Map<const Eigen::VectorXd>(sample.velocities.data(),
                                                static_cast<Eigen::Index>(sample.velocities.size()))
                  .norm();
          ++commands_;
          heard_.notify_all();
        });
    PublishState();
  }

  ~RobotRig() override { executor_.reset(); }

  void PublishState() {
    ircp::JointStateSample sample;
    sample.names = robot_.chain.joint_names();
    sample.positions.assign(measured_.data(), measured_.data() + measured_.size());
    sample.touch_sensors = {"finger"};
    sample.touch_n = {touch_n_};
    if (state_delay_ > Duration::zero()) sample.header.stamp = clock_.Now() - state_delay_;
    if (command_lag_) {
      const std::lock_guard lock(mutex_);
      sample.command_seq = commands_ > *command_lag_ ? commands_ - *command_lag_ : 1;
    }
    ASSERT_TRUE(state_writer_->Write(sample).ok());
  }

  void See(const Eigen::Vector3d& position, const std::string& name = "target") {
    ircp::ObjectSample sample;
    sample.name = name;
    sample.frame = "base";
    sample.base_T_object.translation = position;
    ASSERT_TRUE(object_writer_->Write(sample).ok());
  }

  static api::ExecuteRequest Press() {
    api::ExecuteRequest request;
    request.skill = "press";
    request.objects = {{"target", geometry::Pose::FromTranslation(kTarget), true}};
    return request;
  }

  /// Starts an execution on a thread of its own.
  void Begin(const api::ExecuteRequest& request) {
    over_ = false;
    execution_ = std::async(std::launch::async, [this, request] {
      Result<api::ExecutionResult> result = executor_->Execute(
          request,
          [this](const api::ExecutionFeedback& now) {
            const std::lock_guard lock(mutex_);
            feedback_.push_back(now);
          },
          stop_.get_token());
      const std::lock_guard lock(mutex_);
      over_ = true;
      heard_.notify_all();
      return result;
    });
    Await([this] { return commands_ > 0 || over_; });
  }

  /// One cycle: time moves on, the executor commands, the robot is there (but for `lag_`).
  void Step() {
    std::uint64_t before = 0;
    {
      const std::lock_guard lock(mutex_);
      before = commands_;
    }
    clock_.Advance(std::chrono::milliseconds(8));
    Await([&] { return commands_ > before || over_; });
    {
      const std::lock_guard lock(mutex_);
      if (follows_ && commanded_.size() > 0) {
        measured_ = commanded_;
        measured_[1] += lag_rad_;
      } else if (!frozen_) {
        measured_[0] += 1e-7;  // no sensor stands quite still
      }
    }
    if (!speaks_) return;
    PublishState();
    // A busy machine must not let the checks fall behind: in the world there are 8 ms for them.
    if (awaits_checks_) Await([this] { return over_ || executor_->IsSettled(); });
  }

  void Steps(int count) {
    for (int i = 0; i < count && !over(); ++i) Step();
  }

  Result<api::ExecutionResult> Finish() {
    for (int i = 0; i < 5000 && !over(); ++i) Step();
    EXPECT_TRUE(over());
    return execution_.get();
  }

  bool over() {
    const std::lock_guard lock(mutex_);
    return over_;
  }

  std::string state() { return executor_->GetStatus()->state; }

  double speed() {
    const std::lock_guard lock(mutex_);
    return speed_;
  }

  template <class Condition>
  void Await(Condition condition) {
    std::unique_lock lock(mutex_);
    ASSERT_TRUE(heard_.wait_for(lock, std::chrono::seconds(30), condition));
  }

  kinematics::RobotDescription robot_;
  scene::Description scene_;
  ManualClock clock_;
  GateLog log_;
  ircp::MemoryBus bus_{clock_};
  PressSkill skills_;
  std::unique_ptr<Executor> executor_;
  std::unique_ptr<ircp::Writer<ircp::JointStateSample>> state_writer_;
  std::unique_ptr<ircp::Writer<ircp::ObjectSample>> object_writer_;
  std::unique_ptr<ircp::Writer<ircp::SafetySample>> safety_writer_;
  std::unique_ptr<ircp::Reader> command_reader_;
  std::stop_source stop_;
  std::future<Result<api::ExecutionResult>> execution_;

  Eigen::VectorXd measured_;
  double touch_n_ = 0;
  double lag_rad_ = 0;
  bool follows_ = true;
  bool frozen_ = false;
  Duration state_delay_{0};
  std::optional<std::uint64_t> command_lag_;  ///< in commands; absent: the robot does not say
  bool speaks_ = true;
  bool awaits_checks_ = true;  ///< of a state, before the next step

  std::mutex mutex_;
  std::condition_variable heard_;
  Eigen::VectorXd commanded_;
  double speed_ = 0;
  std::uint64_t commands_ = 0;
  std::vector<api::ExecutionFeedback> feedback_;
  bool over_ = false;
};

}  // namespace exemplar::executor::test
