#pragma once
// Samples as the bytes that travel: CDR with its 4-byte encapsulation header, as the types of idl/
// define it. What a recording holds is the same bytes.
//
// Defined for every sample type of ircp/samples.hpp. Free functions of their arguments only:
// thread-safe.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/ircp/samples.hpp"

namespace exemplar::bus {

/// Little-endian CDR.
template <class Sample>
std::vector<std::uint8_t> Encode(const Sample& sample);

/// Either byte order. An error (never a crash, never an allocation beyond a small multiple of the
/// bytes) for bytes that are cut, left over or not of this type, and for samples that
/// ircp::Check refuses.
template <class Sample>
Result<Sample> Decode(std::span<const std::uint8_t> cdr_with_encapsulation);

/// The flattened IDL text of the sample's type, as writers carry it in their user_data.
template <class Sample>
std::string_view SchemaOf();

/// The type's name on the network: "exemplar::ircp::v1::Suit".
template <class Sample>
std::string_view TypeNameOf();

/// The 16 bytes that name the sample's instance (source, and object or hand), as the protocol has
/// it.
template <class Sample>
std::array<std::uint8_t, 16> KeyHashOf(const Sample& sample);

}  // namespace exemplar::bus
