#include <gtest/gtest.h>

#include "exemplar/ircp/clock_relation.hpp"
#include "recorder_fixture.hpp"
#include "support/eventually.hpp"

namespace exemplar::recorder {
namespace {

/// The relations that a file holds.
std::vector<ircp::ClockRelation> ClocksIn(const FileContent& file) {
  std::vector<ircp::ClockRelation> relations;
  for (const recording::Metadata& record : file.metadata) {
    if (record.name != "exemplar.clock") continue;
    const auto relation = ircp::ClockRelationFromFields(record.metadata);
    EXPECT_TRUE(relation.ok());
    relations.push_back(*relation);
  }
  return relations;
}

TEST_F(RecorderTest, FilesTellHowTheProgramsClocksStandToLogTimes) {
  const Duration apart = (clock_.Now() - Stamp()) - clock_.Steady();
  settings_.clocks = [this, apart] {
    // The suit's clock runs on whatever happens to ours.
    Stamp now = clock_.Now();
    Stamp suit = Stamp() + clock_.Steady() + apart + FromSeconds(2.5);
    while (clock_.Now() - now > std::chrono::minutes(1) ||
           now - clock_.Now() > std::chrono::minutes(1)) {
      now = clock_.Now();
      suit = Stamp() + clock_.Steady() + apart + FromSeconds(2.5);
    }
    return std::vector<ircp::ClockRelation>{{.participant = "01.aa",
                                             .program = "capture_suit",
                                             .observer = "02.bb",
                                             .at = now,
                                             .offset = suit - now,
                                             .since = now}};
  };
  Open();
  api::RecordStart start;
  start.name = "clocks";
  ASSERT_TRUE(recorder_->Start(start).ok());
  const auto record_one = [&] {
    const std::uint64_t before = recorder_->GetStatus()->messages;
    bus_.Publish(kSuit, "suit");
    EXPECT_TRUE(testing::Eventually([&] { return recorder_->GetStatus()->messages > before; }));
  };
  record_one();
  // Our clock is set back by an hour: log times keep their base, and so do the relations.
  clock_.Jump(std::chrono::hours(-1));
  clock_.Advance(std::chrono::seconds(2));
  record_one();
  MustStop();
  const std::vector<ircp::ClockRelation> relations = ClocksIn(ReadFile(PathOf("clocks")));
  ASSERT_GE(relations.size(), 2u);
  for (const ircp::ClockRelation& relation : relations) {
    EXPECT_EQ(relation.program, "capture_suit");
    EXPECT_NEAR(ToSeconds(relation.offset), 2.5, 0.01);
    EXPECT_GE(relation.at, relations.front().at);
    EXPECT_LT(relation.at - relations.front().at, std::chrono::minutes(1));
  }
}

}  // namespace
}  // namespace exemplar::recorder
