#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <boost/beast/ssl.hpp>

#include "http_connection.hpp"

namespace exemplar::http {
namespace {

using TlsStream = boost::beast::ssl_stream<boost::beast::tcp_stream>;

/// "CN=alice,O=Lab", the last part first; empty without a certificate.
std::string SubjectOf(SSL* ssl) {
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(SSL_get1_peer_certificate(ssl),
                                                                &X509_free);
  if (!certificate) return {};
  const std::unique_ptr<BIO, decltype(&BIO_free)> text(BIO_new(BIO_s_mem()), &BIO_free);
  X509_NAME_print_ex(text.get(), X509_get_subject_name(certificate.get()), 0, XN_FLAG_RFC2253);
  char* data = nullptr;
  const long size = BIO_get_mem_data(text.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

class TlsHandshake final : public Connection, public std::enable_shared_from_this<TlsHandshake> {
 public:
  TlsHandshake(Core& core, boost::asio::ip::tcp::socket socket, std::unique_ptr<Admitted> admitted,
               TlsContext context)
      : core_(core),
        admitted_(std::move(admitted)),
        context_(std::move(context)),
        stream_(std::move(socket), *context_) {}

  void Start() {
    core_.connections[admitted_->id()] = weak_from_this();
    boost::beast::get_lowest_layer(stream_).expires_after(core_.options.limits.request_timeout);
    stream_.async_handshake(
        boost::asio::ssl::stream_base::server,
        [self = shared_from_this()](boost::system::error_code error) { self->OnDone(error); });
  }

  void Finish() override { Cut(); }
  void Cut() override { boost::beast::get_lowest_layer(stream_).close(); }

 private:
  void OnDone(boost::system::error_code error) {
    if (error) {
      ++core_.counters.tls_failures;
      return;
    }
    boost::beast::get_lowest_layer(stream_).expires_never();
    std::string subject = SubjectOf(stream_.native_handle());
    std::make_shared<HttpConnection<TlsStream>>(core_, std::move(stream_), std::move(admitted_),
                                                true, std::move(subject))
        ->Start();
  }

  Core& core_;
  std::unique_ptr<Admitted> admitted_;
  TlsContext context_;
  TlsStream stream_;
};

}  // namespace

void ServeTls(Core& core, boost::asio::ip::tcp::socket socket, std::unique_ptr<Admitted> admitted,
              TlsContext context) {
  std::make_shared<TlsHandshake>(core, std::move(socket), std::move(admitted), std::move(context))
      ->Start();
}

Result<TlsContext> MakeTlsContext(const TlsFiles& files) {
  namespace ssl = boost::asio::ssl;
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  SSL_CTX_set_min_proto_version(context->native_handle(), TLS1_2_VERSION);
  context->set_options(ssl::context::no_compression | ssl::context::single_dh_use);
  SSL_CTX_set_options(context->native_handle(), SSL_OP_NO_RENEGOTIATION);
  boost::system::error_code error;
  context->use_certificate_chain_file(files.certificate, error);
  if (error) {
    return InvalidArgument("TLS certificate " + files.certificate + ": " + error.message(),
                           "certificate");
  }
  context->use_private_key_file(files.key, ssl::context::pem, error);
  if (error) return InvalidArgument("TLS key " + files.key + ": " + error.message(), "key");
  if (SSL_CTX_check_private_key(context->native_handle()) != 1) {
    return InvalidArgument(
        "TLS key " + files.key + " is not of the certificate " + files.certificate, "key");
  }
  if (files.client_ca.empty()) {
    if (!files.require_client) return context;
    return InvalidArgument("clients' certificates are asked for without a CA to check them by",
                           "client_ca");
  }
  context->load_verify_file(files.client_ca, error);
  if (error) {
    return InvalidArgument("TLS client CA " + files.client_ca + ": " + error.message(),
                           "client_ca");
  }
  context->set_verify_mode(ssl::verify_peer |
                           (files.require_client ? ssl::verify_fail_if_no_peer_cert : 0));
  return context;
}

}  // namespace exemplar::http
