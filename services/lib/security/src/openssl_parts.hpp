#pragma once
// OpenSSL's objects with owners, and its errors as ours.

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <memory>
#include <string>
#include <string_view>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::security {

template <class T, void (*kFree)(T*)>
struct Deleter {
  void operator()(T* object) const { kFree(object); }
};
inline void FreeBio(BIO* bio) { BIO_free(bio); }
using BioPtr = std::unique_ptr<BIO, Deleter<BIO, FreeBio>>;
using KeyPtr = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY, EVP_PKEY_free>>;
using CertificatePtr = std::unique_ptr<X509, Deleter<X509, X509_free>>;
using NamePtr = std::unique_ptr<X509_NAME, Deleter<X509_NAME, X509_NAME_free>>;
using Pkcs7Ptr = std::unique_ptr<PKCS7, Deleter<PKCS7, PKCS7_free>>;
using StorePtr = std::unique_ptr<X509_STORE, Deleter<X509_STORE, X509_STORE_free>>;
using CrlPtr = std::unique_ptr<X509_CRL, Deleter<X509_CRL, X509_CRL_free>>;
using TimePtr = std::unique_ptr<ASN1_TIME, Deleter<ASN1_TIME, ASN1_TIME_free>>;

BioPtr ReadBio(std::string_view text);
BioPtr WriteBio();
std::string TextOf(BIO* bio);
/// "WHAT: what OpenSSL says last".
Error OpenSslError(const std::string& what);

CertificatePtr ParseCertificate(std::string_view pem);
KeyPtr ParseKey(std::string_view pem);
TimePtr ToAsn1(Stamp stamp);

}  // namespace exemplar::security
