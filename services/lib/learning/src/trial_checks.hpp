#pragma once
// What the learner asks of a set of trials.

#include <span>
#include <string>
#include <vector>

#include "exemplar/learning/skill.hpp"

namespace exemplar::learning {

/// The trials to learn from: valid, not left out by option, each content once.
Result<std::vector<const NamedTrial*>> ChooseTrials(std::span<const NamedTrial> trials,
                                                    const LearnOptions& options,
                                                    std::vector<std::string>& warnings);

/// Checks that all trials have the same joints, poses and objects, drops streams that only some
/// have (said in `warnings`), and brings joints and objects into one order. Errors name the trial.
Status MakeUniform(std::vector<UniformTrial>& trials, const LearnOptions& options,
                   const demonstration::ToolKinematics* tool, std::vector<std::string>& warnings);

}  // namespace exemplar::learning
