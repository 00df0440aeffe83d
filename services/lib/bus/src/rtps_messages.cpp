#include "rtps_messages.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>

namespace exemplar::bus {
namespace {

using Bytes = std::span<const std::uint8_t>;

// DDSI-RTPS 2.3, 9.4.5.1.1.
constexpr std::uint8_t kPad = 0x01, kAckNack = 0x06, kHeartbeat = 0x07, kGap = 0x08, kInfoTs = 0x09,
                       kInfoSrc = 0x0c, kNackFrag = 0x12, kHeartbeatFrag = 0x13, kData = 0x15,
                       kDataFrag = 0x16;
constexpr std::uint8_t kLittleEndian = 0x01, kHasInlineQos = 0x02, kHasData = 0x04;
// Of inline QoS: its end, and what says that an instance goes.
constexpr std::size_t kSentinel = 0x0001, kStatusInfo = 0x0071;

using Entity = std::array<std::uint8_t, 4>;
// DDSI-RTPS 2.3, 9.3.1.5, and DDS-Security 1.1, 7.3.7.1.
constexpr Entity kAnnouncer = {0x00, 0x01, 0x00, 0xc2}, kHandshaker = {0x00, 0x02, 0x01, 0xc3},
                 kKeyExchanger = {0xff, 0x02, 0x02, 0xc3};

struct Submessage {
  std::uint8_t id = 0;
  std::uint8_t flags = 0;
  Bytes body;

  /// The writer that it is from or about; of none that has one, its place in the body is told.
  std::optional<Entity> writer() const {
    const std::size_t place = id == kData || id == kDataFrag ? 8 : 4;
    if (body.size() < place + std::tuple_size_v<Entity>) return std::nullopt;
    Entity found{};
    std::copy_n(body.begin() + static_cast<std::ptrdiff_t>(place), found.size(), found.begin());
    return found;
  }
  bool little() const { return (flags & kLittleEndian) != 0; }
  bool has_writer() const {
    constexpr std::array kWithWriter = {kAckNack,       kHeartbeat, kGap,     kNackFrag,
                                        kHeartbeatFrag, kData,      kDataFrag};
    return std::find(kWithWriter.begin(), kWithWriter.end(), id) != kWithWriter.end();
  }
};

std::size_t Number16(Bytes bytes, bool little) {
  return little ? bytes[0] + 256U * bytes[1] : 256U * bytes[0] + bytes[1];
}

/// Of data: whether it is a sample that does not say of itself that it goes.
bool IsAlive(const Submessage& data) {
  constexpr std::size_t kBeforeQos = 4, kUsualWay = 16;
  if ((data.flags & kHasData) == 0) return false;
  if ((data.flags & kHasInlineQos) == 0) return true;
  if (data.body.size() < kBeforeQos + kUsualWay ||
      Number16(data.body.subspan(2), data.little()) != kUsualWay) {
    return false;
  }
  for (Bytes qos = data.body.subspan(kBeforeQos + kUsualWay); qos.size() >= 4;) {
    const std::size_t what = Number16(qos, data.little());
    const std::size_t length = Number16(qos.subspan(2), data.little());
    if (what == kSentinel) return true;
    if (what == kStatusInfo || qos.size() < 4 + length) return false;
    qos = qos.subspan(4 + length);
  }
  return false;
}

/// Whether `fits` says yes to each submessage.
template <class Fits>
bool All(Bytes bytes, Fits fits) {
  constexpr std::size_t kHeaderBytes = 4;
  while (bytes.size() >= kHeaderBytes) {
    Submessage one{.id = bytes[0], .flags = bytes[1], .body = {}};
    std::size_t length = Number16(bytes.subspan(2), one.little());
    bytes = bytes.subspan(kHeaderBytes);
    // A length of zero stands for "all that is left", except where there is nothing to have.
    if (length == 0 && one.id != kPad && one.id != kInfoTs) length = bytes.size();
    if (length > bytes.size()) return true;
    one.body = bytes.first(length);
    if (!fits(one)) return false;
    bytes = bytes.subspan(std::min(bytes.size(), (length + 3) / 4 * 4));
  }
  return true;
}

}  // namespace

bool OnlyGreets(Bytes submessages) {
  return All(submessages, [](const Submessage& one) {
    if (one.id == kInfoSrc) return false;
    if (!one.has_writer()) return true;
    if (one.id == kData && one.writer() == kAnnouncer) return IsAlive(one);
    return (one.id == kData || one.id == kDataFrag) && one.writer() == kHandshaker;
  });
}

bool OnlyExchangesKeys(Bytes submessages) {
  return All(submessages, [](const Submessage& one) {
    return one.id != kInfoSrc && (!one.has_writer() || one.writer() == kKeyExchanger);
  });
}

bool SpeaksForItself(Bytes submessages, const RtpsSource& source) {
  constexpr std::size_t kPlace = 8;
  return All(submessages, [&source](const Submessage& one) {
    return one.id != kInfoSrc ||
           (one.body.size() >= kPlace + source.size() &&
            std::equal(source.begin(), source.end(), one.body.begin() + kPlace));
  });
}

}  // namespace exemplar::bus
