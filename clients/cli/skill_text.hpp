#pragma once
#include <string>

#include "exemplar/learning/skill.hpp"

namespace exemplar::cli {

/// What learning found, for a person.
std::string ReportText(const learning::SkillReport& report);
/// A motion in a few lines.
std::string MotionText(const demonstration::SkillMotion& motion);

}  // namespace exemplar::cli
