#pragma once
#include <memory>
#include <vector>

#include "contact.hpp"
#include "exemplar/learning/skill.hpp"
#include "exemplars.hpp"
#include "prediction.hpp"

namespace exemplar::learning {

struct Skill::Data {
  SkillReport report;
  std::shared_ptr<const Alignment> alignment;
  std::shared_ptr<const demonstration::ToolKinematics> tool;
  std::shared_ptr<const Exemplars> exemplars;
  std::string choice;  ///< of method_choice.hpp: fits the same model again
  std::shared_ptr<const Model> model;
  std::vector<ContactPoint> contact_points;              ///< as exemplars->contacts
  std::vector<Eigen::Quaterniond> mean_object_rotation;  ///< as exemplars->object_names
};

/// Everything that follows from the alignment, the report (its target), the exemplars built from
/// these and the choice: what LearnSkill and SkillFromJson share.
std::shared_ptr<Skill::Data> MakeSkillData(
    SkillReport report, std::shared_ptr<const Alignment> alignment, Exemplars exemplars,
    std::string choice, std::shared_ptr<const demonstration::ToolKinematics> tool);

}  // namespace exemplar::learning
