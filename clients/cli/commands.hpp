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
/// `robot teleop on`, `robot teleop off`.
void AddTeleopCommands(Command& robot, const Session& session);
void AddRecordCommands(Command& root, const Session& session);
/// `record info`, `record recover`: on files of this machine, without a server.
void AddRecordingFileCommands(Command& record);
/// `record join`.
void AddJoinCommand(Command& record);
/// `record replay`.
void AddReplayCommand(Command& record);

/// `watch`: of a gateway, or on the network itself.
void AddWatchCommand(Command& root, const Session& session);
void AddDoctorCommand(Command& root, const Session& session);
/// `backup`, `restore`, `retention`.
void AddBackupCommands(Command& root, const Session& session);
/// `person`.
void AddPersonCommands(Command& root, const Session& session);
/// `security`: on files of this machine, without a server.
void AddSecurityCommands(Command& root);
void AddCompletionCommand(Command& root);

/// What the scripts of `completion` ask for: how the last of `words` may go on, a line each.
int PrintCompletion(const CommandLine& line, const Session& session,
                    const std::vector<std::string>& words);

}  // namespace exemplar::cli
