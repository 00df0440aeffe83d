#include "openssl_parts.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>

#include <array>

namespace exemplar::security {

BioPtr ReadBio(std::string_view text) {
  return BioPtr(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

BioPtr WriteBio() { return BioPtr(BIO_new(BIO_s_mem())); }

std::string TextOf(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

Error OpenSslError(const std::string& what) {
  std::array<char, 256> text{};
  const unsigned long code = ERR_peek_last_error();
  ERR_error_string_n(code, text.data(), text.size());
  ERR_clear_error();
  return InvalidArgument(code == 0 ? what : what + ": " + text.data());
}

CertificatePtr ParseCertificate(std::string_view pem) {
  const BioPtr bio = ReadBio(pem);
  return CertificatePtr(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
}

KeyPtr ParseKey(std::string_view pem) {
  const BioPtr bio = ReadBio(pem);
  // Without a callback OpenSSL would ask the terminal for a passphrase.
  const auto no_passphrase = [](char*, int, int, void*) { return -1; };
  return KeyPtr(PEM_read_bio_PrivateKey(bio.get(), nullptr, no_passphrase, nullptr));
}

TimePtr ToAsn1(Stamp stamp) {
  return TimePtr(ASN1_TIME_set(nullptr, static_cast<time_t>(stamp.nanoseconds() / 1'000'000'000)));
}

}  // namespace exemplar::security
