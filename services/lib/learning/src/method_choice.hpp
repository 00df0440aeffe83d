#pragma once
// The methods compared inside the training set.

#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/learning/skill.hpp"
#include "exemplars.hpp"
#include "prediction.hpp"

namespace exemplar::learning {

// Texts that FitModel understands; they are the names in MethodScore as well.
inline constexpr const char* kPaperChoice = "paper";
inline constexpr const char* kFramesChoice = "frames";
inline constexpr const char* kFramesByLengthChoice = "frames by length";
inline constexpr const char* kFramesByContactChoice = "frames by contact and length";

/// The exemplars as the chosen method aligns them.
Exemplars ExemplarsFor(const std::string& choice, Exemplars exemplars);

/// The model that `choice` names; an unknown text gives the paper's. `exemplars` from ExemplarsFor.
std::unique_ptr<const Model> FitModel(const std::string& choice, Exemplars exemplars,
                                      std::shared_ptr<const demonstration::ToolKinematics> tool);

/// Scores by predicting each trial (at most 15 of them, evenly chosen) from the others (at most a
/// hundred). Empty where there is nothing to predict, one trial or no tool poses, and when asked to
/// stop. `chosen` is not set.
std::vector<MethodScore> ScoreMethods(std::span<const std::string> choices, Exemplars exemplars,
                                      std::shared_ptr<const demonstration::ToolKinematics> tool,
                                      const Progress& progress, const std::stop_token& stop);

}  // namespace exemplar::learning
