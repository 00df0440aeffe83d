#include "exemplar/base/text.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "exemplar/base/rng.hpp"

namespace exemplar {
namespace {

TEST(TextTest, ReadsNumbersWholeOrNotAtAll) {
  EXPECT_EQ(ParseDouble(" -1.5e-3 "), -1.5e-3);
  EXPECT_EQ(ParseDouble("+2"), 2.0);
  EXPECT_FALSE(ParseDouble("1.5x"));
  EXPECT_FALSE(ParseDouble(""));
  EXPECT_FALSE(ParseDouble("1,5"));
  EXPECT_TRUE(std::isnan(*ParseDouble("nan")));
  EXPECT_EQ(ParseInteger("42"), 42);
  EXPECT_FALSE(ParseInteger("4.2"));
}

TEST(TextTest, WrittenNumbersReadBackAsTheSameDouble) {
  Rng rng(11);
  for (int i = 0; i < 10'000; ++i) {
    const double x = rng.Normal() * std::pow(10.0, rng.Uniform(-20, 20));
    EXPECT_EQ(ParseDouble(FormatDouble(x)), x);
  }
  EXPECT_EQ(FormatFixed(1.005, 1), "1.0");
}

TEST(TextTest, SplitsAndTrims) {
  const auto parts = Split("a,,b,", ',');
  ASSERT_EQ(parts.size(), 4U);
  EXPECT_EQ(parts[1], "");
  EXPECT_EQ(parts[3], "");
  EXPECT_EQ(Trim("\t a b \r\n"), "a b");
  EXPECT_EQ(Trim("  "), "");
}

TEST(TextTest, OffersTheNearestNameForASlipOfTheHand) {
  const std::vector<std::string> names{"target", "table", "grater"};
  EXPECT_EQ(NearestName("targte", names), "target");
  EXPECT_EQ(NearestName("grate", names), "grater");
  EXPECT_FALSE(NearestName("spoon-holder", names));
}

}  // namespace
}  // namespace exemplar
