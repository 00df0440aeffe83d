#include "convert_data.hpp"

#include "exemplar/base/text.hpp"

namespace exemplar::rpc {
namespace {

Status CheckDays(double days, const std::string& field) {
  constexpr double kLongest = 1e6;
  if (days >= 0 && days <= kLongest) return {};
  return InvalidArgument(field + " is " + FormatDouble(days) + ", must lie between 0 and 1000000",
                         field);
}

}  // namespace

void ToProto(const api::PersonInfo& info, v1::PersonInfo* message) {
  message->set_person(Utf8(info.person));
  message->set_items(info.items);
  message->set_bytes(info.bytes);
  ToProto(info.first, message->mutable_first());
  ToProto(info.last, message->mutable_last());
}

api::PersonInfo FromProto(const v1::PersonInfo& message) {
  return {.person = message.person(),
          .items = message.items(),
          .bytes = message.bytes(),
          .first = FromProto(message.first()),
          .last = FromProto(message.last())};
}

void ToProto(const api::DataReport& report, v1::DataReport* message) {
  for (const api::DataItem& item : report.items) {
    v1::DataItem* out = message->add_items();
    out->set_kind(Utf8(item.kind));
    out->set_name(Utf8(item.name));
    out->set_action(Utf8(item.action));
    out->set_detail(Utf8(item.detail));
    out->set_bytes(item.bytes);
    if (item.at != Stamp()) ToProto(item.at, out->mutable_at());
  }
  ToProto(report.notices, message->mutable_notices());
}

api::DataReport FromProto(const v1::DataReport& message) {
  api::DataReport report;
  for (const v1::DataItem& item : message.items()) {
    report.items.push_back({.kind = item.kind(),
                            .name = item.name(),
                            .action = item.action(),
                            .detail = item.detail(),
                            .bytes = item.bytes(),
                            .at = item.has_at() ? FromProto(item.at()) : Stamp()});
  }
  report.notices = FromProto(message.notices());
  return report;
}

void ToProto(const api::RetentionRequest& request, v1::ApplyRetentionRequest* message) {
  message->set_dry_run(request.dry_run);
  if (request.keep_days) message->set_keep_days(*request.keep_days);
  if (request.keep_versions_days) message->set_keep_versions_days(*request.keep_versions_days);
  message->set_needed_too(request.needed_too);
}

Result<api::RetentionRequest> FromProto(const v1::ApplyRetentionRequest& message) {
  api::RetentionRequest request;
  request.dry_run = message.dry_run();
  request.needed_too = message.needed_too();
  if (message.has_keep_days()) {
    if (const Status valid = CheckDays(message.keep_days(), "keep_days"); !valid) {
      return valid.error();
    }
    request.keep_days = message.keep_days();
  }
  if (message.has_keep_versions_days()) {
    if (const Status valid = CheckDays(message.keep_versions_days(), "keep_versions_days");
        !valid) {
      return valid.error();
    }
    request.keep_versions_days = message.keep_versions_days();
  }
  return request;
}

void ToProto(const api::BackupPlan& plan, v1::BackupPlan* message) {
  message->set_service(Utf8(plan.service));
  message->set_schema(plan.schema);
  message->set_parts(plan.parts);
  message->set_bytes(plan.bytes);
  for (const auto& [name, count] : plan.counts) (*message->mutable_counts())[Utf8(name)] = count;
  ToProto(plan.notices, message->mutable_notices());
}

api::BackupPlan FromProto(const v1::BackupPlan& message) {
  return {.service = message.service(),
          .schema = message.schema(),
          .parts = message.parts(),
          .bytes = message.bytes(),
          .counts = {message.counts().begin(), message.counts().end()},
          .notices = FromProto(message.notices())};
}

void ToProto(const api::RestoreRequest& request, v1::RestoreRequest::Header* message) {
  ToProto(request.plan, message->mutable_plan());
  message->set_mode(request.mode == api::RestoreMode::kMerge ? v1::RestoreRequest::MODE_MERGE
                    : request.mode == api::RestoreMode::kReplace
                        ? v1::RestoreRequest::MODE_REPLACE
                        : v1::RestoreRequest::MODE_EMPTY_ONLY);
  for (const api::ErasedPerson& erased : request.erased) {
    v1::ErasedPerson* out = message->add_erased();
    out->set_salt(erased.salt);
    out->set_hash(erased.hash);
    ToProto(erased.erased, out->mutable_erased());
  }
}

Result<api::RestoreRequest> FromProto(const v1::RestoreRequest::Header& message) {
  api::RestoreRequest request;
  request.plan = FromProto(message.plan());
  switch (message.mode()) {
    case v1::RestoreRequest::MODE_EMPTY_ONLY:
      request.mode = api::RestoreMode::kEmptyOnly;
      break;
    case v1::RestoreRequest::MODE_MERGE:
      request.mode = api::RestoreMode::kMerge;
      break;
    case v1::RestoreRequest::MODE_REPLACE:
      request.mode = api::RestoreMode::kReplace;
      break;
    default:
      return InvalidArgument("mode " + std::to_string(message.mode()) + " is unknown",
                             "header.mode");
  }
  for (const v1::ErasedPerson& erased : message.erased()) {
    request.erased.push_back(
        {.salt = erased.salt(), .hash = erased.hash(), .erased = FromProto(erased.erased())});
  }
  return request;
}

}  // namespace exemplar::rpc
