#pragma once
// What every call on the client's side has in common.

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/sync_stream.h>

#include <atomic>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "call_status.hpp"
#include "exemplar/rpc/client.hpp"
#include "tls.hpp"

namespace exemplar::rpc {

/// A channel and what its calls need. Thread-safe.
class Connection {
 public:
  static Result<std::shared_ptr<Connection>> Create(const ClientOptions& options);

  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  const std::string& address() const { return options_.server; }

  enum class Length { kShort, kLong, kOpenEnded };
  /// Waits for the server if the options say so; sets deadline and request id.
  std::unique_ptr<grpc::ClientContext> Begin(Length length = Length::kShort);

 private:
  Connection(const ClientOptions& options, const ChannelSecurity& security);
  const ClientOptions options_;
  const std::string request_id_;
  const std::string authorization_;
  const std::shared_ptr<grpc::Channel> channel_;
  std::atomic<std::uint64_t> calls_{0};
};

/// Cancels the call when `stop` is requested, for as long as it lives.
class CancelOnStop {
 public:
  CancelOnStop(grpc::ClientContext& context, std::stop_token stop)
      : callback_(std::move(stop), [&context] { context.TryCancel(); }) {}

 private:
  std::stop_callback<std::function<void()>> callback_;
};

/// One request, one answer. `method` as `&v1::TrialService::Stub::Get`.
template <class Response, class Stub, class Request>
Result<Response> Call(Connection& connection, Stub& stub,
                      grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request,
                      Connection::Length length = Connection::Length::kShort) {
  const auto context = connection.Begin(length);
  Response response;
  const grpc::Status status = (stub.*method)(context.get(), request, &response);
  if (!status.ok()) return FromGrpc(status, connection.address());
  return response;
}

/// Reads a stream of whatever `tell` takes until its end; the last message, which holds the answer.
template <class Response, class Tell>
Result<Response> ReadToLast(const Connection& connection, grpc::ClientReader<Response>& reader,
                            const Tell& tell) {
  Response last;
  Response response;
  while (reader.Read(&response)) {
    tell(response);
    last.Swap(&response);
  }
  const grpc::Status status = reader.Finish();
  if (!status.ok()) return FromGrpc(status, connection.address());
  return last;
}

/// The report behind a stream of progress, which `progress` is told (none: nobody asks).
template <class Response, class Progress>
Result<Response> ReadReport(const Connection& connection, grpc::ClientReader<Response>& reader,
                            const Progress& progress) {
  Result<Response> last = ReadToLast(connection, reader, [&](const Response& response) {
    if (response.has_progress() && progress) {
      progress(response.progress().fraction(), response.progress().step());
    }
  });
  if (last && !last->has_report()) return Internal(connection.address() + " sent no report");
  return last;
}

/// Sends a message with the header, then the file's bytes in chunks.
template <class Request>
void Upload(grpc::ClientWriter<Request>& writer, const Request& header, std::string_view file) {
  constexpr std::size_t kChunk = std::size_t{256} << 10;
  bool open = writer.Write(header);
  for (std::size_t sent = 0; open && sent < file.size(); sent += kChunk) {
    Request request;
    request.mutable_chunk()->set_data(std::string(file.substr(sent, kChunk)));
    // False: the server has its answer already, and Finish gets it.
    open = writer.Write(request);
  }
  if (open) writer.WritesDone();
}

/// Collects the chunks of a stream.
template <class Response>
Result<std::string> Download(const Connection& connection, grpc::ClientReader<Response>& reader) {
  std::string file;
  Response response;
  while (reader.Read(&response)) file += response.chunk().data();
  const grpc::Status status = reader.Finish();
  if (!status.ok()) return FromGrpc(status, connection.address());
  return file;
}

std::unique_ptr<api::TrialApi> MakeTrialClient(std::shared_ptr<Connection> connection);
std::unique_ptr<api::SkillApi> MakeSkillClient(std::shared_ptr<Connection> connection);
std::unique_ptr<api::ExecutorApi> MakeExecutorClient(std::shared_ptr<Connection> connection);
std::unique_ptr<api::RecorderApi> MakeRecorderClient(std::shared_ptr<Connection> connection);
std::unique_ptr<api::DataApi> MakeLearningDataClient(std::shared_ptr<Connection> connection);
std::unique_ptr<api::DataApi> MakeRecorderDataClient(std::shared_ptr<Connection> connection);
std::unique_ptr<api::TopicApi> MakeTopicClient(std::shared_ptr<Connection> connection);

}  // namespace exemplar::rpc
