#pragma once
// Trial files played onto the topics, as if their people stood here.

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "capture_suit/dead_man.hpp"
#include "capture_suit/recorder_remote.hpp"
#include "capture_suit/session.hpp"
#include "capture_suit/trial_streams.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/control.hpp"

namespace exemplar::capture_suit {

struct ReplayOptions {
  double rate = 1;                ///< so many times faster than recorded
  bool dead_man = false;          ///< hold it, and begin when the robot follows
  bool record = false;            ///< tell the recorder to start and stop around each trial
  std::string name = {};          ///< of the recordings
  std::string demonstrator = {};  ///< whose demonstrations: a pseudonymous id for the recordings
  std::string frame = "base";     ///< the frame of the files' poses
  std::uint64_t seed = 1;         ///< of request ids
};

/// Reads a trial CSV. Errors name file, line and column.
Result<demonstration::Trial> ReadTrialFile(const std::filesystem::path& file);

class ReplaySession final : public Session {
 public:
  /// Precondition: trials is not empty.
  static Result<std::unique_ptr<ReplaySession>> Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                       std::vector<demonstration::Trial> trials,
                                                       const ReplayOptions& options);

  /// Plays every trial once somebody reads (or after some seconds, with a warning), and ends when
  /// the readers have acknowledged. kCancelled soon after `stop`; a recording is stopped first.
  Status Run(std::stop_token stop) override;
  std::vector<ircp::TopicCount> sent() const override;
  std::map<std::string, int> readers() const override { return streams_.readers(); }
  std::uint64_t trials_ended() const override { return trials_ended_; }

 private:
  ReplaySession(const Clock& clock, Log& log, std::vector<demonstration::Trial> trials,
                TrialStreams streams, const ReplayOptions& options);
  /// Presses the dead-man while the suit stands still as the trial begins, until a robot follows.
  Status BeFollowed(const demonstration::Trial& trial, const std::stop_token& stop);
  Status PlayOne(std::size_t index, const std::stop_token& stop);

  const Clock& clock_;
  Log& log_;
  std::vector<demonstration::Trial> trials_;
  TrialStreams streams_;
  ReplayOptions options_;
  std::atomic<std::uint64_t> trials_ended_{0};
  std::optional<RecorderRemote> recorder_;
  std::unique_ptr<DeadMan> dead_man_;             ///< null: nobody holds one
  std::unique_ptr<ircp::ControlServer> control_;  ///< destroyed first: it asks streams_ for counts
};

}  // namespace exemplar::capture_suit
