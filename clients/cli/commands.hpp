#pragma once
// The groups of commands. `session` must outlive the command line.

#include "command_line.hpp"
#include "session.hpp"

namespace exemplar::cli {

void AddTrialCommands(Command& root, const Session& session);
void AddSkillCommands(Command& root, const Session& session);
/// `skill query`, `skill evaluate`, `skill execute`.
void AddMotionCommands(Command& skill, const Session& session);
void AddRobotCommands(Command& root, const Session& session);
void AddRecordCommands(Command& root, const Session& session);
/// `record info`, `record recover`: on files of this machine, without a server.
void AddRecordingFileCommands(Command& record);
/// `record join`.
void AddJoinCommand(Command& record);
/// `record replay`.
void AddReplayCommand(Command& record);

}  // namespace exemplar::cli
