#pragma once
// Where to demonstrate next.

#include <string>
#include <vector>

#include "exemplar/geometry/pose.hpp"
#include "exemplar/learning/skill.hpp"

namespace exemplar::learning {

/// A place for the target at which one more trial would tell most.
struct Suggestion {
  geometry::NamedPose target;  ///< turned as the trials' mean
  double sigma_m = 0;  ///< predicted standard error of the answer there, RMS over its frames
  double nearest_trial_m = 0;
  std::string reason;  ///< for people
};

struct Suggestions {
  std::vector<Suggestion> places;  ///< best first
  double typical_sigma_m = 0;      ///< the same error where the trials had the target: their median
  std::vector<std::string> notes;  ///< what else the trials do not show
};

struct SuggestOptions {
  int count = 3;  ///< from 1 to 20; fewer come back where places would lie too close together
};

/// The places of greatest predicted error inside the hull of the trials' places and on its border;
/// where these lie on a line or at a point, beside it too. Errors: a skill without target or
/// without tool path, a count out of range (field "count").
Result<Suggestions> Suggest(const Skill& skill, const SuggestOptions& options = {});

}  // namespace exemplar::learning
