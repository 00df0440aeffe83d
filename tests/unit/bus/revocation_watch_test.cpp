#include "revocation_watch.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <fstream>

#include "exemplar/base/clock.hpp"
#include "exemplar/security/station.hpp"
#include "support/eventually.hpp"

namespace exemplar::bus {
namespace {

using testing::Eventually;

class RevocationWatchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "exemplar-watch-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    ASSERT_TRUE(security::InitStation({.folder = folder_, .station = "lab"}, now_).ok());
    Issue("capture");
    list_ = security::FilesOf(Issue("executor")).revocations;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Issue(const std::string& name) {
    const auto member =
        security::IssueMember({.folder = folder_, .name = name, .role = name}, now_);
    EXPECT_TRUE(member.ok()) << member.error().message;
    return *member;
  }
  RevocationWatch Watch() {
    return RevocationWatch({.list = list_,
                            .on_revoked = [this](const std::string&) { ++told_; },
                            .period = std::chrono::milliseconds(1)});
  }

  const Stamp now_ = SystemClock().Now();
  std::filesystem::path folder_, list_;
  std::atomic<int> told_{0};
};

TEST_F(RevocationWatchTest, TellsOnceThatSomebodyElseIsRevoked) {
  const auto watch = Watch();
  ASSERT_TRUE(security::RevokeMember(folder_, "capture", now_).ok());
  ASSERT_TRUE(Eventually([&] { return told_ == 1; }));
  Issue("pendant");
  ASSERT_TRUE(security::RevokeMember(folder_, "pendant", now_).ok());
  EXPECT_EQ(told_, 1);
}

TEST_F(RevocationWatchTest, RemindsDayByDay) {
  std::atomic<int> days{0};
  const RevocationWatch watch({.list = list_,
                               .on_revoked = [this](const std::string&) { ++told_; },
                               .on_day = [&days] { ++days; },
                               .period = std::chrono::milliseconds(1),
                               .day = std::chrono::milliseconds(3)});
  ASSERT_TRUE(Eventually([&] { return days >= 2; }));
  EXPECT_EQ(told_, 0);
}

TEST_F(RevocationWatchTest, SaysNothingOfNewMembersOrOfAListThatIsHalfWritten) {
  {
    const auto watch = Watch();
    Issue("recorder");
    std::ofstream(list_) << "-----BEGIN X509 CRL-----\n";
    std::filesystem::remove(list_);
    std::filesystem::copy_file(folder_ / "members/recorder/crl.pem", list_);
  }
  EXPECT_EQ(told_, 0);
}

}  // namespace
}  // namespace exemplar::bus
