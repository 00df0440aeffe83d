#include "greeting_guard.hpp"

#include <gtest/gtest.h>

namespace exemplar::bus {
namespace {

TEST(GreetingGuardTest, StandsBeforeFastDdsOwnFunction) { EXPECT_TRUE(GreetingsAreGuarded()); }

}  // namespace
}  // namespace exemplar::bus
