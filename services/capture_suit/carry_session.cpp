#include "capture_suit/carry_session.hpp"

#include <algorithm>
#include <utility>

#include "capture_suit/places.hpp"
#include "capture_suit/session_parts.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::capture_suit {
namespace {

constexpr const char* kSource = "suit";
constexpr double kWayToStart = 1.0;  // s
/// The object is held this much above its middle, so that the fingertips stay off the table.
constexpr double kAboveMiddle_m = 0.008;
/// And let go so much above where it will stand.
constexpr double kLetGo_m = 0.002;

Result<scene::Object> FindObject(const scene::Description& scene, const std::string& name,
                                 const char* option) {
  std::vector<std::string> names;
  for (const scene::Object& object : scene.objects) {
    if (object.name == name) return object;
    names.push_back(object.name);
  }
  const std::optional<std::string> near = NearestName(name, names);
  return NotFound(
      "the scene has no object \"" + name + '"' + (near ? "; did you mean \"" + *near + "\"?" : ""),
      option);
}

/// From the shape's middle to its top, standing as it is.
double HalfHeight(const kinematics::Shape& shape) {
  if (const auto* box = std::get_if<kinematics::Box>(&shape)) return 0.5 * box->size.z();
  if (const auto* cylinder = std::get_if<kinematics::Cylinder>(&shape)) {
    return 0.5 * cylinder->length;
  }
  if (const auto* capsule = std::get_if<kinematics::Capsule>(&shape)) {
    return 0.5 * capsule->length + capsule->radius;
  }
  if (const auto* sphere = std::get_if<kinematics::Sphere>(&shape)) return sphere->radius;
  return 0;
}

}  // namespace

CarrySession::CarrySession(const Clock& clock, Log& log, scene::Object from, scene::Object to,
                           std::vector<Places> places, reaching::Person person,
                           const CarrySessionOptions& options)
    : clock_(clock),
      log_(log),
      from_(std::move(from)),
      to_(std::move(to)),
      places_(std::move(places)),
      person_(std::move(person)),
      options_(options),
      posture_(person_.rest()) {}

Result<std::unique_ptr<CarrySession>> CarrySession::Create(
    ircp::Bus& bus, const Clock& clock, Log& log, const kinematics::RobotDescription& robot,
    const scene::Description& scene, const CarrySessionOptions& options) {
  if (!robot.model.hand) {
    return InvalidArgument("robot \"" + robot.name + "\" has no hand to take anything with",
                           "robot");
  }
  Result<scene::Object> from = FindObject(scene, options.object, "object");
  if (!from) return from.error();
  if (from->fixed) {
    return InvalidArgument("object \"" + from->name + "\" is fixed, it cannot be taken", "object");
  }
  Result<scene::Object> to = FindObject(scene, options.to, "carry-to");
  if (!to) return to.error();
  std::vector<geometry::Pose> ends[2] = {{from->base_T_object}, {to->base_T_object}};
  const std::string* texts[2] = {&options.places, &options.to_places};
  const scene::Object* objects[2] = {&*from, &*to};
  for (int i = 0; i < 2; ++i) {
    if (texts[i]->empty()) continue;
    Result<std::vector<geometry::Pose>> parsed = ParsePlaces(*texts[i], objects[i]->base_T_object);
    if (!parsed) return parsed.error();
    ends[i] = std::move(*parsed);
  }
  const std::size_t trials = std::max(ends[0].size(), ends[1].size());
  for (int i = 0; i < 2; ++i) {
    if (ends[i].size() == 1) ends[i].resize(trials, ends[i].front());
    if (ends[i].size() != trials) {
      return InvalidArgument("there are " + std::to_string(ends[0].size()) + " places of \"" +
                                 from->name + "\" and " + std::to_string(ends[1].size()) +
                                 " of \"" + to->name + "\", must be as many, or one",
                             "places");
    }
  }
  std::vector<Places> places;
  for (std::size_t i = 0; i < trials; ++i) places.push_back({ends[0][i], ends[1][i]});
  Result<reaching::Person> person = reaching::Person::Create(robot, options.person);
  if (!person) return person.error();

  std::unique_ptr<CarrySession> session(new CarrySession(clock, log, std::move(*from),
                                                         std::move(*to), std::move(places),
                                                         std::move(*person), options));
  auto simulator =
      ircp::ControlClient::Create(bus, clock, "simulator", kSource, options.person.seed);
  if (!simulator) return simulator.error();
  session->simulator_ = std::move(*simulator);
  auto suit = bus.MakeWriter<ircp::SuitSample>(kSource);
  if (!suit) return suit.error();
  session->suit_ = std::move(*suit);
  auto glove = bus.MakeWriter<ircp::EndEffectorSample>(kSource);
  if (!glove) return glove.error();
  session->glove_ = std::move(*glove);
  auto recorder =
      MakeRecorder(options.record, bus, clock, options.person.seed, options.demonstrator);
  if (!recorder) return recorder.error();
  session->recorder_ = std::move(*recorder);
  const CarrySession* counted = session.get();
  auto control = MakeControl(bus, clock, [counted] { return counted->sent(); });
  if (!control) return control.error();
  session->control_ = std::move(*control);
  return session;
}

