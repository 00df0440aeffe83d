#include "client_call.hpp"
#include "convert_data.hpp"
#include "exemplar/v1/data.grpc.pb.h"

namespace exemplar::rpc {
namespace {

using Length = Connection::Length;

/// Of one of the two services, which have the same methods.
template <class Service>
class DataClient final : public api::DataApi {
 public:
  explicit DataClient(std::shared_ptr<Connection> connection)
      : connection_(std::move(connection)), stub_(connection_->channel()) {}

  Result<std::vector<api::PersonInfo>> ListPersons() override {
    const auto response = Call(*connection_, stub_, &Stub::ListPersons, v1::ListPersonsRequest());
    if (!response) return response.error();
    std::vector<api::PersonInfo> list;
    for (const v1::PersonInfo& info : response->persons()) list.push_back(FromProto(info));
    return list;
  }

  Result<api::DataReport> Erase(const api::EraseRequest& erase, const api::DataProgress& progress,
                                std::stop_token stop) override {
    v1::ErasePersonRequest request;
    request.set_person(Utf8(erase.person));
    request.set_dry_run(erase.dry_run);
    const auto context = connection_->Begin(Length::kLong);
    const CancelOnStop cancel(*context, std::move(stop));
    const auto last =
        ReadReport(*connection_, *stub_.ErasePerson(context.get(), request), progress);
    if (!last) return last.error();
    return FromProto(last->report());
  }

  Result<api::DataReport> ApplyRetention(const api::RetentionRequest& retention) override {
    v1::ApplyRetentionRequest request;
    ToProto(retention, &request);
    const auto response = Call(*connection_, stub_, &Stub::ApplyRetention, request, Length::kLong);
    if (!response) return response.error();
    return FromProto(response->report());
  }

  Status Backup(api::BackupSink& sink, std::stop_token stop) override {
    const auto context = connection_->Begin(Length::kLong);
    const CancelOnStop cancel(*context, std::move(stop));
    const auto reader = stub_.Backup(context.get(), v1::BackupRequest());
    v1::BackupResponse response;
    Status taken;
    while (taken && reader->Read(&response)) {
      if (response.has_plan()) {
        taken = sink.Begin(FromProto(response.plan()));
      } else if (response.has_begin()) {
        taken = sink.BeginPart({response.begin().name(), response.begin().bytes()});
      } else {
        taken = sink.Write(response.chunk().data());
      }
    }
    if (!taken) context->TryCancel();
    const grpc::Status status = reader->Finish();
    if (!taken) return taken;
    if (!status.ok()) return FromGrpc(status, connection_->address());
    return {};
  }

  Result<api::DataReport> Restore(const api::RestoreRequest& restore,
                                  api::BackupSource& source) override {
    const auto context = connection_->Begin(Length::kLong);
    v1::RestoreResponse response;
    const auto writer = stub_.Restore(context.get(), &response);
    v1::RestoreRequest request;
    ToProto(restore, request.mutable_header());
    bool open = writer->Write(request);
    while (open) {
      const Result<std::optional<api::BackupPart>> part = source.NextPart();
      if (!part) return GiveUp(*context, *writer, part.error());
      if (!*part) {
        request.set_commit(true);
        open = writer->Write(request);
        break;
      }
      request.mutable_begin()->set_name(Utf8((*part)->name));
      request.mutable_begin()->set_bytes((*part)->bytes);
      open = writer->Write(request);
      while (open) {
        Result<std::string> bytes = source.Read();
        if (!bytes) return GiveUp(*context, *writer, bytes.error());
        if (bytes->empty()) break;
        request.mutable_chunk()->set_data(*std::move(bytes));
        open = writer->Write(request);
      }
    }
    // Not open: the server has its answer already, and Finish gets it.
    if (open) writer->WritesDone();
    const grpc::Status status = writer->Finish();
    if (!status.ok()) return FromGrpc(status, connection_->address());
    return FromProto(response.report());
  }

 private:
  using Stub = typename Service::Stub;

  static Error GiveUp(grpc::ClientContext& context, grpc::ClientWriter<v1::RestoreRequest>& writer,
                      const Error& why) {
    context.TryCancel();
    static_cast<void>(writer.Finish());
    return why;
  }

  std::shared_ptr<Connection> connection_;
  Stub stub_;
};

}  // namespace

std::unique_ptr<api::DataApi> MakeLearningDataClient(std::shared_ptr<Connection> connection) {
  return std::make_unique<DataClient<v1::LearningDataService>>(std::move(connection));
}

std::unique_ptr<api::DataApi> MakeRecorderDataClient(std::shared_ptr<Connection> connection) {
  return std::make_unique<DataClient<v1::RecorderDataService>>(std::move(connection));
}

}  // namespace exemplar::rpc
