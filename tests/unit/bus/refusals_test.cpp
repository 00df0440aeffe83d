#include "refusals.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace exemplar::bus {
namespace {

/// Keeps the field "count" of each line.
class CountLog final : public Log {
 public:
  void Write(LogLevel, std::string_view, Fields fields) override {
    for (const LogField& field : fields) {
      if (field.name == "count") counts.push_back(field.value);
    }
  }
  std::vector<std::string> counts;
};

TEST(RefusalsTest, TellOfTheFirstAtOnceAndOfTheOthersOnceASecond) {
  ManualClock clock;
  CountLog log;
  {
    Refusals refusals("ircp/suit", clock, log);
    for (int i = 0; i < 300; ++i) refusals.Add("w", "cut");
    EXPECT_EQ(log.counts, std::vector<std::string>{"1"});
    clock.Advance(std::chrono::milliseconds(999));
    refusals.Tick();
    EXPECT_EQ(log.counts.size(), 1U);
    clock.Advance(std::chrono::milliseconds(1));
    refusals.Tick();
    EXPECT_EQ(log.counts.back(), "299");
    refusals.Tick();
    EXPECT_EQ(log.counts.size(), 2U);
    refusals.Add("w", "cut");
    EXPECT_EQ(refusals.total(), 301U);
    EXPECT_EQ(log.counts.size(), 2U);
  }
  EXPECT_EQ(log.counts.back(), "1");
}

}  // namespace
}  // namespace exemplar::bus
