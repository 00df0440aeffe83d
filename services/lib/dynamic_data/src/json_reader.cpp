#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "cdr_reader.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/dynamic_data/json.hpp"

namespace exemplar::dynamic_data {
namespace {

using Json = nlohmann::ordered_json;

/// "line 3, column 7" of a byte, from 1.
std::string PlaceOf(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t start = before.rfind('\n');
  const std::size_t column = before.size() - (start == std::string_view::npos ? 0 : start + 1);
  return "line " + std::to_string(line) + ", column " +
         std::to_string(std::max<std::size_t>(column, 1));
}

class Encoder {
 public:
  explicit Encoder(const Absent& absent) : absent_(absent) {}

  std::vector<std::uint8_t> Encode(const Type& type, const Json& json) {
    Value(type, json, true);
    return std::move(bytes_);
  }

 private:
  static constexpr std::size_t kEncapsulation = 4;

  [[noreturn]] static void Refuse(const Json& json, const std::string& due) {
    std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    constexpr std::size_t kMostShown = 60;
    if (text.size() > kMostShown) text = text.substr(0, kMostShown) + "...";
    throw Misfit{due + " is due, not " + text};
  }

  template <class Number>
  void Put(Number value) {
    bytes_.resize(kEncapsulation + (bytes_.size() - kEncapsulation + sizeof value - 1) /
                                       sizeof value * sizeof value);
    std::array<std::uint8_t, sizeof value> raw;
    std::memcpy(raw.data(), &value, sizeof value);
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
  }

  /// Whole numbers come as numbers, or as text where they are beyond those of JavaScript.
  template <class Whole>
  static Whole ReadWhole(const Json& json) {
    const std::string due = "a whole number from " +
                            std::to_string(std::numeric_limits<Whole>::min()) + " to " +
                            std::to_string(std::numeric_limits<Whole>::max());
    if (json.is_number_unsigned()) {
      const auto value = json.get<std::uint64_t>();
      if (value <= static_cast<std::uint64_t>(std::numeric_limits<Whole>::max())) {
        return static_cast<Whole>(value);
      }
    } else if (json.is_number_integer()) {
      const auto value = json.get<std::int64_t>();
      if (std::in_range<Whole>(value)) return static_cast<Whole>(value);
    } else if (json.is_number_float()) {
      const auto value = json.get<double>();
      if (value == std::floor(value) && std::abs(value) < 9e15 &&
          std::in_range<Whole>(static_cast<std::int64_t>(value))) {
        return static_cast<Whole>(value);
      }
    } else if (json.is_string()) {
      const auto& text = json.get_ref<const std::string&>();
      Whole value{};
      const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
      if (read.ec == std::errc() && read.ptr == text.data() + text.size()) return value;
    }
    Refuse(json, due);
  }

  template <class Whole>
  std::int64_t PutWhole(const Json& json) {
    const auto value = ReadWhole<Whole>(json);
    Put(value);
    return static_cast<std::int64_t>(value);
  }

  template <class Number>
  void PutReal(const Json& json) {
    if (json.is_number()) return Put(static_cast<Number>(json.get<double>()));
    if (json.is_string()) {
      const auto& text = json.get_ref<const std::string&>();
      if (text == "NaN") return Put(std::numeric_limits<Number>::quiet_NaN());
      if (text == "Infinity") return Put(std::numeric_limits<Number>::infinity());
      if (text == "-Infinity") return Put(-std::numeric_limits<Number>::infinity());
    }
    Refuse(json, "a number");
  }

  void PutText(const std::string& text, std::size_t bound) {
    if (bound != 0 && text.size() > bound) {
      throw Misfit{"the string has " + std::to_string(text.size()) + " bytes, at most " +
                   std::to_string(bound) + " are allowed"};
    }
    if (text.find('\0') != std::string::npos) throw Misfit{"a string must not hold a NUL"};
    Put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
  }

