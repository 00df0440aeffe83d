#pragma once
#include <string_view>

#include "exemplar/base/result.hpp"

namespace exemplar::recorder {

enum class State {
  kClosed,     ///< not on the network yet, or not any more
  kReady,      ///< listening, no file
  kRecording,  ///< writing a file
  kPaused,     ///< a file is open, nothing is written
  kStopped,    ///< listening; the last file is closed
};

enum class Event { kOpen, kStart, kMark, kStop, kPause, kResume, kFail, kClose };

std::string_view ToString(State state);
std::string_view ToString(Event event);

/// What follows. A mark begins a recording where there is none. kFailedPrecondition names state and
/// event where nothing does. A pause that is paused already, and a stop that is stopped already,
/// are no error: commands come twice.
Result<State> Next(State state, Event event);

}  // namespace exemplar::recorder
