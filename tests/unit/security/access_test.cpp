#include "exemplar/security/access.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exemplar/security/digest.hpp"
#include "exemplar/security/rate_limit.hpp"

namespace exemplar::security {
namespace {

using testing::HasSubstr;

const Stamp kNow = *ParseTime("2026-11-22");

AccessList People() {
  return {
      .tokens = {{.name = "anna",
                  .sha256 = Sha256Hex("secret"),
                  .roles = {Role::kTeach},
                  .expires = *ParseTime("2026-11-23T08:00:00Z")}},
      .certificates = {{.name = "gateway", .roles = {Role::kObserve}, .speaks_for_others = true},
                       {.name = "robot", .sha256 = std::string(64, 'a'), .roles = {}}}};
}

std::string ErrorOf(const Presented& who, Stamp now = kNow) {
  const auto caller = Identify(People(), who, now);
  return caller ? "" : caller.error().message;
}

TEST(Roles, EveryRoleMayObserveAndTheAdministratorMayAll) {
  for (const Role role : kRoles) {
    const RoleSet set = {role};
    EXPECT_TRUE(set.Has(Role::kObserve));
    EXPECT_EQ(ParseRole(ToString(role)), role);
    for (const Role other : kRoles) {
      EXPECT_EQ(set.Has(other),
                other == role || other == Role::kObserve || role == Role::kAdminister);
    }
  }
  EXPECT_FALSE(RoleSet().Has(Role::kObserve));
  EXPECT_EQ(ToText({Role::kRecord}), "observe record");
}

TEST(Identify, KnowsTokensUntilTheyExpire) {
  const auto anna = Identify(People(), {.token = "secret"}, kNow);
  ASSERT_TRUE(anna.ok());
  EXPECT_EQ(anna->name, "anna");
  EXPECT_TRUE(anna->roles.Has(Role::kTeach));
  EXPECT_THAT(ErrorOf({.token = "secret"}, *ParseTime("2026-11-23T08:00:00Z")),
              HasSubstr("expired"));
  EXPECT_THAT(ErrorOf({.token = "Secret"}), HasSubstr("not known"));
  EXPECT_THAT(ErrorOf({}), HasSubstr("token"));
}

TEST(Identify, ATokenThatIsWrongIsNotSavedByACertificate) {
  EXPECT_THAT(ErrorOf({.token = "wrong", .certificate_name = "gateway"}), HasSubstr("not known"));
}

TEST(Identify, KnowsCertificatesByNameAndByDigestWhereItIsGiven) {
  EXPECT_EQ(Identify(People(), {.certificate_name = "gateway"}, kNow)->name, "gateway");
  EXPECT_THAT(ErrorOf({.certificate_name = "robot", .certificate_sha256 = "b"}),
              HasSubstr("no access"));
  const std::string digest(64, 'a');
  EXPECT_EQ(ErrorOf({.certificate_name = "robot", .certificate_sha256 = digest}), "");
}

TEST(Identify, OnlyThoseWhoMaySpeakForOthersDo) {
  const auto caller = Identify(People(), {.certificate_name = "gateway", .for_whom = "anna"}, kNow);
  ASSERT_TRUE(caller.ok());
  EXPECT_EQ(caller->name, "anna via gateway");
  EXPECT_TRUE(caller->roles.Has(Role::kTeach));
  EXPECT_THAT(ErrorOf({.token = "secret", .for_whom = "gateway"}), HasSubstr("may not speak"));
  EXPECT_THAT(ErrorOf({.certificate_name = "gateway", .for_whom = "nobody"}), HasSubstr("unknown"));
  EXPECT_THAT(
      ErrorOf({.certificate_name = "gateway", .for_whom = "anna"}, *ParseTime("2027-01-01")),
      HasSubstr("unknown"));
}

TEST(AccessList, IsReadAsItWasWritten) {
  const AccessList list = People();
  const auto read = ParseAccessList(ToYaml(list), "access.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(ToYaml(*read), ToYaml(list));
  ASSERT_EQ(read->tokens.size(), 1U);
  EXPECT_EQ(read->tokens[0].expires, list.tokens[0].expires);
  EXPECT_TRUE(read->certificates[0].speaks_for_others);
  EXPECT_TRUE(ParseAccessList("", "empty").ok());
}

TEST(AccessList, NamesTheLineOfWhatIsWrong) {
  const std::string hash(64, '0');
  for (const auto& [yaml, says] : std::vector<std::pair<std::string, std::string>>{
           {"tokens: 3", "a.yaml:1: must be a list"},
           {"token: []", "there is no key \"token\""},
           {"tokens:\n  - name: a b\n    sha256: " + hash, "a.yaml:2: name is \"a b\""},
           {"tokens:\n  - name: ben\n", "has no sha256"},
           {"tokens:\n  - name: ben\n    sha256: xyz", "a.yaml:3: sha256"},
           {"tokens:\n  - name: ben\n    sha256: " + hash + "\n    roles: [fly]",
            "a.yaml:4: \"fly\" is no role"},
           {"tokens:\n  - name: ben\n    sha256: " + hash + "\n    expires: soon",
            "expires is \"soon\""},
           {"tokens: [", "a.yaml:"}}) {
    const auto read = ParseAccessList(yaml, "a.yaml");
    ASSERT_FALSE(read.ok()) << yaml;
    EXPECT_THAT(read.error().message, HasSubstr(says));
  }
}

TEST(ParseTime, TakesDatesAndTimesThatExist) {
  EXPECT_EQ(ParseTime("1970-01-02")->nanoseconds(), 86'400'000'000'000);
  EXPECT_EQ(ToIso8601(*ParseTime("2026-02-28T23:59:58Z")).substr(0, 19), "2026-02-28T23:59:58");
  for (const char* wrong : {"", "2026-02-29", "2026-13-01", "2026-02-28T24:00:00Z", "2026-2-2",
                            "2026-02-28T23:59:58", "2026-02-28 23:59:58Z", "20x6-02-28"}) {
    EXPECT_FALSE(ParseTime(wrong)) << wrong;
  }
}

TEST(Digest, KnowsTheStandardsValues) {
  EXPECT_EQ(Sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  // RFC 4231, test case 2.
  EXPECT_EQ(HmacSha256Hex("Jefe", "what do ya want for nothing?"),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
  EXPECT_TRUE(EqualInConstantTime("ab", "ab"));
  EXPECT_FALSE(EqualInConstantTime("ab", "abc"));
  EXPECT_EQ(MakeToken().size(), 47U);
  EXPECT_NE(MakeToken(), MakeToken());
}

TEST(RateLimiter, LetsBurstsPassAndTheMeanAfterThem) {
  ManualClock clock;
  RateLimiter limiter(10, clock);
  int passed = 0;
  for (int i = 0; i < 100; ++i) passed += limiter.Allow("anna") ? 1 : 0;
  EXPECT_EQ(passed, 20);
  EXPECT_TRUE(limiter.Allow("ben"));
  clock.Advance(std::chrono::seconds(1));
  passed = 0;
  for (int i = 0; i < 100; ++i) passed += limiter.Allow("anna") ? 1 : 0;
  EXPECT_EQ(passed, 10);
}

TEST(RateLimiter, ForgetsThoseWhoAreQuietAndRefusesACrowdOfMadeUpNames) {
  ManualClock clock;
  RateLimiter limiter(1, clock);
  int passed = 0;
  for (int i = 0; i < 10'000; ++i) passed += limiter.Allow(std::to_string(i)) ? 1 : 0;
  EXPECT_EQ(passed, 4096);
  clock.Advance(std::chrono::seconds(2));
  EXPECT_TRUE(limiter.Allow("late"));
}

}  // namespace
}  // namespace exemplar::security
