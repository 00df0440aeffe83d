#pragma once
// X.509 certificates on prime256v1, as both TLS and DDS-Security take them (OpenSSL inside only).

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::security {

/// A certificate with its private key, both PEM.
struct KeyPair {
  std::string certificate;
  std::string key;
};

/// What a certificate says.
struct CertificateFacts {
  std::string common_name;
  std::string subject;  ///< as RFC 2253 writes it, last part first: "CN=executor,O=lab"
  std::string serial;   ///< hexadecimal
  std::string sha256;   ///< of its DER form, hexadecimal
  Stamp not_before;
  Stamp not_after;
  bool is_ca = false;
};

/// The first certificate of a PEM text. `place` names it in errors.
Result<CertificateFacts> ReadCertificate(const std::string& pem, const std::string& place);
/// Errors unless the files hold a certificate and the key that belongs to it.
Status CheckKeyPair(const std::filesystem::path& certificate, const std::filesystem::path& key);
/// Errors unless the file holds at least one certificate.
Status CheckAuthorities(const std::filesystem::path& file);

struct Validity {
  Stamp from;
  Stamp to;
};

/// A new key and a certificate that it signs itself, for signing others. `organisation` is the O of
/// the subject, `name` its CN.
Result<KeyPair> MakeAuthority(const std::string& organisation, const std::string& name,
                              Validity validity);

/// What an issued certificate is about.
struct Subject {
  std::string organisation;
  std::string name;
  /// Host names and IP addresses that it proves; for servers.
  std::vector<std::string> hosts = {};
};

/// A new key and its certificate, signed by `authority`: digital signatures, as server and client.
Result<KeyPair> IssueCertificate(const KeyPair& authority, const Subject& subject,
                                 Validity validity);

/// `text` with the authority's signature, as S/MIME multipart/signed: DDS-Security's form of
/// governance and permissions.
Result<std::string> SignDocument(const KeyPair& authority, const std::string& text);
/// The text of a document that `authority` (a certificate) signed; errors where it did not.
Result<std::string> VerifyDocument(const std::string& authority_certificate,
                                   const std::string& document);

/// One certificate that counts no more.
struct Revoked {
  std::string serial;  ///< as CertificateFacts has it
  Stamp when;
};

/// The revocation list of `authority`, PEM.
Result<std::string> MakeRevocationList(const KeyPair& authority,
                                       const std::vector<Revoked>& revoked, Validity validity);

/// The serial numbers on a revocation list, as CertificateFacts has them, sorted. `place` names the
/// list in errors.
Result<std::vector<std::string>> ReadRevocationList(const std::string& pem,
                                                    const std::string& place);

}  // namespace exemplar::security