Status CarrySession::Run(std::stop_token stop) {
  // The simulated robot, and the recorder where there is one.
  if (Status there = AwaitReaders(
          clock_, log_, [this] { return readers(); }, recorder_ ? 2 : 1, stop);
      !there) {
    return there;
  }
  if (Status status = Send(posture_, 1); !status) return status;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (stop.stop_requested()) return Cancelled();
    if (Status status = Perform(i, stop); !status) return status;
  }
  if (Status status = MoveTo(person_.rest(), kWayToStart, stop); !status) return status;
  if (!WaitForAcknowledgments(stop)) {
    log_.Warning("not every reader has acknowledged the last samples",
                 {{"topic", ircp::SuitSample::kTopic}});
  }
  control_->SetState("done", std::to_string(places_.size()) + " trials performed");
  return {};
}

Status CarrySession::Perform(std::size_t index, const std::stop_token& stop) {
  const Places& places = places_[index];
  if (Status status = PutObject(*simulator_, to_.name, places.base_T_to, stop); !status)
    return status;
  if (Status status = PutObject(*simulator_, from_.name, places.base_T_from, stop); !status)
    return status;
  reaching::Target take;
  take.name = from_.name;
  take.base_T_object = places.base_T_from;
  take.object_p_contact = {0, 0, kAboveMiddle_m};
  reaching::Target lay;
  lay.name = to_.name;
  lay.base_T_object = places.base_T_to;
  lay.object_p_contact = {
      0, 0, HalfHeight(to_.shape) + HalfHeight(from_.shape) + kAboveMiddle_m + kLetGo_m};
  const Result<reaching::Demonstration> performed = person_.Carry(take, lay);
  if (!performed) return performed.error();
  const demonstration::ScalarSeries& joints = performed->trial.joints;
  const demonstration::ScalarSeries& hands = performed->trial.hands;

  const std::string trial =
      "trial " + std::to_string(index + 1) + " of " + std::to_string(places_.size());
  control_->SetState("moving", "to the start of " + trial);
  if (Status status =
          MoveTo(joints.values.row(0).transpose(), std::max(kWayToStart, options_.settle_s), stop);
      !status) {
    return status;
  }
  if (recorder_) {
    const std::string name = RecordingName(options_.name, index, places_.size());
    Status started = recorder_->Start(name, performed->trial.source, sent(), stop);
    if (!started) return started;
  }
  control_->SetState("performing", trial);
  const Duration start = clock_.Steady();
  Status sent;
  for (std::size_t k = 0; k < joints.size() && sent; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    if (!clock_.SleepUntil(start + FromSeconds(joints.time_s[k]), stop)) {
      sent = Cancelled();
    } else {
      sent = Send(joints.values.row(row).transpose(), hands.values(row, 0));
    }
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
    log_.Info(trial + ": " + from_.name + " from " + PlaceText(places.base_T_from) + " to " +
              PlaceText(places.base_T_to) + ", " + FormatFixed(performed->trial.duration_s(), 1) +
              " s");
  }
  return sent;
}

Status CarrySession::MoveTo(const Eigen::VectorXd& goal, double seconds,
                            const std::stop_token& stop) {
  return Glide(
      clock_, posture_, goal, seconds, options_.person.rate_hz,
      [this](const Eigen::VectorXd& posture) { return Send(posture, 1); }, stop);
}

Status CarrySession::Send(const Eigen::Ref<const Eigen::VectorXd>& posture, double open) {
  ircp::SuitSample sample;
  sample.header.stamp = clock_.Now();
  sample.names = person_.chain().joint_names();
  sample.positions.assign(posture.begin(), posture.end());
  ircp::EndEffectorSample glove;
  glove.header.stamp = sample.header.stamp;
  glove.has_pose = false;
  glove.has_hand_open = true;
  glove.hand_open = open;
  posture_ = posture;
  if (Status status = suit_->Write(std::move(sample)); !status) return status;
  return glove_->Write(std::move(glove));
}

bool CarrySession::WaitForAcknowledgments(const std::stop_token& stop) {
  return AwaitAcknowledgments(
      clock_,
      [this](Duration slice) {
        return suit_->WaitForAcknowledgments(slice) && glove_->WaitForAcknowledgments(slice);
      },
      stop);
}

std::vector<ircp::TopicCount> CarrySession::sent() const {
  return {{ircp::SuitSample::kTopic, kSource, suit_->sent()},
          {ircp::EndEffectorSample::kTopic, kSource, glove_->sent()}};
}

std::map<std::string, int> CarrySession::readers() const {
  return {{ircp::SuitSample::kTopic, suit_->matched_readers()},
          {ircp::EndEffectorSample::kTopic, glove_->matched_readers()}};
}

}  // namespace exemplar::capture_suit
