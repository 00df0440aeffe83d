#include "capture_suit/person_session.hpp"

#include <algorithm>
#include <utility>

#include "capture_suit/places.hpp"
#include "capture_suit/session_parts.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::capture_suit {
namespace {

constexpr const char* kSource = "suit";
constexpr double kWayToStart = 1.0;      // s
constexpr double kBeyondTravel = 0.003;  // m, as one presses who wants to feel the stop

Result<scene::Button> FindButton(const scene::Description& scene, const std::string& name) {
  if (scene.buttons.empty()) return InvalidArgument("the scene has no button to press", "scene");
  if (name.empty()) return scene.buttons.front();
  std::vector<std::string> names;
  for (const scene::Button& button : scene.buttons) {
    if (button.name == name) return button;
    names.push_back(button.name);
  }
  const std::optional<std::string> near = NearestName(name, names);
  return NotFound(
      "the scene has no button \"" + name + '"' + (near ? "; did you mean \"" + *near + "\"?" : ""),
      "object");
}

}  // namespace

PersonSession::PersonSession(const Clock& clock, Log& log, scene::Button button,
                             std::vector<geometry::Pose> places, reaching::Person person,
                             const PersonSessionOptions& options)
    : clock_(clock),
      log_(log),
      button_(std::move(button)),
      places_(std::move(places)),
      person_(std::move(person)),
      options_(options),
      posture_(person_.rest()) {}

Result<std::unique_ptr<PersonSession>> PersonSession::Create(
    ircp::Bus& bus, const Clock& clock, Log& log, const kinematics::RobotDescription& robot,
    const scene::Description& scene, const PersonSessionOptions& options) {
  Result<scene::Button> button = FindButton(scene, options.object);
  if (!button) return button.error();
  std::vector<geometry::Pose> places = {button->base_T_object};
  if (!options.places.empty()) {
    Result<std::vector<geometry::Pose>> parsed = ParsePlaces(options.places, button->base_T_object);
    if (!parsed) return parsed.error();
    places = std::move(*parsed);
  }
  reaching::PersonOptions habits = options.person;
  habits.press_depth_m =
      options.press_depth_m != 0 ? options.press_depth_m : button->travel_m + kBeyondTravel;
  Result<reaching::Person> person = reaching::Person::Create(robot, habits);
  if (!person) return person.error();

  std::unique_ptr<PersonSession> session(new PersonSession(
      clock, log, std::move(*button), std::move(places), std::move(*person), options));
  auto simulator =
      ircp::ControlClient::Create(bus, clock, "simulator", kSource, options.person.seed);
  if (!simulator) return simulator.error();
  session->simulator_ = std::move(*simulator);
  if (options.place_only) return session;

  auto suit = bus.MakeWriter<ircp::SuitSample>(kSource);
  if (!suit) return suit.error();
  session->suit_ = std::move(*suit);
  auto recorder =
      MakeRecorder(options.record, bus, clock, options.person.seed, options.demonstrator);
  if (!recorder) return recorder.error();
  session->recorder_ = std::move(*recorder);
  if (options.dead_man) {
    Result<std::unique_ptr<DeadMan>> dead_man = DeadMan::Create(bus, clock);
    if (!dead_man) return dead_man.error();
    session->dead_man_ = std::move(*dead_man);
  }
  const PersonSession* counted = session.get();
  auto control = MakeControl(bus, clock, [counted] { return counted->sent(); });
  if (!control) return control.error();
  session->control_ = std::move(*control);
  return session;
}

Status PersonSession::Run(std::stop_token stop) {
  // The simulated robot, and the recorder where there is one.
  if (Status there = AwaitReaders(
          clock_, log_, [this] { return readers(); }, recorder_ ? 2 : 1, stop);
      !there) {
    return there;
  }
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (stop.stop_requested()) return Cancelled();
    if (Status status = PutObject(*simulator_, button_.name, places_[i], stop); !status)
      return status;
    // Where simulated time stands until the suit moves, the first sample has it go on.
    if (i == 0 && suit_) {
      if (Status status = Send(posture_); !status) return status;
    }
    if (options_.place_only) {
      log_.Info("button at " + PlaceText(places_[i]));
    } else if (Status status = Perform(i, stop); !status) {
      return status;
    }
  }
  if (!suit_) return {};
  if (Status status = MoveTo(person_.rest(), kWayToStart, stop); !status) return status;
  if (!WaitForAcknowledgments(stop)) {
    log_.Warning("not every reader has acknowledged the last samples",
                 {{"topic", ircp::SuitSample::kTopic}});
  }
  control_->SetState("done", std::to_string(places_.size()) + " trials performed");
  return {};
}

