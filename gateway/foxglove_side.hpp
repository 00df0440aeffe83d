#pragma once
#include <memory>
#include <vector>

#include "exemplar/api/json_calls.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/metric.hpp"
#include "exemplar/http/server.hpp"
#include "gateway/program_options.hpp"
#include "gateway/topic_hub.hpp"

namespace exemplar::gateway {

/// Foxglove on the gateway's HTTP server: live at / and /foxglove, recordings at
/// /foxglove/recordings/NAME.mcap. Where there is an access file, for those of its tokens only.
class FoxgloveSide {
 public:
  /// Adds its endpoints; before the server's start. All arguments outlive it; its destructor stops
  /// the server. Clients are told the time of `clock` where it `is_simulated`.
  static Result<std::unique_ptr<FoxgloveSide>> Create(const ProgramOptions& words,
                                                      const program::CommonOptions& common,
                                                      TopicHub& hub, api::JsonCalls& calls,
                                                      http::Server& server, const Clock& clock,
                                                      bool is_simulated, Log& log);
  virtual ~FoxgloveSide() = default;
  virtual std::vector<Metric> metrics() const = 0;
};

}  // namespace exemplar::gateway
