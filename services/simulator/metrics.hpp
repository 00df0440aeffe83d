#pragma once
#include <vector>

#include "exemplar/base/metric.hpp"
#include "simulator/session.hpp"

namespace exemplar::simulator {

/// For Prometheus: samples sent, received, refused and lost, clicks, pictures, falling behind.
/// The session outlives them.
std::vector<Metric> MetricsOf(const Session& session);

}  // namespace exemplar::simulator
