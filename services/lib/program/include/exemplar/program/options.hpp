#pragma once
// A program's command line and configuration file. Flags override the file; both are checked alike.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/security/credentials.hpp"

namespace exemplar::program {

/// What most programs share (DESIGN.md, "Processes").
struct CommonOptions {
  int domain = 0;                       ///< DDS domain
  std::string station = "default";      ///< name of the place; the DDS partition of its topics
  std::vector<std::string> interfaces;  ///< network interfaces to use; empty: all
  std::vector<std::string> peers;       ///< machines sought beside multicast
  std::vector<std::string> discovery_servers;  ///< HOST:PORT; with one, no multicast
  std::vector<std::string> best_effort;        ///< topics that are not sent again when lost
  std::string security;  ///< folder with this program's DDS-Security files; empty: open network
  std::string clock = "system";        ///< or "network": the simulated time on ircp/clock
  std::string listen = "127.0.0.1:0";  ///< of the gRPC server; port 0 picks a free one
  std::string port_file;               ///< gets the port that was picked
  security::ServerCredentials server;  ///< of the gRPC server
  security::ClientCredentials client;  ///< for the servers that this program calls
  std::string data_dir;
  std::string metrics;  ///< HOST:PORT of the Prometheus endpoint; empty: none
  std::string log_format = "text";
  std::string log_level = "info";
};

/// Which of the common options a program has.
struct Roles {
  bool bus = false;  ///< --domain, --station, --interface, --peer, --discovery-server,
                     ///< --best-effort, --security
  bool server =
      false;           ///< --listen, --port-file, --tls-cert, --tls-key, --tls-client-ca, --access,
                       ///< --insecure-listen, --calls-per-s
  bool data = false;   ///< --data-dir
  bool clock = false;  ///< --clock
  bool client = false;  ///< --tls-ca, --token; --tls-cert and --tls-key, which with `server` are
                        ///< those of its server
};

/// Builds a command line on CLI11. `--config FILE.yaml` holds the same names without dashes
/// (`data-dir: /var/lib/exemplar`). Thread-compatible.
class Options {
 public:
  /// `program` as typed ("exemplar-recorder"), `summary` one line, `footer` examples.
  Options(std::string program, std::string summary, std::string footer, Roles roles);
  ~Options();
  Options(const Options&) = delete;
  Options& operator=(const Options&) = delete;

  /// `name` with dashes ("--rate"); the variable's value is the default and is shown in --help.
  Options& Add(const std::string& name, std::string& value, const std::string& help);
  Options& Add(const std::string& name, double& value, const std::string& help);
  Options& Add(const std::string& name, int& value, const std::string& help);
  Options& Add(const std::string& name, bool& value, const std::string& help);  ///< a flag
  Options& Add(const std::string& name, std::vector<std::string>& values, const std::string& help);
  /// The option added last must be given / must be one of.
  Options& Required();
  Options& OneOf(const std::vector<std::string>& choices);
  Options& MinMax(double least, double greatest);

  CommonOptions& common();

  /// The exit code when the program is done already (--help, --version: 0; bad usage: 2, said on
  /// stderr).
  std::optional<int> Parse(int argc, char** argv);
  /// Says on stderr what is wrong with the usage; the exit code for that, 2.
  int Refuse(const std::string& what) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace exemplar::program
