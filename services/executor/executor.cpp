#include "executor/executor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/ircp/status_values.hpp"

namespace exemplar::executor {

namespace {

constexpr const char* kProgram = "executor";
constexpr Duration kShutdownPatience = std::chrono::seconds(5);
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();

}  // namespace

Error Refused(State state, Event event, const std::string& holder) {
  std::string message =
      "cannot " + std::string(ToString(event)) + " while " + std::string(ToString(state));
  if (!holder.empty() &&
      (IsMoving(state) || state == State::kPlanning || state == State::kTeleoperating)) {
    message += ": the robot belongs to " + holder;
  }
  if (state == State::kProtectiveStop || state == State::kEmergencyStop) {
    message += "; reset first";
  }
  return FailedPrecondition(std::move(message));
}

Executor::Executor(const Clock& clock, Log& log, api::SkillApi& skills,
                   const kinematics::RobotDescription& robot, const scene::Description& scene,
                   ExecutorOptions options)
    : clock_(clock),
      log_(log),
      robot_(robot),
      scene_(scene),
      options_(std::move(options)),
      view_(robot.chain.joint_names()),
      planner_(clock, skills, robot, scene, view_, options_.planner),
      following_planner_(clock, planner_, tracks_, robot, options_.following),
      state_received_ns_(kNever),
      safety_received_ns_(kNever) {}

Result<std::unique_ptr<Executor>> Executor::Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                   api::SkillApi& skills,
                                                   const kinematics::RobotDescription& robot,
                                                   const scene::Description& scene,
                                                   ExecutorOptions options) {
  if (!(options.rate_hz >= 1 && options.rate_hz <= 1000)) {
    return InvalidArgument(
        "rate is " + FormatDouble(options.rate_hz) + " Hz, must be between 1 and 1000", "rate_hz");
  }
  if (static_cast<std::size_t>(robot.chain.dof()) > kMaxJoints) {
    return InvalidArgument("robot \"" + robot.name + "\" has " + std::to_string(robot.chain.dof()) +
                           " joints, at most " + std::to_string(kMaxJoints) + " can be commanded");
  }
  options.watch.command_period = FromSeconds(1 / options.rate_hz);
  options.planner.plan.touch_links = robot.touch_links;
  options.planner.plan.comfortable = robot.home;
  // Meshes and shapes are looked at once now, so that a bad one shows before anything moves.
  const Result<collision::CollisionChecker> checker = collision::CollisionChecker::Create(
      robot.model, collision::MakeScene(scene), collision::OptionsOf(robot));
  if (!checker.ok()) return checker.error();
  std::unique_ptr<Executor> executor(
      new Executor(clock, log, skills, robot, scene, std::move(options)));
  const Status connected = executor->Connect(bus);
  if (!connected.ok()) return connected.error();
  return executor;
}

