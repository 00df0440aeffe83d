#include "convert_data.hpp"
#include "method_table.hpp"
#include "server_call.hpp"

namespace exemplar::rpc {
namespace {

/// The full names of one service's methods.
struct Names {
  const char* list_persons;
  const char* erase_person;
  const char* apply_retention;
  const char* backup;
  const char* restore;
};
constexpr Names kLearning = {
    "/exemplar.v1.LearningDataService/ListPersons", "/exemplar.v1.LearningDataService/ErasePerson",
    "/exemplar.v1.LearningDataService/ApplyRetention", "/exemplar.v1.LearningDataService/Backup",
    "/exemplar.v1.LearningDataService/Restore"};
constexpr Names kRecorder = {
    "/exemplar.v1.RecorderDataService/ListPersons", "/exemplar.v1.RecorderDataService/ErasePerson",
    "/exemplar.v1.RecorderDataService/ApplyRetention", "/exemplar.v1.RecorderDataService/Backup",
    "/exemplar.v1.RecorderDataService/Restore"};

/// A backup onto a stream.
class StreamSink final : public api::BackupSink {
 public:
  explicit StreamSink(grpc::ServerWriter<v1::BackupResponse>& writer) : writer_(writer) {}

  Status Begin(const api::BackupPlan& plan) override {
    v1::BackupResponse response;
    ToProto(plan, response.mutable_plan());
    return Send(response);
  }
  Status BeginPart(const api::BackupPart& part) override {
    v1::BackupResponse response;
    response.mutable_begin()->set_name(Utf8(part.name));
    response.mutable_begin()->set_bytes(part.bytes);
    return Send(response);
  }
  Status Write(std::string_view bytes) override {
    constexpr std::size_t kChunk = std::size_t{256} << 10;
    v1::BackupResponse response;
    for (std::size_t sent = 0; sent < bytes.size(); sent += kChunk) {
      response.mutable_chunk()->set_data(std::string(bytes.substr(sent, kChunk)));
      if (Status done = Send(response); !done) return done;
    }
    return {};
  }

 private:
  Status Send(const v1::BackupResponse& response) {
    if (writer_.Write(response)) return {};
    return Error{ErrorCode::kCancelled, "the caller went away"};
  }
  grpc::ServerWriter<v1::BackupResponse>& writer_;
};

/// A backup that comes in on a stream.
class StreamSource final : public api::BackupSource {
 public:
  explicit StreamSource(grpc::ServerReader<v1::RestoreRequest>& reader) : reader_(reader) {}

  Result<std::optional<api::BackupPart>> NextPart() override {
    while (!begins_) {
      const Result<std::string> passed = Read();
      if (!passed) return passed.error();
      if (passed->empty() && !begins_) {
        if (committed_) return std::optional<api::BackupPart>();
        if (Status next = Take(); !next) return next.error();
      }
    }
    begins_ = false;
    left_ = request_.begin().bytes();
    part_ = request_.begin().name();
    return std::optional(api::BackupPart{part_, left_});
  }

  Result<std::string> Read() override {
    if (left_ == 0) return std::string();
    if (Status next = Take(); !next) return next.error();
    if (!request_.has_chunk()) {
      return InvalidArgument(
          "part " + part_ + " lacks its last " + std::to_string(left_) + " bytes", "chunk");
    }
    std::string bytes = std::move(*request_.mutable_chunk()->mutable_data());
    if (bytes.empty() || bytes.size() > left_) {
      return InvalidArgument("part " + part_ + " is not as long as announced", "chunk");
    }
    left_ -= bytes.size();
    return bytes;
  }

 private:
  Status Take() {
    if (!reader_.Read(&request_)) {
      return Error{ErrorCode::kCancelled, "the backup broke off before its end"};
    }
    begins_ = request_.has_begin();
    committed_ = request_.part_case() == v1::RestoreRequest::kCommit;
    if (left_ == 0 && !begins_ && !committed_) {
      return InvalidArgument("a part must begin here, or the restoring be committed", "part");
    }
    return {};
  }

