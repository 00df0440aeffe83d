#include "executor/teleoperation.hpp"

#include <algorithm>
#include <cmath>

#include "executor/realtime.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::executor {
namespace {

constexpr int kStepPriority = 40;  // the control loop's: never both at once
constexpr double kBeat_s = 0.1;
/// The last posture goes on being commanded for so long after the robot came to rest.
constexpr double kLastWords_s = 0.3;
/// Steps that are further apart go on as if they were not.
constexpr Duration kLongestStep = std::chrono::milliseconds(20);
constexpr std::size_t kMostUnwatched = 1024;
/// Of a session that is over, until its call has its figures.
constexpr Duration kLastReport = std::chrono::seconds(1);

Error Busy() { return FailedPrecondition("the robot is teleoperated already"); }

}  // namespace

struct Teleoperation::Session {
  std::unique_ptr<TeleoperationMotion> motion;
  std::unique_ptr<TeleoperationWatch> watch;
  std::unique_ptr<collision::CollisionChecker> spare;
  std::vector<geometry::NamedPose> placed;
  Eigen::VectorXd start;
};

Teleoperation::Teleoperation(const Clock& clock, Log& log,
                             const kinematics::RobotDescription& robot,
                             const scene::Description& scene, const RobotView& view,
                             const Planner& planner, CommandStream& commands, JointMap map,
                             TeleoperationHost host, TeleoperationSettings settings)
    : clock_(clock),
      log_(log),
      robot_(robot),
      scene_(scene),
      view_(view),
      planner_(planner),
      commands_(commands),
      host_(std::move(host)),
      settings_(std::move(settings)),
      period_(FromSeconds(1 / settings_.rate_hz)),
      intake_(std::move(map), robot.chain.limits(), settings_.following.suit),
      dead_man_(settings_.following.dead_man_patience) {}

Result<std::unique_ptr<Teleoperation>> Teleoperation::Create(
    ircp::Bus& bus, const Clock& clock, Log& log, const kinematics::RobotDescription& robot,
    const scene::Description& scene, const RobotView& view, const Planner& planner,
    CommandStream& commands, JointMap map, TeleoperationHost host, TeleoperationSettings settings) {
  std::unique_ptr<Teleoperation> made(new Teleoperation(clock, log, robot, scene, view, planner,
                                                        commands, std::move(map), std::move(host),
                                                        std::move(settings)));
  Teleoperation* teleoperation = made.get();
  auto suit = bus.MakeReader<ircp::SuitSample>(
      [teleoperation](const ircp::SuitSample& sample, const ircp::Reception& reception) {
        teleoperation->OnSuit(sample, reception);
      });
  if (!suit.ok()) return suit.error();
  made->suit_reader_ = *std::move(suit);
  made->step_thread_ =
      std::jthread([teleoperation](const std::stop_token& stop) { teleoperation->StepLoop(stop); });
  made->tick_thread_ =
      std::jthread([teleoperation](const std::stop_token& stop) { teleoperation->TickLoop(stop); });
  made->watch_thread_ = std::jthread(
      [teleoperation](const std::stop_token& stop) { teleoperation->WatchLoop(stop); });
  return made;
}

Teleoperation::~Teleoperation() {
  suit_reader_.reset();
  for (std::jthread* thread : {&step_thread_, &tick_thread_, &watch_thread_}) {
    thread->request_stop();
  }
  session_.store(kClosing);
  session_.notify_all();
  WakeStep();
  work_.fetch_add(1);
  work_.notify_all();
  for (std::jthread* thread : {&tick_thread_, &step_thread_, &watch_thread_}) {
    if (thread->joinable()) thread->join();
  }
  delete incoming_.exchange(nullptr);
  delete retired_.exchange(nullptr);
}

// ---------------------------------------------------------------- on and off