Status Executor::Connect(ircp::Bus& bus) {
  auto writer = bus.MakeWriter<ircp::JointCommandSample>(kProgram);
  if (!writer.ok()) return writer.error();
  const Duration period = FromSeconds(1 / options_.rate_hz);
  const Duration validity = std::max<Duration>(5 * period, std::chrono::milliseconds(100));
  commands_ = std::make_unique<CommandStream>(*std::move(writer), robot_.chain.joint_names(),
                                              validity, options_.realtime);
  auto plans = bus.MakeWriter<ircp::PlanSample>(kProgram);
  if (!plans.ok()) return plans.error();
  plans_ = *std::move(plans);
  if (Status on = ConnectTeleoperation(bus); !on.ok()) return on;
  auto control = ircp::ControlServer::Create(
      bus, clock_, kProgram,
      [this](const ircp::CommandSample& command) { return OnCommand(command); });
  if (!control.ok()) return control.error();
  control_ = *std::move(control);
  control_->SetSentCounts([this] { return sent(); });
  control_->SetOnRival([this](const std::string& rival) {
    log_.Warning("another executor runs in this station: both command the robot",
                 {{"writer", rival}, {"advice", "end one of them, or give it its own --station"}});
  });
  control_->SetValues([this] {
    std::map<std::string, std::string> values = {{"speed", FormatDouble(speed_.load())}};
    if (const std::optional<Stamp> press = teleoperation_->AnsweredPress()) {
      values[ircp::kAnsweredPress] = std::to_string(press->nanoseconds());
    }
    const std::lock_guard lock(mutex_);
    if (!holder_.empty() && IsMoving(state_.load())) values["holder"] = holder_;
    if (run_ != nullptr && !run_over_) {
      values["time_s"] = FormatFixed(run_->path_time_s(), 3);
      values["duration_s"] = FormatFixed(run_->duration_s(), 3);
      values["tracking_error_rad"] = FormatFixed(run_->tracking_error_rad(), 4);
      values["touch_n"] = FormatFixed(run_->touch_n(), 2);
    }
    return values;
  });
  control_->SetState(std::string(ToString(State::kIdle)), "");

  control_thread_ = std::jthread([this](const std::stop_token& stop) { ControlLoop(stop); });
  watch_thread_ = std::jthread([this](const std::stop_token& stop) { WatchLoop(stop); });
  publish_thread_ = std::jthread([this](const std::stop_token& stop) { PublishLoop(stop); });

  auto states = bus.MakeReader<ircp::JointStateSample>(
      [this](const ircp::JointStateSample& sample, const ircp::Reception&) {
        OnJointState(sample);
      });
  if (!states.ok()) return states.error();
  state_reader_ = *std::move(states);
  auto objects = bus.MakeReader<ircp::ObjectSample>(
      [this](const ircp::ObjectSample& sample, const ircp::Reception&) { OnObject(sample); });
  if (!objects.ok()) return objects.error();
  object_reader_ = *std::move(objects);
  auto safety = bus.MakeReader<ircp::SafetySample>(
      [this](const ircp::SafetySample& sample, const ircp::Reception&) { OnSafety(sample); });
  if (!safety.ok()) return safety.error();
  safety_reader_ = *std::move(safety);
  return {};
}

Executor::~Executor() {
  state_reader_.reset();
  object_reader_.reset();
  safety_reader_.reset();
  for (std::jthread* thread : {&control_thread_, &watch_thread_, &publish_thread_}) {
    thread->request_stop();
    if (thread->joinable()) thread->join();
  }
  control_.reset();  // it asks for what teleoperation knows
  teleoperation_.reset();
}

// ---------------------------------------------------------------- state

Status Executor::Apply(Event event, std::string detail, std::shared_ptr<MotionRun> run) {
  State before;
  State after;
  {
    const std::lock_guard lock(mutex_);
    before = state_.load();
    const std::optional<State> next = Next(before, event);
    if (!next) return Refused(before, event, holder_);
    after = *next;
    if (after == before && event == Event::kEmergency) return {};
    state_.store(after);
    detail_ = detail;
    if (before == State::kPlanning && after != State::kReady) planning_stop_.request_stop();
    if (run) {
      run_ = std::move(run);
      run_over_ = false;
      beats_ = 0;
      const std::lock_guard measuring(measuring_mutex_);
      measuring_ = run_;
    }
    if (after == State::kTeleoperating) holder_ = "an operator: it is teleoperated";
    const bool left = before == State::kTeleoperating && after != State::kTeleoperating;
    if (left || (IsMoving(before) && !IsMoving(after))) {
      run_end_ = after;
      run_detail_ = detail;
    }
    transitions_.push_back({after, std::move(detail), std::pair(before, event)});
  }
  changed_.notify_all();
  return {};
}

Status Executor::Pause() { return Apply(Event::kPause, "paused"); }
Status Executor::Resume() { return Apply(Event::kResume, "resumed"); }
Status Executor::Cancel() { return Apply(Event::kCancel, "cancelled"); }
Status Executor::Stop() { return Apply(Event::kStop, "stopped by request"); }
Status Executor::Reset() { return Apply(Event::kReset, ""); }

