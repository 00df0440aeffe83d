#pragma once
#include <vector>

#include "capture_vision/session.hpp"
#include "exemplar/base/metric.hpp"

namespace exemplar::capture_vision {

/// For Prometheus: pictures received, lost, skipped and of no use, objects found and sent.
/// The session outlives them.
std::vector<Metric> MetricsOf(const Session& session);

}  // namespace exemplar::capture_vision
