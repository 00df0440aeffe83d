#include "exemplar/security/login.hpp"

#include <gtest/gtest.h>

namespace exemplar::security {
namespace {

TEST(LoginSessions, LiveWhileTheyAreUsed) {
  ManualClock clock;
  LoginSessions sessions(clock,
                         {.idle = std::chrono::minutes(10), .longest = std::chrono::minutes(25)});
  const auto anna = sessions.Open("token");
  EXPECT_EQ(sessions.Find(anna.id)->token, "token");
  EXPECT_EQ(sessions.Find(anna.id)->csrf, anna.csrf);
  for (int i = 0; i < 2; ++i) {
    clock.Advance(std::chrono::minutes(9));
    EXPECT_TRUE(sessions.Find(anna.id));
  }
  clock.Advance(std::chrono::minutes(9));
  EXPECT_FALSE(sessions.Find(anna.id)) << "27 min, 25 at the most";

  const auto ben = sessions.Open("token");
  clock.Advance(std::chrono::minutes(11));
  EXPECT_FALSE(sessions.Find(ben.id));
}

TEST(LoginSessions, EndWhenClosedAndNobodyGuessesThem) {
  ManualClock clock;
  LoginSessions sessions(clock);
  const auto anna = sessions.Open("token");
  const auto again = sessions.Open("token");
  EXPECT_NE(anna.id, again.id);
  EXPECT_NE(anna.id, anna.csrf);
  EXPECT_GE(anna.id.size(), 43U);
  EXPECT_FALSE(sessions.Find(""));
  EXPECT_FALSE(sessions.Find(anna.csrf));
  sessions.Close(anna.id);
  EXPECT_FALSE(sessions.Find(anna.id));
  EXPECT_TRUE(sessions.Find(again.id));
}

TEST(LoginSessions, BeyondTheMostTheLongestIdleGoes) {
  ManualClock clock;
  LoginSessions sessions(clock, {.sessions = 2});
  const auto first = sessions.Open("a");
  clock.Advance(std::chrono::seconds(1));
  const auto second = sessions.Open("b");
  clock.Advance(std::chrono::seconds(1));
  EXPECT_TRUE(sessions.Find(first.id));
  const auto third = sessions.Open("c");
  EXPECT_TRUE(sessions.Find(first.id));
  EXPECT_FALSE(sessions.Find(second.id));
  EXPECT_TRUE(sessions.Find(third.id));
}

TEST(SessionCookie, IsForThisHostAloneAndForNoScript) {
  EXPECT_EQ(SessionCookie("id", true),
            "__Host-exemplar=id; Path=/; HttpOnly; SameSite=Strict; Secure");
  EXPECT_EQ(SessionCookie("id", false), "exemplar=id; Path=/; HttpOnly; SameSite=Strict");
  EXPECT_TRUE(EndedSessionCookie(true).ends_with("; Max-Age=0"));
  EXPECT_EQ(SessionIdOf("a=b; __Host-exemplar=id; c=d", true), "id");
  EXPECT_EQ(SessionIdOf("exemplar=planted", true), "");
  EXPECT_EQ(SessionIdOf("xexemplar=id", false), "");
}

}  // namespace
}  // namespace exemplar::security
