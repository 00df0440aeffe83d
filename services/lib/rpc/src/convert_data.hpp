#pragma once
#include "convert_common.hpp"
#include "exemplar/api/data.hpp"
#include "exemplar/v1/data.pb.h"

namespace exemplar::rpc {

void ToProto(const api::PersonInfo& info, v1::PersonInfo* message);
api::PersonInfo FromProto(const v1::PersonInfo& message);

void ToProto(const api::DataReport& report, v1::DataReport* message);
api::DataReport FromProto(const v1::DataReport& message);

void ToProto(const api::RetentionRequest& request, v1::ApplyRetentionRequest* message);
/// Errors: days that are negative or no number.
Result<api::RetentionRequest> FromProto(const v1::ApplyRetentionRequest& message);

void ToProto(const api::BackupPlan& plan, v1::BackupPlan* message);
api::BackupPlan FromProto(const v1::BackupPlan& message);

void ToProto(const api::RestoreRequest& request, v1::RestoreRequest::Header* message);
/// Errors: a mode that is none.
Result<api::RestoreRequest> FromProto(const v1::RestoreRequest::Header& message);

}  // namespace exemplar::rpc
