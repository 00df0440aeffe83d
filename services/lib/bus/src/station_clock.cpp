#include "exemplar/bus/station_clock.hpp"

#include <utility>

namespace exemplar::bus {

Result<StationClock> StationClock::Follow(ParticipantOptions options, const std::string& name,
                                          std::stop_token stop) {
  StationClock clock;
  options.clock = nullptr;
  options.name += " clock";
  auto participant = Participant::Create(std::move(options));
  if (!participant.ok()) return participant.error();
  clock.participant_ = std::move(*participant);
  auto network = ircp::NetworkClock::Create(*clock.participant_, name, {.answers_at_once = false});
  if (!network.ok()) return network.error();
  clock.network_ = std::move(*network);
  if (!clock.network_->WaitForLeader(std::move(stop))) {
    return Error{ErrorCode::kCancelled, "no simulated time was heard on ircp/clock", "clock"};
  }
  return clock;
}

const Clock& StationClock::operator*() const {
  if (network_) return *network_;
  return system_;
}

void StationClock::SetCommandsSent(std::function<std::uint64_t()> commands_sent) {
  if (network_) network_->SetCommandsSent(std::move(commands_sent));
}

void StationClock::SetInputsTaken(std::function<bool(const ircp::SentInputs&)> inputs_taken) {
  if (network_) network_->SetInputsTaken(std::move(inputs_taken));
}

void StationClock::Recheck() {
  if (network_) network_->Recheck();
}

}  // namespace exemplar::bus