Result<Teleoperation::Session> Teleoperation::Prepare(
    const api::TeleoperationRequest& request,
    const std::optional<Eigen::VectorXd>& last_command) const {
  if (const std::optional<std::string> silence = host_.silence()) return Unavailable(*silence);
  const std::optional<MeasuredState> measured = view_.latest();
  if (!measured) return Unavailable("nothing usable was heard from the robot on ircp/joint_state");
  Session session;
  session.start = measured->joints;
  if (last_command &&
      (*last_command - session.start).cwiseAbs().maxCoeff() <= settings_.start_tolerance_rad) {
    session.start = *last_command;
  }
  for (const api::SeenObject& seen : view_.objects(clock_.Steady())) {
    session.placed.push_back(seen.pose);
  }
  const collision::Scene scene = collision::MakeScene(scene_, session.placed);
  std::vector<std::string> names;
  for (const collision::SceneObject& object : scene.objects) names.push_back(object.name);
  std::vector<collision::AllowedTouch> touches;
  for (const std::string& object : request.touch) {
    if (std::find(names.begin(), names.end(), object) == names.end()) {
      const std::optional<std::string> near = NearestName(object, names);
      return NotFound("the scene has no \"" + object + "\" to touch" +
                          (near ? "; did you mean \"" + *near + "\"?" : ""),
                      "touch");
    }
    for (const std::string& link : robot_.touch_links) touches.push_back({link, object});
  }
  std::vector<collision::CollisionChecker> checkers;
  for (int i = 0; i < 3; ++i) {
    Result<collision::CollisionChecker> checker =
        collision::CollisionChecker::Create(robot_.model, scene, collision::OptionsOf(robot_));
    if (!checker.ok()) return checker.error();
    checkers.push_back(*std::move(checker));
  }
  session.motion = std::make_unique<TeleoperationMotion>(
      robot_, std::make_unique<collision::CollisionChecker>(std::move(checkers[0])), touches,
      settings_.following);
  session.spare = std::make_unique<collision::CollisionChecker>(std::move(checkers[1]));
  session.watch = std::make_unique<TeleoperationWatch>(robot_, std::move(checkers[2]), touches,
                                                       settings_.watch);
  return session;
}

Result<api::TeleoperationResult> Teleoperation::Run(
    const api::TeleoperationRequest& request,
    const std::function<void(const api::TeleoperationFeedback&)>& feedback,
    const std::stop_token& stop, const std::optional<Eigen::VectorXd>& last_command) {
  const std::unique_lock run(run_mutex_, kLastReport);
  if (!run.owns_lock()) return Busy();
  Result<Session> session = Prepare(request, last_command);
  if (!session.ok()) return session.error();
  const Status on =
      host_.apply(Event::kTeleoperate, "holding: press the dead-man to let the robot follow");
  if (!on.ok()) return on.error();
  Begin(*std::move(session), request.suit);
  const std::stop_callback on_stop(
      stop, [this] { (void)host_.apply(Event::kCancel, "the caller went away, or cancelled"); });
  for (std::uint32_t told = beat_.load(); active(); told = beat_.load()) {
    if (feedback) feedback(Feedback());
    beat_.wait(told);
  }
  return Report();
}

Status Teleoperation::End() { return host_.apply(Event::kLeave, "teleoperation was ended"); }

void Teleoperation::Begin(Session session, const std::string& suit) {
  session.motion->Begin(session.start, dead_man_.presses());
  {
    const std::lock_guard lock(intake_mutex_);
    intake_.Begin(suit);
  }
  {
    const std::lock_guard lock(watch_mutex_);
    watch_ = std::move(session.watch);
    spare_ = std::move(session.spare);
    placed_ = std::move(session.placed);
    moved_.reset();
    told_ = Phase::kHolding;
    delete incoming_.exchange(nullptr);
    delete retired_.exchange(nullptr);
  }
  {
    const std::lock_guard lock(figures_mutex_);
    measured_.clear();
    detail_ = "press the dead-man to let the robot follow";
    sent_before_ = commands_.sent();
    holds_ = blocks_ = 0;
    tracking_rad_ = largest_tracking_rad_ = touch_n_ = touch_max_n_ = 0;
    clearance_m_.reset();
    smallest_clearance_m_.reset();
    latency_ = {};
  }
  motion_ = std::move(session.motion);
  for (SuitPosture old; postures_.Get(old);) {
  }
  const Duration now = clock_.Steady();
  last_step_ = last_sample_ = now;
  ticks_ = 0;
  settled_s_ = since_beat_s_ = 0;
  for (Eigen::Index j = 0; j < session.start.size(); ++j) {
    commanded_[static_cast<std::size_t>(j)].store(session.start[j]);
  }
  phase_.store(Phase::kHolding);
  behind_rad_.store(0);
  suit_interval_ns_.store(0);
  begun_ns_.store(now.count());
  over_ns_.store(0);
  following_ns_.store(0);
  next_tick_ns_.store(now.count());
  session_.store(kActive);
  session_.notify_all();
}

