#include "admission.hpp"

#include <gtest/gtest.h>

namespace exemplar::http {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

Limits Small() {
  Limits limits;
  limits.connections = 5;
  limits.connections_per_peer = 3;
  limits.accepts_per_second = 100;
  limits.accepts_per_second_per_peer = 10;
  return limits;
}

TEST(Admission, BoundsConnectionsOfOneAddressAndOfAll) {
  Admission admission(Small(), Duration(0));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(admission.Enter("a", Duration(0)));
  EXPECT_FALSE(admission.Enter("a", Duration(0)));
  EXPECT_TRUE(admission.Enter("b", Duration(0)));
  EXPECT_TRUE(admission.Enter("b", Duration(0)));
  EXPECT_FALSE(admission.Enter("b", Duration(0)));
  EXPECT_EQ(admission.connections(), 5U);
  admission.Leave("a");
  EXPECT_TRUE(admission.Enter("b", Duration(0)));
}

TEST(Admission, BoundsTheRateOfOneAddressWithoutHarmToOthers) {
  Admission admission(Small(), Duration(0));
  int entered = 0;
  for (int i = 0; i < 1000; ++i) {
    if (admission.Enter("hasty", milliseconds(i))) {
      ++entered;
      admission.Leave("hasty");
    }
  }
  EXPECT_GE(entered, 10);
  EXPECT_LE(entered, 20);
  EXPECT_TRUE(admission.Enter("other", seconds(1)));
}

TEST(Admission, BoundsTheRateOfAll) {
  Admission admission(Small(), Duration(0));
  int entered = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::string peer = "peer" + std::to_string(i);
    if (admission.Enter(peer, Duration(0))) {
      ++entered;
      admission.Leave(peer);
    }
  }
  EXPECT_EQ(entered, 100);
}

TEST(Admission, ForgetsAddressesButNotThoseThatAreConnected) {
  Limits limits = Small();
  limits.accepts_per_second = 1e9;
  Admission admission(limits, Duration(0));
  ASSERT_TRUE(admission.Enter("kept", Duration(0)));
  for (int i = 0; i < 10000; ++i) {
    const std::string peer = "peer" + std::to_string(i);
    if (admission.Enter(peer, Duration(0))) admission.Leave(peer);
  }
  EXPECT_EQ(admission.connections(), 1U);
  admission.Leave("kept");
  EXPECT_EQ(admission.connections(), 0U);
}

}  // namespace
}  // namespace exemplar::http
