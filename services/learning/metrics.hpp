#pragma once
#include <vector>

#include "exemplar/api/services.hpp"
#include "exemplar/base/metric.hpp"

namespace exemplar::learning_service {

/// For Prometheus: `calls`, and how many trials and skills are kept. The services outlive them.
std::vector<Metric> MetricsOf(std::vector<Metric> calls, api::TrialApi& trials,
                              api::SkillApi& skills);

}  // namespace exemplar::learning_service
