#include "client_call.hpp"
#include "convert_trial.hpp"
#include "exemplar/v1/trial.grpc.pb.h"

namespace exemplar::rpc {
namespace {

using Stub = v1::TrialService::Stub;

class TrialClient final : public api::TrialApi {
 public:
  explicit TrialClient(std::shared_ptr<Connection> connection)
      : connection_(std::move(connection)), stub_(connection_->channel()) {}

  Result<api::SubmitResult> Submit(const std::string& skill, const std::string& name,
                                   std::string file, const std::string& person) override {
    v1::SubmitTrialRequest header;
    header.mutable_header()->set_person(Utf8(person));
    header.mutable_header()->set_skill(Utf8(skill));
    header.mutable_header()->set_name(Utf8(name));
    const auto context = connection_->Begin();
    v1::SubmitTrialResponse response;
    const auto writer = stub_.Submit(context.get(), &response);
    Upload(*writer, header, file);
    const grpc::Status status = writer->Finish();
    if (!status.ok()) return FromGrpc(status, connection_->address());
    return api::SubmitResult{FromProto(response.trial()), response.duplicate()};
  }

  Result<std::vector<api::TrialInfo>> List(const std::string& skill,
                                           const std::string& person) override {
    v1::ListTrialsRequest request;
    request.set_person(Utf8(person));
    request.set_skill(Utf8(skill));
    const auto response = Call(*connection_, stub_, &Stub::List, request);
    if (!response) return response.error();
    std::vector<api::TrialInfo> list;
    for (const v1::TrialInfo& info : response->trials()) list.push_back(FromProto(info));
    return list;
  }

  Result<api::TrialInfo> Get(const std::string& id) override {
    v1::GetTrialRequest request;
    request.set_id(Utf8(id));
    const auto response = Call(*connection_, stub_, &Stub::Get, request);
    if (!response) return response.error();
    return FromProto(response->trial());
  }

  Result<demonstration::Trial> Load(const std::string& id) override {
    v1::LoadTrialRequest request;
    request.set_id(Utf8(id));
    const auto response = Call(*connection_, stub_, &Stub::Load, request);
    if (!response) return response.error();
    return FromProto(response->trial(), "trial");
  }

  Result<api::TrialSegments> Segments(const std::string& id,
                                      const std::map<std::string, std::string>& options) override {
    v1::SegmentTrialRequest header;
    header.mutable_header()->set_id(Utf8(id));
    return SendForSegments(header, {}, options);
  }

  Result<api::TrialSegments> SegmentsOfFile(
      const std::string& name, std::string file,
      const std::map<std::string, std::string>& options) override {
    v1::SegmentTrialRequest header;
    header.mutable_header()->set_name(Utf8(name));
    return SendForSegments(header, file, options);
  }

  Result<std::string> ExportCsv(const std::string& id) override {
    v1::ExportTrialRequest request;
    request.set_id(Utf8(id));
    const auto context = connection_->Begin();
    return Download(*connection_, *stub_.Export(context.get(), request));
  }

  Status Delete(const std::string& id) override {
    v1::DeleteTrialRequest request;
    request.set_id(Utf8(id));
    const auto response = Call(*connection_, stub_, &Stub::Delete, request);
    if (!response) return response.error();
    return {};
  }

  Status SetPerson(const std::string& id, const std::string& person) override {
    v1::SetTrialPersonRequest request;
    request.set_id(Utf8(id));
    request.set_person(Utf8(person));
    const auto response = Call(*connection_, stub_, &Stub::SetPerson, request);
    if (!response) return response.error();
    return {};
  }

 private:
  Result<api::TrialSegments> SendForSegments(v1::SegmentTrialRequest& header, std::string_view file,
                                             const std::map<std::string, std::string>& options) {
    OptionsToProto(options, header.mutable_header()->mutable_options());
    const auto context = connection_->Begin();
    v1::SegmentTrialResponse response;
    const auto writer = stub_.Segments(context.get(), &response);
    Upload(*writer, header, file);
    const grpc::Status status = writer->Finish();
    if (!status.ok()) return FromGrpc(status, connection_->address());
    return FromProto(response);
  }

  std::shared_ptr<Connection> connection_;
  Stub stub_;
};

}  // namespace

std::unique_ptr<api::TrialApi> MakeTrialClient(std::shared_ptr<Connection> connection) {
  return std::make_unique<TrialClient>(std::move(connection));
}

}  // namespace exemplar::rpc
