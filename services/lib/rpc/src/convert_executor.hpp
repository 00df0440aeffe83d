#pragma once
#include "convert_common.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/v1/executor.pb.h"

namespace exemplar::rpc {

void ToProto(const api::ExecuteRequest& request, v1::SkillExecution* message);
Result<api::ExecuteRequest> FromProto(const v1::SkillExecution& message, std::string_view field);

void ToProto(const api::PlanSummary& plan, v1::PlanSummary* message);
api::PlanSummary FromProto(const v1::PlanSummary& message);

void ToProto(const api::ExecutionFeedback& feedback, v1::ExecutionFeedback* message);
api::ExecutionFeedback FromProto(const v1::ExecutionFeedback& message);

void ToProto(const api::ExecutionResult& result, v1::ExecutionResult* message);
Result<api::ExecutionResult> FromProto(const v1::ExecutionResult& message);

void ToProto(const api::RobotStatus& status, v1::GetRobotStatusResponse* message);
Result<api::RobotStatus> FromProto(const v1::GetRobotStatusResponse& message);

void ToProto(const api::TeleoperationRequest& request, v1::TeleoperateRequest* message);
api::TeleoperationRequest FromProto(const v1::TeleoperateRequest& message);

void ToProto(const api::TeleoperationFeedback& feedback, v1::TeleoperationFeedback* message);
api::TeleoperationFeedback FromProto(const v1::TeleoperationFeedback& message);

void ToProto(const api::TeleoperationResult& result, v1::TeleoperationResult* message);
api::TeleoperationResult FromProto(const v1::TeleoperationResult& message);

}  // namespace exemplar::rpc
