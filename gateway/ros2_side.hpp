#pragma once
#include <memory>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/metric.hpp"
#include "exemplar/ircp/bus.hpp"
#include "gateway/program_options.hpp"

namespace exemplar::gateway {

/// The ROS 2 graph of the same domain, by a participant without partition.
class Ros2Side {
 public:
  /// All arguments outlive it. Errors: a robot that cannot be read, a network that refuses, --ros2
  /// together with --security (the graph would be an open door). Where time `is_simulated`, the
  /// graph gets it as /clock.
  static Result<std::unique_ptr<Ros2Side>> Create(const ProgramOptions& words,
                                                  const program::CommonOptions& common,
                                                  ircp::Bus& station, const Clock& clock,
                                                  bool is_simulated, Log& log);
  virtual ~Ros2Side() = default;
  virtual std::vector<Metric> metrics() const = 0;
};

}  // namespace exemplar::gateway
