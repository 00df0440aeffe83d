#pragma once
// What a program sends and receives on its topics, as figures for operators.

#include <functional>
#include <string>
#include <vector>

#include "exemplar/base/metric.hpp"
#include "exemplar/ircp/bus.hpp"

namespace exemplar::ircp {

/// "<prefix>_sent_total" by topic and source. `counts` is thread-safe.
Metric SentMetric(const std::string& prefix, std::function<std::vector<TopicCount>()> counts);

struct TopicReader {
  std::string topic;
  const Reader* reader;  ///< null: nothing is read yet
};

/// "<prefix>_received_total" and "<prefix>_lost_total" by topic and source,
/// "<prefix>_refused_total" by topic. The readers outlive them.
std::vector<Metric> ReceivedMetrics(const std::string& prefix, std::vector<TopicReader> readers);

/// "<prefix>_state": 1 for the state that `current` names, 0 for the others.
Metric StateMetric(const std::string& prefix, std::vector<std::string> states,
                   std::function<std::string()> current);

}  // namespace exemplar::ircp
