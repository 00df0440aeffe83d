#include "exemplar/base/rng.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "exemplar/base/ids.hpp"

namespace exemplar {
namespace {

TEST(RngTest, TheSameSeedGivesTheSameNumbers) {
  Rng a(7), b(7), c(8);
  const std::uint64_t first = a.NextBits();
  EXPECT_EQ(first, b.NextBits());
  EXPECT_NE(first, c.NextBits());
}

TEST(RngTest, UniformFillsTheUnitIntervalEvenly) {
  Rng rng(1);
  std::array<int, 10> bins{};
  for (int i = 0; i < 100'000; ++i) {
    const double u = rng.Uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    ++bins[static_cast<std::size_t>(u * 10)];
  }
  for (const int count : bins) EXPECT_NEAR(count, 10'000, 400);
}

TEST(RngTest, NormalHasZeroMeanAndUnitDeviation) {
  Rng rng(2);
  double sum = 0, squares = 0;
  constexpr int kDraws = 200'000;
  for (int i = 0; i < kDraws; ++i) {
    const double x = rng.Normal();
    sum += x;
    squares += x * x;
  }
  EXPECT_NEAR(sum / kDraws, 0, 0.01);
  EXPECT_NEAR(std::sqrt(squares / kDraws), 1, 0.01);
}

TEST(RngTest, BelowNeverReachesItsBound) {
  Rng rng(3);
  std::array<int, 3> seen{};
  for (int i = 0; i < 3000; ++i) ++seen.at(rng.Below(3));
  for (const int count : seen) EXPECT_GT(count, 800);
}

TEST(RngTest, ForksAreIndependentOfDrawsMadeLater) {
  Rng a(5), b(5);
  Rng fork_of_a = a.Fork(1);
  Rng fork_of_b = b.Fork(1);
  Rng other = b.Fork(2);
  const std::uint64_t first = fork_of_a.NextBits();
  EXPECT_EQ(first, fork_of_b.NextBits());
  EXPECT_NE(first, other.NextBits());
}

TEST(IdsTest, NamesTheirKindAndContent) {
  Rng rng(1);
  const std::string id = MakeId("trial", rng);
  EXPECT_EQ(id.size(), std::string("trial-").size() + 16);
  EXPECT_NE(id, MakeId("trial", rng));
  EXPECT_EQ(ContentHash(""), "cbf29ce484222325");  // FNV-1a's offset basis
  EXPECT_EQ(ContentHash("a"), "af63dc4c8601ec8c");
}

}  // namespace
}  // namespace exemplar
