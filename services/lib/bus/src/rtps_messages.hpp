#pragma once
// What stands in RTPS messages, as far as a secured participant must judge it before Fast DDS
// believes it. No Fast DDS in here.

#include <array>
#include <cstdint>
#include <span>

namespace exemplar::bus {

/// The participant that a message says it is from.
using RtpsSource = std::array<std::uint8_t, 12>;

// Each takes the submessages that follow an RTPS header, or what was encrypted in their place.
// Bytes that are no submessage end a message, as they do for Fast DDS.

/// Whether they are what secured participants say in clear, because they do not know each other
/// yet: that they are there, the handshake, and what is encrypted anyway. Not that somebody goes.
bool OnlyGreets(std::span<const std::uint8_t> submessages);

/// Whether they are of the exchange of keys, which is encrypted for itself and not as a message.
bool OnlyExchangesKeys(std::span<const std::uint8_t> submessages);

/// Whether none of them speaks for another participant than the message's.
bool SpeaksForItself(std::span<const std::uint8_t> submessages, const RtpsSource& source);

}  // namespace exemplar::bus
