#include "simulator/metrics.hpp"

#include "exemplar/ircp/metrics.hpp"

namespace exemplar::simulator {

std::vector<Metric> MetricsOf(const Session& session) {
  const std::string prefix = "exemplar_simulator";
  const auto count = [&](const char* name, const char* help, std::uint64_t Figures::*number) {
    return CounterOf(prefix + name, help, [&session, number] { return session.figures().*number; });
  };
  std::vector<Metric> metrics =
      ircp::ReceivedMetrics(prefix, {{session.leader_topic(), &session.leader_reader()}});
  metrics.push_back(ircp::SentMetric(prefix, [&session] { return session.sent(); }));
  metrics.push_back(ircp::StateMetric(prefix, {"holding", "following", "going home"},
                                      [&session] { return session.figures().mode; }));
  metrics.push_back(
      {prefix + "_clicks_total", "Clicks of a button since they were last reset", true, [&session] {
         std::vector<Metric::Value> values;
         for (const auto& [button, clicks] : session.figures().clicks) {
           values.push_back({{{"button", button}}, static_cast<double>(clicks)});
         }
         return values;
       }});
  metrics.push_back(
      count("_samples_refused_total", "Samples without sense for this robot", &Figures::refused));
  metrics.push_back(
      count("_samples_overrun_total", "Samples dropped: they came too fast", &Figures::overrun));
  metrics.push_back(count("_stale_total", "Times that samples stopped coming", &Figures::stale));
  metrics.push_back(
      count("_slips_total", "Times that the world fell behind the clock", &Figures::slips));
  metrics.push_back(
      count("_faults_total", "Times that the physics had to be set back", &Figures::faults));
  metrics.push_back(count("_states_dropped_total", "Joint states that the network was too slow for",
                          &Figures::states_dropped));
  metrics.push_back(count("_pictures_skipped_total", "Pictures left out: the last was being drawn",
                          &Figures::pictures_skipped));
  metrics.push_back(GaugeOf(prefix + "_time_seconds", "Simulated time",
                            [&session] { return session.figures().time_s; }));
  metrics.push_back(GaugeOf(prefix + "_time_stands",
                            "1 while the simulated time stands until somebody commands the robot",
                            [&session] { return session.figures().stands ? 1 : 0; }));
  metrics.push_back(GaugeOf(prefix + "_touch_newtons", "Force on the finger",
                            [&session] { return session.figures().touch_n; }));
  return metrics;
}

}  // namespace exemplar::simulator
