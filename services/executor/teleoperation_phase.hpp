#pragma once
// What a teleoperated robot does at a moment, and what leads from there to where.

#include <array>
#include <optional>
#include <string_view>

namespace exemplar::executor {

enum class Phase {
  kHolding,      ///< at rest, or coming to rest; waits for the dead-man to be pressed
  kApproaching,  ///< slowly to the operator's posture
  kFollowing,    ///< the operator's posture, within the joints' limits
  kBlocked,      ///< at rest where going on would come too near to something
};

enum class PhaseEvent {
  kEngage,  ///< the dead-man is pressed and everything else is as it should be
  kArrive,  ///< the operator's posture is reached
  kBlock,   ///< there is no way on that keeps clear
  kFree,    ///< there is one again
  kHold,    ///< the dead-man is released, or something is missing or wrong
};

inline constexpr std::array kAllPhases = {Phase::kHolding, Phase::kApproaching, Phase::kFollowing,
                                          Phase::kBlocked};
inline constexpr std::array kAllPhaseEvents = {PhaseEvent::kEngage, PhaseEvent::kArrive,
                                               PhaseEvent::kBlock, PhaseEvent::kFree,
                                               PhaseEvent::kHold};

/// "holding", "approaching", "following", "blocked".
std::string_view ToString(Phase phase);
/// "engage", "arrive", "block", "free", "hold".
std::string_view ToString(PhaseEvent event);

/// The phase after `event`; nullopt where it does not count. Holding is left by pressing the
/// dead-man alone, and nothing but the approach leads to following.
std::optional<Phase> Next(Phase phase, PhaseEvent event);

}  // namespace exemplar::executor
