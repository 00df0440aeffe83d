#pragma once
#include "convert_common.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/v1/skill.pb.h"

namespace exemplar::rpc {

void ToProto(const learning::Suggestions& suggestions, v1::SuggestSkillResponse* message);
Result<learning::Suggestions> FromProto(const v1::SuggestSkillResponse& message);

}  // namespace exemplar::rpc
