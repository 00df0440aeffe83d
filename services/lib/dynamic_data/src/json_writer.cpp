#include <array>
#include <charconv>
#include <cmath>

#include "cdr_reader.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/dynamic_data/json.hpp"

namespace exemplar::dynamic_data {
namespace {

/// How many bytes at the front of `text` are one character of UTF-8; 0: none.
std::size_t CharacterLength(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  // Too long an encoding, half of a pair, beyond the last character.
  if ((first == 0xE0 && byte(1) < 0xA0) || (first == 0xED && byte(1) > 0x9F) ||
      (first == 0xF0 && byte(1) < 0x90) || (first == 0xF4 && byte(1) > 0x8F)) {
    return 0;
  }
  return length;
}

class Writer {
 public:
  /// Without `out` the bytes are only walked.
  Writer(std::span<const std::uint8_t> cdr, std::string* out) : reader_(cdr), out_(out) {}

  void Value(const Type& type) {
    switch (type.kind) {
      case Kind::kBoolean:
        Boolean();
        return;
      case Kind::kOctet:
        return Integer(reader_.Take<std::uint8_t>());
      case Kind::kChar:
        Char();
        return;
      case Kind::kInt8:
        return Integer(reader_.Take<std::int8_t>());
      case Kind::kInt16:
        return Integer(reader_.Take<std::int16_t>());
      case Kind::kUInt16:
        return Integer(reader_.Take<std::uint16_t>());
      case Kind::kInt32:
        return Integer(reader_.Take<std::int32_t>());
      case Kind::kUInt32:
        return Integer(reader_.Take<std::uint32_t>());
      case Kind::kInt64:
        return Integer(reader_.Take<std::int64_t>());
      case Kind::kUInt64:
        return Integer(reader_.Take<std::uint64_t>());
      case Kind::kFloat32:
        return Real(reader_.Take<float>());
      case Kind::kFloat64:
        return Real(reader_.Take<double>());
      case Kind::kString:
        return String(type);
      case Kind::kEnum:
        Enum(type);
        return;
      case Kind::kSequence:
        return Sequence(type);
      case Kind::kArray:
        if (type.element->kind != Kind::kArray) reader_.SkipCollectionHeader(*type.element);
        return Elements(*type.element, type.length);
      case Kind::kStruct:
        return Struct(type);
      case Kind::kUnion:
        return Union(type);
    }
  }

  void Finish() const { reader_.Finish(); }

 private:
  void Put(std::string_view text) {
    if (out_ != nullptr) out_->append(text);
  }
  void Put(char c) {
    if (out_ != nullptr) out_->push_back(c);
  }

  bool Boolean() {
    const auto value = reader_.Take<std::uint8_t>();
    if (value > 1) throw Misfit{std::to_string(value) + " is no boolean"};
    Put(value == 1 ? "true" : "false");
    return value == 1;
  }

  std::int64_t Char() {
    const auto c = static_cast<char>(reader_.Take<std::uint8_t>());
    Text({&c, 1});
    return static_cast<unsigned char>(c);
  }

  template <class Whole>
  void Integer(Whole value) {
    if (out_ == nullptr) return;
    std::array<char, 24> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    out_->append(text.data(), end);
  }

  template <class Number>
  void Real(Number value) {
    if (out_ == nullptr) return;
    if (std::isnan(value)) return Put("\"NaN\"");
    if (std::isinf(value)) return Put(value > 0 ? "\"Infinity\"" : "\"-Infinity\"");
    if (value == 0 && std::signbit(value)) return Put("-0.0");  // "-0" is read as a whole number
    std::array<char, 32> text;  // the shortest that reads back as the same number
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    out_->append(text.data(), end);
  }

  void Text(std::string_view text) {
    if (out_ == nullptr) return;
    static constexpr std::string_view kHex = "0123456789abcdef";
    Put('"');
    while (!text.empty()) {
      const std::size_t length = CharacterLength(text);
      const char c = text.front();
      if (length == 0) {
        Put("\xef\xbf\xbd");  // the sign for a character that cannot be read
      } else if (c == '"' || c == '\\') {
        Put('\\');
        Put(c);
      } else if (c == '\n') {
        Put("\\n");
      } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
        Put("\\u00");
        Put(kHex[static_cast<unsigned char>(c) >> 4]);
        Put(kHex[c & 15]);
      } else {
        Put(text.substr(0, length));
      }
      text.remove_prefix(length == 0 ? 1 : length);
    }
    Put('"');
  }

  void String(const Type& type) {
    const std::string_view text = reader_.TakeString();
    if (type.length != 0 && text.size() > type.length) {
      throw Misfit{"the string has " + std::to_string(text.size()) + " bytes, at most " +
                   std::to_string(type.length) + " are allowed"};
    }
    Text(text);
  }

