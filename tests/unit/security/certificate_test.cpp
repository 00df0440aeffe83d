#include "exemplar/security/certificate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exemplar/base/clock.hpp"

namespace exemplar::security {
namespace {

using testing::HasSubstr;

Validity Day() {
  const Stamp now = SystemClock().Now();
  return {now - std::chrono::hours(12), now + std::chrono::hours(12)};
}

TEST(Certificate, SaysWhatItWasIssuedFor) {
  const auto authority = MakeAuthority("lab", "lab authority", Day());
  ASSERT_TRUE(authority.ok()) << authority.error().message;
  EXPECT_TRUE(ReadCertificate(authority->certificate, "ca")->is_ca);
  const auto pair = IssueCertificate(
      *authority,
      {.organisation = "lab", .name = "executor", .hosts = {"robot.lab", "10.0.0.7", "::1"}},
      Day());
  ASSERT_TRUE(pair.ok()) << pair.error().message;
  const auto facts = ReadCertificate(pair->certificate, "cert");
  ASSERT_TRUE(facts.ok());
  EXPECT_EQ(facts->common_name, "executor");
  EXPECT_EQ(facts->subject, "CN=executor,O=lab");
  EXPECT_FALSE(facts->is_ca);
  EXPECT_EQ(facts->sha256.size(), 64U);
  EXPECT_LT(facts->not_before, facts->not_after);
  const auto other =
      IssueCertificate(*authority, {.organisation = "lab", .name = "executor"}, Day());
  EXPECT_NE(ReadCertificate(other->certificate, "cert")->serial, facts->serial);
}

TEST(Certificate, RefusesHostsThatWouldAddOthers) {
  const auto authority = MakeAuthority("lab", "lab authority", Day());
  for (const char* host : {"", "a,DNS:b", "a b", "a=b"}) {
    EXPECT_FALSE(
        IssueCertificate(*authority, {.organisation = "lab", .name = "x", .hosts = {host}}, Day())
            .ok())
        << host;
  }
}

TEST(Certificate, RefusesWhatIsNone) {
  EXPECT_THAT(ReadCertificate("nothing", "cert.pem").error().message,
              HasSubstr("cert.pem holds no PEM certificate"));
}

TEST(SignedDocument, IsReadBackAndNotWhenItWasChangedOrSignedByAnother) {
  const auto authority = MakeAuthority("lab", "lab authority", Day());
  const auto other = MakeAuthority("lab", "lab authority", Day());
  const auto document = SignDocument(*authority, "<dds>lab</dds>\n");
  ASSERT_TRUE(document.ok()) << document.error().message;
  EXPECT_THAT(*document, HasSubstr("multipart/signed"));
  const auto text = VerifyDocument(authority->certificate, *document);
  ASSERT_TRUE(text.ok()) << text.error().message;
  EXPECT_THAT(*text, HasSubstr("<dds>lab</dds>"));
  EXPECT_FALSE(VerifyDocument(other->certificate, *document).ok());
  std::string changed = *document;
  changed.replace(changed.find("lab"), 3, "bar");
  EXPECT_FALSE(VerifyDocument(authority->certificate, changed).ok());
  EXPECT_FALSE(VerifyDocument(authority->certificate, "no mail").ok());
}

TEST(RevocationList, IsMadeOfSerialNumbers) {
  const auto authority = MakeAuthority("lab", "lab authority", Day());
  const auto list = MakeRevocationList(*authority, {{"0A1B", SystemClock().Now()}}, Day());
  ASSERT_TRUE(list.ok()) << list.error().message;
  EXPECT_THAT(*list, HasSubstr("BEGIN X509 CRL"));
  EXPECT_FALSE(MakeRevocationList(*authority, {{"xyz", SystemClock().Now()}}, Day()).ok());
}

}  // namespace
}  // namespace exemplar::security
