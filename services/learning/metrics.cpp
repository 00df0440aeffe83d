#include "learning/metrics.hpp"

namespace exemplar::learning_service {

std::vector<Metric> MetricsOf(std::vector<Metric> calls, api::TrialApi& trials,
                              api::SkillApi& skills) {
  std::vector<Metric> metrics = std::move(calls);
  metrics.push_back({"exemplar_learning_trials", "Trials kept, by skill", false, [&trials] {
                       std::vector<Metric::Value> values;
                       const Result<std::vector<api::TrialInfo>> all = trials.List("");
                       if (!all) return values;
                       std::map<std::string, int> count;
                       for (const api::TrialInfo& trial : *all) ++count[trial.skill];
                       for (const auto& [skill, number] : count) {
                         values.push_back({{{"skill", skill}}, static_cast<double>(number)});
                       }
                       return values;
                     }});
  metrics.push_back(
      {"exemplar_learning_skill_version", "Current version of a learned skill", false, [&skills] {
         std::vector<Metric::Value> values;
         const Result<std::vector<api::SkillInfo>> all = skills.List();
         if (!all) return values;
         for (const api::SkillInfo& skill : *all) {
           values.push_back({{{"skill", skill.name}}, static_cast<double>(skill.version)});
         }
         return values;
       }});
  return metrics;
}

}  // namespace exemplar::learning_service
