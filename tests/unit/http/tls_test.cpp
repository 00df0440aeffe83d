// Real TLS on loopback, with certificates made here. The client is plain OpenSSL.

#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "../../support/eventually.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/http/server.hpp"
#include "exemplar/security/certificate.hpp"
#include "raw_client.hpp"

namespace exemplar::http {
namespace {

using exemplar::testing::Eventually;
using std::chrono::milliseconds;
using testing::RawClient;

template <class Part, void (*Free)(Part*)>
struct Freed {
  void operator()(Part* part) const { Free(part); }
};
using Context = std::unique_ptr<SSL_CTX, Freed<SSL_CTX, SSL_CTX_free>>;
using Connection = std::unique_ptr<SSL, Freed<SSL, SSL_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509, X509_free>>;

class TlsClient {
 public:
  struct Identity {
    std::string certificate;
    std::string key;
  };
  /// Believes what `authority` (a file) signed.
  TlsClient(int port, const std::string& authority, const Identity& identity = {},
            int newest = TLS1_3_VERSION)
      : tcp_(port), context_(SSL_CTX_new(TLS_client_method())) {
    SSL_CTX_set_verify(context_.get(), SSL_VERIFY_PEER, nullptr);
    SSL_CTX_load_verify_locations(context_.get(), authority.c_str(), nullptr);
    SSL_CTX_set_max_proto_version(context_.get(), newest);
    // So that an old version fails for the server's sake, not for the client's own caution.
    SSL_CTX_set_security_level(context_.get(), 0);
    if (!identity.certificate.empty()) {
      SSL_CTX_use_certificate_chain_file(context_.get(), identity.certificate.c_str());
      SSL_CTX_use_PrivateKey_file(context_.get(), identity.key.c_str(), SSL_FILETYPE_PEM);
    }
    connection_.reset(SSL_new(context_.get()));
    SSL_set_fd(connection_.get(), tcp_.fd());
    connected_ = SSL_connect(connection_.get()) == 1;
  }

  /// What a GET of `path` answers, head and all; empty where the server says nothing.
  std::string Get(const std::string& path) {
    if (!connected_) return {};
    const std::string request = "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
    SSL_write(connection_.get(), request.data(), static_cast<int>(request.size()));
    std::string answer(4096, '\0');
    const int size = SSL_read(connection_.get(), answer.data(), static_cast<int>(answer.size()));
    answer.resize(static_cast<std::size_t>(std::max(0, size)));
    return answer;
  }
  bool connected() const { return connected_; }
  /// The common name that the server proves.
  std::string server() const {
    const Certificate certificate(SSL_get1_peer_certificate(connection_.get()));
    if (!certificate) return {};
    char name[100] = {};
    X509_NAME_get_text_by_NID(X509_get_subject_name(certificate.get()), NID_commonName, name,
                              sizeof name);
    return name;
  }

 private:
  RawClient tcp_;
  Context context_;
  Connection connection_;
  bool connected_ = false;
};

class TlsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "exemplar-tls-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    const Stamp now = SystemClock().Now();
    validity_ = {now - std::chrono::hours(2), now + std::chrono::hours(2)};
    authority_ = *security::MakeAuthority("lab", "lab CA", validity_);
    Write("ca.pem", authority_.certificate);
    Issue("server", authority_, "gateway");
  }
  void TearDown() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
  }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  void Issue(const std::string& file, const security::KeyPair& authority,
             const std::string& name) const {
    const auto pair = security::IssueCertificate(
        authority, {.organisation = "lab", .name = name, .hosts = {"127.0.0.1"}}, validity_);
    ASSERT_TRUE(pair.ok()) << pair.error().message;
    Write(file + ".pem", pair->certificate);
    Write(file + ".key", pair->key);
  }
  TlsFiles Files() const {
    return {.certificate = Path("server.pem"), .key = Path("server.key"), .refresh = Duration(0)};
  }
  TlsFiles FilesThatAskForClients() const {
    TlsFiles files = Files();
    files.client_ca = Path("ca.pem");
    files.require_client = true;
    return files;
  }

  void Make(TlsFiles files, Limits limits = {}) {
    auto made = Server::Create({.limits = limits, .tls = std::move(files)}, log_);
    ASSERT_TRUE(made.ok()) << made.error().message;
    server_ = std::move(*made);
    ASSERT_TRUE(server_
                    ->Route(Method::kGet, "/who",
                            [](const Request& request) {
                              return Answer((request.tls ? "tls " : "plain ") +
                                            request.certificate_subject);
                            })
                    .ok());
    server_->Start();
  }
  int port() const { return server_->port(); }
  bool Serves() const {
    return TlsClient(port(), Path("ca.pem")).Get("/who").ends_with("\r\n\r\ntls ");
  }

  NullLog log_;
  std::filesystem::path folder_;
  security::Validity validity_;
  security::KeyPair authority_;
  std::unique_ptr<Server> server_;
};

