#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include <string>
#include <vector>

#include "client_call.hpp"
#include "exemplar/rpc/health.hpp"

namespace exemplar::rpc {

Result<bool> AskHealth(const ClientOptions& options) {
  const Result<std::shared_ptr<Connection>> connection = Connection::Create(options);
  if (!connection) return connection.error();
  const std::unique_ptr<grpc::ClientContext> context =
      (*connection)->Begin(Connection::Length::kShort);
  grpc::CompletionQueue queue;
  grpc::GenericStub stub((*connection)->channel());
  // grpc.health.v1.HealthCheckRequest without a service's name has no bytes.
  const grpc::ByteBuffer request(nullptr, 0);
  const auto call =
      stub.PrepareUnaryCall(context.get(), "/grpc.health.v1.Health/Check", request, &queue);
  call->StartCall();
  grpc::ByteBuffer answer;
  grpc::Status status;
  call->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) return true;
  if (!status.ok()) return FromGrpc(status, options.server);
  std::vector<grpc::Slice> slices;
  std::string bytes;
  if (answer.Dump(&slices).ok()) {
    for (const grpc::Slice& slice : slices) {
      bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
  }
  // HealthCheckResponse: field 1, a number; 1 is SERVING.
  return bytes == "\x08\x01";
}

}  // namespace exemplar::rpc
