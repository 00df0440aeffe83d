// What a stranger sends in the name of the executor's joint commands, in clear: he needs no
// certificate for it, only a look at the network.

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>
#include <sstream>
#include <vector>

#include "exemplar/bus/codec.hpp"
#include "message_guard.hpp"
#include "secured_station.hpp"
#include "support/eventually.hpp"

namespace exemplar::bus {
namespace {

using ::testing::ElementsAre;
using testing::Eventually;

using Packet = std::vector<std::uint8_t>;
/// Of a writer: its participant's 12 bytes, and its own 4.
using Guid = std::array<std::uint8_t, 16>;

/// "01.0f.7a...|0.0.1.2", as receptions have it.
Guid ParseGuid(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '.' || c == '|'; }, ' ');
  std::istringstream in(text);
  Guid guid{};
  for (std::uint8_t& byte : guid) {
    int value = 0;
    in >> std::hex >> value;
    byte = static_cast<std::uint8_t>(value);
  }
  EXPECT_TRUE(in) << text;
  return guid;
}

template <class Number>
void Add(Packet& packet, Number number) {
  std::array<std::uint8_t, sizeof(Number)> bytes{};
  std::memcpy(bytes.data(), &number, sizeof number);
  packet.insert(packet.end(), bytes.begin(), bytes.end());
}
void AddNumber(Packet& packet, std::uint32_t sequence) {
  Add<std::int32_t>(packet, 0);
  Add(packet, sequence);
}

/// An RTPS message of one submessage (DDSI-RTPS 2.3, 9.4), little-endian.
Packet Message(const Guid& writer, std::uint8_t id, std::uint8_t flags, const Packet& body) {
  Packet packet = {'R', 'T', 'P', 'S', 2, 3, 1, 0x0f};
  packet.insert(packet.end(), writer.begin(), writer.begin() + 12);
  packet.push_back(id);
  packet.push_back(static_cast<std::uint8_t>(flags | 1));
  Add(packet, static_cast<std::uint16_t>(body.size()));
  packet.insert(packet.end(), body.begin(), body.end());
  return packet;
}

/// The beginning of a body: any reader, this writer.
Packet About(const Guid& writer, Packet before = {}) {
  Add<std::uint32_t>(before, 0);
  before.insert(before.end(), writer.begin() + 12, writer.end());
  return before;
}

constexpr Packet::value_type kData = 0x15, kGap = 0x08, kHeartbeat = 0x07;

Packet Sample(const Guid& writer, std::uint32_t sequence, const Packet& payload) {
  Packet body = About(writer, {0, 0, 16, 0});
  AddNumber(body, sequence);
  body.insert(body.end(), payload.begin(), payload.end());
  while (body.size() % 4 != 0) body.push_back(0);
  return Message(writer, kData, 0x04, body);
}

Packet Gap(const Guid& writer, std::uint32_t from, std::uint32_t to) {
  Packet body = About(writer);
  AddNumber(body, from);
  AddNumber(body, to);
  Add<std::uint32_t>(body, 0);
  return Message(writer, kGap, 0, body);
}

Packet Heartbeat(const Guid& writer, std::uint32_t first) {
  Packet body = About(writer);
  AddNumber(body, first);
  AddNumber(body, first);
  Add<std::uint32_t>(body, 1000000);
  return Message(writer, kHeartbeat, 0x02, body);
}

/// That the writer's participant goes.
Packet Goes(const Guid& writer) {
  Packet body = {0, 0, 16, 0, 0, 1, 0, 0xc7, 0, 1, 0, 0xc2};
  AddNumber(body, 1000000);
  const Packet key_hash = {0x70, 0, 16, 0}, participant = {0, 0, 1, 0xc1};
  const Packet disposed = {0x71, 0, 4, 0, 0, 0, 0, 3, 1, 0, 0, 0};
  body.insert(body.end(), key_hash.begin(), key_hash.end());
  body.insert(body.end(), writer.begin(), writer.begin() + 12);
  body.insert(body.end(), participant.begin(), participant.end());
  body.insert(body.end(), disposed.begin(), disposed.end());
  return Message(writer, kData, 0x02, body);
}

