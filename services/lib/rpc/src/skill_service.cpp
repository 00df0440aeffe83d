#include "convert_skill.hpp"
#include "convert_suggest.hpp"
#include "method_table.hpp"
#include "motion_wire.hpp"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

/// As skill.proto has it, but that motions leave as bytes that motion_wire writes.
class SkillService final : public MethodTable<SkillService> {
 public:
  SkillService(ServerShared& shared, api::SkillApi& skills) : shared_(shared), skills_(skills) {
    Add("/exemplar.v1.SkillService/Learn", &SkillService::Learn);
    Add("/exemplar.v1.SkillService/Get", &SkillService::Get);
    Add("/exemplar.v1.SkillService/List", &SkillService::List);
    Add("/exemplar.v1.SkillService/Versions", &SkillService::Versions);
    Add("/exemplar.v1.SkillService/Rollback", &SkillService::Rollback);
    Add("/exemplar.v1.SkillService/Query", &SkillService::Query);
    Add("/exemplar.v1.SkillService/QueryStream", &SkillService::QueryStream);
    Add("/exemplar.v1.SkillService/Evaluate", &SkillService::Evaluate);
    Add("/exemplar.v1.SkillService/Suggest", &SkillService::Suggest);
    Add("/exemplar.v1.SkillService/Delete", &SkillService::Delete);
    Add("/exemplar.v1.SkillService/Export", &SkillService::Export);
  }

 private:
  grpc::Status Learn(grpc::ServerContext* context, const v1::LearnSkillRequest* request,
                     grpc::ServerWriter<v1::LearnSkillResponse>* writer) {
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
                   v1::GetSkillResponse* response) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Get", [&]() -> Status {
      const Result<learning::SkillReport> report =
          skills_.Show(request->skill().name(), request->skill().version());
      if (!report) return report.error();
      ToProto(*report, response->mutable_report());
      return {};
    });
  }

  grpc::Status List(grpc::ServerContext* context, const v1::ListSkillsRequest*,
                    v1::ListSkillsResponse* response) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/List", [&]() -> Status {
      const Result<std::vector<api::SkillInfo>> list = skills_.List();
      if (!list) return list.error();
      for (const api::SkillInfo& info : *list) ToProto(info, response->add_skills());
      return {};
    });
  }

  grpc::Status Versions(grpc::ServerContext* context, const v1::ListSkillVersionsRequest* request,
                        v1::ListSkillVersionsResponse* response) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Versions", [&]() -> Status {
      const Result<std::vector<api::VersionInfo>> versions = skills_.Versions(request->name());
      if (!versions) return versions.error();
      for (const api::VersionInfo& info : *versions) ToProto(info, response->add_versions());
      return {};
    });
  }

  grpc::Status Rollback(grpc::ServerContext* context, const v1::RollbackSkillRequest* request,
                        v1::RollbackSkillResponse*) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Rollback", request->name(),
                 [&] { return skills_.Rollback(request->name(), request->version()); });
  }

  grpc::Status Query(grpc::ServerContext* context, const v1::QuerySkillRequest* request,
                     grpc::ByteBuffer* response) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Query", [&]() -> Status {
      const Result<demonstration::SkillMotion> motion = Answer(request->skill(), request->query());
      if (!motion) return motion.error();
      *response = ResponseBytes(*motion);
      return {};
    });
  }

  grpc::Status QueryStream(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<grpc::ByteBuffer, v1::QuerySkillStreamRequest>* stream) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/QueryStream", [&]() -> Status {
      v1::SkillVersion skill;
      v1::QuerySkillStreamRequest request;
      while (stream->Read(&request)) {
        if (request.has_skill()) skill = request.skill();
        const Result<demonstration::SkillMotion> motion = Answer(skill, request.query());
        const bool written =
            stream->Write(motion ? StreamResponseBytes(request.tag(), *motion)
                                 : StreamResponseBytes(request.tag(), motion.error()));
        if (!written) return Error{ErrorCode::kCancelled, "the caller went away"};
      }
      return {};
    });
  }

  grpc::Status Evaluate(grpc::ServerContext* context,
                        grpc::ServerReader<v1::EvaluateSkillRequest>* reader,
                        v1::EvaluateSkillResponse* response) {
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

  grpc::Status Suggest(grpc::ServerContext* context, const v1::SuggestSkillRequest* request,
                       v1::SuggestSkillResponse* response) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Suggest", [&]() -> Status {
      learning::SuggestOptions options;
      if (request->count() != 0) options.count = request->count();
      const Result<learning::Suggestions> suggestions =
          skills_.Suggest(request->skill().name(), request->skill().version(), options);
      if (!suggestions) return suggestions.error();
      ToProto(*suggestions, response);
      return {};
    });
  }

  grpc::Status Delete(grpc::ServerContext* context, const v1::DeleteSkillRequest* request,
                      v1::DeleteSkillResponse*) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Delete", request->name(),
                 [&] { return skills_.Delete(request->name()); });
  }

  grpc::Status Export(grpc::ServerContext* context, const v1::ExportSkillRequest* request,
                      grpc::ServerWriter<v1::ExportSkillResponse>* writer) {
    return Serve(shared_, *context, "exemplar.v1.SkillService/Export", [&]() -> Status {
      const Result<std::string> json =
          skills_.ExportJson(request->skill().name(), request->skill().version());
      if (!json) return json.error();
      return WriteDownload(*writer, *json);
    });
  }

  /// Fields as the request has them: the interface's arguments lie in two of its messages.
  static Error WithRequestField(Error error) {
    if (error.field == "name" || error.field == "version") {
      error.field.insert(0, "skill.");
    } else if (!error.field.empty()) {
      error.field.insert(0, "query.");
    }
    return error;
  }

  Result<demonstration::SkillMotion> Answer(const v1::SkillVersion& skill,
                                            const v1::SkillQuery& message) {
    const Result<demonstration::SkillQuery> query = FromProto(message, "query");
    if (!query) return query.error();
    Result<demonstration::SkillMotion> motion =
        skills_.Query(skill.name(), skill.version(), *query);
    if (!motion) return WithRequestField(motion.error());
    return motion;
  }

  ServerShared& shared_;
  api::SkillApi& skills_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeSkillService(ServerShared& shared, api::SkillApi& skills) {
  return std::make_unique<SkillService>(shared, skills);
}

}  // namespace exemplar::rpc
