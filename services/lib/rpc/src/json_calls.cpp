#include "json_calls.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include "call_status.hpp"
#include "json_message.hpp"
#include "open_api.hpp"

namespace exemplar::rpc {
namespace {

using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using grpc::StatusCode;

/// As google.rpc.Code has them.
int HttpStatusOf(StatusCode code) {
  switch (code) {
    case StatusCode::OK:
      return 200;
    case StatusCode::INVALID_ARGUMENT:
    case StatusCode::FAILED_PRECONDITION:
    case StatusCode::OUT_OF_RANGE:
      return 400;
    case StatusCode::UNAUTHENTICATED:
      return 401;
    case StatusCode::PERMISSION_DENIED:
      return 403;
    case StatusCode::NOT_FOUND:
      return 404;
    case StatusCode::ABORTED:
    case StatusCode::ALREADY_EXISTS:
      return 409;
    case StatusCode::RESOURCE_EXHAUSTED:
      return 429;
    case StatusCode::CANCELLED:
      return 499;
    case StatusCode::UNIMPLEMENTED:
      return 501;
    case StatusCode::UNAVAILABLE:
      return 503;
    case StatusCode::DEADLINE_EXCEEDED:
      return 504;
    default:
      return 500;
  }
}

api::JsonFailure FailureOf(const grpc::Status& status) {
  const Error error = FromGrpc(status, "the gateway");
  return {.http_status = HttpStatusOf(status.error_code()),
          .code = std::string(ToString(error.code)),
          .message = error.message,
          .field = error.field};
}

grpc::ByteBuffer ToBuffer(const Message& message) {
  const grpc::Slice slice(message.SerializeAsString());
  return {&slice, 1};
}

Status ToMessage(const grpc::ByteBuffer& buffer, Message& message) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return Internal("the answer cannot be read");
  std::string bytes;
  bytes.reserve(buffer.Length());
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  if (!message.ParseFromString(bytes)) return Internal("the answer is not of its type");
  return {};
}

/// The messages that a call sends.
Result<std::deque<grpc::ByteBuffer>> ReadRequests(const MethodDescriptor& method,
                                                  const api::JsonCall& call) {
  std::deque<grpc::ByteBuffer> requests;
  const auto read = [&](std::string_view json, int line) -> Status {
    const std::unique_ptr<Message> message = NewMessage(*method.input_type());
    if (json.find_first_not_of(" \t\r\n") != std::string_view::npos) {
      if (Status done = ReadJson(json, line, *message); !done) return done;
    }
    for (const auto& [path, value] : call.fields) {
      if (Status set = SetField(path, value, *message); !set) return set;
    }
    requests.push_back(ToBuffer(*message));
    return {};
  };
  if (!method.client_streaming()) {
    if (const Status done = read(call.body, 1); !done) return done.error();
    return requests;
  }
  std::string_view left = call.body;
  for (int line = 1; !left.empty(); ++line) {
    const std::size_t end = std::min(left.find('\n'), left.size());
    const std::string_view text = left.substr(0, end);
    left.remove_prefix(std::min(end + 1, left.size()));
    if (text.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    if (const Status done = read(text, line); !done) return done.error();
  }
  return requests;
}

/// One call, driven by the thread that makes it.
class Exchange {
 public:
  Exchange(const std::shared_ptr<grpc::Channel>& channel, const api::JsonCall& call,
           std::deque<grpc::ByteBuffer> requests)
      : requests_(std::move(requests)) {
    for (const auto& [name, value] : call.metadata) context_.AddMetadata(name, value);
    if (call.timeout > Duration::zero()) {
      context_.set_deadline(
          std::chrono::system_clock::now() +
          std::chrono::duration_cast<std::chrono::system_clock::duration>(call.timeout));
    }
    stream_ = grpc::GenericStub(channel).PrepareCall(&context_, "/" + call.method, &queue_);
  }
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;
  ~Exchange() {
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
    }
  }

  grpc::ClientContext& context() { return context_; }

  /// False from `on_answer` cancels the call.
  grpc::Status Run(const std::function<bool(const grpc::ByteBuffer&)>& on_answer) {
    stream_->StartCall(&started_);
    grpc::Status status;
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
      if (tag == &started_) {
        stream_->Read(&answer_, &read_);
        if (ok) Send();
      } else if (tag == &written_) {
        if (ok) Send();
      } else if (tag == &read_) {
        if (ok) {
          if (!on_answer(answer_)) context_.TryCancel();
          stream_->Read(&answer_, &read_);
        } else {
          stream_->Finish(&status, &finished_);
        }
      } else if (tag == &finished_) {
        break;
      }
    }
    return status;
  }

