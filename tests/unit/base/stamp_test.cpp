#include "exemplar/base/stamp.hpp"

#include <gtest/gtest.h>

namespace exemplar {
namespace {

TEST(StampTest, ConvertsSecondsToTheNearestNanosecond) {
  EXPECT_EQ(FromSeconds(0.1).count(), 100'000'000);
  EXPECT_EQ(FromSeconds(-1e-9).count(), -1);
  EXPECT_EQ(Stamp::FromSeconds(2.5).nanoseconds(), 2'500'000'000);
}

TEST(StampTest, DifferencesAndSumsAreExact) {
  const Stamp a = Stamp::FromNanoseconds(1'700'000'000'123'456'789);
  const Stamp b = a + Duration(7);
  EXPECT_EQ((b - a).count(), 7);
  EXPECT_EQ(b - Duration(7), a);
  EXPECT_LT(a, b);
}

TEST(StampTest, PrintsAsIso8601InUtc) {
  EXPECT_EQ(ToIso8601(Stamp::FromNanoseconds(0)), "1970-01-01T00:00:00.000000Z");
  EXPECT_EQ(ToIso8601(Stamp::FromNanoseconds(951'782'400'250'000'000)),
            "2000-02-29T00:00:00.250000Z");
  EXPECT_EQ(ToIso8601(Stamp::FromNanoseconds(-1)), "1969-12-31T23:59:59.999999Z");
}

}  // namespace
}  // namespace exemplar
