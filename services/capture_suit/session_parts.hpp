#pragma once
// What all sessions have in common towards the other programs of the station.

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "capture_suit/recorder_remote.hpp"
#include "capture_suit/session.hpp"
#include "exemplar/base/log.hpp"
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

/// Waits until each topic of `readers` has `wanted` of them, for a while, in which simulated time
/// stands; then says what has fewer. kCancelled: `stop` came first.
Status AwaitReaders(const Clock& clock, Log& log,
                    const std::function<std::map<std::string, int>()>& readers, int wanted,
                    const std::stop_token& stop);

/// Until `acknowledged`, which is asked with the time that it may wait, says that every reader has
/// all of it; false when they took too long, or `stop` came first.
bool AwaitAcknowledgments(const Clock& clock, const std::function<bool(Duration)>& acknowledged,
                          const std::stop_token& stop);

/// Postures (rad) from one at rest to another at rest, `rate_hz` of them a second, each sent when
/// its time has come. kCancelled: `stop` came first.
Status Glide(const Clock& clock, const Eigen::VectorXd& from, const Eigen::VectorXd& to,
             double seconds, double rate_hz,
             const std::function<Status(const Eigen::VectorXd&)>& send,
             const std::stop_token& stop);

/// That of a session which was stopped.
Error Cancelled();

/// "(0.46, -0.12)".
std::string PlaceText(const geometry::Pose& pose);

}  // namespace exemplar::capture_suit
