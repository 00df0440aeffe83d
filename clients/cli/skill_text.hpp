#pragma once
#include <string>

#include "exemplar/learning/skill.hpp"
#include "exemplar/learning/suggest.hpp"

namespace exemplar::cli {

/// What learning found, for a person.
std::string ReportText(const learning::SkillReport& report);
/// Where to demonstrate next, for a person.
std::string SuggestionsText(const learning::Suggestions& suggestions);
/// A motion in a few lines.
std::string MotionText(const demonstration::SkillMotion& motion);

}  // namespace exemplar::cli
