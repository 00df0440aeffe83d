#include "exemplar/dynamic_data/json.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sample_types.hpp"

namespace exemplar::dynamic_data {
namespace {

std::shared_ptr<const Type> Parsed(const std::string& idl, const std::string& name) {
  auto type = ParseType(idl, name);
  if (!type.ok()) throw std::runtime_error(type.error().message);
  return *type;
}

std::shared_ptr<const Type> SampleType() { return Parsed(kIdl, "lab::v1::Sample"); }

std::string ReadError(const std::string& members, const std::string& json) {
  const auto bytes = FromJson(*Parsed("struct A { " + members + " };", "A"), json);
  return bytes.ok() ? "none" : bytes.error().message;
}

TEST(Json, TellsASampleByItsType) {
  for (const bool little_endian : {true, false}) {
    const auto json = ToJson(*SampleType(), SampleBytes(little_endian));
    ASSERT_TRUE(json.ok()) << json.error().message;
    EXPECT_EQ(*json, kSampleJson);
  }
}

TEST(Json, BecomesTheSameBytesAgain) {
  const auto bytes = FromJson(*SampleType(), kSampleJson);
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  EXPECT_EQ(*bytes, SampleBytes());
}

TEST(Json, ReadsVersion2WithItsNarrowAlignmentAndCollectionHeaders) {
  const auto type =
      Parsed("struct P { string s; }; struct A { octet o; double d; sequence<P> p; };", "A");
  Cdr cdr(true, 4, 6);
  cdr.Put(std::uint8_t{7}).Put(2.5);
  cdr.Put(std::uint32_t{10}).Put(std::uint32_t{1}).Text("a");
  const auto json = ToJson(*type, cdr.bytes());
  ASSERT_TRUE(json.ok()) << json.error().message;
  EXPECT_EQ(*json, R"({"o":7,"d":2.5,"p":[{"s":"a"}]})");
}

TEST(Json, KeepsNumbersExactly) {
  const auto type = Parsed("struct A { double d; float f; long long i; };", "A");
  for (const double value : {0.1, -0.0, 5e-324, 1.7976931348623157e308}) {
    const auto bytes =
        Cdr().Put(value).Put(0.1F).Put(std::int64_t{-9223372036854775807 - 1}).bytes();
    const auto json = ToJson(*type, bytes);
    ASSERT_TRUE(json.ok());
    const auto again = FromJson(*type, *json);
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(*again, bytes) << *json;
  }
}

TEST(Json, NamesNumbersThatAreNotFinite) {
  const auto type = Parsed("struct A { double x[3]; };", "A");
  const double infinity = std::numeric_limits<double>::infinity();
  const auto json = ToJson(*type, Cdr().Put(std::nan("")).Put(infinity).Put(-infinity).bytes());
  ASSERT_TRUE(json.ok());
  EXPECT_EQ(*json, R"({"x":["NaN","Infinity","-Infinity"]})");
  EXPECT_TRUE(FromJson(*type, *json).ok());
}

TEST(Json, IsUtf8WhateverTheStringsHold) {
  const auto type = Parsed("struct A { string s; };", "A");
  const auto json =
      ToJson(*type, Cdr().Text("\xc3\xa9\xff\xed\xa0\x80\xf4\x90\x80\x80\xc3\t\x1f").bytes());
  ASSERT_TRUE(json.ok());
  std::string expected = "{\"s\":\"\xc3\xa9";
  for (int i = 0; i < 9; ++i) expected += "\xef\xbf\xbd";
  EXPECT_EQ(*json, expected + "\\u0009\\u001f\"}");
}

TEST(Json, TakesWholeNumbersAsTextAndOctetsAsNumbers) {
  const auto type = Parsed("struct A { unsigned long long n; sequence<octet> o; };", "A");
  const auto bytes = FromJson(*type, R"({"n":"18446744073709551615","o":[1,2.0]})");
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  EXPECT_EQ(*ToJson(*type, *bytes), R"({"n":18446744073709551615,"o":"AQI="})");
}

TEST(Json, SaysWhereTheBytesDoNotFit) {
  const auto type = SampleType();
  const std::vector<std::uint8_t> good = SampleBytes();
  for (std::size_t length = 0; length < good.size(); ++length) {
    const std::vector<std::uint8_t> cut(good.begin(), good.begin() + static_cast<long>(length));
    EXPECT_FALSE(ToJson(*type, cut).ok()) << length;
  }
  std::vector<std::uint8_t> longer = good;
  longer.resize(good.size() + 8);
  EXPECT_EQ(Check(*type, longer).error().message,
            "byte " + std::to_string(good.size()) + ": 8 bytes are left over");
  std::vector<std::uint8_t> other = good;
  other[1] = 3;
  EXPECT_EQ(Check(*type, other).error().code, ErrorCode::kDataLoss);
  const auto points = Parsed("struct P { boolean b; }; struct A { sequence<P> p; };", "A");
  const auto bad = Cdr().Put(std::uint32_t{2}).Put(std::uint8_t{1}).Put(std::uint8_t{2}).bytes();
  EXPECT_EQ(Check(*points, bad).error().message, "p[1].b: 2 is no boolean");
  EXPECT_EQ(Check(*points, bad).error().field, "p[1].b");
}

TEST(Json, ClaimsOfEndlessSequencesCostNothing) {
  const auto type = Parsed("struct A { sequence<sequence<double>> x; };", "A");
  const auto status = Check(*type, Cdr().Put(std::uint32_t{0xFFFFFFFF}).bytes());
  EXPECT_NE(status.error().message.find("4294967295 elements"), std::string::npos);
}

TEST(Json, NamesThePlaceOrMemberAtFault) {
  EXPECT_EQ(ReadError("long x;", "{\n  \"x\": }"), "line 2, column 8: this is not JSON");
  EXPECT_EQ(ReadError("long x;", R"({"x": 1.5})"),
            "x: a whole number from -2147483648 to 2147483647 is due, not 1.5");
  EXPECT_EQ(ReadError("octet x;", R"({"x": 256})"),
            "x: a whole number from 0 to 255 is due, not 256");
  EXPECT_EQ(ReadError("long first;", R"({"frist": 1})"),
            "frist: is no member of A; did you mean first?");
  EXPECT_EQ(ReadError("long x;", "{}"), "x: is not there");
  EXPECT_EQ(ReadError("string<2> x;", R"({"x": "abc"})"),
            "x: the string has 3 bytes, at most 2 are allowed");
  EXPECT_EQ(ReadError("double x[2];", R"({"x": [1]})"), "x: the array has 1 elements, must have 2");
  EXPECT_EQ(ReadError("sequence<double> x;", R"({"x": [1, true]})"),
            "x[1]: a number is due, not true");
  EXPECT_EQ(ReadError("sequence<octet> x;", R"({"x": "A"})"), "x: base64 text is due, not \"A\"");
  EXPECT_EQ(ReadError("string x;", "[]"), "an object is due, not []");
  EXPECT_NE(ReadError("string x;", std::string(100000, '[')).find("nested deeper"),
            std::string::npos);
}

TEST(Json, FillsInWhatTheCallerKnows) {
  const auto type = Parsed("struct A { string source; unsigned long long seq; long x; };", "A");
  const Absent absent = [](const std::string& member) -> std::optional<std::string> {
    if (member == "source") return "\"gateway\"";
    if (member == "seq") return "4";
    return std::nullopt;
  };
  EXPECT_EQ(*ToJson(*type, *FromJson(*type, R"({"x":1})", absent)),
            R"({"source":"gateway","seq":4,"x":1})");
  EXPECT_EQ(*ToJson(*type, *FromJson(*type, R"({"seq":9,"x":1})", absent)),
            R"({"source":"gateway","seq":9,"x":1})");
  EXPECT_EQ(FromJson(*type, "{}", absent).error().field, "x");
}

}  // namespace
}  // namespace exemplar::dynamic_data
