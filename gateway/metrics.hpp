#pragma once
#include <vector>

#include "exemplar/base/metric.hpp"
#include "exemplar/rpc/server.hpp"
#include "gateway/topic_hub.hpp"

namespace exemplar::gateway {

/// Both outlive the figures.
std::vector<Metric> MetricsOf(const TopicHub& hub);
std::vector<Metric> MetricsOf(const rpc::Server& server);

}  // namespace exemplar::gateway
