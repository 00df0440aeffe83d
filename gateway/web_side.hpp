#pragma once
#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/http/server.hpp"
#include "gateway/program_options.hpp"

namespace exemplar::gateway {

/// The web page at "/" (from --web, or where the build or the installation puts it), and what it
/// draws: the robot at /robot/description.json and /robot/files/, the scene at /robot/scene.json,
/// the names of the newest recordings of the folder --recordings at /recordings.json.
/// Before the server's start.
Status AddWebSide(const ProgramOptions& words, http::Server& server, Log& log);

}  // namespace exemplar::gateway
