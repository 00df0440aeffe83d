#include "exemplar/http/message.hpp"

#include <gtest/gtest.h>

#include "origin.hpp"

namespace exemplar::http {
namespace {

TEST(Target, SplitsPathAndQueryAndDecodesThem) {
  const auto target = ParseTarget("/v1/a%2Fb/c%20d?x=1+2&y=%3d&flag&&z=");
  ASSERT_TRUE(target.ok());
  EXPECT_EQ(target->segments, (std::vector<std::string>{"v1", "a/b", "c d"}));
  const std::vector<std::pair<std::string, std::string>> query = {
      {"x", "1 2"}, {"y", "="}, {"flag", ""}, {"z", ""}};
  EXPECT_EQ(target->query, query);
}

TEST(Target, TellsARootFromNothing) {
  EXPECT_EQ(ParseTarget("/")->segments, std::vector<std::string>{""});
  EXPECT_EQ(ParseTarget("/?")->segments, std::vector<std::string>{""});
  EXPECT_EQ(ParseTarget("").error().code, ErrorCode::kInvalidArgument);
}

TEST(Target, RefusesBrokenEscapesControlsAndDotSegments) {
  for (const char* bad : {"*", "http://a/b", "/%", "/%4", "/%zz", "/a%00b", "/a\tb", "/?x=%g1",
                          "/..", "/a/../b", "/a/%2e%2E/b", "/."}) {
    EXPECT_FALSE(ParseTarget(bad).ok()) << bad;
  }
}

TEST(Pattern, TakesVariablesWithTextAroundThem) {
  const auto pattern = PathPattern::Parse("/v1/skills/{name}:query");
  ASSERT_TRUE(pattern.ok());
  const auto match = pattern->Match({"v1", "skills", "press:query"});
  ASSERT_TRUE(match);
  EXPECT_EQ(match->at("name"), "press");
  EXPECT_FALSE(pattern->Match({"v1", "skills", ":query"}));
  EXPECT_FALSE(pattern->Match({"v1", "skills", "press"}));
  EXPECT_FALSE(pattern->Match({"v1", "skills", "press:query", ""}));
  EXPECT_FALSE(pattern->Match({"v1", "skills"}));
}

TEST(Pattern, TakesAllThatIsLeft) {
  const auto pattern = PathPattern::Parse("/topics/{topic=**}");
  ASSERT_TRUE(pattern.ok());
  EXPECT_EQ(pattern->Match({"topics", "ircp", "suit"})->at("topic"), "ircp/suit");
  EXPECT_FALSE(pattern->Match({"topics", ""}));
}

TEST(Pattern, RefusesWhatIsNone) {
  for (const char* bad : {"", "a", "/{", "/}", "/{}", "/{a}{b}", "/{a}/{a}", "/{a=**}/b", "/}{"}) {
    EXPECT_FALSE(PathPattern::Parse(bad).ok()) << bad;
  }
}

TEST(HeaderFields, CompareWithoutCase) {
  Headers headers{{"Content-Type", "a"}, {"X", "1"}, {"x", "2"}};
  EXPECT_EQ(headers.Get("content-TYPE"), "a");
  EXPECT_EQ(headers.Get("none"), "");
  headers.Set("x", "3");
  EXPECT_EQ(headers.fields().size(), 2U);
  EXPECT_EQ(headers.Get("X"), "3");
}

TEST(ErrorAnswers, AreJsonWithTheStatusOfTheirCode) {
  const Response response = ErrorAnswer(InvalidArgument("\"a\"\n is bad", "objects[0]"));
  EXPECT_EQ(response.status, 400);
  EXPECT_EQ(response.body,
            "{\"code\": \"invalid_argument\", \"message\": \"\\\"a\\\"\\u000a is bad\", \"field\": "
            "\"objects[0]\"}\n");
}

TEST(OriginRule, LetsListedPagesAndThoseOfAnAddressIn) {
  const Origins origins{{"https://app.foxglove.dev"}};
  EXPECT_TRUE(MayUse(origins, "https://app.foxglove.dev", "10.0.0.1:8765"));
  EXPECT_TRUE(MayUse(origins, "http://10.0.0.1:8765", "10.0.0.1:8765"));
  EXPECT_TRUE(MayUse(origins, "http://localhost:8765", "localhost:8765"));
  EXPECT_TRUE(MayUse(origins, "http://[::1]:8765", "[::1]:8765"));
  EXPECT_FALSE(MayUse(origins, "http://10.0.0.1:80", "10.0.0.1:8765"));
  EXPECT_FALSE(MayUse(origins, "https://app.foxglove.dev.evil.com", "10.0.0.1:8765"));
  EXPECT_FALSE(MayUse(origins, "null", "10.0.0.1:8765"));
  EXPECT_FALSE(MayUse(origins, "http://lab.example:8080", "lab.example:8080"));
  EXPECT_TRUE(MayUse(origins, "https://lab.example:8080", "lab.example:8080", true));
  EXPECT_FALSE(MayUse(origins, "http://lab.example:8080", "lab.example:8080", true));
  EXPECT_FALSE(MayUse(origins, "https://other.example", "lab.example:8080", true));
  EXPECT_TRUE(MayUse({{"*"}}, "null", "10.0.0.1:8765"));
}

TEST(OriginRule, DistrustsANameThatItsOwnerMayPointHere) {
  EXPECT_FALSE(MayUse({}, "http://evil.com:8765", "evil.com:8765"));
  EXPECT_TRUE(MayUse({{"http://robot.lab:8765"}}, "http://robot.lab:8765", "robot.lab:8765"));
}

}  // namespace
}  // namespace exemplar::http
