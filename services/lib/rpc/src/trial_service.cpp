#include "convert_trial.hpp"
#include "exemplar/v1/trial.grpc.pb.h"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

class TrialService final : public v1::TrialService::Service {
 public:
  TrialService(ServerShared& shared, api::TrialApi& trials) : shared_(shared), trials_(trials) {}

  grpc::Status Submit(grpc::ServerContext* context,
                      grpc::ServerReader<v1::SubmitTrialRequest>* reader,
                      v1::SubmitTrialResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.TrialService/Submit", [&]() -> Status {
      v1::SubmitTrialRequest::Header header;
      std::string file;
      if (Status read = ReadUpload(shared_, *reader, header, file); !read) return read;
      // Half a file must not be taken for a whole one.
      if (context->IsCancelled()) return Error{ErrorCode::kCancelled, "the upload broke off"};
      if (header.skill().empty()) return InvalidArgument("skill is empty", "header.skill");
      Result<api::SubmitResult> result =
          trials_.Submit(header.skill(), header.name(), std::move(file), header.person());
      if (!result) return result.error();
      ToProto(result->info, response->mutable_trial());
      response->set_duplicate(result->duplicate);
      return {};
    });
  }

  grpc::Status List(grpc::ServerContext* context, const v1::ListTrialsRequest* request,
                    v1::ListTrialsResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.TrialService/List", [&]() -> Status {
      const Result<std::vector<api::TrialInfo>> list =
          trials_.List(request->skill(), request->person());
      if (!list) return list.error();
      for (const api::TrialInfo& info : *list) ToProto(info, response->add_trials());
      return {};
    });
  }

  grpc::Status Get(grpc::ServerContext* context, const v1::GetTrialRequest* request,
                   v1::GetTrialResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.TrialService/Get", [&]() -> Status {
      const Result<api::TrialInfo> info = trials_.Get(request->id());
      if (!info) return info.error();
      ToProto(*info, response->mutable_trial());
      return {};
    });
  }

  grpc::Status Load(grpc::ServerContext* context, const v1::LoadTrialRequest* request,
                    v1::LoadTrialResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.TrialService/Load", [&]() -> Status {
      const Result<demonstration::Trial> trial = trials_.Load(request->id());
      if (!trial) return trial.error();
      ToProto(*trial, response->mutable_trial());
      return {};
    });
  }

  grpc::Status Segments(grpc::ServerContext* context,
                        grpc::ServerReader<v1::SegmentTrialRequest>* reader,
                        v1::SegmentTrialResponse* response) override {
    return Serve(shared_, *context, "exemplar.v1.TrialService/Segments", [&]() -> Status {
      v1::SegmentTrialRequest::Header header;
      std::string file;
      if (Status read = ReadUpload(shared_, *reader, header, file); !read) return read;
      const auto options = OptionsFromProto(header.options());
      const Result<api::TrialSegments> segments =
          header.id().empty() ? trials_.SegmentsOfFile(header.name(), std::move(file), options)
                              : trials_.Segments(header.id(), options);
      if (!segments) return segments.error();
      ToProto(*segments, response);
      return {};
    });
  }

  grpc::Status Export(grpc::ServerContext* context, const v1::ExportTrialRequest* request,
                      grpc::ServerWriter<v1::ExportTrialResponse>* writer) override {
    return Serve(shared_, *context, "exemplar.v1.TrialService/Export", [&]() -> Status {
      const Result<std::string> csv = trials_.ExportCsv(request->id());
      if (!csv) return csv.error();
      return WriteDownload(*writer, *csv);
    });
  }

  grpc::Status Delete(grpc::ServerContext* context, const v1::DeleteTrialRequest* request,
                      v1::DeleteTrialResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.TrialService/Delete", request->id(),
                 [&] { return trials_.Delete(request->id()); });
  }

  grpc::Status SetPerson(grpc::ServerContext* context, const v1::SetTrialPersonRequest* request,
                         v1::SetTrialPersonResponse*) override {
    return Serve(shared_, *context, "exemplar.v1.TrialService/SetPerson", request->id(),
                 [&] { return trials_.SetPerson(request->id(), request->person()); });
  }

 private:
  ServerShared& shared_;
  api::TrialApi& trials_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeTrialService(ServerShared& shared, api::TrialApi& trials) {
  return std::make_unique<TrialService>(shared, trials);
}

}  // namespace exemplar::rpc
