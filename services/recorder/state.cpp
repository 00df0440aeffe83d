#include "recorder/state.hpp"

#include <string>

namespace exemplar::recorder {

std::string_view ToString(State state) {
  switch (state) {
    case State::kClosed:
      return "closed";
    case State::kReady:
      return "ready";
    case State::kRecording:
      return "recording";
    case State::kPaused:
      return "paused";
    case State::kStopped:
      return "stopped";
  }
  return "closed";
}

std::string_view ToString(Event event) {
  switch (event) {
    case Event::kOpen:
      return "open";
    case Event::kStart:
      return "start";
    case Event::kMark:
      return "mark an event";
    case Event::kStop:
      return "stop";
    case Event::kPause:
      return "pause";
    case Event::kResume:
      return "resume";
    case Event::kFail:
      return "fail";
    case Event::kClose:
      return "close";
  }
  return "close";
}

Result<State> Next(State state, Event event) {
  const bool has_file = state == State::kRecording || state == State::kPaused;
  const bool listening = state != State::kClosed;
  switch (event) {
    case Event::kOpen:
      if (state == State::kClosed) return State::kReady;
      break;
    case Event::kStart:
      if (state == State::kReady || state == State::kStopped) return State::kRecording;
      break;
    case Event::kMark:
      if (has_file) return state;
      if (listening) return State::kRecording;
      break;
    case Event::kStop:
      if (has_file || state == State::kStopped) return State::kStopped;
      break;
    case Event::kPause:
      if (has_file) return State::kPaused;
      break;
    case Event::kResume:
      if (has_file) return State::kRecording;
      break;
    case Event::kFail:
      if (listening) return has_file ? State::kStopped : state;
      break;
    case Event::kClose:
      return State::kClosed;
  }
  return FailedPrecondition("the recorder is " + std::string(ToString(state)) + ", it cannot " +
                            std::string(ToString(event)));
}

}  // namespace exemplar::recorder
