#pragma once
// What all sessions have in common towards the other programs of the station.

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "capture_suit/recorder_remote.hpp"
#include "exemplar/geometry/pose.hpp"
#include "exemplar/ircp/control.hpp"

namespace exemplar::capture_suit {

/// Tells the state of a session, and takes no command. `sent` is asked for as long as it lives.
Result<std::unique_ptr<ircp::ControlServer>> MakeControl(
    ircp::Bus& bus, const Clock& clock, std::function<std::vector<ircp::TopicCount>()> sent);

/// The recorder, where trials are to be recorded.
Result<std::optional<RecorderRemote>> MakeRecorder(bool wanted, ircp::Bus& bus, const Clock& clock,
                                                   std::uint64_t seed,
                                                   const std::string& demonstrator);

/// Has the simulator put an object somewhere. Errors say which, and where.
Status PutObject(ircp::ControlClient& simulator, const std::string& object,
                 const geometry::Pose& base_T_object, const std::stop_token& stop);

/// "(0.46, -0.12)".
std::string PlaceText(const geometry::Pose& pose);

}  // namespace exemplar::capture_suit
