#pragma once
#include <vector>

#include "capture_tactile/session.hpp"
#include "exemplar/base/metric.hpp"

namespace exemplar::capture_tactile {

/// For Prometheus: touches sent, polls, states that were too old, and what was received and lost.
/// The session outlives them.
std::vector<Metric> MetricsOf(const Session& session);

}  // namespace exemplar::capture_tactile
