#include "exemplar/security/station.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "exemplar/base/clock.hpp"
#include "exemplar/security/access.hpp"
#include "exemplar/security/certificate.hpp"
#include "exemplar/security/dds_documents.hpp"
#include "exemplar/security/digest.hpp"
#include "exemplar/security/station_role.hpp"

namespace exemplar::security {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class StationTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "exemplar-station-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
    folder_ = root_ / "station";
    const Status made = InitStation({.folder = folder_, .station = "lab"}, now_);
    ASSERT_TRUE(made.ok()) << made.error().message;
  }
  void TearDown() override { fs::remove_all(root_); }

  fs::path Issue(const std::string& name, const std::string& role, double days = 10) {
    const auto member =
        IssueMember({.folder = folder_, .name = name, .role = role, .days = days}, now_);
    EXPECT_TRUE(member.ok()) << member.error().message;
    return *member;
  }
  static std::string Text(const fs::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  const Stamp now_ = SystemClock().Now();
  fs::path root_, folder_;
};

TEST_F(StationTest, MembersHaveWhatTheirRoleMayDoAndNoMore) {
  const fs::path executor = Issue("executor", "executor");
  EXPECT_TRUE(CheckMemberFolder(executor, "lab", now_).ok());
  const std::string granted = Text(FilesOf(executor).permissions);
  EXPECT_THAT(granted, HasSubstr("<topic>ircp/joint_command</topic>"));
  EXPECT_THAT(granted, HasSubstr("<subject_name>CN=executor,O=lab</subject_name>"));
  EXPECT_THAT(granted, HasSubstr("<partition>lab</partition>"));
  EXPECT_THAT(granted, HasSubstr("<default>DENY</default>"));
  EXPECT_FALSE(fs::exists(executor / "ca.key"));
}

TEST_F(StationTest, JointCommandsAreWrittenByTheExecutorsRoleAlone) {
  int writers = 0;
  for (const StationRole& role : StationRoles()) {
    for (const std::string_view topic : role.writes) {
      EXPECT_EQ(
          topic.find_first_of("*?[") == std::string_view::npos || topic == "ircp/capture_*/status",
          true)
          << "a pattern among what " << role.name
          << " writes might reach joint commands: " << topic;
      if (topic == "ircp/joint_command") {
        ++writers;
        EXPECT_EQ(role.name, "executor");
      }
    }
  }
  EXPECT_EQ(writers, 1);
}

/// "`ircp/suit` `ircp/clock`", or "none".
std::string Cell(const std::vector<std::string_view>& topics) {
  std::string text;
  for (const std::string_view topic : topics) {
    text += (text.empty() ? "`" : " `") + std::string(topic) + "`";
  }
  return text.empty() ? "none" : text;
}

TEST_F(StationTest, TheDocumentationSaysWhatEachRoleMayDo) {
  const std::string page = Text(fs::path(EXEMPLAR_SOURCE_DIR) / "docs/security.md");
  for (const StationRole& role : StationRoles()) {
    const std::string row = "| `" + std::string(role.name) + "` | " + Cell(role.writes) + " | " +
                            Cell(role.reads) + " | " + ToText(role.calls) + " |";
    EXPECT_THAT(page, HasSubstr(row));
  }
}

TEST_F(StationTest, SecretsAreReadableByTheirOwnerAlone) {
  const fs::path member = Issue("executor", "executor");
  for (const fs::path& file :
       {FilesOf(member).key, folder_ / "authority/ca.key", folder_ / "access.yaml"}) {
    struct stat state {};
    ASSERT_EQ(::stat(file.c_str(), &state), 0) << file;
    EXPECT_EQ(state.st_mode & 0777, 0600U) << file;
  }
}

TEST_F(StationTest, AnAuthorityIsNotMadeTwice) {
  const Status again = InitStation({.folder = folder_, .station = "lab"}, now_);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kAlreadyExists);
}

TEST_F(StationTest, RevokedMembersStandOnEveryListAndHaveNoAccess) {
  Issue("recorder", "recorder");
  const auto before = Text(folder_ / "members/recorder/crl.pem");
  Issue("gateway", "gateway");
  EXPECT_THAT(Text(folder_ / "access.yaml"), HasSubstr("name: gateway"));
  const Status revoked = RevokeMember(folder_, "gateway", now_);
  ASSERT_TRUE(revoked.ok()) << revoked.error().message;
  EXPECT_EQ(Text(folder_ / "access.yaml").find("gateway"), std::string::npos);
  EXPECT_NE(Text(folder_ / "members/recorder/crl.pem"), before);
  EXPECT_EQ(ListMembers(folder_)->size(), 1U);
  EXPECT_EQ(RevokeMember(folder_, "gateway", now_).error().code, ErrorCode::kNotFound);
}

TEST_F(StationTest, ThoseThatAreCalledHaveTheAccessFileAndItsChanges) {
  const auto recorder = Issue("recorder", "recorder");
  const auto robot = Issue("robot", "robot");
  ASSERT_TRUE(AddToken(folder_, "ben", {Role::kRecord}, 1, now_).ok());
  EXPECT_EQ(Text(recorder / "access.yaml"), Text(folder_ / "access.yaml"));
  EXPECT_THAT(Text(recorder / "access.yaml"), HasSubstr("name: ben"));
  EXPECT_FALSE(std::filesystem::exists(robot / "access.yaml"));
  ASSERT_TRUE(RevokeMember(folder_, "ben", now_).ok());
  EXPECT_EQ(Text(recorder / "access.yaml").find("ben"), std::string::npos);
}

