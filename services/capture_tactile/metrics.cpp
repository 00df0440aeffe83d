#include "capture_tactile/metrics.hpp"

#include "exemplar/ircp/metrics.hpp"

namespace exemplar::capture_tactile {

std::vector<Metric> MetricsOf(const Session& session) {
  const std::string prefix = "exemplar_capture_tactile";
  std::vector<Metric> metrics =
      ircp::ReceivedMetrics(prefix, {{ircp::JointStateSample::kTopic, &session.reader()}});
  metrics.push_back(ircp::SentMetric(prefix, [&session] { return session.sent(); }));
  metrics.push_back(CounterOf(prefix + "_polls_total", "Looks at the newest joint state",
                              [&session] { return session.polls(); }));
  metrics.push_back(CounterOf(prefix + "_stale_total", "Joint states that came too late to be sent",
                              [&session] { return session.stale(); }));
  return metrics;
}

}  // namespace exemplar::capture_tactile