  std::int64_t Enum(const Type& type) {
    const auto value = reader_.Take<std::int32_t>();
    for (const Type::Enumerator& enumerator : type.enumerators) {
      if (enumerator.value != value) continue;
      Text(enumerator.name);
      return value;
    }
    throw Misfit{std::to_string(value) + " is no value of " + type.name};
  }

  void Sequence(const Type& type) {
    reader_.SkipCollectionHeader(*type.element);
    const auto count = reader_.Take<std::uint32_t>();
    if (type.length != 0 && count > type.length) {
      throw Misfit{"the sequence has " + std::to_string(count) + " elements, at most " +
                   std::to_string(type.length) + " are allowed"};
    }
    Elements(*type.element, count);
  }

  void Elements(const Type& element, std::size_t count) {
    reader_.Require(count, element.least_bytes);
    if (element.kind == Kind::kOctet) return Base64(reader_.TakeBytes(count));
    Put('[');
    for (std::size_t i = 0; i < count; ++i) {
      if (i > 0) Put(',');
      Element(element, i);
    }
    Put(']');
  }

  void Element(const Type& element, std::size_t index) {
    try {
      Value(element);
    } catch (Misfit& misfit) {
      misfit.Within("[" + std::to_string(index) + "]");
      throw;
    }
  }

  void Base64(std::span<const std::uint8_t> bytes) {
    if (out_ == nullptr) return;
    static constexpr std::string_view kLetters =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    Put('"');
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
      const std::size_t left = std::min<std::size_t>(bytes.size() - i, 3);
      std::uint32_t three = std::uint32_t{bytes[i]} << 16;
      if (left > 1) three |= std::uint32_t{bytes[i + 1]} << 8;
      if (left > 2) three |= bytes[i + 2];
      for (std::size_t k = 0; k < 4; ++k) {
        Put(k <= left ? kLetters[(three >> (18 - 6 * k)) & 63] : '=');
      }
    }
    Put('"');
  }

  void Member(const Type::Member& member) {
    try {
      Put('"');
      Put(member.name);
      Put("\":");
      Value(*member.type);
    } catch (Misfit& misfit) {
      misfit.Within(member.name);
      throw;
    }
  }

  void Struct(const Type& type) {
    char before = '{';
    for (const Type::Member& member : type.members) {
      Put(before);
      Member(member);
      before = ',';
    }
    Put('}');
  }

  void Union(const Type& type) {
    Put("{\"_d\":");
    const std::int64_t value = Discriminator(*type.element);
    if (const Type::Member* chosen = CaseOf(type, value)) {
      Put(',');
      Member(*chosen);
    }
    Put('}');
  }

  std::int64_t Discriminator(const Type& type) {
    switch (type.kind) {
      case Kind::kEnum:
        return Enum(type);
      case Kind::kBoolean:
        return Boolean() ? 1 : 0;
      case Kind::kInt8:
        return Whole(reader_.Take<std::int8_t>());
      case Kind::kInt16:
        return Whole(reader_.Take<std::int16_t>());
      case Kind::kUInt16:
        return Whole(reader_.Take<std::uint16_t>());
      case Kind::kInt32:
        return Whole(reader_.Take<std::int32_t>());
      case Kind::kUInt32:
        return Whole(reader_.Take<std::uint32_t>());
      case Kind::kInt64:
        return Whole(reader_.Take<std::int64_t>());
      case Kind::kUInt64:
        return Whole(reader_.Take<std::uint64_t>());
      case Kind::kChar:
        return Char();
      default:
        return Whole(reader_.Take<std::uint8_t>());
    }
  }

  template <class Number>
  std::int64_t Whole(Number value) {
    Integer(value);
    return static_cast<std::int64_t>(value);
  }

  CdrReader reader_;
  std::string* out_;
};

Status Walk(const Type& type, std::span<const std::uint8_t> cdr, std::string* out) {
  try {
    Writer writer(cdr, out);
    writer.Value(type);
    writer.Finish();
    return {};
  } catch (const Misfit& misfit) {
    const std::string place = misfit.path.empty() ? "" : misfit.path + ": ";
    return Error{ErrorCode::kDataLoss, place + misfit.message, misfit.path};
  }
}

}  // namespace

Result<std::string> ToJson(const Type& type, std::span<const std::uint8_t> cdr) {
  std::string json;
  json.reserve(2 * cdr.size());
  if (const Status walked = Walk(type, cdr, &json); !walked) return walked.error();
  return json;
}

Status Check(const Type& type, std::span<const std::uint8_t> cdr) {
  return Walk(type, cdr, nullptr);
}

}  // namespace exemplar::dynamic_data
