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
  std::string choices;  ///< what FitModel needs to fit the same model again
  std::shared_ptr<const Model> model;
  std::vector<ContactPoint> contact_points;              ///< as exemplars->contacts
  std::vector<Eigen::Quaterniond> mean_object_rotation;  ///< as exemplars->object_names
};

/// Everything that follows from the alignment and the report's choices (method, target): what
/// LearnSkill and SkillFromJson share.
std::shared_ptr<Skill::Data> MakeSkillData(
    SkillReport report, std::shared_ptr<const Alignment> alignment,
    std::shared_ptr<const demonstration::ToolKinematics> tool);

/// The model that `choices` describes ("paper", "frames ..."); an unknown text gives the paper's.
std::unique_ptr<const Model> FitModel(const std::string& choices, const Exemplars& exemplars,
                                      std::shared_ptr<const demonstration::ToolKinematics> tool);

}  // namespace exemplar::learning
