// The executor's part in teleoperation: one robot, one who commands it.

#include <utility>

#include "executor/executor.hpp"

namespace exemplar::executor {

Status Executor::ConnectTeleoperation(ircp::Bus& bus) {
  TeleoperationHost host;
  host.apply = [this](Event event, std::string detail) { return Apply(event, std::move(detail)); };
  host.state = [this] { return state_.load(); };
  host.ended = [this] {
    const std::lock_guard lock(mutex_);
    return std::pair(run_end_, run_detail_);
  };
  host.tell = [this](std::string detail) {
    {
      const std::lock_guard lock(mutex_);
      if (state_.load() != State::kTeleoperating) return;
      detail_ = detail;
      transitions_.push_back({State::kTeleoperating, std::move(detail)});
    }
    changed_.notify_all();
  };
  host.silence = [this] { return Silence(); };
  host.speed = [this] { return speed_.load(std::memory_order_relaxed); };
  host.over = [this](const Eigen::VectorXd& commanded) {
    {
      const std::lock_guard lock(mutex_);
      last_command_ = commanded;
    }
    changed_.notify_all();
  };
  host.released = [this] { WakeAll(); };
  host.on_settled = [this] {
    if (options_.on_taken) options_.on_taken();
  };
  TeleoperationSettings settings;
  settings.following = options_.teleoperation;
  settings.rate_hz = options_.rate_hz;
  settings.realtime = options_.realtime;
  settings.watch = options_.watch;
  settings.start_tolerance_rad = options_.planner.start_tolerance_rad;
  auto teleoperation =
      Teleoperation::Create(bus, clock_, log_, robot_, scene_, view_, planner_, *commands_,
                            options_.joint_map.value_or(JointMap(robot_.chain.joint_names())),
                            std::move(host), std::move(settings));
  if (!teleoperation.ok()) return teleoperation.error();
  teleoperation_ = *std::move(teleoperation);
  return {};
}

Result<api::TeleoperationResult> Executor::Teleoperate(
    const api::TeleoperationRequest& request,
    const std::function<void(const api::TeleoperationFeedback&)>& feedback, std::stop_token stop) {
  {
    const std::lock_guard lock(mutex_);
    if (closing_) return Unavailable("the executor is shutting down");
  }
  if (const Status rests = AwaitRest(Event::kTeleoperate); !rests.ok()) return rests.error();
  std::optional<Eigen::VectorXd> last_command;
  {
    const std::lock_guard lock(mutex_);
    last_command = last_command_;
  }
  return teleoperation_->Run(request, feedback, stop, last_command);
}

Status Executor::EndTeleoperation() { return teleoperation_->End(); }

}  // namespace exemplar::executor
