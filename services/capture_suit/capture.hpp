#pragma once
// What exemplar-capture-suit was asked to do, and the doing of it.

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "capture_suit/carry_session.hpp"
#include "capture_suit/person_session.hpp"
#include "capture_suit/replay_session.hpp"
#include "exemplar/base/metric.hpp"

namespace exemplar::capture_suit {

struct CaptureOptions {
  std::vector<std::string> replay;  ///< trial files; else `person`
  ReplayOptions replaying;
  bool person = false;
  std::string robot_folder;  ///< the person's body
  std::string scene_file;    ///< what stands around it
  PersonSessionOptions performing;
  CarrySessionOptions carrying;   ///< of a person who carries, where `to` is named
  std::string name = "trial";     ///< of the recordings
  std::string demonstrator = {};  ///< whose demonstrations: a pseudonymous id for the recordings
  int seed = 1;                   ///< of the person's chance
  bool dead_man = false;          ///< hold the dead-man on ircp/safety while a trial goes on
  bool record = false;            ///< have the recorder record every trial
};

/// Says what is missing or too much.
Status CheckUsage(const CaptureOptions& options);

/// Reads the files and makes the session that was asked for. Precondition: CheckUsage.
Result<std::unique_ptr<Session>> MakeSession(ircp::Bus& bus, const Clock& clock, Log& log,
                                             const CaptureOptions& options);

/// For Prometheus: samples sent, trials ended. The session outlives them.
std::vector<Metric> MetricsOf(const Session& session);

}  // namespace exemplar::capture_suit
