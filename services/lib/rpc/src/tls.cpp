#include "tls.hpp"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "exemplar/base/text.hpp"
#include "exemplar/security/certificate.hpp"

namespace exemplar::rpc {
namespace {

using grpc::experimental::FileWatcherCertificateProvider;

constexpr unsigned kSecondsBetweenLooks = 30;

Error WithField(Error error, std::string field) {
  error.message.insert(0, "--" + field + ": ");
  error.field = std::move(field);
  return error;
}

Status CheckPair(const std::string& certificate, const std::string& key) {
  if (certificate.empty() != key.empty()) {
    return InvalidArgument("--tls-cert and --tls-key must be given together", "tls-cert");
  }
  if (certificate.empty()) return {};
  if (const Status checked = security::CheckKeyPair(certificate, key); !checked) {
    return WithField(checked.error(), "tls-cert");
  }
  return {};
}

Result<std::string> ReadToken(const std::string& token) {
  if (!token.starts_with('@')) return token;
  const std::string file = token.substr(1);
  std::ifstream in(file);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in.is_open() || in.bad()) {
    return InvalidArgument("--token: " + file + " cannot be read", "token");
  }
  return std::string(Trim(text));
}

}  // namespace

bool IsLoopback(std::string_view host) {
  return host == "localhost" || host.starts_with("127.") || host == "::1" || host == "[::1]" ||
         host.starts_with("unix:") || host == "unix";
}

Status CheckListening(const std::string& host, const security::ServerCredentials& credentials) {
  if (IsLoopback(host) || credentials.insecure_listen) return {};
  const bool encrypted = !credentials.certificate.empty();
  const bool callers_known = !credentials.client_ca.empty() || !credentials.access.empty();
  if (encrypted && callers_known) return {};
  const std::string missing =
      encrypted ? "anybody could call. Give --tls-client-ca or --access"
                : "calls would cross the network in plain text. Give --tls-cert and --tls-key "
                  "with --tls-client-ca or --access (`exemplar security init` makes them)";
  return FailedPrecondition("will not listen on " + host + ", beyond this machine: " + missing +
                                ", or --insecure-listen on a network that you trust",
                            "listen");
}

Result<std::shared_ptr<grpc::ServerCredentials>> MakeServerCredentials(
    const security::ServerCredentials& credentials) {
  const std::string& ca = credentials.client_ca;
  if (Status pair = CheckPair(credentials.certificate, credentials.key); !pair) return pair.error();
  if (credentials.certificate.empty()) {
    if (ca.empty()) return grpc::InsecureServerCredentials();
    return InvalidArgument("--tls-client-ca needs --tls-cert and --tls-key", "tls-client-ca");
  }
  if (!ca.empty()) {
    if (const Status checked = security::CheckAuthorities(ca); !checked) {
      return WithField(checked.error(), "tls-client-ca");
    }
  }
  const auto files = ca.empty()
                         ? std::make_shared<FileWatcherCertificateProvider>(
                               credentials.key, credentials.certificate, kSecondsBetweenLooks)
                         : std::make_shared<FileWatcherCertificateProvider>(
                               credentials.key, credentials.certificate, ca, kSecondsBetweenLooks);
  grpc::experimental::TlsServerCredentialsOptions options(files);
  options.watch_identity_key_cert_pairs();
  if (!ca.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(options);
}

Result<ChannelSecurity> MakeChannelSecurity(const std::string& host,
                                            const security::ClientCredentials& credentials) {
  Result<std::string> token = ReadToken(credentials.token);
  if (!token) return token.error();
  if (Status pair = CheckPair(credentials.certificate, credentials.key); !pair) return pair.error();
  if (credentials.ca.empty()) {
    if (!credentials.certificate.empty()) {
      return InvalidArgument("--tls-cert needs --tls-ca, the CA of the server", "tls-ca");
    }
    if (!token->empty() && !IsLoopback(host)) {
      return FailedPrecondition(
          "the token would cross the network to " + host + " in plain text; give --tls-ca",
          "tls-ca");
    }
    return ChannelSecurity{grpc::InsecureChannelCredentials(), *token};
  }
  if (const Status checked = security::CheckAuthorities(credentials.ca); !checked) {
    return WithField(checked.error(), "tls-ca");
  }
  const auto files = std::make_shared<FileWatcherCertificateProvider>(
      credentials.key, credentials.certificate, credentials.ca, kSecondsBetweenLooks);
  grpc::experimental::TlsChannelCredentialsOptions options;
  options.set_certificate_provider(files);
  options.watch_root_certs();
  if (!credentials.certificate.empty()) options.watch_identity_key_cert_pairs();
  return ChannelSecurity{grpc::experimental::TlsCredentials(options), *token};
}

}  // namespace exemplar::rpc
