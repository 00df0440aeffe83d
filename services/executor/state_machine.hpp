#pragma once
// What an executor may do when.

#include <array>
#include <optional>
#include <string_view>

namespace exemplar::executor {

enum class State {
  kIdle,
  kPlanning,
  kReady,  ///< a plan was made and nothing moves
  kExecuting,
  kPaused,          ///< comes to rest on the path, or rests there
  kProtectiveStop,  ///< after a fault or a stop; needs a reset
  kEmergencyStop,   ///< latched until a reset
  kDone,
  kAborted,
  kTeleoperating,  ///< follows an operator, or holds; see teleoperation_phase.hpp
};

enum class Event {
  kPlan,     ///< planning begins
  kPlanned,  ///< the plan stands
  kRefused,  ///< there is no plan
  kStart,    ///< the planned motion begins
  kPause,
  kResume,
  kCancel,  ///< given up; rests where it stops, no reset needed
  kStop,    ///< at once; needs a reset
  kFault,   ///< something watched went wrong; needs a reset
  kEmergency,
  kReset,
  kFinish,       ///< the end of the motion is reached
  kMiss,         ///< it is reached, but a press met no touch
  kTeleoperate,  ///< the robot belongs to an operator from here on
  kLeave,        ///< teleoperation ends as it should
};

inline constexpr std::array kAllStates = {
    State::kIdle,    State::kPlanning,       State::kReady,         State::kExecuting,
    State::kPaused,  State::kProtectiveStop, State::kEmergencyStop, State::kDone,
    State::kAborted, State::kTeleoperating};
inline constexpr std::array kAllEvents = {
    Event::kPlan,   Event::kPlanned, Event::kRefused, Event::kStart,       Event::kPause,
    Event::kResume, Event::kCancel,  Event::kStop,    Event::kFault,       Event::kEmergency,
    Event::kReset,  Event::kFinish,  Event::kMiss,    Event::kTeleoperate, Event::kLeave};

/// "executing", "protective_stop", ...
std::string_view ToString(State state);
std::string_view ToString(Event event);

/// The state after `event`; nullopt where it is refused. Stop and emergency are taken in every
/// state; nothing but a reset leaves the two stops, and an emergency is never downgraded.
std::optional<State> Next(State state, Event event);

/// Whether a motion is being run through, also while it comes to rest.
inline bool IsMoving(State state) { return state == State::kExecuting || state == State::kPaused; }

}  // namespace exemplar::executor