TEST_F(StationTest, IssuingAgainRevokesTheOldCertificate) {
  Issue("executor", "executor");
  const std::string old = ListMembers(folder_)->front().serial;
  Issue("executor", "executor");
  EXPECT_NE(ListMembers(folder_)->front().serial, old);
  EXPECT_TRUE(fs::exists(folder_ / "revoked" / (old + ".pem")));
}

TEST_F(StationTest, WhoWasGivenAFolderOwnsWhatIsIssuedAgain) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives files away";
  const fs::path executor = Issue("executor", "executor");
  constexpr uid_t kUser = 10001;
  ASSERT_EQ(::chown(executor.c_str(), kUser, kUser), 0);
  Issue("executor", "executor");
  for (const fs::path& file :
       {FilesOf(executor).key, FilesOf(executor).permissions, executor / "access.yaml"}) {
    struct stat state {};
    ASSERT_EQ(::stat(file.c_str(), &state), 0) << file;
    EXPECT_EQ(state.st_uid, kUser) << file;
  }
}

TEST_F(StationTest, TokensAreKeptAsHashesOnly) {
  const auto token = AddToken(folder_, "anna", {Role::kTeach}, 30, now_);
  ASSERT_TRUE(token.ok()) << token.error().message;
  const std::string text = Text(folder_ / "access.yaml");
  EXPECT_EQ(text.find(*token), std::string::npos);
  EXPECT_THAT(text, HasSubstr(Sha256Hex(*token)));
  const auto list = ReadAccessList(folder_ / "access.yaml");
  EXPECT_EQ(Identify(*list, {.token = *token}, now_)->name, "anna");
  ASSERT_TRUE(RevokeMember(folder_, "anna", now_).ok());
  EXPECT_FALSE(Identify(*ReadAccessList(folder_ / "access.yaml"), {.token = *token}, now_).ok());
}

TEST_F(StationTest, FoldersThatCannotWorkAreRefusedWithTheReason) {
  const fs::path executor = Issue("executor", "executor", 1);
  EXPECT_THAT(CheckMemberFolder(executor, "kitchen", now_).error().message,
              HasSubstr("another station"));
  EXPECT_THAT(CheckMemberFolder(executor, "lab", now_ + std::chrono::hours(25)).error().message,
              HasSubstr("is valid from"));
  const fs::path recorder = Issue("recorder", "recorder");
  fs::copy_file(FilesOf(recorder).key, FilesOf(executor).key, fs::copy_options::overwrite_existing);
  EXPECT_THAT(CheckMemberFolder(executor, "lab", now_).error().message,
              HasSubstr("is not the key of"));
}

TEST_F(StationTest, FoldersAreWarnedOfBeforeTheyEnd) {
  using std::chrono::hours;
  const fs::path executor = Issue("executor", "executor", 40);
  EXPECT_THAT(MemberFolderWarnings(executor, now_), testing::IsEmpty());
  EXPECT_THAT(MemberFolderWarnings(executor, now_ + hours(24 * 11)),
              testing::ElementsAre(testing::AllOf(HasSubstr("cert.pem"), HasSubstr("28 more days"),
                                                  HasSubstr("issue the member again"))));
  EXPECT_THAT(MemberFolderWarnings(executor, now_ + hours(24 * 3660)),
              testing::ElementsAre(HasSubstr("and so no more"), HasSubstr("ca.pem")));
  EXPECT_NEAR(DaysLeft(ListMembers(folder_)->front().not_after, now_), 40, 0.01);
}

TEST_F(StationTest, FoldersWithAnotherVersionsGovernanceAreWarnedOf) {
  const fs::path executor = Issue("executor", "executor", 40);
  std::string governance = GovernanceXml();
  const std::string strong = "ENCRYPT_WITH_ORIGIN_AUTHENTICATION";
  governance.replace(governance.find(strong), strong.size(), "ENCRYPT");
  const KeyPair authority{.certificate = Text(folder_ / "authority/ca.pem"),
                          .key = Text(folder_ / "authority/ca.key")};
  std::ofstream(FilesOf(executor).governance) << *SignDocument(authority, governance);
  EXPECT_THAT(MemberFolderWarnings(executor, now_),
              testing::ElementsAre(HasSubstr("another version's")));
}

TEST_F(StationTest, NamesThatWouldLeaveTheirPlaceAreRefused) {
  for (const char* name : {"", "../x", "a/b", "a b", "<x>", "a,b"}) {
    EXPECT_FALSE(IssueMember({.folder = folder_, .name = name, .role = "executor"}, now_).ok());
    EXPECT_FALSE(RevokeMember(folder_, name, now_).ok());
    EXPECT_FALSE(AddToken(folder_, name, {Role::kTeach}, 1, now_).ok());
  }
  EXPECT_THAT(IssueMember({.folder = folder_, .name = "x", .role = "king"}, now_).error().message,
              HasSubstr("is none of capture, recorder"));
}

}  // namespace
}  // namespace exemplar::security
