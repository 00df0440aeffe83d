#include "exemplar/program/options.hpp"

#include <yaml-cpp/yaml.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <string_view>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/program/runtime.hpp"

namespace exemplar::program {
namespace {

/// The options' names without dashes, as a configuration file has them.
std::vector<std::string> Names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back(name);
  }
  return names;
}

std::string Suggestion(const std::string& name, const CLI::App& app, const std::string& dashes) {
  const std::optional<std::string> near = NearestName(name, Names(app));
  return near ? "; did you mean " + dashes + *near + '?' : std::string();
}

/// Lets CLI11 read YAML: a map of option names to scalars or lists of scalars.
class YamlConfig final : public CLI::Config {
 public:
  explicit YamlConfig(const CLI::App& app) : app_(app) {}

  std::string to_config(const CLI::App*, bool, bool, std::string) const override { return {}; }

  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override {
    YAML::Node root;
    try {
      root = YAML::Load(input);
    } catch (const YAML::Exception& e) {
      throw CLI::ConfigError("line " + std::to_string(e.mark.line + 1) + ": " + e.msg);
    }
    std::vector<CLI::ConfigItem> entries;
    if (root.IsNull()) return entries;
    if (!root.IsMap()) throw CLI::ConfigError("the file must hold a map of option names to values");
    for (const auto& entry : root) {
      CLI::ConfigItem item;
      item.name = entry.first.as<std::string>();
      const int line = entry.first.Mark().line + 1;
      if (!IsOption(item.name)) {
        throw CLI::ConfigError("line " + std::to_string(line) + ": there is no option \"" +
                               item.name + '"' + Suggestion(item.name, app_, ""));
      }
      if (entry.second.IsScalar()) {
        item.inputs = {entry.second.Scalar()};
      } else if (entry.second.IsSequence()) {
        for (const YAML::Node& part : entry.second) {
          if (!part.IsScalar()) Refuse(line, item.name);
          item.inputs.push_back(part.Scalar());
        }
      } else {
        Refuse(line, item.name);
      }
      entries.push_back(std::move(item));
    }
    return entries;
  }

 private:
  bool IsOption(const std::string& name) const {
    const std::vector<std::string> names = Names(app_);
    return std::find(names.begin(), names.end(), name) != names.end();
  }

  [[noreturn]] static void Refuse(int line, const std::string& name) {
    throw CLI::ConfigError("line " + std::to_string(line) + ": " + name +
                           " must be a value or a list of values");
  }

  const CLI::App& app_;
};

void AddServerOptions(CLI::App& app, CommonOptions& common) {
  security::ServerCredentials& server = common.server;
  app.add_option("--listen", common.listen, "HOST:PORT of the gRPC server; port 0 picks one");
  app.add_option("--port-file", common.port_file, "file that gets the port in use");
  app.add_option("--tls-cert", server.certificate, "PEM file with this program's certificate")
      ->envname("EXEMPLAR_TLS_CERT");
  app.add_option("--tls-key", server.key, "PEM file with its key")->envname("EXEMPLAR_TLS_KEY");
  app.add_option("--tls-client-ca", server.client_ca,
                 "PEM file of the CA that callers' certificates must come from");
  app.add_option("--access", server.access, "file that says who may call what (docs/security.md)");
  app.add_flag("--insecure-listen", server.insecure_listen,
               "listen beyond this machine though anybody may call, or in plain text");
  app.add_option("--calls-per-s", server.calls_per_s,
                 "what each caller may ask in the mean; 0: no limit")
      ->check(CLI::Range(0.0, 1e6));
}

void AddClientOptions(CLI::App& app, security::ClientCredentials& client, bool own_certificate) {
  app.add_option("--tls-ca", client.ca,
                 "PEM file of the CA of the servers that are called; empty: plain text")
      ->envname("EXEMPLAR_TLS_CA");
  if (own_certificate) {
    app.add_option("--tls-cert", client.certificate, "PEM file with this program's certificate")
        ->envname("EXEMPLAR_TLS_CERT");
    app.add_option("--tls-key", client.key, "PEM file with its key")->envname("EXEMPLAR_TLS_KEY");
  }
  app.add_option("--token", client.token, "sent to the servers that are called; @FILE reads a file")
      ->envname("EXEMPLAR_TOKEN")
      ->default_str("");
}

}  // namespace

struct Options::Impl {
  Impl(std::string name, std::string summary, std::string footer)
      : program(std::move(name)), app(std::move(summary), program) {
    app.footer("Examples:\n" + std::move(footer) +
               "\n\nExit codes: 0 done, 2 usage, 3 not found, 4 refused, 5 unavailable, 1 anything "
               "else.");
    app.get_formatter()->column_width(34);
    app.option_defaults()->always_capture_default();
  }

  std::string program;
  Roles roles;
  CommonOptions common;
  CLI::App app;
  CLI::Option* last = nullptr;
  bool check = false;
};

