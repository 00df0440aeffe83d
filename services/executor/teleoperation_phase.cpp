#include "executor/teleoperation_phase.hpp"

namespace exemplar::executor {

std::string_view ToString(Phase phase) {
  switch (phase) {
    case Phase::kHolding:
      return "holding";
    case Phase::kApproaching:
      return "approaching";
    case Phase::kFollowing:
      return "following";
    case Phase::kBlocked:
      return "blocked";
  }
  return "unknown";
}

std::string_view ToString(PhaseEvent event) {
  switch (event) {
    case PhaseEvent::kEngage:
      return "engage";
    case PhaseEvent::kArrive:
      return "arrive";
    case PhaseEvent::kBlock:
      return "block";
    case PhaseEvent::kFree:
      return "free";
    case PhaseEvent::kHold:
      return "hold";
  }
  return "unknown";
}

std::optional<Phase> Next(Phase phase, PhaseEvent event) {
  switch (event) {
    case PhaseEvent::kHold:
      return Phase::kHolding;
    case PhaseEvent::kEngage:
      if (phase == Phase::kHolding) return Phase::kApproaching;
      return std::nullopt;
    case PhaseEvent::kArrive:
      if (phase == Phase::kApproaching) return Phase::kFollowing;
      return std::nullopt;
    case PhaseEvent::kBlock:
      if (phase == Phase::kApproaching || phase == Phase::kFollowing) return Phase::kBlocked;
      return std::nullopt;
    case PhaseEvent::kFree:
      if (phase == Phase::kBlocked) return Phase::kApproaching;
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace exemplar::executor
