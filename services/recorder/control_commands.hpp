#pragma once
#include "exemplar/api/services.hpp"
#include "exemplar/ircp/control.hpp"

namespace exemplar::recorder {

/// Commands of ircp/recorder/command: "start" (arguments `name`, `expect` as topics separated by
/// commas, `timeout_s`; all optional; `meta.KEY` and every other one is kept in the file), "stop",
/// "pause", "resume", "status". The answer's values: `state`, `file`, `messages`, `bytes`,
/// `duration_s`, `sent`, `received`, `lost`.
ircp::Answer AnswerCommand(api::RecorderApi& recorder, const ircp::CommandSample& command);

/// The same values, for the status topic.
std::map<std::string, std::string> StatusValues(const api::RecorderStatus& status);

}  // namespace exemplar::recorder
