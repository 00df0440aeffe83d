#pragma once
// CDR bytes to JSON and back, along a type.
//
// A struct is an object with its members in their order; a union {"_d": discriminator, "case":
// value}; an enum the name of its value; octets in arrays and sequences are base64 text; numbers
// that are not finite are "NaN", "Infinity" and "-Infinity", as protobuf's JSON has them.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/dynamic_data/type.hpp"

namespace exemplar::dynamic_data {

/// `cdr` with its encapsulation header: plain CDR of either byte order, XCDR version 1 or 2. Never
/// reads beyond it, and makes at most a small multiple of it. Errors (kDataLoss) name the member
/// and the byte.
Result<std::string> ToJson(const Type& type, std::span<const std::uint8_t> cdr);

/// Only whether ToJson would succeed.
Status Check(const Type& type, std::span<const std::uint8_t> cdr);

/// The JSON of a member of the outermost struct that the text leaves out; nullopt: an error.
using Absent = std::function<std::optional<std::string>(const std::string& member)>;

/// Little-endian XCDR version 1. Every member must be there unless `absent` has it. Errors
/// (kInvalidArgument) name the line and column of text that is not JSON, else the member at fault,
/// which is the error's field.
Result<std::vector<std::uint8_t>> FromJson(const Type& type, std::string_view json,
                                           const Absent& absent = {});

}  // namespace exemplar::dynamic_data