 private:
  void Send() {
    if (done_sending_) return;
    if (requests_.empty()) {
      done_sending_ = true;
      stream_->WritesDone(&written_);
      return;
    }
    stream_->Write(requests_.front(), &written_);
    requests_.pop_front();
  }

  std::deque<grpc::ByteBuffer> requests_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
  grpc::ByteBuffer answer_;
  bool done_sending_ = false;
  // Their addresses tell what came out of the queue.
  char started_ = 0;
  char written_ = 0;
  char read_ = 0;
  char finished_ = 0;
};

class Calls final : public api::JsonCalls {
 public:
  Calls(std::shared_ptr<grpc::Channel> channel, const std::vector<std::string>& services)
      : channel_(std::move(channel)) {
    const auto* pool = google::protobuf::DescriptorPool::generated_pool();
    for (const std::string& name : services) {
      const auto* service = pool->FindServiceByName(name);
      if (service == nullptr) continue;
      for (int i = 0; i < service->method_count(); ++i) {
        const MethodDescriptor& method = *service->method(i);
        methods_.push_back({.service = name,
                            .name = method.name(),
                            .client_streaming = method.client_streaming(),
                            .server_streaming = method.server_streaming(),
                            .read_only = method.options().idempotency_level() ==
                                         google::protobuf::MethodOptions::NO_SIDE_EFFECTS});
        by_name_[name + "/" + method.name()] = &method;
      }
    }
  }

  const std::vector<api::JsonMethod>& methods() const override { return methods_; }
  std::string OpenApi() const override { return OpenApiOf(methods_); }

  std::optional<api::JsonFailure> Call(
      const api::JsonCall& call, const std::function<bool(std::string&&)>& on_answer) override {
    const auto found = by_name_.find(call.method);
    if (found == by_name_.end()) {
      return FailureOf({StatusCode::NOT_FOUND, "there is no method " + call.method});
    }
    const MethodDescriptor& method = *found->second;
    Result<std::deque<grpc::ByteBuffer>> requests = ReadRequests(method, call);
    if (!requests) return FailureOf(ToGrpc(requests.error()));
    const std::unique_ptr<Message> message = NewMessage(*method.output_type());
    Status read;
    Exchange exchange(channel_, call, std::move(*requests));
    const std::stop_callback cancel(call.stop, [&exchange] { exchange.context().TryCancel(); });
    const grpc::Status status = exchange.Run([&](const grpc::ByteBuffer& answer) {
      message->Clear();
      read = ToMessage(answer, *message);
      if (!read) return false;
      Result<std::string> json = WriteJson(*message);
      if (!json) {
        read = json.error();
        return false;
      }
      return on_answer(std::move(*json));
    });
    if (!read) return FailureOf(ToGrpc(read));
    if (!status.ok()) return FailureOf(status);
    return std::nullopt;
  }

 private:
  const std::shared_ptr<grpc::Channel> channel_;
  std::vector<api::JsonMethod> methods_;
  std::map<std::string, const MethodDescriptor*> by_name_;
};

}  // namespace

std::unique_ptr<api::JsonCalls> MakeJsonCalls(std::shared_ptr<grpc::Channel> channel,
                                              const std::vector<std::string>& services) {
  return std::make_unique<Calls>(std::move(channel), services);
}

}  // namespace exemplar::rpc
