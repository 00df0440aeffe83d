#pragma once
// Figures for operators. A port: program/ serves them to Prometheus.

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace exemplar {

/// One figure by name, asked for at each scrape.
struct Metric {
  std::string name;  ///< "exemplar_recorder_messages_total"
  std::string help;
  bool counter = false;  ///< else a gauge
  struct Value {
    std::vector<std::pair<std::string, std::string>> labels;
    double value = 0;
  };
  std::function<std::vector<Value>()> values;  ///< called on another thread
};

/// A figure without labels.
template <class Number>
Metric CounterOf(std::string name, std::string help, Number number) {
  return {std::move(name), std::move(help), true, [number] {
            return std::vector<Metric::Value>{{{}, static_cast<double>(number())}};
          }};
}
template <class Number>
Metric GaugeOf(std::string name, std::string help, Number number) {
  return {std::move(name), std::move(help), false, [number] {
            return std::vector<Metric::Value>{{{}, static_cast<double>(number())}};
          }};
}

}  // namespace exemplar
