#include <cstdint>
#include <string>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/bus/discovery.hpp"

namespace exemplar::bus {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = ircp::SeenLocator::Kind;

/// An announcement as RTPS 2.2 lays it out, built by hand.
class Datagram {
 public:
  explicit Datagram(bool little = true) : little_(little) {}

  Datagram& Parameter(std::uint16_t id, Bytes value) {
    while (value.size() % 4 != 0) value.push_back(0);
    Append(list_, Number(id, 2));
    Append(list_, Number(static_cast<std::uint32_t>(value.size()), 2));
    Append(list_, value);
    return *this;
  }
  Bytes Number(std::uint32_t number, int count) const {
    Bytes bytes;
    for (int i = 0; i < count; ++i) {
      bytes.push_back(static_cast<std::uint8_t>(number >> (8 * (little_ ? i : count - 1 - i))));
    }
    return bytes;
  }
  Bytes Text(const std::string& text) const {
    Bytes bytes = Number(static_cast<std::uint32_t>(text.size() + 1), 4);
    bytes.insert(bytes.end(), text.begin(), text.end());
    do bytes.push_back(0);
    while (bytes.size() % 4 != 0);
    return bytes;
  }
  Bytes Locator(std::uint32_t kind, std::uint32_t port, const Bytes& address) const {
    Bytes bytes = Number(kind, 4);
    Append(bytes, Number(port, 4));
    bytes.insert(bytes.end(), 16 - address.size(), 0);
    Append(bytes, address);
    return bytes;
  }

  Bytes Whole() const {
    Bytes data{0, 0};
    Append(data, Number(16, 2));                             // octetsToInlineQos
    Append(data, {0, 1, 0, 0xc7, 0, 1, 0, 0xc2});            // the reader, and who announces
    Append(data, Bytes(8, 1));                               // the sequence number
    Append(data, {0, std::uint8_t(little_ ? 3 : 2), 0, 0});  // PL_CDR
    Append(data, list_);
    Append(data, Number(1, 2));
    Append(data, Number(0, 2));
    Bytes whole{'R', 'T', 'P', 'S', 2, 2, 1, 0x0f};
    for (std::uint8_t i = 1; i <= 12; ++i) whole.push_back(i);
    // A time stamp before it, as Fast DDS has it.
    Append(whole, {0x09, std::uint8_t(little_ ? 1 : 0)});
    Append(whole, Number(8, 2));
    Append(whole, Bytes(8, 7));
    Append(whole, {0x15, std::uint8_t(little_ ? 5 : 4)});
    Append(whole, Number(static_cast<std::uint32_t>(data.size()), 2));
    Append(whole, data);
    return whole;
  }

 private:
  static void Append(Bytes& bytes, const Bytes& more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
  }

  bool little_;
  Bytes list_;
};

Datagram Full(bool little) {
  Datagram datagram(little);
  Bytes properties = datagram.Number(1, 4);
  for (const char* word : {"exemplar.version", "0.1.0"}) {
    const Bytes text = datagram.Text(word);
    properties.insert(properties.end(), text.begin(), text.end());
  }
  datagram.Parameter(0x0016, {1, 0x10})
      .Parameter(0x0062, datagram.Text("a robot"))
      .Parameter(0x000f, datagram.Number(42, 4))
      .Parameter(0x0032, datagram.Locator(1, 7411, {192, 168, 1, 7}))
      .Parameter(0x0031, datagram.Locator(16, 7413,
                                          Bytes{'M', 3, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}))
      .Parameter(0x0059, properties)
      .Parameter(0x1001, {1, 2, 3, 4});
  return datagram;
}

TEST(AnnouncementTest, TellsWhoAnnouncesInEitherByteOrder) {
  for (const bool little : {true, false}) {
    const auto seen = ReadAnnouncement(Full(little).Whole());
    ASSERT_TRUE(seen);
    EXPECT_EQ(seen->id, "01.02.03.04.05.06.07.08.09.0a.0b.0c");
    EXPECT_EQ(seen->name, "a robot");
    EXPECT_EQ(seen->domain, 42);
    EXPECT_EQ(seen->vendor, "Cyclone DDS");
    EXPECT_TRUE(seen->secured);
    EXPECT_EQ(seen->properties.at("exemplar.version"), "0.1.0");
    ASSERT_EQ(seen->locators.size(), 2U);
    EXPECT_EQ(seen->locators[0],
              (ircp::SeenLocator{.kind = Kind::kUdp4, .address = "192.168.1.7", .port = 7411}));
    EXPECT_EQ(seen->locators[1].kind, Kind::kSharedMemory);
  }
}

TEST(AnnouncementTest, LeavesTheDomainOpenWhereItIsNotTold) {
  const auto seen = ReadAnnouncement(Datagram().Whole());
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->domain, -1);
  EXPECT_EQ(seen->vendor, "Fast DDS");
  EXPECT_FALSE(seen->secured);
}

TEST(AnnouncementTest, OtherDatagramsAreNone) {
  EXPECT_FALSE(ReadAnnouncement({}));
  EXPECT_FALSE(ReadAnnouncement(Bytes(100, 0)));
  Bytes other = Full(true).Whole();
  other[0] = 'X';
  EXPECT_FALSE(ReadAnnouncement(other));
}

TEST(AnnouncementTest, EveryCutIsReadWithinItsBytes) {
  const Bytes whole = Full(true).Whole();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    // In memory of its own, so that a sanitizer sees a step too far.
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(ReadAnnouncement(cut)) << size << " bytes";
  }
}

TEST(AnnouncementTest, BrokenBytesAreReadOrRefused) {
  Rng rng(11);
  const Bytes whole = Full(false).Whole();
  int read = 0;
  for (int i = 0; i < 20000; ++i) {
    Bytes broken = whole;
    for (int k = 0; k < 3; ++k) {
      broken[rng.Below(broken.size())] = static_cast<std::uint8_t>(rng.Below(256));
    }
    if (ReadAnnouncement(broken)) ++read;
  }
  EXPECT_GT(read, 0);
  EXPECT_LT(read, 20000);
}

}  // namespace
}  // namespace exemplar::bus
