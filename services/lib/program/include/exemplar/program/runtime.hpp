#pragma once
// What surrounds a program's behaviour: logging, signals, metrics, the way out.

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/log.hpp"
#include "exemplar/base/metric.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/program/options.hpp"

namespace exemplar::program {

/// Lines on stderr: "2026-11-22T03:24:33.123Z info recorder: recording file=a.mcap messages=12", or
/// one JSON object each with --log-format json.
std::unique_ptr<Log> MakeLog(const CommonOptions& options, const std::string& program);

/// A stop token that SIGTERM and SIGINT trigger; SIGPIPE is ignored. Create one, first thing in
/// main, before any thread starts (the signals are blocked and waited for by a thread of its own).
/// Under systemd it also says that the program is ready (when the token is first asked for), that
/// it is alive (WatchdogSec=) and that it stops.
class Signals {
 public:
  Signals();
  ~Signals();
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;
  std::stop_token token() const;
  /// Blocks until a signal came, or Stop was called by somebody else.
  void Wait() const;
  void Stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

using exemplar::Metric;

/// All figures as they are now, in Prometheus' text format.
std::string MetricsText(const std::vector<Metric>& metrics);

/// Serves GET /metrics and /healthz on HOST:PORT until destroyed. Thread-safe.
class MetricsServer {
 public:
  static Result<std::unique_ptr<MetricsServer>> Create(const std::string& address,
                                                       std::vector<Metric> metrics);
  virtual ~MetricsServer() = default;
  virtual int port() const = 0;
};

/// The server of --metrics; null where the option is empty. Destroy it before what `metrics` ask.
Result<std::unique_ptr<MetricsServer>> ServeMetrics(const CommonOptions& options,
                                                    std::vector<Metric> metrics);

/// Asks the program that serves its metrics on HOST:PORT for its health, as --check does; an
/// address that means every interface is asked on loopback. Fails with kUnavailable where it is not
/// well.
Status CheckHealth(const std::string& address,
                   std::chrono::milliseconds patience = std::chrono::seconds(2));

/// Prints "PROGRAM: message" to stderr and returns the exit code for the error.
int Fail(const std::string& program, const Error& error);
/// The contract's exit codes: 3 not found, 4 refused, 5 unavailable, 1 else.
int ExitCode(ErrorCode code);

const char* Version();

}  // namespace exemplar::program