Status PersonSession::Perform(std::size_t index, std::stop_token stop) {
  reaching::Target target;
  target.name = button_.name;
  target.base_T_object = places_[index];
  target.object_p_contact = button_.object_p_contact;
  target.object_normal = button_.object_normal;
  const Result<reaching::Demonstration> performed = person_.Press(target);
  if (!performed) return performed.error();
  const demonstration::ScalarSeries& joints = performed->trial.joints;

  const std::string trial =
      "trial " + std::to_string(index + 1) + " of " + std::to_string(places_.size());
  if (Status status = BeFollowed(stop); !status) return status;
  control_->SetState("moving", "to the start of " + trial);
  if (Status status =
          MoveTo(joints.values.row(0).transpose(), std::max(kWayToStart, options_.settle_s), stop);
      !status) {
    return status;
  }
  if (recorder_) {
    const std::string name = RecordingName(options_.name, index, places_.size());
    Status started = WhileStill(
        [&] { return recorder_->Start(name, performed->trial.source, sent(), stop); }, stop);
    if (!started) return started;
  }
  control_->SetState("performing", trial);
  const Duration start = clock_.Steady();
  Status sent;
  for (std::size_t k = 0; k < joints.size() && sent; ++k) {
    if (!clock_.SleepUntil(start + FromSeconds(joints.time_s[k]), stop)) {
      sent = Cancelled();
    } else {
      sent = Send(joints.values.row(static_cast<Eigen::Index>(k)).transpose());
    }
  }
  if (dead_man_) {
    const Duration held_until = clock_.Steady() + kHeldAfter;
    const Status still = StandStill([&] { return clock_.Steady() < held_until; }, stop);
    dead_man_->Release();
    if (sent) sent = still;
  }
  if (sent && !WaitForAcknowledgments(stop)) {
    log_.Warning("not every reader has acknowledged the trial", {{"trial", index + 1}});
  }
  if (recorder_) {
    const Status stopped = recorder_->Stop(stop);
    if (!stopped && sent) sent = stopped;
  }
  if (sent) {
    ++trials_ended_;
    log_.Info(trial + ": button at " + PlaceText(places_[index]) + ", " +
              FormatFixed(performed->trial.duration_s(), 1) + " s");
  }
  return sent;
}

Status PersonSession::WhileStill(const std::function<Status()>& work, const std::stop_token& stop) {
  if (!dead_man_) return work();
  Status sent;
  Status done;
  {
    std::stop_source over;
    const std::jthread still([&] {
      while (sent && !stop.stop_requested() &&
             clock_.SleepFor(FromSeconds(1 / options_.person.rate_hz), over.get_token())) {
        sent = Send(posture_);
      }
    });
    done = work();
    over.request_stop();
  }
  return done ? sent : done;
}

Status PersonSession::StandStill(const std::function<bool()>& goes_on,
                                 const std::stop_token& stop) {
  while (goes_on()) {
    if (Status sent = Send(posture_); !sent) return sent;
    if (!clock_.SleepFor(FromSeconds(1 / options_.person.rate_hz), stop)) return Cancelled();
  }
  return {};
}

Status PersonSession::BeFollowed(const std::stop_token& stop) {
  if (!dead_man_) return {};
  dead_man_->BeginToPress();
  const Duration deadline = clock_.Steady() + kFollowTimeout;
  Status stood = StandStill(
      [&] {
        dead_man_->GoOnPressing();
        return !dead_man_->followed() && clock_.Steady() < deadline;
      },
      stop);
  if (stood && !dead_man_->followed()) log_.Warning("no robot follows the suit");
  return stood;
}

Status PersonSession::MoveTo(const Eigen::VectorXd& goal, double seconds,
                             const std::stop_token& stop) {
  return Glide(
      clock_, posture_, goal, seconds, options_.person.rate_hz,
      [this](const Eigen::VectorXd& posture) { return Send(posture); }, stop);
}

Status PersonSession::Send(const Eigen::Ref<const Eigen::VectorXd>& posture) {
  ircp::SuitSample sample;
  sample.header.stamp = clock_.Now();
  sample.names = person_.chain().joint_names();
  sample.positions.assign(posture.begin(), posture.end());
  posture_ = posture;
  return suit_->Write(std::move(sample));
}

bool PersonSession::WaitForAcknowledgments(const std::stop_token& stop) {
  return AwaitAcknowledgments(
      clock_, [this](Duration slice) { return suit_->WaitForAcknowledgments(slice); }, stop);
}

std::vector<ircp::TopicCount> PersonSession::sent() const {
  if (suit_ == nullptr) return {};
  std::vector<ircp::TopicCount> counts = {{ircp::SuitSample::kTopic, kSource, suit_->sent()}};
  if (dead_man_) counts.push_back(dead_man_->sent());
  return counts;
}

std::map<std::string, int> PersonSession::readers() const {
  if (suit_ == nullptr) return {};
  return {{ircp::SuitSample::kTopic, suit_->matched_readers()}};
}

}  // namespace exemplar::capture_suit
