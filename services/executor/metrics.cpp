#include "executor/metrics.hpp"

#include "exemplar/ircp/metrics.hpp"

namespace exemplar::executor {

std::vector<Metric> MetricsOf(const Executor& executor) {
  const std::string prefix = "exemplar_executor";
  std::vector<std::string> states;
  states.reserve(std::size(kAllStates));
  for (const State state : kAllStates) states.emplace_back(ToString(state));
  std::vector<Metric> metrics = ircp::ReceivedMetrics(prefix, executor.readers());
  metrics.push_back(ircp::SentMetric(prefix, [&executor] { return executor.sent(); }));
  metrics.push_back(
      ircp::StateMetric(prefix, states, [&executor] { return executor.figures().state; }));
  metrics.push_back({prefix + "_executions_total", "Motions that ended, by the state they ended in",
                     true, [&executor] {
                       std::vector<Metric::Value> values;
                       for (const auto& [end, count] : executor.figures().executions) {
                         values.push_back({{{"end", end}}, static_cast<double>(count)});
                       }
                       return values;
                     }});
  metrics.push_back(CounterOf(prefix + "_plans_refused_total", "Motions that could not be planned",
                              [&executor] { return executor.figures().plans_refused; }));
  metrics.push_back(CounterOf(prefix + "_commands_dropped_total",
                              "Commands for which the ring to the writing thread was full",
                              [&executor] { return executor.figures().commands_dropped; }));
  metrics.push_back(CounterOf(prefix + "_commands_failed_total", "Commands the network refused",
                              [&executor] { return executor.figures().commands_failed; }));
  metrics.push_back(GaugeOf(prefix + "_command_readers",
                            "Readers that hear the joint commands: the robot, a recorder",
                            [&executor] { return executor.figures().command_readers; }));
  metrics.push_back(CounterOf(prefix + "_cycles_total", "Cycles of the control loop",
                              [&executor] { return executor.figures().cycles; }));
  metrics.push_back(CounterOf(prefix + "_lateness_seconds_total",
                              "By how much the cycles began late, summed",
                              [&executor] { return executor.figures().lateness_s; }));
  metrics.push_back(GaugeOf(prefix + "_lateness_max_seconds", "The latest beginning of a cycle",
                            [&executor] { return executor.figures().lateness_max_s; }));
  metrics.push_back(GaugeOf(prefix + "_speed_ratio", "Share of the planned speed",
                            [&executor] { return executor.figures().speed; }));
  metrics.push_back({prefix + "_joint_state_age_seconds",
                     "Age of the robot's last usable joint state", false, [&executor] {
                       std::vector<Metric::Value> values;
                       const ExecutorFigures now = executor.figures();
                       if (now.state_age_s) values.push_back({{}, *now.state_age_s});
                       return values;
                     }});
  metrics.push_back(
      CounterOf(prefix + "_suit_samples_total",
                "Samples on ircp/suit that a teleoperated robot was asked to follow",
                [&executor] { return executor.figures().teleoperation.suit_samples; }));
  metrics.push_back(
      CounterOf(prefix + "_suit_samples_left_out_total",
                "Samples on ircp/suit that came late, or from another suit than the one followed",
                [&executor] { return executor.figures().teleoperation.suit_left_out; }));
  metrics.push_back(
      GaugeOf(prefix + "_suit_to_command_p99_seconds",
              "From a suit sample's reception to its command, 99 of 100",
              [&executor] { return executor.figures().teleoperation.latency_p99_s; }));
  return metrics;
}

}  // namespace exemplar::executor
