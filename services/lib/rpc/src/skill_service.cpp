#include "convert_skill.hpp"
#include "exemplar/v1/skill.grpc.pb.h"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

class SkillService final : public v1::SkillService::Service {
 public:
  SkillService(ServerShared& shared, api::SkillApi& skills) : shared_(shared), skills_(skills) {}

  grpc::Status Learn(grpc::ServerContext* context, const v1::LearnSkillRequest* request,
                     grpc::ServerWriter<v1::LearnSkillResponse>* writer) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Learn", [&]() -> Status {
      CancellationWatch watch(shared_, *context);
      LatestWriter<v1::LearnSkillResponse> progress(*writer, watch);
      const Result<learning::SkillReport> report = skills_.Learn(
          request->name(), OptionsFromProto(request->options()),
          [&](double fraction, std::string_view step) {
            v1::LearnSkillResponse message;
            message.mutable_progress()->set_fraction(fraction);
            message.mutable_progress()->set_step(Utf8(step));
            progress.Post(std::move(message));
          },
          watch.token());
      progress.Finish();
      if (!report) return report.error();
      v1::LearnSkillResponse last;
      ToProto(*report, last.mutable_report());
      writer->Write(last);
      return {};
    });
  }

  grpc::Status Get(grpc::ServerContext* context, const v1::GetSkillRequest* request,
                   v1::GetSkillResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Get", [&]() -> Status {
      const Result<learning::SkillReport> report =
          skills_.Show(request->skill().name(), request->skill().version());
      if (!report) return report.error();
      ToProto(*report, response->mutable_report());
      return {};
    });
  }

  grpc::Status List(grpc::ServerContext* context, const v1::ListSkillsRequest*,
                    v1::ListSkillsResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/List", [&]() -> Status {
      const Result<std::vector<api::SkillInfo>> list = skills_.List();
      if (!list) return list.error();
      for (const api::SkillInfo& info : *list) ToProto(info, response->add_skills());
      return {};
    });
  }

  grpc::Status Versions(grpc::ServerContext* context, const v1::ListSkillVersionsRequest* request,
                        v1::ListSkillVersionsResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Versions", [&]() -> Status {
      const Result<std::vector<api::VersionInfo>> versions = skills_.Versions(request->name());
      if (!versions) return versions.error();
      for (const api::VersionInfo& info : *versions) ToProto(info, response->add_versions());
      return {};
    });
  }

  grpc::Status Rollback(grpc::ServerContext* context, const v1::RollbackSkillRequest* request,
                        v1::RollbackSkillResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Rollback",
                 [&] { return skills_.Rollback(request->name(), request->version()); });
  }

  grpc::Status Query(grpc::ServerContext* context, const v1::QuerySkillRequest* request,
                     v1::QuerySkillResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Query", [&]() -> Status {
      return Answer(request->skill(), request->query(), response->mutable_motion());
    });
  }

  grpc::Status QueryStream(grpc::ServerContext* context,
                           grpc::ServerReaderWriter<v1::QuerySkillStreamResponse,
                                                    v1::QuerySkillStreamRequest>* stream) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/QueryStream", [&]() -> Status {
      v1::SkillVersion skill;
      v1::QuerySkillStreamRequest request;
      while (stream->Read(&request)) {
        if (request.has_skill()) skill = request.skill();
        v1::QuerySkillStreamResponse response;
        response.set_tag(request.tag());
        const Status answered = Answer(skill, request.query(), response.mutable_motion());
        if (!answered) ToProto(answered.error(), response.mutable_error());
        if (!stream->Write(response)) return Error{ErrorCode::kCancelled, "the caller went away"};
      }
      return {};
    });
  }

  grpc::Status Evaluate(grpc::ServerContext* context,
                        grpc::ServerReader<v1::EvaluateSkillRequest>* reader,
                        v1::EvaluateSkillResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Evaluate", [&]() -> Status {
      v1::EvaluateSkillRequest::Header header;
      std::string file;
      if (Status read = ReadUpload(shared_, *reader, header, file); !read) return read;
      const Result<learning::Evaluation> evaluation = skills_.Evaluate(
          header.skill().name(), header.skill().version(), header.name(), std::move(file));
      if (!evaluation) return evaluation.error();
      ToProto(*evaluation, response);
      return {};
    });
  }

  grpc::Status Delete(grpc::ServerContext* context, const v1::DeleteSkillRequest* request,
                      v1::DeleteSkillResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Delete",
                 [&] { return skills_.Delete(request->name()); });
  }

  grpc::Status Export(grpc::ServerContext* context, const v1::ExportSkillRequest* request,
                      grpc::ServerWriter<v1::ExportSkillResponse>* writer) override {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Export", [&]() -> Status {
      const Result<std::string> json =
          skills_.ExportJson(request->skill().name(), request->skill().version());
      if (!json) return json.error();
      return WriteDownload(*writer, *json);
    });
  }

 private:
  /// Fields as the request has them: the interface's arguments lie in two of its messages.
  static Error WithRequestField(Error error) {
    if (error.field == "name" || error.field == "version") {
      error.field.insert(0, "skill.");
    } else if (!error.field.empty()) {
      error.field.insert(0, "query.");
    }
    return error;
  }

  Status Answer(const v1::SkillVersion& skill, const v1::SkillQuery& message,
                v1::SkillMotion* answer) {
    const Result<demonstration::SkillQuery> query = FromProto(message, "query");
    if (!query) return query.error();
    const Result<demonstration::SkillMotion> motion =
        skills_.Query(skill.name(), skill.version(), *query);
    if (!motion) return WithRequestField(motion.error());
    ToProto(*motion, answer);
    return {};
  }

  ServerShared& shared_;
  api::SkillApi& skills_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeSkillService(ServerShared& shared, api::SkillApi& skills) {
  return std::make_unique<SkillService>(shared, skills);
}

}  // namespace exemplar::rpc
