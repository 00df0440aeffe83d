#include "exemplar/base/result.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <set>

namespace exemplar {
namespace {

Result<int> Half(int n) {
  if (n % 2 != 0) return InvalidArgument(std::to_string(n) + " is odd", "n");
  return n / 2;
}

TEST(ResultTest, HoldsAValueOrAnError) {
  EXPECT_EQ(Half(4).value(), 2);
  const Result<int> odd = Half(3);
  ASSERT_FALSE(odd.ok());
  EXPECT_EQ(odd.error().message, "3 is odd");
  EXPECT_EQ(odd.error().field, "n");
}

TEST(ResultTest, MovesOutValuesThatCannotBeCopied) {
  Result<std::unique_ptr<int>> made = std::make_unique<int>(7);
  const std::unique_ptr<int> taken = std::move(made).value();
  EXPECT_EQ(*taken, 7);
}

TEST(ResultTest, PlaceComesBeforeTheMessage) {
  const Error error = WithPlace(WithPlace(InvalidArgument("is odd"), "line 3"), "a.csv");
  EXPECT_EQ(error.message, "a.csv: line 3: is odd");
  EXPECT_EQ(error.code, ErrorCode::kInvalidArgument);
}

TEST(ErrorCodeTest, IsFoundAgainByItsName) {
  std::set<std::string_view> names;
  for (const ErrorCode code : kErrorCodes) {
    EXPECT_EQ(ParseErrorCode(ToString(code)), code);
    names.insert(ToString(code));
  }
  EXPECT_EQ(names.size(), kErrorCodes.size());
  EXPECT_EQ(ParseErrorCode("none_of_them"), std::nullopt);
}

TEST(ResultTest, StatusIsGoodUnlessToldOtherwise) {
  EXPECT_TRUE(Status().ok());
  EXPECT_FALSE(Status(NotFound("no such trial")).ok());
}

}  // namespace
}  // namespace exemplar
