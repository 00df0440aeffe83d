#pragma once
// What every call on the server's side has in common.

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>
#include <grpcpp/support/sync_stream.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include "exemplar/base/result.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/rpc/server.hpp"
#include "guard.hpp"

namespace grpc {
class Service;
}

namespace exemplar::rpc {

/// Shared by all services of a server; outlives their calls. Thread-safe.
class ServerShared {
 public:
  explicit ServerShared(const ServerOptions& options);
  const ServerOptions& options() const { return options_; }
  std::stop_source& shutdown() { return shutdown_; }
  Guard& guard() { return guard_; }
  CallDeadlines& deadlines() { return deadlines_; }
  std::string MakeRequestId();

 private:
  const ServerOptions options_;
  std::stop_source shutdown_;
  Guard guard_;
  CallDeadlines deadlines_;
  std::mutex mutex_;
  Rng rng_;
};

/// Runs `body` if the caller may call `method`, turns what it returns (or throws) into gRPC's
/// status, and reports the call. `target` names what it is about, for the audit.
grpc::Status Serve(ServerShared& shared, grpc::ServerContext& context, std::string_view method,
                   std::string_view target, const std::function<Status()>& body);
inline grpc::Status Serve(ServerShared& shared, grpc::ServerContext& context,
                          std::string_view method, const std::function<Status()>& body) {
  return Serve(shared, context, method, {}, body);
}

/// The caller as others may be told of it: its request id, or where it calls from.
std::string WhoCalls(const grpc::ServerContext& context);

/// Requests a stop when the caller cancels, goes away or runs out of time, or the server shuts
/// down.
class CancellationWatch {
 public:
  CancellationWatch(ServerShared& shared, grpc::ServerContext& context);
  std::stop_token token() const { return stop_.get_token(); }
  void RequestStop() { stop_.request_stop(); }

 private:
  std::stop_source stop_;
  std::stop_callback<std::function<void()>> on_shutdown_;
  std::jthread thread_;
};

/// Writes messages to a stream from a thread of its own, so that a slow client never holds up the
/// one who posts: of what piles up only the latest is sent. Post is thread-safe.
template <class Message>
class LatestWriter {
 public:
  LatestWriter(grpc::ServerWriter<Message>& writer, CancellationWatch& watch)
      : writer_(writer), watch_(watch), thread_([this] { Run(); }) {}
  LatestWriter(const LatestWriter&) = delete;
  LatestWriter& operator=(const LatestWriter&) = delete;
  ~LatestWriter() { Finish(); }

  void Post(Message message) {
    {
      const std::lock_guard lock(mutex_);
      latest_ = std::move(message);
    }
    changed_.notify_one();
  }

  /// Sends what is left. Nothing else may be written to the stream before.
  void Finish() {
    {
      const std::lock_guard lock(mutex_);
      finished_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void Run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return finished_ || latest_.has_value(); });
      if (!latest_) return;
      const Message message = *std::exchange(latest_, std::nullopt);
      lock.unlock();
      if (!writer_.Write(message)) watch_.RequestStop();
      lock.lock();
    }
  }

  grpc::ServerWriter<Message>& writer_;
  CancellationWatch& watch_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Message> latest_;
  bool finished_ = false;
  std::thread thread_;
};

/// Reads a header and the chunks behind it.
template <class Request, class Header>
Status ReadUpload(ServerShared& shared, grpc::ServerReader<Request>& reader, Header& header,
                  std::string& file) {
  Request request;
  if (!reader.Read(&request) || !request.has_header()) {
    return InvalidArgument("the first message of an upload must hold the header", "header");
  }
  header = request.header();
  while (reader.Read(&request)) {
    if (!request.has_chunk()) {
      return InvalidArgument("a message after the header must hold a chunk", "chunk");
    }
    const std::string& data = request.chunk().data();
    if (file.size() + data.size() > shared.options().max_file_bytes) {
      return Error{ErrorCode::kResourceExhausted,
                   "the file is over " + std::to_string(shared.options().max_file_bytes) +
                       " bytes, the most that this server takes",
                   "chunk"};
    }
    file += data;
  }
  return {};
}

/// Sends `file` as messages with a chunk each (one, if it is empty).
template <class Response>
Status WriteDownload(grpc::ServerWriter<Response>& writer, std::string_view file) {
  constexpr std::size_t kChunk = std::size_t{256} << 10;
  Response response;
  std::size_t sent = 0;
  do {
    response.mutable_chunk()->set_data(std::string(file.substr(sent, kChunk)));
    if (!writer.Write(response)) return Error{ErrorCode::kCancelled, "the caller went away"};
    sent += kChunk;
  } while (sent < file.size());
  return {};
}

std::unique_ptr<grpc::Service> MakeTrialService(ServerShared& shared, api::TrialApi& trials);
std::unique_ptr<grpc::Service> MakeSkillService(ServerShared& shared, api::SkillApi& skills);
std::unique_ptr<grpc::Service> MakeExecutorService(ServerShared& shared,
                                                   api::ExecutorApi& executor);
std::unique_ptr<grpc::Service> MakeRecorderService(ServerShared& shared,
                                                   api::RecorderApi& recorder);
std::unique_ptr<grpc::Service> MakeLearningDataService(ServerShared& shared, api::DataApi& data);
std::unique_ptr<grpc::Service> MakeRecorderDataService(ServerShared& shared, api::DataApi& data);
std::unique_ptr<grpc::Service> MakeTopicService(ServerShared& shared, api::TopicApi& topics);

}  // namespace exemplar::rpc