  grpc::ServerReader<v1::RestoreRequest>& reader_;
  v1::RestoreRequest request_;
  std::string part_;
  std::uint64_t left_ = 0;
  bool begins_ = false;
  bool committed_ = false;
};

class DataService final : public MethodTable<DataService> {
 public:
  DataService(ServerShared& shared, api::DataApi& data, const Names& names)
      : shared_(shared), data_(data), names_(names) {
    Add(names_.list_persons, &DataService::ListPersons);
    Add(names_.erase_person, &DataService::ErasePerson);
    Add(names_.apply_retention, &DataService::ApplyRetention);
    Add(names_.backup, &DataService::Backup);
    Add(names_.restore, &DataService::Restore);
  }

 private:
  grpc::Status ListPersons(grpc::ServerContext* context, const v1::ListPersonsRequest*,
                           v1::ListPersonsResponse* response) {
    return Serve(shared_, *context, names_.list_persons + 1, [&]() -> Status {
      const Result<std::vector<api::PersonInfo>> list = data_.ListPersons();
      if (!list) return list.error();
      for (const api::PersonInfo& info : *list) ToProto(info, response->add_persons());
      return {};
    });
  }

  /// The audit does not hold who was erased.
  grpc::Status ErasePerson(grpc::ServerContext* context, const v1::ErasePersonRequest* request,
                           grpc::ServerWriter<v1::ErasePersonResponse>* writer) {
    const char* target = request->dry_run() ? "dry run" : "a person";
    return Serve(shared_, *context, names_.erase_person + 1, target, [&]() -> Status {
      CancellationWatch watch(shared_, *context);
      LatestWriter<v1::ErasePersonResponse> progress(*writer, watch);
      const Result<api::DataReport> report = data_.Erase(
          {.person = request->person(), .dry_run = request->dry_run()},
          [&](double fraction, std::string_view step) {
            v1::ErasePersonResponse message;
            message.mutable_progress()->set_fraction(fraction);
            message.mutable_progress()->set_step(Utf8(step));
            progress.Post(std::move(message));
          },
          watch.token());
      progress.Finish();
      if (!report) return report.error();
      v1::ErasePersonResponse last;
      ToProto(*report, last.mutable_report());
      writer->Write(last);
      return {};
    });
  }

  grpc::Status ApplyRetention(grpc::ServerContext* context,
                              const v1::ApplyRetentionRequest* request,
                              v1::ApplyRetentionResponse* response) {
    const char* target = request->dry_run() ? "dry run" : "";
    return Serve(shared_, *context, names_.apply_retention + 1, target, [&]() -> Status {
      const Result<api::RetentionRequest> read = FromProto(*request);
      if (!read) return read.error();
      const Result<api::DataReport> report = data_.ApplyRetention(*read);
      if (!report) return report.error();
      ToProto(*report, response->mutable_report());
      return {};
    });
  }

  grpc::Status Backup(grpc::ServerContext* context, const v1::BackupRequest*,
                      grpc::ServerWriter<v1::BackupResponse>* writer) {
    return Serve(shared_, *context, names_.backup + 1, [&] {
      CancellationWatch watch(shared_, *context);
      StreamSink sink(*writer);
      return data_.Backup(sink, watch.token());
    });
  }

  grpc::Status Restore(grpc::ServerContext* context, grpc::ServerReader<v1::RestoreRequest>* reader,
                       v1::RestoreResponse* response) {
    return Serve(shared_, *context, names_.restore + 1, [&]() -> Status {
      v1::RestoreRequest first;
      if (!reader->Read(&first) || !first.has_header()) {
        return InvalidArgument("the first message must hold the header", "header");
      }
      const Result<api::RestoreRequest> request = FromProto(first.header());
      if (!request) return request.error();
      StreamSource source(*reader);
      const Result<api::DataReport> report = data_.Restore(*request, source);
      if (!report) return report.error();
      ToProto(*report, response->mutable_report());
      return {};
    });
  }

  ServerShared& shared_;
  api::DataApi& data_;
  const Names& names_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeLearningDataService(ServerShared& shared, api::DataApi& data) {
  return std::make_unique<DataService>(shared, data, kLearning);
}

std::unique_ptr<grpc::Service> MakeRecorderDataService(ServerShared& shared, api::DataApi& data) {
  return std::make_unique<DataService>(shared, data, kRecorder);
}

}  // namespace exemplar::rpc