Status Executor::SetSpeed(double factor) {
  if (!(factor > 0 && factor <= 1)) {
    return InvalidArgument("speed is " + FormatDouble(factor) + ", must be above 0 and at most 1",
                           "factor");
  }
  speed_.store(factor);
  log_.Info("speed", {{"factor", factor}});
  return {};
}

ircp::Answer Executor::OnCommand(const ircp::CommandSample& command) {
  Status done;
  if (command.action == "pause") {
    done = Pause();
  } else if (command.action == "resume") {
    done = Resume();
  } else if (command.action == "cancel") {
    done = Cancel();
  } else if (command.action == "stop") {
    done = Stop();
  } else if (command.action == "reset") {
    done = Reset();
  } else if (command.action == "end_teleoperation") {
    done = EndTeleoperation();
  } else if (command.action == "speed") {
    const auto factor = command.arguments.find("factor");
    const std::optional<double> value =
        factor == command.arguments.end() ? std::nullopt : ParseDouble(factor->second);
    done =
        value ? SetSpeed(*value) : InvalidArgument("speed needs a number as \"factor\"", "factor");
  } else {
    done = InvalidArgument(
        "unknown action \"" + command.action +
        "\"; known are pause, resume, cancel, stop, reset, speed, end_teleoperation");
  }
  if (!done.ok()) return {false, done.error().message, {}};
  return {true, std::string(ToString(state_.load())), {}};
}

void Executor::OnSafety(const ircp::SafetySample& sample) {
  safety_received_ns_.store(clock_.Steady().count());
  teleoperation_->Take(sample);
  if (sample.emergency_stop) {
    (void)Apply(Event::kEmergency, "emergency stop by " + sample.header.source);
  } else if (sample.reset && state_.load() == State::kEmergencyStop) {
    (void)Apply(Event::kReset, "reset by " + sample.header.source);
  }
}

void Executor::OnJointState(const ircp::JointStateSample& sample) {
  const Duration now = clock_.Steady();
  const std::optional<MeasuredState> state = view_.Take(sample, now);
  if (state) {
    state_received_ns_.store(now.count());
    {
      const std::lock_guard lock(measuring_mutex_);
      if (measuring_) measuring_->Measure(*state, commands_->sent());
    }
    measured_.notify_one();
    teleoperation_->Measure(*state);
  }
  has_state_.store(true);
  if (options_.on_taken) options_.on_taken();
}

void Executor::OnObject(const ircp::ObjectSample& sample) {
  constexpr Duration kOldest = std::chrono::milliseconds(300);
  const Duration now = clock_.Steady();
  view_.Take(sample, now);
  // A sender whose clock is another's is taken to be prompt.
  const Duration age = clock_.Now() - sample.header.stamp;
  const bool plausible = age >= Duration::zero() && age <= kOldest;
  const auto& variance = sample.position_variance_m2;
  const double sigma_m = std::sqrt(*std::max_element(variance.begin(), variance.end()));
  tracks_.Add(sample.name, plausible ? now - age : now, sample.base_T_object, sigma_m);
  std::shared_ptr<Following> following;
  {
    const std::lock_guard lock(mutex_);
    following = following_;
  }
  if (following) following->Take(sample.name);
  if (options_.on_taken) options_.on_taken();
}

bool Executor::IsSettled() const {
  {
    const std::lock_guard lock(mutex_);
    if (is_publishing_ || !transitions_.empty()) return false;
    if (following_ && !following_->IsSettled()) return false;
  }
  if (!teleoperation_->IsSettled()) return false;
  commands_->Flush();
  if (!has_state_.load() && state_reader_->matched_writers() == 0) return false;
  const std::lock_guard lock(measuring_mutex_);
  return !measuring_ || !measuring_->has_unwatched();
}

