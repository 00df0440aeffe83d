// The executor's threads: the control loop, the watch beside it, and the one that publishes and
// logs.

#include <algorithm>
#include <utility>

#include "executor/executor.hpp"
#include "executor/realtime.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::executor {
namespace {

constexpr double kBeat_s = 0.1;
constexpr int kControlPriority = 40;

}  // namespace

void Executor::ControlLoop(const std::stop_token& stop) {
  if (options_.realtime && !RaisePriority(kControlPriority)) {
    log_.Warning("no real-time priority", {{"advice", "CAP_SYS_NICE, or an rtprio limit"}});
  }
  std::stop_source left;
  left.request_stop();
  while (true) {
    std::shared_ptr<MotionRun> run;
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [this] { return !run_over_; })) return;
      run = run_;
    }
    if (!RunMotion(*run, stop)) return;
    commands_->Flush();  // so that the status that follows counts every command
    EndMotion(*run);
    {
      const std::lock_guard lock(mutex_);
      run_over_ = true;
      last_command_ = run->commanded();
    }
    changed_.notify_all();
    // Where time waits for those who sleep by it: this one does no more.
    (void)clock_.SleepUntil(Duration::max(), left.get_token());
  }
}

void Executor::EndMotion(MotionRun& run) {
  // Refused where a stop came first: then the motion ended by that.
  if (const std::optional<std::string> away = run.not_arrived(); away && IsMoving(state_.load())) {
    (void)Apply(Event::kFault, *away);
  } else if (const GuardZone* zone = run.missed()) {
    (void)Apply(Event::kMiss, "no touch: \"" + zone->object + "\" was not felt within " +
                                  FormatFixed(1000 * zone->distance_m, 0) +
                                  " mm past the place where it was expected");
  } else {
    (void)Apply(Event::kFinish, "the end of the motion is reached");
  }
}

bool Executor::RunMotion(MotionRun& run, const std::stop_token& stop) {
  const Duration period = FromSeconds(1 / options_.rate_hz);
  Duration deadline = clock_.Steady();
  Duration before = deadline;
  double since_beat_s = 0;
  while (!run.finished()) {
    if (!clock_.SleepUntil(deadline, stop)) return false;
    const Duration now = clock_.Steady();
    run.AddLateness(now - deadline);
    CountCycle(now - deadline);
    // Cycles that were missed altogether are skipped; the path goes on by the time that passed.
    while (deadline + period <= now) deadline += period;
    const double elapsed_s = ToSeconds(deadline - before);
    before = deadline;
    deadline += period;
    commands_->Put(run.Tick(elapsed_s, state_.load(), speed_.load(std::memory_order_relaxed)));

    if (IsMoving(state_.load())) {
      std::optional<std::string> silence = Silence();
      if (!silence && run.follower() != nullptr) silence = run.follower()->Problem();
      if (silence) (void)Apply(Event::kFault, *silence);
    }
    since_beat_s += elapsed_s;
    if (since_beat_s >= kBeat_s) {
      since_beat_s = 0;
      {
        const std::lock_guard lock(mutex_);
        ++beats_;
      }
      changed_.notify_all();
    }
  }
  return true;
}

void Executor::CountCycle(Duration lateness) {
  cycles_.fetch_add(1, std::memory_order_relaxed);
  lateness_ns_.fetch_add(lateness.count(), std::memory_order_relaxed);
  if (lateness.count() > lateness_max_ns_.load(std::memory_order_relaxed)) {
    lateness_max_ns_.store(lateness.count(), std::memory_order_relaxed);
  }
}

void Executor::WatchLoop(const std::stop_token& stop) {
  std::shared_ptr<MotionRun> run;  // beside the loop that runs it and the call that asked for it
  std::vector<geometry::NamedPose> fixed;
  std::vector<geometry::NamedPose> placed;
  std::vector<motion::Carry> carries;
  while (true) {
    std::shared_ptr<MotionRun> next;
    {
      std::unique_lock lock(measuring_mutex_);
      if (!measured_.wait(lock, stop,
                          [this] { return measuring_ && measuring_->has_unwatched(); })) {
        return;
      }
      next = measuring_;
    }
    if (next != run) {
      run = std::move(next);
      const std::lock_guard lock(mutex_);
      fixed = fixed_;
      placed = placed_;
      carries = carries_;
    }
    std::optional<collision::Scene> moved = planner_.MovedScene(fixed, carries, placed);
    if (moved) {
      const Status set = run->SetScene(*std::move(moved));
      if (!set.ok()) log_.Warning("an object's place is not used", {{"why", set.error().message}});
    }
    const std::optional<std::string> wrong = run->Watch();
    if (wrong && IsMoving(state_.load())) (void)Apply(Event::kFault, *wrong);
    if (run->finished()) WakeAll();
    if (options_.on_taken) options_.on_taken();
  }
}

void Executor::PublishLoop(const std::stop_token& stop) {
  while (true) {
    Transition now;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [this] { return !transitions_.empty(); });
      if (transitions_.empty()) return;
      now = std::move(transitions_.front());
      transitions_.pop_front();
      is_publishing_ = true;
    }
    if (now.from) {
      const bool bad = now.state == State::kProtectiveStop || now.state == State::kEmergencyStop;
      log_.Write(bad ? LogLevel::kWarning : LogLevel::kInfo, ToString(now.state),
                 {{"was", ToString(now.from->first)},
                  {"event", ToString(now.from->second)},
                  {"detail", now.detail}});
    }
    control_->SetState(std::string(ToString(now.state)), now.detail);
    {
      const std::lock_guard lock(mutex_);
      is_publishing_ = false;
    }
    if (options_.on_taken) options_.on_taken();
  }
}

}  // namespace exemplar::executor
