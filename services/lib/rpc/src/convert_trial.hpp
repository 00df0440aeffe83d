#pragma once
#include "convert_common.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/v1/trial.pb.h"

namespace exemplar::rpc {

void ToProto(const api::TrialInfo& info, v1::TrialInfo* message);
api::TrialInfo FromProto(const v1::TrialInfo& message);

void ToProto(const demonstration::Trial& trial, v1::Trial* message);
Result<demonstration::Trial> FromProto(const v1::Trial& message, std::string_view field);

void ToProto(const api::TrialSegments& segments, v1::SegmentTrialResponse* message);
Result<api::TrialSegments> FromProto(const v1::SegmentTrialResponse& message);

}  // namespace exemplar::rpc
