#include "exemplar/security/certificate.hpp"

#include <arpa/inet.h>
#include <openssl/pem.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <fstream>
#include <sstream>

#include "exemplar/security/digest.hpp"
#include "openssl_parts.hpp"

namespace exemplar::security {
namespace {

constexpr long kX509Version3 = 2;

Result<std::string> ReadText(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in.is_open() || in.bad()) return InvalidArgument(file.string() + " cannot be read");
  return std::move(text).str();
}

std::string PemOf(X509& certificate) {
  const BioPtr bio = WriteBio();
  PEM_write_bio_X509(bio.get(), &certificate);
  return TextOf(bio.get());
}

std::string PemOf(EVP_PKEY& key) {
  const BioPtr bio = WriteBio();
  PEM_write_bio_PrivateKey(bio.get(), &key, nullptr, nullptr, 0, nullptr, nullptr);
  return TextOf(bio.get());
}

std::string SerialOf(const ASN1_INTEGER* serial) {
  const BioPtr bio = WriteBio();
  i2a_ASN1_INTEGER(bio.get(), serial);
  return TextOf(bio.get());
}

Stamp ToStamp(const ASN1_TIME* time) {
  std::tm parts{};
  ASN1_TIME_to_tm(time, &parts);
  return Stamp::FromNanoseconds(std::int64_t{timegm(&parts)} * 1'000'000'000);
}

Status SetName(X509& certificate, const std::string& organisation, const std::string& name) {
  X509_NAME* subject = X509_get_subject_name(&certificate);
  for (const auto& [kind, text] : {std::pair{"O", &organisation}, std::pair{"CN", &name}}) {
    if (X509_NAME_add_entry_by_txt(subject, kind, MBSTRING_UTF8,
                                   reinterpret_cast<const unsigned char*>(text->c_str()), -1, -1,
                                   0) != 1) {
      return OpenSslError(std::string(kind) + " \"" + *text + "\" cannot stand in a certificate");
    }
  }
  return {};
}

Status AddExtension(X509& certificate, X509& issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, &issuer, &certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  if (extension == nullptr) return OpenSslError("extension \"" + value + '"');
  X509_add_ext(&certificate, extension, -1);
  X509_EXTENSION_free(extension);
  return {};
}

bool IsAddress(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> address{};
  return inet_pton(AF_INET, host.c_str(), address.data()) == 1 ||
         inet_pton(AF_INET6, host.c_str(), address.data()) == 1;
}

Result<std::string> AlternativeNames(const std::vector<std::string>& hosts) {
  std::string names;
  for (const std::string& host : hosts) {
    // A comma would begin another name.
    if (host.empty() || host.size() > 253 || host.find_first_of(", ;=\n") != std::string::npos) {
      return InvalidArgument("\"" + host + "\" is no host name or IP address", "host");
    }
    if (!names.empty()) names += ',';
    names += (IsAddress(host) ? "IP:" : "DNS:") + host;
  }
  return names;
}

/// What both kinds of certificate have: a new key, a serial number of 126 random bits, the times.
struct Draft {
  CertificatePtr certificate;
  KeyPtr key;
};
Result<Draft> Begin(const std::string& organisation, const std::string& name, Validity validity) {
  Draft draft{CertificatePtr(X509_new()), KeyPtr(EVP_EC_gen("P-256"))};
  if (!draft.certificate || !draft.key) return OpenSslError("no key can be made");
  X509& certificate = *draft.certificate;
  X509_set_version(&certificate, kX509Version3);
  BIGNUM* number = BN_new();
  BN_rand(number, 126, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY);
  BN_to_ASN1_INTEGER(number, X509_get_serialNumber(&certificate));
  BN_free(number);
  X509_set1_notBefore(&certificate, ToAsn1(validity.from).get());
  X509_set1_notAfter(&certificate, ToAsn1(validity.to).get());
  X509_set_pubkey(&certificate, draft.key.get());
  if (Status named = SetName(certificate, organisation, name); !named) return named.error();
  return draft;
}

struct ParsedPair {
  CertificatePtr certificate;
  KeyPtr key;
};
Result<ParsedPair> Parse(const KeyPair& authority) {
  ParsedPair parsed{ParseCertificate(authority.certificate), ParseKey(authority.key)};
  if (!parsed.certificate || !parsed.key) return OpenSslError("the authority cannot be read");
  return parsed;
}

}  // namespace

Result<CertificateFacts> ReadCertificate(const std::string& pem, const std::string& place) {
  const CertificatePtr certificate = ParseCertificate(pem);
  if (!certificate) return OpenSslError(place + " holds no PEM certificate");
  CertificateFacts facts;
  X509_NAME* subject = X509_get_subject_name(certificate.get());
  std::array<char, 256> name{};
  if (X509_NAME_get_text_by_NID(subject, NID_commonName, name.data(), name.size()) > 0) {
    facts.common_name = name.data();
  }
  const BioPtr text = WriteBio();
  X509_NAME_print_ex(text.get(), subject, 0, XN_FLAG_RFC2253);
  facts.subject = TextOf(text.get());
  facts.serial = SerialOf(X509_get0_serialNumber(certificate.get()));
  unsigned char* der = nullptr;
  const int size = i2d_X509(certificate.get(), &der);
  if (size > 0) {
    facts.sha256 = Sha256Hex({reinterpret_cast<const char*>(der), static_cast<std::size_t>(size)});
  }
  OPENSSL_free(der);
  facts.not_before = ToStamp(X509_get0_notBefore(certificate.get()));
  facts.not_after = ToStamp(X509_get0_notAfter(certificate.get()));
  facts.is_ca = X509_check_ca(certificate.get()) == 1;
  return facts;
}

Status CheckKeyPair(const std::filesystem::path& certificate, const std::filesystem::path& key) {
  const Result<std::string> certificate_text = ReadText(certificate);
  if (!certificate_text) return certificate_text.error();
  const Result<std::string> key_text = ReadText(key);
  if (!key_text) return key_text.error();
  const CertificatePtr parsed = ParseCertificate(*certificate_text);
  if (!parsed) return OpenSslError(certificate.string() + " holds no PEM certificate");
  const KeyPtr parsed_key = ParseKey(*key_text);
  if (!parsed_key) return OpenSslError(key.string() + " holds no PEM key without passphrase");
  if (X509_check_private_key(parsed.get(), parsed_key.get()) != 1) {
    return OpenSslError(key.string() + " is not the key of " + certificate.string());
  }
  return {};
}

Status CheckAuthorities(const std::filesystem::path& file) {
  const Result<std::string> text = ReadText(file);
  if (!text) return text.error();
  if (!ParseCertificate(*text)) return OpenSslError(file.string() + " holds no PEM certificate");
  return {};
}

Result<KeyPair> MakeAuthority(const std::string& organisation, const std::string& name,
                              Validity validity) {
  Result<Draft> draft = Begin(organisation, name, validity);
  if (!draft) return draft.error();
  X509& certificate = *draft->certificate;
  X509_set_issuer_name(&certificate, X509_get_subject_name(&certificate));
  for (const auto& [kind, value] :
       {std::pair{NID_basic_constraints, "critical,CA:TRUE,pathlen:0"},
        std::pair{NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature"},
        std::pair{NID_subject_key_identifier, "hash"}}) {
    if (Status added = AddExtension(certificate, certificate, kind, value); !added) {
      return added.error();
    }
  }
  if (X509_sign(&certificate, draft->key.get(), EVP_sha256()) == 0) {
    return OpenSslError("the authority cannot sign");
  }
  return KeyPair{PemOf(certificate), PemOf(*draft->key)};
}

Result<KeyPair> IssueCertificate(const KeyPair& authority, const Subject& subject,
                                 Validity validity) {
  const Result<ParsedPair> issuer = Parse(authority);
  if (!issuer) return issuer.error();
  Result<Draft> draft = Begin(subject.organisation, subject.name, validity);
  if (!draft) return draft.error();
  X509& certificate = *draft->certificate;
  X509_set_issuer_name(&certificate, X509_get_subject_name(issuer->certificate.get()));
  const Result<std::string> hosts = AlternativeNames(subject.hosts);
  if (!hosts) return hosts.error();
  std::vector<std::pair<int, std::string>> extensions = {
      {NID_basic_constraints, "critical,CA:FALSE"},
      {NID_key_usage, "critical,digitalSignature,keyAgreement"},
      {NID_ext_key_usage, "serverAuth,clientAuth"},
      {NID_subject_key_identifier, "hash"},
      {NID_authority_key_identifier, "keyid"}};
  if (!hosts->empty()) extensions.emplace_back(NID_subject_alt_name, *hosts);
  for (const auto& [kind, value] : extensions) {
    const Status added = AddExtension(certificate, *issuer->certificate, kind, value);
    if (!added) return added.error();
  }
  if (X509_sign(&certificate, issuer->key.get(), EVP_sha256()) == 0) {
    return OpenSslError("the authority cannot sign");
  }
  return KeyPair{PemOf(certificate), PemOf(*draft->key)};
}

Result<std::string> SignDocument(const KeyPair& authority, const std::string& text) {
  const Result<ParsedPair> signer = Parse(authority);
  if (!signer) return signer.error();
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  BioPtr data = ReadBio(text);
  const Pkcs7Ptr signature(
      PKCS7_sign(signer->certificate.get(), signer->key.get(), nullptr, data.get(), kFlags));
  if (!signature) return OpenSslError("the document cannot be signed");
  const BioPtr out = WriteBio();
  if (SMIME_write_PKCS7(out.get(), signature.get(), data.get(), kFlags) != 1) {
    return OpenSslError("the document cannot be signed");
  }
  return TextOf(out.get());
}

Result<std::string> VerifyDocument(const std::string& authority_certificate,
                                   const std::string& document) {
  const CertificatePtr authority = ParseCertificate(authority_certificate);
  if (!authority) return OpenSslError("the authority cannot be read");
  const BioPtr in = ReadBio(document);
  BIO* content_place = nullptr;
  const Pkcs7Ptr signature(SMIME_read_PKCS7(in.get(), &content_place));
  const BioPtr content(content_place);
  if (!signature) return OpenSslError("the document is no S/MIME");
  const StorePtr store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority.get());
  X509_STORE_set_purpose(store.get(), X509_PURPOSE_ANY);
  const BioPtr out = WriteBio();
  if (PKCS7_verify(signature.get(), nullptr, store.get(), content.get(), out.get(), PKCS7_TEXT) !=
      1) {
    return OpenSslError("the document is not signed by this authority");
  }
  return TextOf(out.get());
}

Result<std::string> MakeRevocationList(const KeyPair& authority,
                                       const std::vector<Revoked>& revoked, Validity validity) {
  const Result<ParsedPair> issuer = Parse(authority);
  if (!issuer) return issuer.error();
  const CrlPtr list(X509_CRL_new());
  X509_CRL_set_version(list.get(), 1);
  X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(issuer->certificate.get()));
  X509_CRL_set1_lastUpdate(list.get(), ToAsn1(validity.from).get());
  X509_CRL_set1_nextUpdate(list.get(), ToAsn1(validity.to).get());
  for (const Revoked& each : revoked) {
    BIGNUM* number = nullptr;
    if (BN_hex2bn(&number, each.serial.c_str()) == 0) {
      return InvalidArgument("\"" + each.serial + "\" is no serial number");
    }
    ASN1_INTEGER* serial = BN_to_ASN1_INTEGER(number, nullptr);
    BN_free(number);
    X509_REVOKED* entry = X509_REVOKED_new();
    X509_REVOKED_set_serialNumber(entry, serial);
    X509_REVOKED_set_revocationDate(entry, ToAsn1(each.when).get());
    ASN1_INTEGER_free(serial);
    X509_CRL_add0_revoked(list.get(), entry);
  }
  X509_CRL_sort(list.get());
  if (X509_CRL_sign(list.get(), issuer->key.get(), EVP_sha256()) == 0) {
    return OpenSslError("the authority cannot sign");
  }
  const BioPtr bio = WriteBio();
  PEM_write_bio_X509_CRL(bio.get(), list.get());
  return TextOf(bio.get());
}

Result<std::vector<std::string>> ReadRevocationList(const std::string& pem,
                                                    const std::string& place) {
  const BioPtr bio = ReadBio(pem);
  const CrlPtr list(PEM_read_bio_X509_CRL(bio.get(), nullptr, nullptr, nullptr));
  if (list == nullptr) return OpenSslError(place + " holds no revocation list");
  std::vector<std::string> serials;
  STACK_OF(X509_REVOKED)* revoked = X509_CRL_get_REVOKED(list.get());
  // -1 where the list is empty.
  const int count = std::max(sk_X509_REVOKED_num(revoked), 0);
  serials.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    serials.push_back(SerialOf(X509_REVOKED_get0_serialNumber(sk_X509_REVOKED_value(revoked, i))));
  }
  std::sort(serials.begin(), serials.end());
  return serials;
}

}  // namespace exemplar::security