ircp::JointCommandSample Command(double position) {
  ircp::JointCommandSample command;
  command.header = {.source = "executor", .seq = 2, .stamp = SystemClock().Now()};
  command.names = {"elbow"};
  command.positions = {position};
  command.validity = std::chrono::milliseconds(500);
  return command;
}

class ForgeryTest : public BusSecurityTest {
 protected:
  void TearDown() override {
    reader_.reset();
    writer_.reset();
    close(socket_);
    BusSecurityTest::TearDown();
  }

  /// The robot hears the executor's first command.
  void Meet(std::unique_ptr<Participant> robot, std::unique_ptr<Participant> executor) {
    robot_ = std::move(robot);
    executor_ = std::move(executor);
    auto reader = robot_->MakeReader<ircp::JointCommandSample>(
        [this](const ircp::JointCommandSample& command, const ircp::Reception& reception) {
          const std::lock_guard lock(mutex_);
          heard_.push_back(command.positions.front());
          from_ = reception.writer;
        });
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    reader_ = std::move(*reader);
    writer_ = WriterOf<ircp::JointCommandSample>(*executor_);
    ASSERT_TRUE(Eventually([this] { return writer_->matched_readers() == 1; }));
    ASSERT_TRUE(Eventually([this] { return reader_->matched_writers() == 1; }));
    ASSERT_TRUE(writer_->Write(Command(1)).ok());
    ASSERT_TRUE(Eventually([this] { return heard().size() == 1; }));
    name_ = ParseGuid(from_);
  }
  std::vector<double> heard() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  /// To the unicast ports of the first participants of this machine, discovery's and programs'.
  void Send(const Packet& packet) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    for (int port = 10; port < 18; ++port) {
      to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain_.number() + port));
      (void)sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                   sizeof to);
    }
  }

  const int socket_ = socket(AF_INET, SOCK_DGRAM, 0);
  std::unique_ptr<Participant> robot_, executor_;
  std::unique_ptr<ircp::Reader> reader_;
  std::unique_ptr<ircp::Writer<ircp::JointCommandSample>> writer_;
  mutable std::mutex mutex_;
  std::vector<double> heard_;
  std::string from_;
  Guid name_{};
};

TEST_F(ForgeryTest, AnOpenRobotObeysWhoeverUsesTheExecutorsName) {
  Meet(Join(""), Join(""));
  Send(Sample(name_, 2, Encode(Command(99))));
  ASSERT_TRUE(Eventually([this] { return heard().size() == 2; }));
  EXPECT_THAT(heard(), ElementsAre(1, 99));
}

TEST_F(ForgeryTest, ASecuredRobotTakesNothingInClearFromAnybody) {
  Meet(JoinAs("robot"), JoinAs("executor"));
  // Each of two participants has two ports.
  const std::vector<Packet> forged = {Sample(name_, 2, Encode(Command(99))),
                                      Gap(name_, 2, 0x7ffffff0), Heartbeat(name_, 1000000),
                                      Goes(name_)};
  const std::uint64_t before = RefusedMessages();
  for (const Packet& packet : forged) Send(packet);
  ASSERT_TRUE(Eventually([&] { return RefusedMessages() >= before + 4 * forged.size(); }));
  // It neither obeys, nor goes deaf, nor believes that the executor went.
  ASSERT_TRUE(writer_->Write(Command(2)).ok());
  ASSERT_TRUE(Eventually([this] { return heard().size() == 2; }));
  EXPECT_THAT(heard(), ElementsAre(1, 2));
  EXPECT_EQ(reader_->matched_writers(), 1);
  EXPECT_EQ(writer_->matched_readers(), 1);
}

}  // namespace
}  // namespace exemplar::bus