  void Value(const Type& type, const Json& json, bool outermost = false) {
    switch (type.kind) {
      case Kind::kString:
        if (!json.is_string()) Refuse(json, "a string");
        return PutText(json.get_ref<const std::string&>(), type.length);
      case Kind::kFloat32:
        return PutReal<float>(json);
      case Kind::kFloat64:
        return PutReal<double>(json);
      case Kind::kSequence:
        return Sequence(type, json);
      case Kind::kArray:
        return Array(type, json);
      case Kind::kStruct:
        return Struct(type, json, outermost);
      case Kind::kUnion:
        return Union(type, json);
      default:
        Discrete(type, json);
    }
  }

  std::int64_t Discrete(const Type& type, const Json& json) {
    switch (type.kind) {
      case Kind::kBoolean:
        if (!json.is_boolean()) Refuse(json, "true or false");
        Put(static_cast<std::uint8_t>(json.get<bool>() ? 1 : 0));
        return json.get<bool>() ? 1 : 0;
      case Kind::kChar: {
        if (!json.is_string() || json.get_ref<const std::string&>().size() != 1) {
          Refuse(json, "a string of one byte");
        }
        const auto c = static_cast<std::uint8_t>(json.get_ref<const std::string&>().front());
        Put(c);
        return c;
      }
      case Kind::kEnum:
        return Enum(type, json);
      case Kind::kInt8:
        return PutWhole<std::int8_t>(json);
      case Kind::kInt16:
        return PutWhole<std::int16_t>(json);
      case Kind::kUInt16:
        return PutWhole<std::uint16_t>(json);
      case Kind::kInt32:
        return PutWhole<std::int32_t>(json);
      case Kind::kUInt32:
        return PutWhole<std::uint32_t>(json);
      case Kind::kInt64:
        return PutWhole<std::int64_t>(json);
      case Kind::kUInt64:
        return PutWhole<std::uint64_t>(json);
      default:
        return PutWhole<std::uint8_t>(json);
    }
  }

  std::int64_t Enum(const Type& type, const Json& json) {
    std::vector<std::string> names;
    for (const Type::Enumerator& enumerator : type.enumerators) {
      const bool chosen = json.is_string() ? json.get_ref<const std::string&>() == enumerator.name
                                           : json == enumerator.value;
      if (chosen) {
        Put(enumerator.value);
        return enumerator.value;
      }
      names.push_back(enumerator.name);
    }
    Refuse(json, "one of " + Join(names, ", "));
  }

  void Sequence(const Type& type, const Json& json) {
    const bool is_bytes = type.element->kind == Kind::kOctet && json.is_string();
    const std::vector<std::uint8_t> octets =
        is_bytes ? FromBase64(json) : std::vector<std::uint8_t>();
    if (!is_bytes && !json.is_array()) Refuse(json, "an array");
    const std::size_t count = is_bytes ? octets.size() : json.size();
    if (type.length != 0 && count > type.length) {
      throw Misfit{"the sequence has " + std::to_string(count) + " elements, at most " +
                   std::to_string(type.length) + " are allowed"};
    }
    Put(static_cast<std::uint32_t>(count));
    if (is_bytes) {
      bytes_.insert(bytes_.end(), octets.begin(), octets.end());
    } else {
      Elements(*type.element, json);
    }
  }

  void Array(const Type& type, const Json& json) {
    if (type.element->kind == Kind::kOctet && json.is_string()) {
      const std::vector<std::uint8_t> octets = FromBase64(json);
      RequireLength(octets.size(), type.length);
      bytes_.insert(bytes_.end(), octets.begin(), octets.end());
      return;
    }
    if (!json.is_array()) Refuse(json, "an array");
    RequireLength(json.size(), type.length);
    Elements(*type.element, json);
  }

  static void RequireLength(std::size_t count, std::size_t due) {
    if (count == due) return;
    throw Misfit{"the array has " + std::to_string(count) + " elements, must have " +
                 std::to_string(due)};
  }

  void Elements(const Type& element, const Json& json) {
    for (std::size_t i = 0; i < json.size(); ++i) {
      try {
        Value(element, json[i]);
      } catch (Misfit& misfit) {
        misfit.Within("[" + std::to_string(i) + "]");
        throw;
      }
    }
  }

  void Member(const Type::Member& member, const Json& json) {
    try {
      Value(*member.type, json);
    } catch (Misfit& misfit) {
      misfit.Within(member.name);
      throw;
    }
  }

