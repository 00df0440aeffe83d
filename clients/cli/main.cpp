// exemplar: the command line to all services.

#include "commands.hpp"
#include "exemplar/program/runtime.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  cli::Session session;
  cli::CommandLine line(
      "exemplar", "Teaches a robot skills from a few demonstrations: trials in, motions out.",
      program::Version(),
      {"exemplar trial submit --skill press trial-*.csv", "exemplar skill learn press",
       "exemplar skill query press --object button=0.45,-0.2,0.06 --format csv",
       "exemplar skill execute press --object button=0.45,-0.2,0.06 --wait"},
      "Exit codes: 0 done, 2 bad usage, 3 not found, 4 refused as invalid or unsafe,\n"
      "5 no service answers, 1 anything else.");
  line.root()
      .Option("--server", "HOST:PORT", session.server, "the gateway, or a service directly")
      .FromEnvironment("EXEMPLAR_SERVER")
      .Option("--timeout", "SECONDS", session.timeout_s,
              "limit of each call (default: 30; none to learn, plan and execute)");
  cli::AddTrialCommands(line.root(), session);
  cli::AddSkillCommands(line.root(), session);
  cli::AddRobotCommands(line.root(), session);
  cli::AddRecordCommands(line.root(), session);
  return line.Run(argc, argv);
}
