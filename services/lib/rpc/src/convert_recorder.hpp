#pragma once
#include "convert_common.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/v1/recorder.pb.h"

namespace exemplar::rpc {

void ToProto(const api::RecordStart& request, v1::StartRecordingRequest* message);
/// Errors: a waiting or splitting time that is negative or no number.
Result<api::RecordStart> FromProto(const v1::StartRecordingRequest& message);

void ToProto(const api::RecordEvent& event, v1::MarkEventRequest* message);
api::RecordEvent FromProto(const v1::MarkEventRequest& message);

void ToProto(const api::RecorderStatus& status, v1::RecorderStatus* message);
api::RecorderStatus FromProto(const v1::RecorderStatus& message);

}  // namespace exemplar::rpc