std::optional<Duration> Executor::StateAge() const {
  const std::int64_t received = state_received_ns_.load();
  if (received == kNever) return std::nullopt;
  return clock_.Steady() - Duration(received);
}

std::optional<std::string> Executor::SafetySilence() const {
  if (options_.safety_patience == Duration::zero()) return std::nullopt;
  const std::int64_t received = safety_received_ns_.load();
  if (received == kNever) return "nothing was heard on ircp/safety, which is asked for";
  const Duration age = clock_.Steady() - Duration(received);
  if (age <= options_.safety_patience) return std::nullopt;
  return "the last sample on ircp/safety is " + FormatFixed(ToSeconds(age), 2) + " s old, " +
         FormatFixed(ToSeconds(options_.safety_patience), 2) + " s allowed";
}

std::optional<std::string> Executor::Silence() const {
  const std::optional<Duration> age = StateAge();
  if (age && *age <= options_.planner.state_patience) return SafetySilence();
  const std::string problem = view_.problem();
  return "the robot's last usable joint state is " + FormatFixed(age ? ToSeconds(*age) : 0, 2) +
         " s old" + (problem.empty() ? "" : ": " + problem);
}

ExecutorFigures Executor::figures() const {
  ExecutorFigures now;
  now.state = ToString(state_.load());
  now.speed = speed_.load();
  now.plans_refused = plans_refused_.load(std::memory_order_relaxed);
  now.commands_dropped = commands_->dropped();
  now.commands_failed = commands_->failed();
  now.command_readers = commands_->matched_readers();
  now.cycles = cycles_.load(std::memory_order_relaxed);
  now.lateness_s = ToSeconds(Duration(lateness_ns_.load(std::memory_order_relaxed)));
  now.lateness_max_s = ToSeconds(Duration(lateness_max_ns_.load(std::memory_order_relaxed)));
  if (const std::optional<Duration> age = StateAge()) now.state_age_s = ToSeconds(*age);
  now.teleoperation = teleoperation_->figures();
  const std::lock_guard lock(mutex_);
  now.executions = executions_;
  return now;
}

std::vector<ircp::TopicCount> Executor::sent() const {
  return {{ircp::JointCommandSample::kTopic, kProgram, commands_->sent()}};
}

std::vector<ircp::TopicReader> Executor::readers() const {
  return {{ircp::JointStateSample::kTopic, state_reader_.get()},
          {ircp::ObjectSample::kTopic, object_reader_.get()},
          {ircp::SafetySample::kTopic, safety_reader_.get()},
          {ircp::SuitSample::kTopic, teleoperation_->suit_reader()}};
}

Result<api::RobotStatus> Executor::GetStatus() {
  api::RobotStatus status;
  {
    const std::lock_guard lock(mutex_);
    status.state = ToString(state_.load());
    status.detail = detail_;
  }
  status.speed = speed_.load();
  const Duration now = clock_.Steady();
  if (const std::optional<MeasuredState> measured = view_.latest()) {
    status.joint_names = robot_.chain.joint_names();
    status.joints = measured->joints;
    status.state_age_s = ToSeconds(now - measured->received);
    status.base_T_tool = robot_.chain.ToolPose(measured->joints);
  } else if (status.detail.empty()) {
    status.detail = view_.problem();
  }
  status.objects = view_.objects(now);
  return status;
}

// ---------------------------------------------------------------- planning

