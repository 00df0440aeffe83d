#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/dynamic_data/type.hpp"
#include "idl_lexer.hpp"

namespace exemplar::dynamic_data {
namespace {

using TypePtr = std::shared_ptr<const Type>;

/// Reading and writing samples calls itself this deep at most.
constexpr int kDeepest = 64;
constexpr std::size_t kMostIdl = std::size_t{1} << 20;

/// Thrown and caught within this file: a parser that checks each step's Result hides its grammar.
struct SyntaxError {
  std::string message;
};

std::size_t Saturating(std::size_t a, std::size_t b) {
  const std::size_t most = std::numeric_limits<std::size_t>::max();
  return b != 0 && a > most / b ? most : a * b;
}

std::size_t SaturatingSum(std::size_t a, std::size_t b) {
  const std::size_t most = std::numeric_limits<std::size_t>::max();
  return a > most - b ? most : a + b;
}

TypePtr Primitive(Kind kind, std::size_t bytes) {
  return std::make_shared<const Type>(Type{.kind = kind, .least_bytes = bytes});
}

class Parser {
 public:
  explicit Parser(std::string_view idl) : lexer_(idl) { Advance(); }

  std::map<std::string, TypePtr> Parse() {
    while (token_.kind != Token::Kind::kEnd) Definition();
    return std::move(types_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw SyntaxError{"line " + std::to_string(token_.line) + ": " + what};
  }
  void Advance() { token_ = lexer_.Next(); }
  bool Is(std::string_view text) const {
    return token_.text == text && token_.kind != Token::Kind::kText;
  }
  bool Accept(std::string_view text) {
    if (!Is(text)) return false;
    Advance();
    return true;
  }
  void Expect(std::string_view text) {
    if (Accept(text)) return;
    Fail("\"" + std::string(text) + "\" is due, not " +
         (token_.kind == Token::Kind::kEnd ? "the end" : "\"" + std::string(token_.text) + "\""));
  }
  std::string Name() {
    if (token_.kind != Token::Kind::kName || token_.text.find("::") != std::string_view::npos) {
      Fail("a name is due, not \"" + std::string(token_.text) + "\"");
    }
    std::string name(token_.text);
    Advance();
    return name;
  }
  std::string Scoped(const std::string& name) const {
    return scope_.empty() ? name : scope_ + "::" + name;
  }

  /// Whether one of the annotations was @key.
  bool Annotations() {
    bool key = false;
    while (Accept("@")) {
      const std::string name = Name();
      if (name == "optional" || name == "external") {
        Fail("members with @" + name + " are not known here");
      }
      key = key || name == "key" || name == "Key";
      if (!Accept("(")) continue;
      for (int open = 1; open > 0; Advance()) {
        if (token_.kind == Token::Kind::kEnd) Fail("the annotation does not end");
        if (Is("(")) ++open;
        if (Is(")")) --open;
      }
    }
    return key;
  }

  void Definition() {
    Annotations();
    if (Accept(";")) return;
    if (Accept("module")) return Module();
    if (Accept("const")) return Constant();
    if (Accept("typedef")) return Typedef();
    if (Accept("struct")) return Struct();
    if (Accept("union")) return Union();
    if (Accept("enum")) return Enum();
    Fail("\"" + std::string(token_.text) + "\" begins no definition that is known here");
  }

  void Module() {
    const std::string outer = scope_;
    if (std::count(scope_.begin(), scope_.end(), ':') > std::ptrdiff_t{2} * kDeepest) {
      Fail("modules lie too deep");
    }
    scope_ = Scoped(Name());
    Expect("{");
    while (!Is("}")) {
      if (token_.kind == Token::Kind::kEnd) Fail("the module does not end");
      Definition();
    }
    Expect("}");
    Accept(";");
    scope_ = outer;
  }

  void Constant() {
    const TypePtr type = TypeSpec();
    const std::string name = Name();
    Expect("=");
    // Constants of other kinds bound nothing.
    if (type->kind == Kind::kString || type->kind == Kind::kFloat32 ||
        type->kind == Kind::kFloat64 || type->kind == Kind::kChar) {
      while (!Is(";") && token_.kind != Token::Kind::kEnd) Advance();
    } else {
      constants_[Scoped(name)] = Sum();
    }
    Expect(";");
  }

  void Typedef() {
    const TypePtr type = TypeSpec();
    do {
      const std::string name = Name();
      types_[Scoped(name)] = Arrays(type);
    } while (Accept(","));
    Expect(";");
  }

  void Struct() {
    Type type{.kind = Kind::kStruct, .name = Scoped(Name()), .least_bytes = 0};
    if (Accept(";")) return;  // announced only
    if (Is(":")) Fail("structs that inherit are not known here");
    Expect("{");
    while (!Accept("}")) Members(type);
    Accept(";");
    if (type.members.empty()) Fail("struct " + type.name + " has no member");
    Define(std::move(type));
  }

  void Members(Type& type) {
    const bool key = Annotations();
    const TypePtr member_type = TypeSpec();
    do {
      Annotations();
      Type::Member member{.name = Name(), .type = Arrays(member_type), .key = key};
      type.least_bytes = SaturatingSum(type.least_bytes, member.type->least_bytes);
      Add(type, std::move(member));
    } while (Accept(","));
    Expect(";");
  }

  void Add(Type& type, Type::Member member) const {
    for (const Type::Member& other : type.members) {
      if (other.name == member.name) Fail("member " + member.name + " is there twice");
    }
    type.depth = std::max(type.depth, member.type->depth + 1);
    type.members.push_back(std::move(member));
  }

  void Union() {
    Type type{.kind = Kind::kUnion, .name = Scoped(Name())};
    if (Accept(";")) return;
    Expect("switch");
    Expect("(");
    Annotations();
    type.element = TypeSpec();
    switch (type.element->kind) {
      case Kind::kFloat32:
      case Kind::kFloat64:
      case Kind::kString:
      case Kind::kSequence:
      case Kind::kArray:
      case Kind::kStruct:
      case Kind::kUnion:
        Fail("a union cannot switch on this type");
      default:
        break;
    }
    Expect(")");
    type.least_bytes = type.element->least_bytes;
    Expect("{");
    while (!Accept("}")) Case(type);
    Accept(";");
    if (type.members.empty()) Fail("union " + type.name + " has no case");
    Define(std::move(type));
  }

  void Case(Type& type) {
    Type::Member member;
    while (Is("case") || Is("default")) {
      if (Accept("default")) {
        member.is_default = true;
      } else {
        Advance();
        member.labels.push_back(Label(*type.element));
      }
      Expect(":");
    }
    if (member.labels.empty() && !member.is_default) Fail("\"case\" or \"default\" is due");
    Annotations();
    const TypePtr of = TypeSpec();
    Annotations();
    member.name = Name();
    member.type = Arrays(of);
    Expect(";");
    Add(type, std::move(member));
  }

  std::int64_t Label(const Type& discriminator) {
    if (discriminator.kind == Kind::kBoolean && (Is("TRUE") || Is("FALSE"))) {
      const bool value = Is("TRUE");
      Advance();
      return value ? 1 : 0;
    }
    if (token_.kind == Token::Kind::kText && token_.text.size() == 3) {
      const char value = token_.text[1];
      Advance();
      return static_cast<unsigned char>(value);
    }
    if (discriminator.kind == Kind::kEnum && token_.kind == Token::Kind::kName) {
      const std::string_view name = token_.text.substr(token_.text.rfind(':') + 1);
      for (const Type::Enumerator& enumerator : discriminator.enumerators) {
        if (enumerator.name == name) {
          Advance();
          return enumerator.value;
        }
      }
    }
    return Sum();
  }

  void Enum() {
    Type type{.kind = Kind::kEnum, .name = Scoped(Name()), .least_bytes = 4};
    Expect("{");
    std::int64_t next = 0;
    do {
      if (Is("}")) break;
      // @value(N) numbers an enumerator.
      while (Accept("@")) {
        const std::string annotation = Name();
        if (!Accept("(")) continue;
        if (annotation == "value") {
          next = Sum();
        } else {
          while (!Is(")") && token_.kind != Token::Kind::kEnd) Advance();
        }
        Expect(")");
      }
      if (next < 0 || next > std::numeric_limits<std::int32_t>::max()) {
        Fail("an enumerator's value must have 31 bits");
      }
      const std::string name = Name();
      constants_[Scoped(name)] = next;
      type.enumerators.push_back({.name = name, .value = static_cast<std::int32_t>(next++)});
    } while (Accept(","));
    Expect("}");
    Accept(";");
    if (type.enumerators.empty()) Fail("enum " + type.name + " has no value");
    Define(std::move(type));
  }

  void Define(Type type) {
    if (type.depth > kDeepest) Fail(type.name + " is nested too deep");
    std::string name = type.name;
    if (!types_.emplace(name, std::make_shared<const Type>(std::move(type))).second) {
      Fail(name + " is defined twice");
    }
  }

  TypePtr TypeSpec() {
    Annotations();
    if (token_.kind != Token::Kind::kName) {
      Fail("a type is due, not \"" + std::string(token_.text) + "\"");
    }
    if (Accept("sequence")) return Sequence();
    if (Accept("string")) return String();
    if (Accept("unsigned")) {
      if (Accept("short")) return Primitive(Kind::kUInt16, 2);
      Expect("long");
      return Accept("long") ? Primitive(Kind::kUInt64, 8) : Primitive(Kind::kUInt32, 4);
    }
    if (Accept("long")) {
      if (Is("double")) Fail("long double is not known here");
      return Accept("long") ? Primitive(Kind::kInt64, 8) : Primitive(Kind::kInt32, 4);
    }
    static const std::map<std::string_view, std::pair<Kind, std::size_t>> kPrimitives = {
        {"boolean", {Kind::kBoolean, 1}}, {"octet", {Kind::kOctet, 1}},
        {"uint8", {Kind::kOctet, 1}},     {"char", {Kind::kChar, 1}},
        {"int8", {Kind::kInt8, 1}},       {"short", {Kind::kInt16, 2}},
        {"int16", {Kind::kInt16, 2}},     {"uint16", {Kind::kUInt16, 2}},
        {"int32", {Kind::kInt32, 4}},     {"uint32", {Kind::kUInt32, 4}},
        {"int64", {Kind::kInt64, 8}},     {"uint64", {Kind::kUInt64, 8}},
        {"float", {Kind::kFloat32, 4}},   {"double", {Kind::kFloat64, 8}}};
    if (const auto found = kPrimitives.find(token_.text); found != kPrimitives.end()) {
      Advance();
      return Primitive(found->second.first, found->second.second);
    }
    const TypePtr* named = Find(types_, token_.text);
    if (named == nullptr) Fail("type \"" + std::string(token_.text) + "\" is not known here");
    Advance();
    return *named;
  }

  /// As seen from the present scope outwards.
  template <class Value>
  const Value* Find(const std::map<std::string, Value>& all, std::string_view name) const {
    const bool rooted = name.starts_with("::");
    std::string scope = rooted ? std::string() : scope_;
    if (rooted) name.remove_prefix(2);
    for (;;) {
      const std::string full = scope.empty() ? std::string(name) : scope + "::" + std::string(name);
      if (const auto found = all.find(full); found != all.end()) return &found->second;
      if (scope.empty()) return nullptr;
      const std::size_t cut = scope.rfind("::");
      scope.resize(cut == std::string::npos ? 0 : cut);
    }
  }

  TypePtr Sequence() {
    // Types are read by calls that nest as they do; the text may nest them without end.
    if (++nesting_ > kDeepest) Fail("sequences are nested too deep");
    Expect("<");
    Type type{.kind = Kind::kSequence, .element = TypeSpec(), .least_bytes = 4};
    if (Accept(",")) type.length = Length();
    Expect(">");
    --nesting_;
    type.depth = type.element->depth + 1;
    if (type.depth > kDeepest) Fail("a sequence is nested too deep");
    return std::make_shared<const Type>(std::move(type));
  }

  TypePtr String() {
    Type type{.kind = Kind::kString, .least_bytes = 4};
    if (Accept("<")) {
      type.length = Length();
      Expect(">");
    }
    return std::make_shared<const Type>(std::move(type));
  }

  TypePtr Arrays(TypePtr element) {
    std::vector<std::size_t> lengths;
    while (Accept("[")) {
      lengths.push_back(Length());
      Expect("]");
    }
    for (auto length = lengths.rbegin(); length != lengths.rend(); ++length) {
      Type type{.kind = Kind::kArray, .element = element, .length = *length};
      type.least_bytes = Saturating(element->least_bytes, *length);
      type.depth = element->depth + 1;
      if (type.depth > kDeepest) Fail("an array is nested too deep");
      element = std::make_shared<const Type>(std::move(type));
    }
    return element;
  }

  std::size_t Length() {
    const std::int64_t length = Sum();
    if (length < 1 || length > std::numeric_limits<std::uint32_t>::max()) {
      Fail("a length must be from 1 to 4294967295, not " + std::to_string(length));
    }
    return static_cast<std::size_t>(length);
  }

  /// Whole numbers and constants with + - * between them: what bounds are made of.
  std::int64_t Sum() {
    std::int64_t value = Product();
    for (;;) {
      bool over = false;
      if (Accept("+")) {
        over = __builtin_add_overflow(value, Product(), &value);
      } else if (Accept("-")) {
        over = __builtin_sub_overflow(value, Product(), &value);
      } else {
        return value;
      }
      if (over) Fail("a number is too large");
    }
  }

  std::int64_t Product() {
    std::int64_t value = Factor();
    while (Accept("*")) {
      if (__builtin_mul_overflow(value, Factor(), &value)) Fail("a number is too large");
    }
    return value;
  }

  std::int64_t Factor() {
    if (Accept("-")) {
      if (token_.kind != Token::Kind::kNumber) Fail("a number is due behind -");
      return -Factor();
    }
    if (token_.kind == Token::Kind::kNumber) {
      const std::string text(token_.text);
      std::size_t used = 0;
      std::int64_t value = 0;
      try {
        value = std::stoll(text, &used, 0);
      } catch (const std::exception&) {
        used = 0;
      }
      if (used != text.size()) Fail("\"" + text + "\" is not a whole number");
      Advance();
      return value;
    }
    const std::int64_t* constant = Find(constants_, token_.text);
    if (constant == nullptr) Fail("\"" + std::string(token_.text) + "\" is no number");
    Advance();
    return *constant;
  }

  Lexer lexer_;
  Token token_;
  std::string scope_;
  int nesting_ = 0;
  std::map<std::string, TypePtr> types_;
  std::map<std::string, std::int64_t> constants_;
};

/// "a::b::dds_::C_" is a::b::C as ROS 2 names it on the network; nullopt for other names.
std::optional<std::string> WithoutRosMarks(std::string_view name) {
  constexpr std::string_view kMark = "::dds_::";
  const std::size_t at = name.find(kMark);
  if (at == std::string_view::npos || !name.ends_with('_')) return std::nullopt;
  const std::string_view last = name.substr(at + kMark.size());
  return std::string(name.substr(0, at)) + "::" + std::string(last.substr(0, last.size() - 1));
}

}  // namespace

Result<std::shared_ptr<const Type>> ParseType(std::string_view idl, std::string_view name) {
  if (idl.size() > kMostIdl) {
    return InvalidArgument("the IDL has " + std::to_string(idl.size()) + " bytes, at most " +
                           std::to_string(kMostIdl) + " are read");
  }
  try {
    const std::map<std::string, TypePtr> types = Parser(idl).Parse();
    auto found = types.find(std::string(name));
    if (found == types.end()) {
      if (const auto plain = WithoutRosMarks(name)) found = types.find(*plain);
    }
    if (found == types.end() ||
        (found->second->kind != Kind::kStruct && found->second->kind != Kind::kUnion)) {
      return NotFound("the IDL has no struct \"" + std::string(name) + "\"");
    }
    return found->second;
  } catch (const SyntaxError& error) {
    return InvalidArgument("IDL " + error.message);
  }
}

}  // namespace exemplar::dynamic_data
