#pragma once
// Recordings played to one client each, who steers: play, pause, seek, speed.

#include <filesystem>
#include <memory>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/http/server.hpp"
#include "gateway/foxglove/bridge.hpp"

namespace exemplar::gateway::foxglove {

struct PlaybackOptions {
  std::filesystem::path folder;           ///< whose *.mcap files may be played
  std::size_t players = 8;                ///< at once
  http::WebSocketEndpoint endpoint = {};  ///< bounds; the rest is the playback's
  Permit permit = {};                     ///< who may watch: those who may observe
};

/// Nothing of it goes over the station's network: a recording's messages reach the client who
/// opened it, with their own times, on channels of their own. A client of foxglove.sdk.v1 begins
/// paused and steers (capability "playbackControl"); one of foxglove.websocket.v1 sees it played
/// once, from its first subscription on. The HTTP server that has the endpoint stops before the
/// playback goes. Thread-safe.
class Playback {
 public:
  /// Clock and log outlive it.
  static std::unique_ptr<Playback> Create(const Clock& clock, Log& log, PlaybackOptions options);
  virtual ~Playback() = default;
  /// For a pattern with the variable {file}: "/foxglove/recordings/{file}".
  virtual http::WebSocketEndpoint Endpoint() = 0;
};

/// Whether `name` is a plain file name of a recording: no folder, no dot first, ".mcap" last.
bool IsRecordingName(std::string_view name);

}  // namespace exemplar::gateway::foxglove
