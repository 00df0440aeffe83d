#pragma once
// gRPC's credentials from files.

#include <grpcpp/security/credentials.h>
#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>
#include <string_view>

#include "exemplar/base/result.hpp"
#include "exemplar/security/credentials.hpp"

namespace exemplar::rpc {

/// Errors unless a server with these credentials may listen on `host`.
Status CheckListening(const std::string& host, const security::ServerCredentials& credentials);

/// Files that change are read again within a minute. Errors name the option and the file.
Result<std::shared_ptr<grpc::ServerCredentials>> MakeServerCredentials(
    const security::ServerCredentials& credentials);

/// A client's credentials and token. Errors: files that cannot be read, a token that would cross a
/// network in plain text.
struct ChannelSecurity {
  std::shared_ptr<grpc::ChannelCredentials> credentials;
  std::string token;
};
Result<ChannelSecurity> MakeChannelSecurity(const std::string& host,
                                            const security::ClientCredentials& credentials);

/// Whether the address never leaves this machine.
bool IsLoopback(std::string_view host);

}  // namespace exemplar::rpc
