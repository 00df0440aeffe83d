#pragma once
#include <vector>

#include "exemplar/api/services.hpp"
#include "exemplar/program/runtime.hpp"

namespace exemplar::recorder {

/// For Prometheus: messages and bytes of the present file, and sent, received and lost by topic.
/// The recorder must outlive them.
std::vector<program::Metric> MetricsOf(api::RecorderApi& recorder);

}  // namespace exemplar::recorder