TEST_F(TlsTest, AnswersWhoBelievesItsAuthority) {
  Make(Files());
  TlsClient client(port(), Path("ca.pem"));
  EXPECT_TRUE(client.Get("/who").ends_with("\r\n\r\ntls "));
  EXPECT_EQ(client.server(), "gateway");
  const auto other = security::MakeAuthority("lab", "other CA", validity_);
  ASSERT_TRUE(other.ok());
  Write("other.pem", other->certificate);
  EXPECT_FALSE(TlsClient(port(), Path("other.pem")).connected());
  EXPECT_TRUE(Serves());
}

TEST_F(TlsTest, TellsWhoTheClientIsAndRefusesWhoCannotProveIt) {
  Make(FilesThatAskForClients());
  Issue("anna", authority_, "anna");
  TlsClient anna(port(), Path("ca.pem"), {Path("anna.pem"), Path("anna.key")});
  EXPECT_TRUE(anna.Get("/who").ends_with("tls CN=anna,O=lab"));

  TlsClient nobody(port(), Path("ca.pem"));
  EXPECT_EQ(nobody.Get("/who"), "");
  const auto other = security::MakeAuthority("lab", "other CA", validity_);
  ASSERT_TRUE(other.ok());
  Issue("stranger", *other, "anna");
  TlsClient stranger(port(), Path("ca.pem"), {Path("stranger.pem"), Path("stranger.key")});
  EXPECT_EQ(stranger.Get("/who"), "");
  EXPECT_TRUE(Eventually([&] { return server_->counters().tls_failures == 2; }));
  EXPECT_TRUE(anna.Get("/who").ends_with("tls CN=anna,O=lab"));
}

TEST_F(TlsTest, RefusesPlainTextAndOldProtocolsAndCountsThem) {
  Make(Files());
  RawClient plain(port());
  plain.Send("GET /who HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  EXPECT_EQ(plain.ReadAll().find("HTTP/1.1 200"), std::string::npos);
  EXPECT_FALSE(TlsClient(port(), Path("ca.pem"), {}, TLS1_1_VERSION).connected());
  EXPECT_TRUE(Eventually([&] { return server_->counters().tls_failures == 2; }));
  EXPECT_TRUE(TlsClient(port(), Path("ca.pem"), {}, TLS1_2_VERSION).connected());
  EXPECT_EQ(server_->counters().requests, 0U);
}

TEST_F(TlsTest, CutsAHandshakeThatDoesNotGoOn) {
  Limits limits;
  limits.request_timeout = milliseconds(100);
  Make(Files(), limits);
  RawClient silent(port());
  RawClient half(port());
  half.Send("\x16\x03\x01");
  EXPECT_TRUE(silent.Closed());
  EXPECT_TRUE(half.Closed());
  EXPECT_TRUE(Eventually([&] { return server_->counters().tls_failures == 2; }));
  EXPECT_TRUE(Eventually([&] { return server_->connections() == 0; }));
  // Once a whole request is made in so short a time.
  EXPECT_TRUE(Eventually([&] { return Serves(); }));
}

TEST_F(TlsTest, TakesNewFilesForNewConnectionsWhileTheOldGoOn) {
  Make(Files());
  TlsClient before(port(), Path("ca.pem"));
  EXPECT_EQ(before.server(), "gateway");
  Issue("server", authority_, "renewed");
  ASSERT_TRUE(server_->ReloadTls().ok());
  EXPECT_EQ(TlsClient(port(), Path("ca.pem")).server(), "renewed");
  EXPECT_TRUE(before.Get("/who").ends_with("tls "));
}

TEST_F(TlsTest, KeepsTheOldFilesWhenTheNewOnesAreOfNoUse) {
  Make(Files());
  Issue("other", authority_, "other");
  std::filesystem::copy_file(Path("other.key"), Path("server.key"),
                             std::filesystem::copy_options::overwrite_existing);
  const Status reloaded = server_->ReloadTls();
  ASSERT_FALSE(reloaded.ok());
  EXPECT_NE(reloaded.error().message.find("server.key"), std::string::npos);
  EXPECT_EQ(TlsClient(port(), Path("ca.pem")).server(), "gateway");
}

TEST_F(TlsTest, ReadsItsFilesAgainByItself) {
  TlsFiles files = Files();
  files.refresh = milliseconds(5);
  Make(files);
  Issue("server", authority_, "renewed");
  EXPECT_TRUE(Eventually([&] { return TlsClient(port(), Path("ca.pem")).server() == "renewed"; }));
}

TEST_F(TlsTest, NamesFilesThatItCannotUse) {
  const auto refused = [this](TlsFiles files) {
    const auto made = Server::Create({.tls = std::move(files)}, log_);
    return made.ok() ? Error{} : made.error();
  };
  TlsFiles files = Files();
  files.certificate = Path("none.pem");
  EXPECT_EQ(refused(files).field, "certificate");
  Issue("other", authority_, "other");
  files = Files();
  files.key = Path("other.key");
  EXPECT_EQ(refused(files).field, "key");
  files = Files();
  files.require_client = true;
  EXPECT_EQ(refused(files).field, "client_ca");
  files.client_ca = Path("server.key");
  EXPECT_EQ(refused(files).field, "client_ca");
}

TEST_F(TlsTest, ReloadsNothingWithoutTls) {
  auto plain = Server::Create({}, log_);
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ((*plain)->ReloadTls().error().code, ErrorCode::kFailedPrecondition);
}

}  // namespace
}  // namespace exemplar::http
