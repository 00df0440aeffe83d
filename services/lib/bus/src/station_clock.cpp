#include "exemplar/bus/station_clock.hpp"

#include <chrono>
#include <utility>

namespace exemplar::bus {
namespace {

/// Longer than a busy machine keeps a thread from running, and shorter than the leader waits for
/// the whole program.
constexpr Duration kPatience = std::chrono::seconds(8);

}  // namespace

Result<StationClock> StationClock::Create(const std::string& kind, ParticipantOptions& network,
                                          const std::string& name, std::stop_token stop) {
  StationClock clock;
  clock.name_ = name;
  clock.system_ = std::make_unique<SystemClock>();
  if (kind == "network") {
    ParticipantOptions own = network;
    own.clock = nullptr;
    own.name += " clock";
    own.shared_memory_bytes = 0;
    auto participant = Participant::Create(std::move(own));
    if (!participant.ok()) return participant.error();
    clock.participant_ = std::move(*participant);
    auto followed = ircp::NetworkClock::Create(*clock.participant_, name,
                                               {.patience = kPatience, .is_complete = false});
    if (!followed.ok()) return followed.error();
    clock.network_ = std::move(*followed);
    if (!clock.network_->WaitForLeader(std::move(stop))) {
      return Error{ErrorCode::kCancelled, "no simulated time was heard on ircp/clock", "clock"};
    }
  }
  network.clock = &*clock;
  network.stamps_all = clock.is_simulated();
  return clock;
}

const Clock& StationClock::operator*() const {
  if (network_) return *network_;
  return *system_;
}

ircp::Bus& StationClock::bus(Participant& participant) {
  if (!network_) return participant;
  bus_ = std::make_unique<ircp::InStepBus>(participant, *participant_, &participant, *network_);
  return *bus_;
}

ircp::RawBus& StationClock::raw_bus(Participant& participant) {
  if (!network_) return participant;
  return *bus_;
}

void StationClock::SetSettled(std::function<bool()> is_settled) {
  if (network_) network_->SetSettled(std::move(is_settled));
}

void StationClock::Recheck() {
  if (network_) network_->Recheck();
}

void StationClock::Begin(ircp::NetworkClock::Caller caller, Log& log, std::stop_token stop) {
  if (!network_ || network_->Begin(caller, std::move(stop))) return;
  log.Warning("the simulated time does not wait for this program",
              {{"advice", "name \"" + name_ + "\" in the simulator's --in-step-with"}});
}

}  // namespace exemplar::bus
