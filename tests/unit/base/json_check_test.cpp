#include "exemplar/base/json_check.hpp"

#include <gtest/gtest.h>

#include <string>

namespace exemplar {
namespace {

TEST(JsonCheck, TakesJsonOfAnyKind) {
  for (const char* text :
       {"{}", "[]", "1", "null", "\"a\"", R"( {"a": [1, 2.5e3, {"b": true}]} )"}) {
    EXPECT_FALSE(FindJsonFault(text, 4)) << text;
  }
}

TEST(JsonCheck, TellsWhereItEnds) {
  const std::string text = "{\"skill\":\n {\"name\" \"press\"}}";
  const auto fault = FindJsonFault(text, 4);
  ASSERT_TRUE(fault);
  EXPECT_FALSE(fault->too_deep);
  EXPECT_EQ(text.substr(0, fault->byte), "{\"skill\":\n {\"name\" \"press\"");
  for (const char* bad : {"", " ", "{", "[1,]", "{'a': 1}", "1 2", "NaN", "\xff", "\"\x01\""}) {
    EXPECT_TRUE(FindJsonFault(bad, 4)) << bad;
  }
}

TEST(JsonCheck, CountsHowDeepObjectsAndArraysNest) {
  EXPECT_FALSE(FindJsonFault("[[[]], [{}]]", 3));
  const auto fault = FindJsonFault("[[[]], [{\"a\": {}}]]", 3);
  ASSERT_TRUE(fault);
  EXPECT_TRUE(fault->too_deep);
  EXPECT_TRUE(FindJsonFault(std::string(1'000'000, '['), 64)->too_deep);
}

}  // namespace
}  // namespace exemplar