Status Executor::Begin(const api::ExecuteRequest& request) {
  if (request.skill.empty()) return InvalidArgument("no skill is named", "skill");
  if (request.follow && !request.objects.empty()) {
    return InvalidArgument("a target that is followed is taken where it is seen: name no objects",
                           "objects");
  }
  if (!(request.speed > 0 && request.speed <= 1)) {
    return InvalidArgument(
        "speed is " + FormatDouble(request.speed) + ", must be above 0 and at most 1", "speed");
  }
  {
    const std::lock_guard lock(mutex_);
    if (closing_) return Unavailable("the executor is shutting down");
  }
  if (Status rests = AwaitRest(Event::kPlan); !rests.ok()) return rests;
  if (const std::optional<std::string> silence = SafetySilence()) return Unavailable(*silence);
  Status begun = Apply(Event::kPlan, "planning \"" + request.skill + "\"");
  if (!begun.ok()) return begun;
  const std::lock_guard lock(mutex_);
  holder_ = "an execution of \"" + request.skill + "\"";
  if (!request.client.empty()) holder_ += " (" + request.client + ")";
  return {};
}

Status Executor::AwaitRest(Event event) {
  std::unique_lock lock(mutex_);
  const auto rests = [this] { return run_over_ && !teleoperation_->active(); };
  const auto may = [&] { return Next(state_.load(), event).has_value(); };
  changed_.wait_for(lock, options_.rest_patience, [&] { return rests() || !may(); });
  if (!may()) return Refused(state_.load(), event, holder_);
  if (rests()) return {};
  return Unavailable("the robot is still slowing down after " + holder_ + ", which is " +
                     std::string(ToString(state_.load())) + "; ask again");
}

Result<Planned> Executor::MakePlan(const api::ExecuteRequest& request,
                                   std::optional<FollowingPlan>* followed) {
  std::stop_token stop;
  std::optional<Eigen::VectorXd> last_command;
  {
    const std::lock_guard lock(mutex_);
    planning_stop_ = std::stop_source();
    stop = planning_stop_.get_token();
    last_command = last_command_;
  }
  Result<Planned> planned = FailedPrecondition("not planned");
  if (request.follow) {
    Result<FollowingPlan> plan = following_planner_.Plan(request, last_command, stop);
    if (plan.ok()) {
      planned = std::move(plan->planned);
      if (followed != nullptr) followed->emplace(*std::move(plan));
    } else {
      planned = plan.error();
    }
  } else {
    planned = planner_.Plan(request, last_command, stop);
  }
  if (!planned.ok()) {
    plans_refused_.fetch_add(1, std::memory_order_relaxed);
    (void)Apply(Event::kRefused, "refused: " + planned.error().message);
    return planned;
  }
  const Status ready = Apply(Event::kPlanned, "planned \"" + request.skill + "\"");
  if (!ready.ok()) {
    return Error{ErrorCode::kCancelled,
                 "planning was ended: the robot is in " + std::string(ToString(state_.load()))};
  }
  ShowPlan(request.skill, planned->motion.trajectory);
  return planned;
}

void Executor::ShowPlan(const std::string& skill, const motion::JointTrajectory& trajectory) {
  ircp::PlanSample sample;
  sample.skill = skill;
  sample.names = trajectory.joint_names;
  sample.times_s = trajectory.time_s;
  for (Eigen::Index frame = 0; frame < trajectory.positions.rows(); ++frame) {
    const Eigen::VectorXd joints = trajectory.positions.row(frame).transpose();
    const Eigen::Vector3d tool = robot_.chain.ToolPose(joints).translation;
    sample.positions.insert(sample.positions.end(), joints.begin(), joints.end());
    sample.tool_m.insert(sample.tool_m.end(), tool.begin(), tool.end());
  }
  const Status shown = plans_->Write(std::move(sample));
  if (!shown.ok()) log_.Error("plan not shown", {{"reason", shown.error().message}});
}

Result<api::PlanSummary> Executor::Plan(const api::ExecuteRequest& request) {
  const Status begun = Begin(request);
  if (!begun.ok()) return begun.error();
  const Result<Planned> planned = MakePlan(request);
  if (!planned.ok()) return planned.error();
  return Summarise(*planned);
}

// ---------------------------------------------------------------- execution