api::TeleoperationFeedback Teleoperation::Feedback() const {
  api::TeleoperationFeedback now;
  now.state = ToString(host_.state());
  now.phase = ToString(phase_.load());
  now.time_s = ToSeconds(clock_.Steady() - Duration(begun_ns_.load()));
  now.behind_rad = behind_rad_.load();
  if (now.behind_rad > 0) {
    now.behind_joint = robot_.chain.joint_names()[static_cast<std::size_t>(behind_joint_.load())];
  }
  const Duration interval(suit_interval_ns_.load());
  if (interval > Duration::zero()) now.suit_rate_hz = 1 / ToSeconds(interval);
  const std::lock_guard lock(figures_mutex_);
  now.detail = detail_;
  now.tracking_error_rad = tracking_rad_;
  now.touch_n = touch_n_;
  now.clearance_m = clearance_m_;
  return now;
}

api::TeleoperationResult Teleoperation::Report() {
  {
    const std::lock_guard lock(watch_mutex_);
    Drain();
  }
  api::TeleoperationResult result;
  const auto [state, detail] = host_.ended();
  result.state = ToString(state);
  result.detail = detail;
  result.duration_s = ToSeconds(Duration(over_ns_.load() - begun_ns_.load()));
  result.following_s = ToSeconds(Duration(following_ns_.load()));
  result.suit_samples = intake_.taken();
  result.suit_samples_left_out = intake_.left_out() + suit_reader_->refused();
  const std::lock_guard lock(figures_mutex_);
  result.commands_sent = commands_.sent() - sent_before_;
  result.holds = holds_;
  result.blocks = blocks_;
  result.tracking_error_rad = largest_tracking_rad_;
  result.clearance_m = smallest_clearance_m_;
  result.touch_max_n = touch_max_n_;
  result.latency_p50_s = latency_.count() > 0 ? latency_.QuantileSeconds(0.5) : 0;
  result.latency_p99_s = latency_.count() > 0 ? latency_.QuantileSeconds(0.99) : 0;
  result.latency_max_s = latency_.max_s();
  return result;
}

TeleoperationFigures Teleoperation::figures() const {
  TeleoperationFigures now;
  if (active()) now.phase = ToString(phase_.load());
  now.suit_samples = intake_.taken();
  now.suit_left_out = intake_.left_out();
  const std::lock_guard lock(figures_mutex_);
  now.latency_p99_s = latency_.count() > 0 ? latency_.QuantileSeconds(0.99) : 0;
  now.latency_max_s = latency_.max_s();
  return now;
}

std::optional<Stamp> Teleoperation::AnsweredPress() const {
  if (!active() || phase_.load() == Phase::kHolding) return std::nullopt;
  return dead_man_.pressed();
}

// ---------------------------------------------------------------- what comes in

void Teleoperation::OnSuit(const ircp::SuitSample& sample, const ircp::Reception& reception) {
  if (!active()) return;
  {
    const std::lock_guard lock(intake_mutex_);
    const std::optional<SuitPosture> posture =
        intake_.Take(sample, reception.writer, clock_.Steady());
    if (!posture || !postures_.Put(*posture)) return;
  }
  WakeStep();
}

void Teleoperation::Take(const ircp::SafetySample& sample) {
  const bool was_held = dead_man_.held();
  if (dead_man_.Take(sample, clock_.Steady())) intake_.ForgetDelay();
  if (active() && was_held != dead_man_.held()) WakeStep();
}

void Teleoperation::Measure(const MeasuredState& state) {
  if (!active()) return;
  {
    const std::lock_guard lock(figures_mutex_);
    if (measured_.size() >= kMostUnwatched) return;
    measured_.push_back({state, Commanded(), commands_.sent()});
  }
  work_.fetch_add(1, std::memory_order_release);
  work_.notify_all();
}

Eigen::VectorXd Teleoperation::Commanded() const {
  Eigen::VectorXd joints(robot_.chain.dof());
  for (Eigen::Index j = 0; j < joints.size(); ++j) {
    joints[j] = commanded_[static_cast<std::size_t>(j)].load(std::memory_order_relaxed);
  }
  return joints;
}

// ---------------------------------------------------------------- the step

void Teleoperation::WakeStep() {
  wake_.fetch_add(1, std::memory_order_release);
  wake_.notify_all();
}

void Teleoperation::StepLoop(const std::stop_token& stop) {
  if (settings_.realtime) (void)RaisePriority(kStepPriority);  // the control loop says when not
  std::uint32_t seen = 0;
  while (!stop.stop_requested()) {
    wake_.wait(seen, std::memory_order_acquire);
    seen = wake_.load(std::memory_order_acquire);
    if (active()) Step();
    stepped_.store(seen, std::memory_order_release);
    stepped_.notify_all();
    host_.on_settled();
  }
  stepped_.store(wake_.load() + (1U << 30), std::memory_order_release);
  stepped_.notify_all();
}

