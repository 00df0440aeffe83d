#pragma once
#include <vector>

#include "executor/executor.hpp"
#include "exemplar/base/metric.hpp"

namespace exemplar::executor {

/// For Prometheus: the state, commands sent, dropped and late, executions by outcome, what was
/// received and lost. The executor outlives them.
std::vector<Metric> MetricsOf(const Executor& executor);

}  // namespace exemplar::executor
