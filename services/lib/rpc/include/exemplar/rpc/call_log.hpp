#pragma once
// Calls as log lines and as figures for metrics.

#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/log.hpp"
#include "exemplar/base/metric.hpp"
#include "exemplar/rpc/server.hpp"

namespace exemplar::rpc {

/// Takes the records of ServerOptions::on_call: a line each (failed calls as warnings, the rest at
/// debug level) and sums by method and outcome. Thread-safe. The log must outlive it.
class CallLog {
 public:
  explicit CallLog(Log& log) : log_(log) {}
  void Record(const CallRecord& call);

  struct Figure {
    std::string method;
    std::string code;  ///< "ok", or the name of the ErrorCode
    std::uint64_t calls = 0;
    double seconds = 0;  ///< summed
  };
  std::vector<Figure> figures() const;

 private:
  Log& log_;
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, std::string>, Figure> figures_;
};

/// "<prefix>_calls_total" and "<prefix>_call_seconds_total" by method and code. `calls` outlives
/// them.
std::vector<Metric> MetricsOf(const CallLog& calls, const std::string& prefix);

}  // namespace exemplar::rpc