Options::Options(std::string program, std::string summary, std::string footer, Roles roles)
    : impl_(std::make_unique<Impl>(std::move(program), std::move(summary), std::move(footer))) {
  CLI::App& app = impl_->app;
  CommonOptions& common = impl_->common;
  impl_->roles = roles;
  app.config_formatter(std::make_shared<YamlConfig>(app));
  app.set_config("--config", "", "YAML file with any of these options; flags override it");
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.set_version_flag("--version", std::string(Version()));
  if (roles.bus) {
    app.add_option("--domain", common.domain, "DDS domain")->check(CLI::Range(0, 232));
    app.add_option("--station", common.station, "name of the place; stations never mix");
    app.add_option("--interface", common.interfaces, "network interfaces to use (default: all)");
    app.add_option("--peer", common.peers, "machines to seek where multicast does not reach");
    app.add_option("--discovery-server", common.discovery_servers,
                   "HOST:PORT of Fast DDS discovery servers, used instead of multicast");
    app.add_option("--best-effort", common.best_effort,
                   "topics not sent again when lost (ircp/joint_state); all programs alike");
    app.add_option("--security", common.security,
                   "folder that `exemplar security issue` made: authenticated, encrypted topics");
  }
  if (roles.clock) {
    app.add_option("--clock", common.clock,
                   "the machine's, or the simulated time that a simulator sends")
        ->check(CLI::IsMember({"system", "network"}));
  }
  if (roles.server) AddServerOptions(app, common);
  if (roles.client) AddClientOptions(app, common.client, !roles.server);
  if (roles.data)
    app.add_option("--data-dir", common.data_dir, "folder for what is stored")->required();
  app.add_option("--metrics", common.metrics, "HOST:PORT of the Prometheus endpoint; empty: none");
  app.add_flag("--check", impl_->check,
               "run nothing: ask the program that runs with this --metrics for its health");
  app.add_option("--log-format", common.log_format, "how events are written to stderr")
      ->check(CLI::IsMember({"text", "json"}));
  app.add_option("--log-level", common.log_level, "least level that is written")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}));
}

Options::~Options() = default;

Options& Options::Add(const std::string& name, std::string& value, const std::string& help) {
  impl_->last = impl_->app.add_option(name, value, help);
  return *this;
}
Options& Options::Add(const std::string& name, double& value, const std::string& help) {
  impl_->last = impl_->app.add_option(name, value, help);
  return *this;
}
Options& Options::Add(const std::string& name, int& value, const std::string& help) {
  impl_->last = impl_->app.add_option(name, value, help);
  return *this;
}
Options& Options::Add(const std::string& name, bool& value, const std::string& help) {
  impl_->last = impl_->app.add_flag(name, value, help);
  return *this;
}
Options& Options::Add(const std::string& name, std::vector<std::string>& values,
                      const std::string& help) {
  impl_->last = impl_->app.add_option(name, values, help);
  return *this;
}
Options& Options::Required() {
  impl_->last->required();
  return *this;
}
Options& Options::OneOf(const std::vector<std::string>& choices) {
  impl_->last->check(CLI::IsMember(choices));
  return *this;
}
Options& Options::MinMax(double least, double greatest) {
  impl_->last->check(CLI::Range(least, greatest));
  return *this;
}

CommonOptions& Options::common() { return impl_->common; }

int Options::Refuse(const std::string& what) const {
  std::cerr << impl_->program << ": " << what << "\nTry '" << impl_->program << " --help'.\n";
  return 2;
}

std::optional<int> Options::Parse(int argc, char** argv) {
  // A check needs none of what the program needs to run.
  if (std::find(argv, argv + argc, std::string_view("--check")) != argv + argc) {
    for (CLI::Option* option : impl_->app.get_options()) option->required(false);
  }
  try {
    impl_->app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::cout << impl_->app.help();
    return 0;
  } catch (const CLI::CallForVersion&) {
    std::cout << impl_->program << ' ' << Version() << '\n';
    return 0;
  } catch (const CLI::ConfigError& e) {
    return Refuse("--config " + impl_->app.get_config_ptr()->as<std::string>() + ": " + e.what());
  } catch (const CLI::ParseError& e) {
    // A slip of the hand is often why something else is missing: it is said first.
    const std::vector<std::string> unknown = impl_->app.remaining();
    if (unknown.empty()) return Refuse(e.what());
    const std::string& word = unknown.front();
    const std::size_t dashes = std::min(word.size(), word.find_first_not_of('-'));
    const std::string name = word.substr(dashes, word.find('=') - dashes);
    return Refuse('"' + word + "\" is not expected" +
                  (dashes > 0 ? Suggestion(name, impl_->app, "--") : std::string()));
  }
  CommonOptions& common = impl_->common;
  if (!common.security.empty() && !common.discovery_servers.empty()) {
    return Refuse(
        "--security and --discovery-server do not go together: Fast DDS 2.9 cannot secure a "
        "discovery server; use multicast or --peer");
  }
  if (impl_->roles.server && impl_->roles.client && !common.client.ca.empty()) {
    common.client.certificate = common.server.certificate;
    common.client.key = common.server.key;
  }
  if (impl_->check) {
    if (impl_->common.metrics.empty()) return Refuse("--check needs the program's --metrics");
    const Status health = CheckHealth(impl_->common.metrics);
    if (!health.ok()) return Fail(impl_->program, health.error());
    return 0;
  }
  return std::nullopt;
}

}  // namespace exemplar::program
