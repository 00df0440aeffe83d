#pragma once
// A gRPC service put together by hand, for methods whose messages are not those of the .proto's
// generated code: a method may read or write grpc::ByteBuffer where its bytes are made elsewhere.

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/impl/rpc_service_method.h>
#include <grpcpp/impl/service_type.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/method_handler.h>
#include <grpcpp/support/sync_stream.h>

#include <functional>

namespace exemplar::rpc {

/// Base of `Self`, which adds each of its methods in its constructor. `name` is
/// "/package.Service/Method" and outlives the service.
template <class Self>
class MethodTable : public grpc::Service {
 protected:
  template <class Request, class Response>
  void Add(const char* name,
           grpc::Status (Self::*method)(grpc::ServerContext*, const Request*, Response*)) {
    Register<grpc::internal::RpcMethodHandler<Self, Request, Response>>(
        name, grpc::internal::RpcMethod::NORMAL_RPC, method);
  }
  template <class Request, class Response>
  void Add(const char* name, grpc::Status (Self::*method)(grpc::ServerContext*, const Request*,
                                                          grpc::ServerWriter<Response>*)) {
    Register<grpc::internal::ServerStreamingHandler<Self, Request, Response>>(
        name, grpc::internal::RpcMethod::SERVER_STREAMING, method);
  }
  template <class Request, class Response>
  void Add(const char* name,
           grpc::Status (Self::*method)(grpc::ServerContext*, grpc::ServerReader<Request>*,
                                        Response*)) {
    Register<grpc::internal::ClientStreamingHandler<Self, Request, Response>>(
        name, grpc::internal::RpcMethod::CLIENT_STREAMING, method);
  }
  template <class Request, class Response>
  void Add(const char* name,
           grpc::Status (Self::*method)(grpc::ServerContext*,
                                        grpc::ServerReaderWriter<Response, Request>*)) {
    Register<grpc::internal::BidiStreamingHandler<Self, Request, Response>>(
        name, grpc::internal::RpcMethod::BIDI_STREAMING, method);
  }

 private:
  template <class Handler, class Method>
  void Register(const char* name, grpc::internal::RpcMethod::RpcType type, Method method) {
    // gRPC takes ownership of both.
    AddMethod(new grpc::internal::RpcServiceMethod(
        name, type, new Handler(std::mem_fn(method), static_cast<Self*>(this))));
  }
};

}  // namespace exemplar::rpc