Result<api::ExecutionResult> Executor::Execute(
    const api::ExecuteRequest& request,
    const std::function<void(const api::ExecutionFeedback&)>& feedback, std::stop_token stop) {
  const Status begun = Begin(request);
  if (!begun.ok()) return begun.error();
  const std::stop_callback on_stop(stop, [this] { (void)Cancel(); });
  if (feedback) feedback({std::string(ToString(State::kPlanning)), 0, 0, 0, 0});
  std::optional<FollowingPlan> followed;
  Result<Planned> planned = MakePlan(request, &followed);
  if (!planned.ok()) return planned.error();

  api::ExecutionResult result;
  result.plan = Summarise(*planned);
  result.objects = planned->objects;
  const Status there = planner_.CheckStart(planned->motion);
  if (!there.ok()) {
    (void)Apply(Event::kReset, there.error().message);
    return there.error();
  }
  const std::uint64_t sent_before = commands_->sent();
  std::shared_ptr<Following> following;
  if (followed) {
    following = std::make_shared<Following>(clock_, log_, following_planner_, robot_, request,
                                            *followed, planned->motion);
    {
      const std::lock_guard lock(mutex_);
      following_ = following;
    }
    following->Start([this] {
      if (options_.on_taken) options_.on_taken();
    });
    if (!clock_.SleepUntil(followed->start, stop)) {
      const std::lock_guard lock(mutex_);
      following_.reset();
      return Error{ErrorCode::kCancelled, "cancelled before the motion began"};
    }
  }
  WatchLimits watch = options_.watch;
  if (following) watch.slow_within_m = 0;  // who slows down comes too late for a moving target
  const auto run =
      std::make_shared<MotionRun>(robot_, std::move(planned->motion), std::move(planned->checker),
                                  watch, std::move(planned->zones));
  {
    const std::lock_guard lock(mutex_);
    fixed_ = planned->objects;
    placed_ = std::move(planned->placed);
    carries_ = std::move(planned->carries);
  }
  run->SetFollower(following.get());
  const Status started = Apply(Event::kStart, "executing \"" + request.skill + "\"", run);
  if (!started.ok()) {
    const std::lock_guard lock(mutex_);
    following_.reset();
    return started.error();
  }

  std::unique_lock lock(mutex_);
  for (std::uint64_t told = 0;;) {
    changed_.wait(lock, [&] { return run_over_ || beats_ != told; });
    if (run_over_) break;
    told = beats_;
    if (!feedback) continue;
    const api::ExecutionFeedback now{std::string(ToString(state_.load())), run->path_time_s(),
                                     run->duration_s(), run->tracking_error_rad(), run->touch_n()};
    lock.unlock();
    feedback(now);
    lock.lock();
  }
  changed_.wait(lock, [&] { return !run->has_unwatched(); });
  result.state = ToString(run_end_);
  result.detail = run_detail_;
  ++executions_[result.state];
  lock.unlock();

  commands_->Flush();
  run->Report(result);
  if (following) {
    {
      const std::lock_guard held(mutex_);
      following_.reset();
    }
    following->Report(result);
    log_.Info("followed", {{"target", followed->target}, {"plans", following->plans_blended()}});
  }
  result.commands_sent = commands_->sent() - sent_before;
  log_.Info("executed", {{"skill", request.skill},
                         {"state", result.state},
                         {"tracking_error_rad", result.tracking_error_rad},
                         {"clearance_m", result.clearance_m},
                         {"commands", result.commands_sent},
                         {"lateness_p99_s", result.lateness_p99_s}});
  return result;
}

void Executor::WakeAll() {
  { const std::lock_guard lock(mutex_); }
  changed_.notify_all();
}

void Executor::Shutdown() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  const State state = state_.load();
  if (IsMoving(state) || state == State::kPlanning || state == State::kTeleoperating) {
    (void)Apply(Event::kStop, "the executor is shutting down");
  }
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, kShutdownPatience,
                    [this] { return run_over_ && !teleoperation_->active(); });
}

}  // namespace exemplar::executor
