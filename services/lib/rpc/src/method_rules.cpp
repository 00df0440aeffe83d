#include "exemplar/rpc/method_rules.hpp"

#include <algorithm>
#include <array>

namespace exemplar::rpc {
namespace {

using security::Role;

constexpr std::array kRules = {
    MethodRule{"exemplar.v1.TrialService/Submit", Role::kTeach, CallLength::kLong},
    MethodRule{"exemplar.v1.TrialService/List", Role::kObserve},
    MethodRule{"exemplar.v1.TrialService/Get", Role::kObserve},
    MethodRule{"exemplar.v1.TrialService/Load", Role::kObserve},
    MethodRule{"exemplar.v1.TrialService/Segments", Role::kObserve, CallLength::kLong},
    MethodRule{"exemplar.v1.TrialService/Export", Role::kObserve, CallLength::kLong},
    MethodRule{"exemplar.v1.TrialService/Delete", Role::kTeach, CallLength::kShort, true},
    MethodRule{"exemplar.v1.TrialService/SetPerson", Role::kTeach, CallLength::kShort, true},

    MethodRule{"exemplar.v1.SkillService/Learn", Role::kTeach, CallLength::kLong},
    MethodRule{"exemplar.v1.SkillService/Get", Role::kObserve},
    MethodRule{"exemplar.v1.SkillService/List", Role::kObserve},
    MethodRule{"exemplar.v1.SkillService/Versions", Role::kObserve},
    MethodRule{"exemplar.v1.SkillService/Rollback", Role::kTeach, CallLength::kShort, true},
    MethodRule{"exemplar.v1.SkillService/Query", Role::kObserve},
    MethodRule{"exemplar.v1.SkillService/QueryStream", Role::kObserve, CallLength::kLong},
    MethodRule{"exemplar.v1.SkillService/Evaluate", Role::kObserve, CallLength::kLong},
    MethodRule{"exemplar.v1.SkillService/Suggest", Role::kObserve, CallLength::kLong},
    MethodRule{"exemplar.v1.SkillService/Delete", Role::kAdminister, CallLength::kShort, true},
    MethodRule{"exemplar.v1.SkillService/Export", Role::kObserve, CallLength::kLong},

    MethodRule{"exemplar.v1.ExecutorService/Plan", Role::kExecute, CallLength::kLong},
    MethodRule{"exemplar.v1.ExecutorService/Execute", Role::kExecute, CallLength::kLong, true},
    MethodRule{"exemplar.v1.ExecutorService/GetStatus", Role::kObserve},
    MethodRule{"exemplar.v1.ExecutorService/Pause", Role::kExecute, CallLength::kShort, true},
    MethodRule{"exemplar.v1.ExecutorService/Resume", Role::kExecute, CallLength::kShort, true},
    MethodRule{"exemplar.v1.ExecutorService/Cancel", Role::kExecute, CallLength::kShort, true},
    // Whoever may look at the robot may stop it.
    MethodRule{"exemplar.v1.ExecutorService/Stop", Role::kObserve, CallLength::kShort, true},
    MethodRule{"exemplar.v1.ExecutorService/Reset", Role::kExecute, CallLength::kShort, true},
    MethodRule{"exemplar.v1.ExecutorService/SetSpeed", Role::kExecute, CallLength::kShort, true},
    MethodRule{"exemplar.v1.ExecutorService/Teleoperate", Role::kExecute, CallLength::kLong, true},
    MethodRule{"exemplar.v1.ExecutorService/EndTeleoperation", Role::kExecute, CallLength::kShort,
               true},

    MethodRule{"exemplar.v1.RecorderService/Start", Role::kRecord},
    MethodRule{"exemplar.v1.RecorderService/Stop", Role::kRecord},
    MethodRule{"exemplar.v1.RecorderService/Pause", Role::kRecord},
    MethodRule{"exemplar.v1.RecorderService/Resume", Role::kRecord},
    MethodRule{"exemplar.v1.RecorderService/MarkEvent", Role::kRecord},
    MethodRule{"exemplar.v1.RecorderService/GetStatus", Role::kObserve},

    MethodRule{"exemplar.v1.TopicService/List", Role::kObserve},
    MethodRule{"exemplar.v1.TopicService/Subscribe", Role::kObserve, CallLength::kLong},
    MethodRule{"exemplar.v1.TopicService/Publish", Role::kAdminister, CallLength::kShort, true},

    MethodRule{"exemplar.v1.LearningDataService/ListPersons", Role::kTeach},
    MethodRule{"exemplar.v1.LearningDataService/ErasePerson", Role::kAdminister, CallLength::kLong,
               true},
    MethodRule{"exemplar.v1.LearningDataService/ApplyRetention", Role::kAdminister,
               CallLength::kLong, true},
    MethodRule{"exemplar.v1.LearningDataService/Backup", Role::kAdminister, CallLength::kLong,
               true},
    MethodRule{"exemplar.v1.LearningDataService/Restore", Role::kAdminister, CallLength::kLong,
               true},

    MethodRule{"exemplar.v1.RecorderDataService/ListPersons", Role::kTeach},
    MethodRule{"exemplar.v1.RecorderDataService/ErasePerson", Role::kAdminister, CallLength::kLong,
               true},
    MethodRule{"exemplar.v1.RecorderDataService/ApplyRetention", Role::kAdminister,
               CallLength::kLong, true},
    MethodRule{"exemplar.v1.RecorderDataService/Backup", Role::kAdminister, CallLength::kLong,
               true},
    MethodRule{"exemplar.v1.RecorderDataService/Restore", Role::kAdminister, CallLength::kLong,
               true},
};

}  // namespace

std::span<const MethodRule> MethodRules() { return kRules; }

const MethodRule* RuleOf(std::string_view method) {
  const auto found = std::find_if(kRules.begin(), kRules.end(),
                                  [&](const MethodRule& rule) { return rule.method == method; });
  return found == kRules.end() ? nullptr : &*found;
}

}  // namespace exemplar::rpc
