// The loop of a session: time, the world's steps, and what is measured in it.

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/text.hpp"
#include "simulator/running_session.hpp"

namespace exemplar::simulator {
namespace {

/// Behind by more than this, the world lets time pass rather than rush after it.
constexpr Duration kLargestLag = std::chrono::milliseconds(200);
/// Of real time, between two sayings of a time that stands.
constexpr Duration kSayAgain = std::chrono::milliseconds(50);

bool IsSound(const Arrival& arrival) {
  const auto finite = [](double v) { return std::isfinite(v); };
  return arrival.positions.size() == arrival.names.size() &&
         (arrival.velocities.empty() || arrival.velocities.size() == arrival.names.size()) &&
         std::all_of(arrival.positions.begin(), arrival.positions.end(), finite) &&
         std::all_of(arrival.velocities.begin(), arrival.velocities.end(), finite);
}

}  // namespace

void RunningSession::Run(std::stop_token stop) {
  log_.Info("running", {{"joints", joint_names_.size()},
                        {"rate_hz", options_.rate_hz},
                        {"follows", options_.leader == Leader::kSuit ? "suit" : "command"},
                        {"cameras", cameras_ ? "on" : "off"},
                        {"in_step_with", Join(options_.in_step_with, " ")}});
  if (time_) {
    RunInStep(stop);
  } else {
    RunInPace(stop);
  }
  states_->Finish();
  if (tracked_) tracked_->Finish();
  control_->SetState("stopped", "asked to stop");
  log_.Info("stopped", {{"sim_time_s", ToSeconds(world_.time())}});
}

void RunningSession::RunInPace(const std::stop_token& stop) {
  Duration begin = clock_.Steady() - world_.time();
  Stamp epoch = clock_.Now() - world_.time();
  while (!stop.stop_requested()) {
    const Duration now = clock_.Steady() - begin;
    if (now - world_.time() > kLargestLag) {
      const Duration lag = now - world_.time();
      begin += lag;
      epoch = epoch + lag;
      {
        const std::lock_guard lock(mutex_);
        ++slips_;
      }
      log_.Warning("the world fell behind the clock", {{"by_s", ToSeconds(lag)}});
    }
    while (world_.time() + world_.step() <= clock_.Steady() - begin) Tick(epoch);
    if (!clock_.SleepUntil(begin + world_.time() + world_.step(), stop)) break;
  }
}

bool RunningSession::StandUntilCommanded(const std::function<bool()>& lead,
                                         const std::stop_token& stop) {
  if (options_.stand_after == Duration(0)) return true;
  if (world_.time() - last_arrival_ < options_.stand_after) return true;
  std::unique_lock lock(inbox_mutex_);
  stands_.store(true);
  while (!arrived_.wait_for(lock, stop, kSayAgain, [this] { return !inbox_.empty(); })) {
    lock.unlock();
    if (!lead()) return false;  // who came later hears the time as well
    lock.lock();
  }
  stands_.store(false);
  lock.unlock();
  time_->AskAnew();
  return lead();
}

void RunningSession::RunInStep(const std::stop_token& stop) {
  const Stamp epoch = options_.epoch.value_or(clock_.Now()) - world_.time();
  const Duration begin = clock_.Steady();
  const auto has_come = [this](const ircp::TopicCount& count) {
    const std::lock_guard lock(inbox_mutex_);
    const bool is_read = count.topic == leader_topic() ||
                         (glove_reader_ && count.topic == ircp::EndEffectorSample::kTopic);
    if (!is_read) return true;
    const auto it = last_seq_.find({count.topic, count.source});
    return it != last_seq_.end() && it->second >= count.sent;
  };
  const auto lead = [&] {
    states_->Flush();
    if (cameras_) cameras_->Flush();
    const Stamp now = epoch + world_.time();
    if (options_.leader_clock) options_.leader_clock->Set(now);
    return time_->Lead(world_.time(), now, sent(), has_come, stop);
  };
  for (double beats = 1; lead(); ++beats) {
    if (!StandUntilCommanded(lead, stop)) return;
    for (const std::string& program : time_->TakeLost()) {
      log_.Warning("time goes on without a program that is silent", {{"program", program}});
    }
    const Duration until = FromSeconds(beats / options_.rate_hz) - world_.step() / 2;
    while (world_.time() < until) Tick(epoch);
    if (options_.pace == 0) continue;
    const Duration real = FromSeconds(ToSeconds(world_.time()) / options_.pace);
    if (!clock_.SleepUntil(begin + real, stop)) return;
  }
}

void RunningSession::Tick(Stamp epoch) {
  const std::lock_guard lock(mutex_);
  TakeSamples();
  const Follower::Output target = follower_.At(world_.time() + world_.step());
  world_.SetTarget(target.positions, target.velocities);
  world_.SetHand(hand_open_);
  world_.Step();
  SayClicks();
  const Stamp stamp = epoch + world_.time();
  if (tracked_ && ToSeconds(world_.time()) * options_.track_hz >= static_cast<double>(looks_)) {
    ++looks_;
    Track(stamp);
    if (time_) tracked_->Flush();  // the state that follows finds them
  }
  if (ToSeconds(world_.time()) * options_.rate_hz >= static_cast<double>(states_due_)) {
    ++states_due_;
    states_->Put({State(stamp), follower_.mode()});
  }
  if (cameras_) cameras_->Look(world_, stamp);
}

void RunningSession::Track(Stamp stamp) {
  const auto noise = [this](double deviation) {
    const double x = noise_.Normal(0, deviation);
    const double y = noise_.Normal(0, deviation);
    return Eigen::Vector3d(x, y, noise_.Normal(0, deviation));
  };
  for (const ThingState& thing : world_.things()) {
    ircp::ObjectSample sample;
    sample.header.stamp = stamp;
    sample.name = thing.name;
    sample.frame = base_frame_;
    sample.base_T_object = thing.base_T_object;
    sample.base_T_object.translation += noise(options_.noise.object_m);
    sample.base_T_object.rotation =
        sample.base_T_object.rotation * geometry::ExpSo3(noise(options_.noise.object_rad));
    sample.position_variance_m2.fill(options_.noise.object_m * options_.noise.object_m);
    sample.rotation_variance_rad2 = options_.noise.object_rad * options_.noise.object_rad;
    tracked_->Put(std::move(sample));
  }
}

void RunningSession::TakeSamples() {
  std::deque<Arrival> arrivals;
  {
    const std::lock_guard lock(inbox_mutex_);
    arrivals.swap(inbox_);
  }
  if (!arrivals.empty()) last_arrival_ = world_.time();
  for (Arrival& arrival : arrivals) {
    on_the_way_.emplace_back(world_.time() + options_.command_delay, std::move(arrival));
  }
  for (; !on_the_way_.empty() && on_the_way_.front().first <= world_.time();
       on_the_way_.pop_front()) {
    const Arrival& arrival = on_the_way_.front().second;
    std::optional<Setpoint> setpoint = MapOntoJoints(arrival);
    if (!setpoint) {
      ++refused_;
      continue;
    }
    if (arrival.has_hand_open) hand_open_ = std::clamp(arrival.hand_open, 0.0, 1.0);
    if (options_.leader == Leader::kSuit) {
      follower_.Stream(world_.time(), std::move(*setpoint));
    } else {
      follower_.Command(world_.time(), std::move(*setpoint), arrival.validity);
    }
  }
}

std::optional<Setpoint> RunningSession::MapOntoJoints(const Arrival& arrival) const {
  if (!IsSound(arrival)) return std::nullopt;
  Setpoint setpoint;
  setpoint.positions = follower_.last().positions;
  setpoint.stamp = arrival.header.stamp;
  setpoint.seq = arrival.header.seq;
  if (!arrival.velocities.empty()) {
    setpoint.velocities = Eigen::VectorXd::Zero(setpoint.positions.size());
  }
  bool fits = false;
  for (std::size_t i = 0; i < arrival.names.size(); ++i) {
    const auto it = std::find(joint_names_.begin(), joint_names_.end(), arrival.names[i]);
    if (it == joint_names_.end()) continue;
    fits = true;
    const Eigen::Index joint = it - joint_names_.begin();
    setpoint.positions[joint] = arrival.positions[i];
    if (!arrival.velocities.empty()) setpoint.velocities[joint] = arrival.velocities[i];
  }
  if (!fits) return std::nullopt;
  return setpoint;
}

void RunningSession::SayClicks() {
  const std::vector<ButtonState> buttons = world_.buttons();
  for (std::size_t i = 0; i < buttons.size(); ++i) {
    if (buttons[i].clicks == clicks_[i]) continue;
    clicks_[i] = buttons[i].clicks;
    log_.Info("button clicked", {{"button", buttons[i].name},
                                 {"clicks", buttons[i].clicks},
                                 {"sim_time_s", ToSeconds(buttons[i].last_click)},
                                 {"touch_n", world_.touch_n()}});
  }
}

void RunningSession::Publish(Outgoing&& outgoing) {
  if (outgoing.mode != said_mode_) {
    said_mode_ = outgoing.mode;
    control_->SetState("running", NameOf(said_mode_));
  }
  if (Status status = state_writer_->Write(std::move(outgoing.state)); !status) {
    log_.Warning("joint state not sent", {{"cause", status.error().message}});
  }
}

ircp::JointStateSample RunningSession::State(Stamp stamp) {
  ircp::JointStateSample sample;
  sample.header.stamp = stamp;
  sample.names = joint_names_;
  const auto list = [](const Eigen::VectorXd& v) {
    return std::vector<double>(v.data(), v.data() + v.size());
  };
  sample.positions = list(world_.positions());
  for (double& q : sample.positions) q += noise_.Normal(0, options_.noise.position_rad);
  sample.velocities = list(world_.velocities());
  for (double& v : sample.velocities) v += noise_.Normal(0, options_.noise.velocity_rad_s);
  sample.efforts = list(world_.efforts());
  sample.hand_open = world_.has_hand() ? world_.hand_open() : hand_open_;
  sample.touch_sensors = {kTouchSensor};
  sample.touch_n = {world_.touch_n() + noise_.Normal(0, options_.noise.touch_n)};
  sample.command_seq = follower_.acted_seq();
  return sample;
}

}  // namespace exemplar::simulator
