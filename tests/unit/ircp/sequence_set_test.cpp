#include "exemplar/ircp/sequence_set.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "exemplar/base/rng.hpp"

namespace exemplar::ircp {
namespace {

TEST(SequenceSetTest, CountsAsASetDoesInAnyOrder) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Rng rng(seed);
    SequenceSet numbers;
    std::set<std::uint64_t> truth;
    for (int i = 0; i < 300; ++i) {
      const std::uint64_t number = 1 + rng.Below(200);
      EXPECT_EQ(numbers.Insert(number), truth.insert(number).second);
      EXPECT_EQ(numbers.received(), truth.size());
      EXPECT_EQ(numbers.highest(), *truth.rbegin());
      EXPECT_EQ(numbers.lost(), *truth.rbegin() - *truth.begin() + 1 - truth.size());
    }
  }
}

TEST(SequenceSetTest, LosesNothingBeforeTheFirst) {
  SequenceSet numbers;
  EXPECT_EQ(numbers.lost(), 0u);
  numbers.Insert(1000);
  EXPECT_EQ(numbers.lost(), 0u);
}

TEST(SequenceSetTest, StaysExactOnLossesWhenGapsAreMore) {
  SequenceSet numbers;
  const std::uint64_t count = 3 * SequenceSet::kMaxGaps;
  for (std::uint64_t i = 0; i < count; ++i) EXPECT_TRUE(numbers.Insert(1 + 2 * i));
  EXPECT_EQ(numbers.received(), count);
  EXPECT_EQ(numbers.lost(), count - 1);
  EXPECT_FALSE(numbers.Insert(2));  // its gap was closed long ago
  EXPECT_TRUE(numbers.Insert(2 * count - 2));
  EXPECT_EQ(numbers.lost(), count - 2);
}

TEST(SequenceSetTest, TakesTheLargestNumbers) {
  SequenceSet numbers;
  EXPECT_TRUE(numbers.Insert(UINT64_MAX));
  EXPECT_TRUE(numbers.Insert(UINT64_MAX - 2));
  EXPECT_FALSE(numbers.Insert(UINT64_MAX));
  EXPECT_EQ(numbers.lost(), 1u);
}

}  // namespace
}  // namespace exemplar::ircp
