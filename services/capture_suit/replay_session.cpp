#include "capture_suit/replay_session.hpp"

#include <cassert>
#include <cmath>
#include <fstream>
#include <sstream>
#include <utility>

#include "capture_suit/session_parts.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/demonstration/csv.hpp"

namespace exemplar::capture_suit {
namespace {

constexpr Duration kPollInterval = std::chrono::milliseconds(20);

}  // namespace

Result<demonstration::Trial> ReadTrialFile(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  if (!stream || !(text << stream.rdbuf())) {
    return NotFound(file.string() + ": cannot be read", "replay");
  }
  return demonstration::ReadCsv(text.str(), file.string());
}

ReplaySession::ReplaySession(const Clock& clock, Log& log, std::vector<demonstration::Trial> trials,
                             TrialStreams streams, const ReplayOptions& options)
    : clock_(clock),
      log_(log),
      trials_(std::move(trials)),
      streams_(std::move(streams)),
      options_(options) {}

Result<std::unique_ptr<ReplaySession>> ReplaySession::Create(
    ircp::Bus& bus, const Clock& clock, Log& log, std::vector<demonstration::Trial> trials,
    const ReplayOptions& options) {
  assert(!trials.empty());
  if (!std::isfinite(options.rate) || options.rate <= 0) {
    return InvalidArgument("rate is " + FormatDouble(options.rate) + ", must be positive", "rate");
  }
  // Only to see which topics are needed: stamps are given when a trial is played.
  std::vector<ircp::TrialSamples> samples;
  samples.reserve(trials.size());
  for (const demonstration::Trial& trial : trials) {
    samples.push_back(ircp::SamplesOf(trial, Stamp{}, options.frame));
  }
  Result<TrialStreams> streams = TrialStreams::Create(bus, samples);
  if (!streams) return streams.error();
  std::unique_ptr<ReplaySession> session(
      new ReplaySession(clock, log, std::move(trials), std::move(*streams), options));
  auto recorder = MakeRecorder(options.record, bus, clock, options.seed, options.demonstrator);
  if (!recorder) return recorder.error();
  session->recorder_ = std::move(*recorder);
  if (options.dead_man) {
    Result<std::unique_ptr<DeadMan>> dead_man = DeadMan::Create(bus, clock);
    if (!dead_man) return dead_man.error();
    session->dead_man_ = std::move(*dead_man);
  }
  const ReplaySession* counted = session.get();
  auto control = MakeControl(bus, clock, [counted] { return counted->sent(); });
  if (!control) return control.error();
  session->control_ = std::move(*control);
  return session;
}

Status ReplaySession::Run(std::stop_token stop) {
  if (Status there = AwaitReaders(
          clock_, log_, [this] { return readers(); }, 1, stop);
      !there) {
    return there;
  }
  for (std::size_t i = 0; i < trials_.size(); ++i) {
    if (Status status = PlayOne(i, stop); !status) return status;
  }
  control_->SetState("done", std::to_string(trials_.size()) + " trials played");
  return {};
}

Status ReplaySession::PlayOne(std::size_t index, const std::stop_token& stop) {
  const demonstration::Trial& trial = trials_[index];
  const std::string place =
      "trial " + std::to_string(index + 1) + " of " + std::to_string(trials_.size());
  for (const std::string& notice : trial.notices) log_.Warning(notice);
  if (Status status = BeFollowed(trial, stop); !status) return status;
  if (recorder_) {
    const std::string name = RecordingName(options_.name, index, trials_.size());
    if (Status status = recorder_->Start(name, trial.source, sent(), stop); !status) return status;
  }
  control_->SetState("playing", trial.source);
  const ircp::TrialSamples samples = ircp::SamplesOf(trial, clock_.Now(), options_.frame);
  Status played = streams_.Play(samples, options_.rate, clock_, stop);
  if (dead_man_) dead_man_->Release();
  const auto acknowledged = [this](Duration slice) {
    return streams_.WaitForAcknowledgments(slice);
  };
  if (played && !AwaitAcknowledgments(clock_, acknowledged, stop)) {
    log_.Warning("not every reader has acknowledged the trial", {{"trial", trial.source}});
  }
  control_->SetState("idle", trial.source + " played");
  if (recorder_) {
    const Status stopped = recorder_->Stop(stop);
    if (played && !stopped) played = stopped;
  }
  if (played) {
    ++trials_ended_;
    log_.Info(place + ": " + trial.source + ", " + FormatFixed(trial.duration_s(), 1) + " s");
  }
  return played;
}

Status ReplaySession::BeFollowed(const demonstration::Trial& trial, const std::stop_token& stop) {
  if (!dead_man_) return {};
  const ircp::TrialSamples samples = ircp::SamplesOf(trial, Stamp{}, options_.frame);
  const ircp::SuitSample* first = nullptr;
  for (const ircp::TrialSample& sample : samples.samples) {
    first = std::get_if<ircp::SuitSample>(&sample);
    if (first != nullptr) break;
  }
  if (first == nullptr) {
    log_.Warning("the trial has no joints of a suit that a robot could follow");
    return {};
  }
  dead_man_->BeginToPress();
  const Duration deadline = clock_.Steady() + kFollowTimeout;
  while (!dead_man_->followed() && clock_.Steady() < deadline) {
    dead_man_->GoOnPressing();
    ircp::SuitSample still = *first;
    still.header.stamp = clock_.Now();
    if (Status sent = streams_.Send(still); !sent) return sent;
    if (!clock_.SleepFor(kPollInterval, stop)) {
      return Error{ErrorCode::kCancelled, "stopped before the trial had begun"};
    }
  }
  if (!dead_man_->followed()) log_.Warning("no robot follows the suit");
  return {};
}

std::vector<ircp::TopicCount> ReplaySession::sent() const {
  std::vector<ircp::TopicCount> counts = streams_.sent();
  if (dead_man_) counts.push_back(dead_man_->sent());
  return counts;
}

}  // namespace exemplar::capture_suit