  void Struct(const Type& type, const Json& json, bool outermost) {
    if (!json.is_object()) Refuse(json, "an object");
    for (const auto& entry : json.items()) RequireMember(type, entry.key());
    for (const Type::Member& member : type.members) {
      if (const auto found = json.find(member.name); found != json.end()) {
        Member(member, *found);
        continue;
      }
      std::optional<std::string> text;
      if (outermost && absent_) text = absent_(member.name);
      if (!text) throw Misfit{"is not there", member.name};
      Member(member, Json::parse(*text));
    }
  }

  static void RequireMember(const Type& type, const std::string& name) {
    std::vector<std::string> names;
    for (const Type::Member& member : type.members) {
      if (member.name == name) return;
      names.push_back(member.name);
    }
    const std::optional<std::string> near = NearestName(name, names);
    throw Misfit{"is no member of " + type.name + (near ? "; did you mean " + *near + "?" : ""),
                 name};
  }

  void Union(const Type& type, const Json& json) {
    if (!json.is_object() || !json.contains("_d")) {
      Refuse(json, "an object with \"_d\" and the case that it chooses");
    }
    std::int64_t discriminator = 0;
    try {
      discriminator = Discrete(*type.element, json["_d"]);
    } catch (Misfit& misfit) {
      misfit.Within("_d");
      throw;
    }
    const Type::Member* chosen = CaseOf(type, discriminator);
    for (const auto& entry : json.items()) {
      if (entry.key() == "_d" || (chosen != nullptr && entry.key() == chosen->name)) continue;
      throw Misfit{"is not the case that _d chooses", entry.key()};
    }
    if (chosen == nullptr) return;
    if (!json.contains(chosen->name)) throw Misfit{"is not there", chosen->name};
    Member(*chosen, json[chosen->name]);
  }

  static std::vector<std::uint8_t> FromBase64(const Json& json) {
    std::string_view text = json.get_ref<const std::string&>();
    while (text.ends_with('=')) text.remove_suffix(1);
    std::vector<std::uint8_t> bytes;
    bytes.reserve(text.size() * 3 / 4);
    std::uint32_t held = 0;
    int bits = 0;
    for (const char c : text) {
      const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                        : c >= 'a' && c <= 'z' ? c - 'a' + 26
                        : c >= '0' && c <= '9' ? c - '0' + 52
                        : c == '+' || c == '-' ? 62
                        : c == '/' || c == '_' ? 63
                                               : -1;
      if (value < 0) Refuse(json, "base64 text");
      held = (held << 6) | static_cast<std::uint32_t>(value);
      bits += 6;
      if (bits < 8) continue;
      bits -= 8;
      bytes.push_back(static_cast<std::uint8_t>(held >> bits));
      held &= (1U << bits) - 1;
    }
    if (bits >= 6) Refuse(json, "base64 text");
    return bytes;
  }

  const Absent& absent_;
  std::vector<std::uint8_t> bytes_ = {0, 1, 0, 0};
};

/// Refuses what is nested deeper than any type, before a tree is made of it.
class DepthGuard {
 public:
  bool operator()(int depth, Json::parse_event_t, Json&) {
    constexpr int kDeepest = 128;
    if (depth > kDeepest)
      throw Misfit{"the JSON is nested deeper than " + std::to_string(kDeepest)};
    return true;
  }
};

}  // namespace

Result<std::vector<std::uint8_t>> FromJson(const Type& type, std::string_view json,
                                           const Absent& absent) {
  try {
    return Encoder(absent).Encode(type, Json::parse(json, DepthGuard()));
  } catch (const Json::parse_error& error) {
    return InvalidArgument(PlaceOf(json, error.byte) + ": this is not JSON");
  } catch (const Json::exception& error) {
    return InvalidArgument(std::string("the JSON cannot be read: ") + error.what());
  } catch (const Misfit& misfit) {
    const std::string place = misfit.path.empty() ? "" : misfit.path + ": ";
    return InvalidArgument(place + misfit.message, misfit.path);
  }
}

}  // namespace exemplar::dynamic_data
