#include "client_call.hpp"
#include "convert_skill.hpp"
#include "convert_suggest.hpp"
#include "exemplar/v1/skill.grpc.pb.h"

namespace exemplar::rpc {
namespace {

using Stub = v1::SkillService::Stub;

void Name(const std::string& name, int version, v1::SkillVersion* message) {
  message->set_name(Utf8(name));
  message->set_version(version);
}

class SkillClient final : public api::SkillApi {
 public:
  explicit SkillClient(std::shared_ptr<Connection> connection)
      : connection_(std::move(connection)), stub_(connection_->channel()) {}

  Result<learning::SkillReport> Learn(const std::string& name,
                                      const std::map<std::string, std::string>& options,
                                      const learning::Progress& progress,
                                      std::stop_token stop) override {
    v1::LearnSkillRequest request;
    request.set_name(Utf8(name));
    OptionsToProto(options, request.mutable_options());
    const auto context = connection_->Begin(Connection::Length::kLong);
    const CancelOnStop cancel(*context, std::move(stop));
    const auto last = ReadReport(*connection_, *stub_.Learn(context.get(), request), progress);
    if (!last) return last.error();
    return FromProto(last->report());
  }

  Result<std::vector<api::SkillInfo>> List() override {
    const auto response = Call(*connection_, stub_, &Stub::List, v1::ListSkillsRequest());
    if (!response) return response.error();
    std::vector<api::SkillInfo> list;
    for (const v1::SkillInfo& info : response->skills()) list.push_back(FromProto(info));
    return list;
  }

  Result<learning::SkillReport> Show(const std::string& name, int version) override {
    v1::GetSkillRequest request;
    Name(name, version, request.mutable_skill());
    const auto response = Call(*connection_, stub_, &Stub::Get, request);
    if (!response) return response.error();
    return FromProto(response->report());
  }

  Result<std::vector<api::VersionInfo>> Versions(const std::string& name) override {
    v1::ListSkillVersionsRequest request;
    request.set_name(Utf8(name));
    const auto response = Call(*connection_, stub_, &Stub::Versions, request);
    if (!response) return response.error();
    std::vector<api::VersionInfo> list;
    for (const v1::SkillVersionInfo& info : response->versions()) list.push_back(FromProto(info));
    return list;
  }

  Status Rollback(const std::string& name, int version) override {
    v1::RollbackSkillRequest request;
    request.set_name(Utf8(name));
    request.set_version(version);
    const auto response = Call(*connection_, stub_, &Stub::Rollback, request);
    if (!response) return response.error();
    return {};
  }

  Status Delete(const std::string& name) override {
    v1::DeleteSkillRequest request;
    request.set_name(Utf8(name));
    const auto response = Call(*connection_, stub_, &Stub::Delete, request);
    if (!response) return response.error();
    return {};
  }

  Result<demonstration::SkillMotion> Query(const std::string& name, int version,
                                           const demonstration::SkillQuery& query) override {
    v1::QuerySkillRequest request;
    Name(name, version, request.mutable_skill());
    ToProto(query, request.mutable_query());
    const auto response = Call(*connection_, stub_, &Stub::Query, request);
    if (!response) return response.error();
    return FromProto(response->motion(), "motion");
  }

  Result<learning::Suggestions> Suggest(const std::string& name, int version,
                                        const learning::SuggestOptions& options) override {
    v1::SuggestSkillRequest request;
    Name(name, version, request.mutable_skill());
    request.set_count(options.count);
    const auto response = Call(*connection_, stub_, &Stub::Suggest, request);
    if (!response) return response.error();
    return FromProto(*response);
  }

  Result<learning::Evaluation> Evaluate(const std::string& name, int version,
                                        const std::string& file_name, std::string file) override {
    v1::EvaluateSkillRequest header;
    Name(name, version, header.mutable_header()->mutable_skill());
    header.mutable_header()->set_name(Utf8(file_name));
    const auto context = connection_->Begin();
    v1::EvaluateSkillResponse response;
    const auto writer = stub_.Evaluate(context.get(), &response);
    Upload(*writer, header, file);
    const grpc::Status status = writer->Finish();
    if (!status.ok()) return FromGrpc(status, connection_->address());
    return FromProto(response);
  }

  Result<std::string> ExportJson(const std::string& name, int version) override {
    v1::ExportSkillRequest request;
    Name(name, version, request.mutable_skill());
    const auto context = connection_->Begin();
    return Download(*connection_, *stub_.Export(context.get(), request));
  }

 private:
  std::shared_ptr<Connection> connection_;
  Stub stub_;
};

class GrpcMotionStream final : public MotionStream {
 public:
  GrpcMotionStream(std::shared_ptr<Connection> connection, const std::string& skill, int version)
      : connection_(std::move(connection)),
        stub_(connection_->channel()),
        context_(connection_->Begin(Connection::Length::kOpenEnded)),
        stream_(stub_.QueryStream(context_.get())) {
    Name(skill, version, request_.mutable_skill());
  }
  GrpcMotionStream(const GrpcMotionStream&) = delete;
  GrpcMotionStream& operator=(const GrpcMotionStream&) = delete;
  ~GrpcMotionStream() override {
    if (!failure_) End();
  }

  Result<demonstration::SkillMotion> Ask(const demonstration::SkillQuery& query) override {
    if (failure_) return *failure_;
    request_.set_tag(request_.tag() + 1);
    request_.mutable_query()->Clear();
    ToProto(query, request_.mutable_query());
    v1::QuerySkillStreamResponse response;
    if (!stream_->Write(request_) || !stream_->Read(&response)) {
      failure_ = End();
      return *failure_;
    }
    request_.clear_skill();
    if (response.has_error()) return FromProto(response.error());
    return FromProto(response.motion(), "motion");
  }

 private:
  Error End() {
    stream_->WritesDone();
    const grpc::Status status = stream_->Finish();
    return status.ok() ? Unavailable(connection_->address() + " ended the stream")
                       : FromGrpc(status, connection_->address());
  }

  std::shared_ptr<Connection> connection_;
  Stub stub_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<
      grpc::ClientReaderWriter<v1::QuerySkillStreamRequest, v1::QuerySkillStreamResponse>>
      stream_;
  v1::QuerySkillStreamRequest request_;
  std::optional<Error> failure_;
};

}  // namespace

std::unique_ptr<api::SkillApi> MakeSkillClient(std::shared_ptr<Connection> connection) {
  return std::make_unique<SkillClient>(std::move(connection));
}

Result<std::unique_ptr<MotionStream>> OpenMotionStream(const ClientOptions& options,
                                                       const std::string& skill, int version) {
  Result<std::shared_ptr<Connection>> connection = Connection::Create(options);
  if (!connection) return connection.error();
  return std::unique_ptr<MotionStream>(
      std::make_unique<GrpcMotionStream>(*connection, skill, version));
}

}  // namespace exemplar::rpc
