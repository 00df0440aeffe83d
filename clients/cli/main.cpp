// exemplar: the command line to all services.

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

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
      "Exit codes: 0 done, 2 bad usage, 3 not found, 4 refused as invalid, unsafe or not allowed,\n"
      "5 no service answers, 130 interrupted (Ctrl-C), 1 anything else.");
  line.root()
      .Option("--server", "HOST:PORT", session.server,
              std::string("the gateway, or a service directly (default: ") +
                  cli::Session::kDefaultServer + ")")
      .FromEnvironment("EXEMPLAR_SERVER")
      .Option("--timeout", "SECONDS", session.timeout_s,
              "limit of each call (default: 30; none to learn, plan and execute)")
      .Option("--tls-ca", "FILE", session.credentials.ca,
              "PEM file of the CA that the server's certificate comes from")
      .FromEnvironment("EXEMPLAR_TLS_CA")
      .Option("--tls-cert", "FILE", session.credentials.certificate,
              "PEM file with your own certificate, and")
      .FromEnvironment("EXEMPLAR_TLS_CERT")
      .Option("--tls-key", "FILE", session.credentials.key, "with its key")
      .FromEnvironment("EXEMPLAR_TLS_KEY")
      .Option("--token", "TOKEN", session.credentials.token,
              "sent with each call; @FILE reads a file")
      .FromEnvironment("EXEMPLAR_TOKEN");
  cli::AddTrialCommands(line.root(), session);
  cli::AddSkillCommands(line.root(), session);
  cli::AddRobotCommands(line.root(), session);
  cli::AddRecordCommands(line.root(), session);
  cli::AddPersonCommands(line.root(), session);
  cli::AddBackupCommands(line.root(), session);
  cli::AddWatchCommand(line.root(), session);
  cli::AddDoctorCommand(line.root(), session);
  cli::AddSecurityCommands(line.root());
  cli::AddCompletionCommand(line.root());

  const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (!words.empty() && words.front() == "__complete") {
    if (const char* server = std::getenv("EXEMPLAR_SERVER")) session.server = server;
    return cli::PrintCompletion(line, session, {words.begin() + 1, words.end()});
  }
  if (words == std::vector<std::string>{"__manual"}) {
    std::cout << line.ManualPage();
    return 0;
  }
  return line.Run(argc, argv);
}
