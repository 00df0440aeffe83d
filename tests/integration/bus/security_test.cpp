// DDS-Security with the files that `exemplar security` makes, between participants of one process.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>

#include "greeting_guard.hpp"
#include "message_guard.hpp"
#include "secured_station.hpp"
#include "support/eventually.hpp"

namespace exemplar::bus {
namespace {

using testing::Eventually;
using ::testing::HasSubstr;

ircp::SuitSample Suit() {
  ircp::SuitSample sample;
  sample.names = {"elbow"};
  sample.positions = {0.5};
  return sample;
}

TEST_F(BusSecurityTest, MembersHearEachOtherAndTheRecordersTapHearsAll) {
  const auto capture = JoinAs("capture");
  const auto executor = JoinAs("executor");
  const auto recorder = JoinAs("recorder");
  std::atomic<int> taped{0};
  const auto tap = recorder->MakeTap({.wanted = [](const ircp::RawTopic&) { return true; },
                                      .on_topic = [](const ircp::RawTopic&) {},
                                      .on_sample = [&](const ircp::RawSample&) { ++taped; }});
  ASSERT_TRUE(tap.ok()) << tap.error().message;
  Counted<ircp::SuitSample> heard(*executor);
  const auto writer = WriterOf<ircp::SuitSample>(*capture);
  ASSERT_TRUE(Eventually([&] { return writer->matched_readers() == 2; }));
  ASSERT_TRUE(writer->Write(Suit()).ok());
  EXPECT_TRUE(Eventually([&] { return heard.count == 1 && taped == 1; }));
}

TEST_F(BusSecurityTest, GreetingsOfNewcomersTakeTurns) { EXPECT_TRUE(GreetingsAreGuarded()); }

TEST_F(BusSecurityTest, MessagesInAnothersNameAreLookedFor) { EXPECT_TRUE(MessagesAreGuarded()); }

TEST_F(BusSecurityTest, StrangersNeitherReadNorWrite) {
  const auto capture = JoinAs("capture");
  const auto executor = JoinAs("executor");
  const auto plain = Join("");
  const auto other = Join(Issue(MakeStation("other"), "executor", "executor"));
  const auto other_capture = Join(Issue(root_ / "other", "capture", "capture"));
  Counted<ircp::SuitSample> heard(*executor);
  Counted<ircp::SuitSample> plain_heard(*plain);
  Counted<ircp::SuitSample> other_heard(*other);
  const auto writer = WriterOf<ircp::SuitSample>(*capture);
  const auto plain_writer = WriterOf<ircp::SuitSample>(*plain);
  const auto other_writer = WriterOf<ircp::SuitSample>(*other_capture);
  // The strangers are able to talk: to their own.
  ASSERT_TRUE(Eventually([&] {
    return writer->matched_readers() == 1 && plain_writer->matched_readers() == 1 &&
           other_writer->matched_readers() == 1;
  }));
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(writer->Write(Suit()).ok());
    ASSERT_TRUE(plain_writer->Write(Suit()).ok());
    ASSERT_TRUE(other_writer->Write(Suit()).ok());
  }
  ASSERT_TRUE(Eventually(
      [&] { return heard.count >= 20 && plain_heard.count >= 20 && other_heard.count >= 20; }));
  EXPECT_EQ(heard.count, 20);
  EXPECT_EQ(plain_heard.count, 20);
  EXPECT_EQ(other_heard.count, 20);
  EXPECT_EQ(heard.reader->matched_writers(), 1);
}

TEST_F(BusSecurityTest, OnlyTheExecutorWritesJointCommands) {
  const auto robot = JoinAs("robot");
  const auto executor = JoinAs("executor");
  for (const char* role : {"capture", "recorder", "gateway", "observer", "pendant"}) {
    const auto writer = JoinAs(role)->MakeWriter<ircp::JointCommandSample>("source");
    ASSERT_FALSE(writer.ok()) << role;
    EXPECT_EQ(writer.error().code, ErrorCode::kFailedPrecondition);
    EXPECT_THAT(writer.error().message, HasSubstr("ircp/joint_command"));
  }
  EXPECT_FALSE(robot->MakeWriter<ircp::JointCommandSample>("source").ok());
  Counted<ircp::JointCommandSample> heard(*robot);
  const auto writer = WriterOf<ircp::JointCommandSample>(*executor);
  ASSERT_TRUE(Eventually([&] { return writer->matched_readers() == 1; }));
  ircp::JointCommandSample command;
  command.names = {"elbow"};
  command.positions = {0.5};
  ASSERT_TRUE(writer->Write(command).ok());
  EXPECT_TRUE(Eventually([&] { return heard.count == 1; }));
}

TEST_F(BusSecurityTest, MembersThatMayNotReadATopicCannot) {
  const auto capture = JoinAs("capture");
  EXPECT_FALSE(capture
                   ->MakeReader<ircp::JointCommandSample>(
                       [](const ircp::JointCommandSample&, const ircp::Reception&) {})
                   .ok());
}

TEST_F(BusSecurityTest, WhoIsRevokedIsNotTalkedTo) {
  const std::string folder = Issue(station_, "capture", "capture");
  std::filesystem::copy(folder, root_ / "stolen");
  ASSERT_TRUE(security::RevokeMember(station_, "capture", SystemClock().Now()).ok());
  const auto executor = JoinAs("executor");
  const auto thief = Join((root_ / "stolen").string());
  const auto capture = JoinAs("capture");  // a new certificate of the same name
  Counted<ircp::SuitSample> heard(*executor);
  const auto stolen_writer = WriterOf<ircp::SuitSample>(*thief);
  const auto writer = WriterOf<ircp::SuitSample>(*capture);
  ASSERT_TRUE(Eventually([&] { return writer->matched_readers() == 1; }));
  EXPECT_EQ(stolen_writer->matched_readers(), 0);
  EXPECT_TRUE(Eventually([&] { return heard.reader->matched_writers() == 1; }));
}

TEST_F(BusSecurityTest, FoldersThatDoNotFitAreNamed) {
  const std::string folder = Issue(station_, "executor", "executor");
  EXPECT_THAT(TryJoin(folder, "kitchen").error().message, HasSubstr("another station"));
  EXPECT_THAT(TryJoin((root_ / "none").string()).error().message, HasSubstr("none/cert.pem"));
  const auto servers = Participant::Create({.domain = domain_.number(),
                                            .station = "lab",
                                            .discovery_servers = {"127.0.0.1:11811"},
                                            .security = folder});
  EXPECT_THAT(servers.error().message, HasSubstr("discovery server"));

  const std::string other = Issue(station_, "recorder", "recorder");
  std::filesystem::copy_file(std::filesystem::path(other) / "permissions.p7s",
                             std::filesystem::path(folder) / "permissions.p7s",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(TryJoin(folder).error().message, HasSubstr("not about"));
}

}  // namespace
}  // namespace exemplar::bus