void Teleoperation::TickLoop(const std::stop_token& stop) {
  if (settings_.realtime) (void)RaisePriority(kStepPriority);
  while (true) {
    session_.wait(kIdle);
    if (stop.stop_requested()) return;
    if (!clock_.SleepUntil(Duration(next_tick_ns_.load()), stop)) return;
    if (clock_.Steady().count() < next_tick_ns_.load()) continue;
    const std::uint32_t mine = wake_.fetch_add(1, std::memory_order_acq_rel) + 1;
    wake_.notify_all();
    for (std::uint32_t done = stepped_.load(std::memory_order_acquire);
         static_cast<std::int32_t>(done - mine) < 0;
         done = stepped_.load(std::memory_order_acquire)) {
      stepped_.wait(done, std::memory_order_acquire);
    }
  }
}

void Teleoperation::Step() {
  SuitPosture posture;
  Duration came{0};
  bool sample_came = false;
  while (postures_.Get(posture)) {
    motion_->Take(posture);
    came = posture.received;
    sample_came = true;
  }
  if (collision::CollisionChecker* scene = incoming_.exchange(nullptr)) {
    retired_.store(
        motion_->Exchange(std::unique_ptr<collision::CollisionChecker>(scene)).release());
  }
  const Duration now = clock_.Steady();
  if (now <= last_step_ && !sample_came) {
    next_tick_ns_.store(std::max(next_tick_ns_.load(), (last_step_ + period_).count()));
    return;
  }
  StepInput input;
  input.now = now;
  input.elapsed_s = ToSeconds(std::clamp(now - last_step_, Duration::zero(),
                                         std::max<Duration>(kLongestStep, 2 * period_)));
  last_step_ = now;
  input.on = host_.state() == State::kTeleoperating;
  input.dead_man_held = dead_man_.held();
  input.dead_man_heard = dead_man_.heard(now);
  input.presses = dead_man_.presses();
  input.speed = host_.speed();
  const Setpoint& setpoint = motion_->Step(input);
  commands_.Put(setpoint);
  if (sample_came) latencies_.Put(clock_.Steady() - came);

  PlanNextTick(now, sample_came);
  for (std::size_t j = 0; j < static_cast<std::size_t>(robot_.chain.dof()); ++j) {
    commanded_[j].store(setpoint.positions[j], std::memory_order_relaxed);
  }
  phase_.store(motion_->phase(), std::memory_order_relaxed);
  behind_rad_.store(motion_->behind_rad(), std::memory_order_relaxed);
  behind_joint_.store(motion_->behind_joint(), std::memory_order_relaxed);
  suit_interval_ns_.store(motion_->suit_interval().count(), std::memory_order_relaxed);
  if (motion_->phase() == Phase::kFollowing) {
    following_ns_.fetch_add(FromSeconds(input.elapsed_s).count(), std::memory_order_relaxed);
  }
  for (const PhaseChange& change : motion_->changes()) changes_.Put(change);
  since_beat_s_ += input.elapsed_s;
  if (!motion_->changes().empty() || since_beat_s_ >= kBeat_s) {
    since_beat_s_ = 0;
    due_.fetch_add(1, std::memory_order_relaxed);
    work_.fetch_add(1, std::memory_order_release);
    work_.notify_all();
  }
  if (input.on) {
    if (std::optional<std::string> silence = host_.silence()) {
      (void)host_.apply(Event::kFault, *std::move(silence));
    }
  } else if (motion_->resting()) {
    settled_s_ += input.elapsed_s;
    if (settled_s_ >= kLastWords_s) FinishSession();
  }
}

void Teleoperation::PlanNextTick(Duration now, bool sample_came) {
  if (sample_came) {
    last_sample_ = now;
    ticks_ = 0;
  } else {
    ++ticks_;
  }
  // Evenly between the suit's samples: the next of those makes the last step of an interval itself,
  // unless it is late by half a step.
  Duration next = now + period_;
  const Duration interval = motion_->suit_interval();
  if (interval > Duration::zero() && now - last_sample_ < settings_.following.suit_patience) {
    const int steps =
        std::max(1, static_cast<int>(std::lround(ToSeconds(interval) / ToSeconds(period_))));
    const Duration apart = interval / steps;
    next = last_sample_ + (ticks_ + 1) * apart;
    if (ticks_ + 1 >= steps) next += apart / 2;
    if (next <= now) next = now + apart;
  }
  next_tick_ns_.store(next.count());
}

void Teleoperation::FinishSession() {
  over_ns_.store(clock_.Steady().count());
  commands_.Flush();
  host_.over(Commanded());
  session_.store(kIdle);
  host_.released();
  beat_.fetch_add(1);
  beat_.notify_all();
}

}  // namespace exemplar::executor
