#include "executor/state_machine.hpp"

namespace exemplar::executor {

std::string_view ToString(State state) {
  switch (state) {
    case State::kIdle:
      return "idle";
    case State::kPlanning:
      return "planning";
    case State::kReady:
      return "ready";
    case State::kExecuting:
      return "executing";
    case State::kPaused:
      return "paused";
    case State::kProtectiveStop:
      return "protective_stop";
    case State::kEmergencyStop:
      return "emergency_stop";
    case State::kDone:
      return "done";
    case State::kAborted:
      return "aborted";
    case State::kTeleoperating:
      return "teleoperating";
  }
  return "unknown";
}

std::string_view ToString(Event event) {
  switch (event) {
    case Event::kPlan:
      return "plan";
    case Event::kPlanned:
      return "planned";
    case Event::kRefused:
      return "refused";
    case Event::kStart:
      return "start";
    case Event::kPause:
      return "pause";
    case Event::kResume:
      return "resume";
    case Event::kCancel:
      return "cancel";
    case Event::kStop:
      return "stop";
    case Event::kFault:
      return "fault";
    case Event::kEmergency:
      return "emergency";
    case Event::kReset:
      return "reset";
    case Event::kFinish:
      return "finish";
    case Event::kMiss:
      return "miss";
    case Event::kTeleoperate:
      return "teleoperate";
    case Event::kLeave:
      return "end teleoperation";
  }
  return "unknown";
}

std::optional<State> Next(State state, Event event) {
  if (event == Event::kEmergency) return State::kEmergencyStop;
  if (event == Event::kStop) {
    return state == State::kEmergencyStop ? State::kEmergencyStop : State::kProtectiveStop;
  }
  switch (state) {
    case State::kIdle:
    case State::kReady:
    case State::kDone:
    case State::kAborted:
      if (event == Event::kPlan) return State::kPlanning;
      if (event == Event::kTeleoperate) return State::kTeleoperating;
      if (event == Event::kReset) return State::kIdle;
      if (event == Event::kStart && state == State::kReady) return State::kExecuting;
      if (event == Event::kCancel && state == State::kReady) return State::kIdle;
      return std::nullopt;
    case State::kPlanning:
      if (event == Event::kPlanned) return State::kReady;
      if (event == Event::kRefused) return State::kIdle;
      if (event == Event::kCancel) return State::kAborted;
      return std::nullopt;
    case State::kExecuting:
    case State::kPaused:
      if (event == Event::kPause) return State::kPaused;
      if (event == Event::kResume) return State::kExecuting;
      if (event == Event::kCancel) return State::kAborted;
      if (event == Event::kFault) return State::kProtectiveStop;
      if (event == Event::kFinish) return State::kDone;
      if (event == Event::kMiss) return State::kAborted;
      return std::nullopt;
    case State::kTeleoperating:
      if (event == Event::kLeave) return State::kDone;
      if (event == Event::kCancel) return State::kAborted;
      if (event == Event::kFault) return State::kProtectiveStop;
      return std::nullopt;
    case State::kProtectiveStop:
    case State::kEmergencyStop:
      if (event == Event::kReset) return State::kIdle;
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace exemplar::executor
