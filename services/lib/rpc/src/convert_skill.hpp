#pragma once
#include "convert_common.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/v1/skill.pb.h"

namespace exemplar::rpc {

void ToProto(const learning::SkillReport& report, v1::SkillReport* message);
Result<learning::SkillReport> FromProto(const v1::SkillReport& message);

void ToProto(const api::SkillInfo& info, v1::SkillInfo* message);
api::SkillInfo FromProto(const v1::SkillInfo& message);
void ToProto(const api::VersionInfo& info, v1::SkillVersionInfo* message);
api::VersionInfo FromProto(const v1::SkillVersionInfo& message);

void ToProto(const demonstration::SkillQuery& query, v1::SkillQuery* message);
Result<demonstration::SkillQuery> FromProto(const v1::SkillQuery& message, std::string_view field);

void ToProto(const demonstration::SkillMotion& motion, v1::SkillMotion* message);
/// All but the arrays with a value or more a frame.
void ToProtoWithoutArrays(const demonstration::SkillMotion& motion, v1::SkillMotion* message);
Result<demonstration::SkillMotion> FromProto(const v1::SkillMotion& message,
                                             std::string_view field);

void ToProto(const learning::Evaluation& evaluation, v1::EvaluateSkillResponse* message);
Result<learning::Evaluation> FromProto(const v1::EvaluateSkillResponse& message);

}  // namespace exemplar::rpc
