#pragma once
// Samples of types that are known only by their IDL: what no generated code reads. The subset that
// Fast DDS, Cyclone and omgidl-parser share: modules, structs, enums, unions, constants, typedefs,
// arrays, sequences and strings, bounded or not, numbers of all sizes; annotations are passed over.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::dynamic_data {

enum class Kind {
  kBoolean,
  kOctet,  ///< octet and uint8: raw bytes
  kChar,
  kInt8,
  kInt16,
  kUInt16,
  kInt32,
  kUInt32,
  kInt64,
  kUInt64,
  kFloat32,
  kFloat64,
  kString,
  kEnum,
  kSequence,
  kArray,
  kStruct,
  kUnion,
};

/// A type, made of others. Immutable.
struct Type {
  struct Member {
    std::string name;
    std::shared_ptr<const Type> type;  ///< shared by all that are of this type
    bool key = false;
    std::vector<std::int64_t> labels = {};  ///< of a union's case
    bool is_default = false;                ///< likewise
  };
  struct Enumerator {
    std::string name;
    std::int32_t value = 0;
  };

  Kind kind = Kind::kStruct;
  std::string name = {};                     ///< "exemplar::ircp::v1::Suit"; of the named ones
  std::vector<Member> members = {};          ///< of a struct; the cases of a union
  std::shared_ptr<const Type> element = {};  ///< of a sequence or array; a union's discriminator
  std::size_t length = 0;                    ///< of an array; the bound of others, 0: none
  std::vector<Enumerator> enumerators = {};
  std::size_t least_bytes = 1;  ///< of a sample, without padding
  int depth = 1;                ///< of nesting
};

/// Reads `idl` (flattened: without #include) and finds the struct or union `name` in it, given with
/// its modules ("a::b::C") or as ROS 2 names it on the network ("a::b::dds_::C_").
/// Errors name the line, or say that there is no such type in it.
Result<std::shared_ptr<const Type>> ParseType(std::string_view idl, std::string_view name);

}  // namespace exemplar::dynamic_data
