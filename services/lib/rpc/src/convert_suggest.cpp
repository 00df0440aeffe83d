#include "convert_suggest.hpp"

namespace exemplar::rpc {

void ToProto(const learning::Suggestions& suggestions, v1::SuggestSkillResponse* message) {
  for (const learning::Suggestion& suggestion : suggestions.places) {
    v1::SuggestSkillResponse::Place* place = message->add_places();
    ToProto(suggestion.target, place->mutable_target());
    place->set_sigma_m(suggestion.sigma_m);
    place->set_nearest_trial_m(suggestion.nearest_trial_m);
    place->set_reason(Utf8(suggestion.reason));
  }
  message->set_typical_sigma_m(suggestions.typical_sigma_m);
  ToProto(suggestions.notes, message->mutable_notes());
}

Result<learning::Suggestions> FromProto(const v1::SuggestSkillResponse& message) {
  learning::Suggestions suggestions;
  for (int k = 0; k < message.places_size(); ++k) {
    const v1::SuggestSkillResponse::Place& place = message.places(k);
    Result<geometry::NamedPose> target =
        FromProto(place.target(), "places[" + std::to_string(k) + "].target");
    if (!target) return target.error();
    suggestions.places.push_back({.target = *std::move(target),
                                  .sigma_m = place.sigma_m(),
                                  .nearest_trial_m = place.nearest_trial_m(),
                                  .reason = place.reason()});
  }
  suggestions.typical_sigma_m = message.typical_sigma_m();
  suggestions.notes = FromProto(message.notes());
  return suggestions;
}

}  // namespace exemplar::rpc
