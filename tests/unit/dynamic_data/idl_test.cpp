#include <gtest/gtest.h>

#include "exemplar/dynamic_data/type.hpp"
#include "sample_types.hpp"

namespace exemplar::dynamic_data {
namespace {

std::string ErrorOf(const std::string& idl, const std::string& name = "A") {
  const auto type = ParseType(idl, name);
  return type.ok() ? "none" : type.error().message;
}

TEST(Idl, ReadsEverythingOfTheSharedSubset) {
  const auto type = ParseType(kIdl, "lab::v1::Sample");
  ASSERT_TRUE(type.ok()) << type.error().message;
  const Type& sample = **type;
  ASSERT_EQ(sample.members.size(), 11U);
  EXPECT_EQ(sample.name, "lab::v1::Sample");
  EXPECT_TRUE(sample.members[0].key);
  EXPECT_FALSE(sample.members[1].key);
  EXPECT_EQ(sample.members[1].type->kind, Kind::kUInt64);
  EXPECT_EQ(sample.members[2].type->enumerators[2].value, 6);
  EXPECT_EQ(sample.members[7].type->length, 4U);
  const Type& point = *sample.members[7].type->element;
  EXPECT_EQ(point.members[0].type->kind, Kind::kArray);
  EXPECT_EQ(point.members[0].type->length, 3U);
  const Type& shape = *sample.members[8].type;
  EXPECT_EQ(shape.members[0].labels, (std::vector<std::int64_t>{0, 5}));
  EXPECT_TRUE(shape.members[1].is_default);
  const Type& grid = *sample.members[10].type;
  EXPECT_EQ(grid.length, 2U);
  EXPECT_EQ(grid.element->length, 2U);
}

TEST(Idl, FindsTheTypeThatRos2NamesOnTheNetwork) {
  const auto type =
      ParseType("module std_msgs { module msg { struct String { string data; }; }; };",
                "std_msgs::msg::dds_::String_");
  ASSERT_TRUE(type.ok()) << type.error().message;
  EXPECT_EQ((*type)->members[0].name, "data");
}

TEST(Idl, SearchesNamesFromTheInnermostScopeOutwards) {
  const auto type = ParseType(R"(
    struct P { long outer; };
    module m { struct P { long inner; }; struct A { P near; ::P far; m::P full; }; };)",
                              "m::A");
  ASSERT_TRUE(type.ok()) << type.error().message;
  EXPECT_EQ((*type)->members[0].type->members[0].name, "inner");
  EXPECT_EQ((*type)->members[1].type->members[0].name, "outer");
  EXPECT_EQ((*type)->members[2].type->members[0].name, "inner");
}

TEST(Idl, NamesTheLineOfWhatItCannotRead) {
  EXPECT_EQ(ErrorOf("struct A {\n  long x\n};"), "IDL line 3: \";\" is due, not \"}\"");
  EXPECT_EQ(ErrorOf("struct A {\n  Lost x; };"), "IDL line 2: type \"Lost\" is not known here");
  EXPECT_EQ(ErrorOf("struct A { long x; long x; };"), "IDL line 1: member x is there twice");
  EXPECT_EQ(ErrorOf("struct A { @optional long x; };"),
            "IDL line 1: members with @optional are not known here");
  EXPECT_EQ(ErrorOf("struct B { long x; };"), "the IDL has no struct \"A\"");
  EXPECT_EQ(ErrorOf("struct A { long x[0]; };"),
            "IDL line 1: a length must be from 1 to 4294967295, not 0");
  EXPECT_NE(ErrorOf("struct A { long x[9223372036854775807 + 1]; };").find("too large"),
            std::string::npos);
  EXPECT_NE(ErrorOf("struct A { A again; };").find("not known"), std::string::npos);
  EXPECT_NE(ErrorOf("union A switch (double) { case 1: long x; };").find("switch"),
            std::string::npos);
}

TEST(Idl, RefusesTypesNestedTooDeepToBeWalked) {
  std::string sequences;
  for (int i = 0; i < 50000; ++i) sequences += "sequence<";
  EXPECT_NE(ErrorOf("struct A { " + sequences + " x; };").find("too deep"), std::string::npos);
  std::string structs = "struct S0 { long x; };\n";
  for (int i = 1; i < 200; ++i) {
    structs += "struct S" + std::to_string(i) + " { S" + std::to_string(i - 1) + " x; };\n";
  }
  EXPECT_NE(ErrorOf(structs, "S199").find("too deep"), std::string::npos);
  std::string modules;
  for (int i = 0; i < 50000; ++i) modules += "module m { ";
  EXPECT_NE(ErrorOf(modules).find("too deep"), std::string::npos);
}

}  // namespace
}  // namespace exemplar::dynamic_data
