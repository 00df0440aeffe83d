#include "convert_data.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace exemplar::rpc {
namespace {

TEST(ConvertData, PersonsReportsAndPlansComeBackAsTheyWere) {
  const api::PersonInfo person{.person = "user03",
                               .items = 3,
                               .bytes = 1'000'000'000'000,
                               .first = Stamp::FromNanoseconds(1),
                               .last = Stamp::FromNanoseconds(1'700'000'000'000'000'001)};
  v1::PersonInfo person_message;
  ToProto(person, &person_message);
  const api::PersonInfo read = FromProto(person_message);
  EXPECT_EQ(read.person, person.person);
  EXPECT_EQ(read.items, person.items);
  EXPECT_EQ(read.bytes, person.bytes);
  EXPECT_EQ(read.first, person.first);
  EXPECT_EQ(read.last, person.last);

  api::DataReport report;
  report.items.push_back({.kind = "trial", .name = "trial-1", .action = "deleted"});
  report.items.push_back({.kind = "skill version",
                          .name = "press 2",
                          .action = "relearned",
                          .detail = "from 3 trials",
                          .bytes = 7,
                          .at = Stamp::FromNanoseconds(5)});
  report.notices = {"one", "two"};
  v1::DataReport report_message;
  ToProto(report, &report_message);
  EXPECT_FALSE(report_message.items(0).has_at());
  const api::DataReport read_report = FromProto(report_message);
  ASSERT_EQ(read_report.items.size(), 2u);
  EXPECT_EQ(read_report.items[0].at, Stamp());
  EXPECT_EQ(read_report.items[1].detail, "from 3 trials");
  EXPECT_EQ(read_report.items[1].at, Stamp::FromNanoseconds(5));
  EXPECT_EQ(read_report.notices, report.notices);

  const api::BackupPlan plan{.service = "learning",
                             .schema = 3,
                             .parts = 5,
                             .bytes = 99,
                             .counts = {{"trials", 4}},
                             .notices = {"left out"}};
  v1::BackupPlan plan_message;
  ToProto(plan, &plan_message);
  const api::BackupPlan read_plan = FromProto(plan_message);
  EXPECT_EQ(read_plan.service, plan.service);
  EXPECT_EQ(read_plan.schema, plan.schema);
  EXPECT_EQ(read_plan.counts, plan.counts);
  EXPECT_EQ(read_plan.notices, plan.notices);
}

TEST(ConvertData, RequestsComeBackAsTheyWere) {
  for (const auto mode :
       {api::RestoreMode::kEmptyOnly, api::RestoreMode::kMerge, api::RestoreMode::kReplace}) {
    const api::RestoreRequest request{
        .plan = {},
        .mode = mode,
        .erased = {{.salt = "salt", .hash = "hash", .erased = Stamp::FromNanoseconds(3)}}};
    v1::RestoreRequest::Header message;
    ToProto(request, &message);
    const auto read = FromProto(message);
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(read->mode, mode);
    EXPECT_EQ(read->erased.at(0).salt, "salt");
    EXPECT_EQ(read->erased.at(0).erased, Stamp::FromNanoseconds(3));
  }
  v1::ApplyRetentionRequest retention;
  api::RetentionRequest asked;
  asked.dry_run = true;
  asked.keep_days = 0.0;
  asked.needed_too = true;
  ToProto(asked, &retention);
  const auto read = FromProto(retention);
  ASSERT_TRUE(read.ok());
  EXPECT_TRUE(read->dry_run);
  EXPECT_EQ(read->keep_days, 0.0);
  EXPECT_FALSE(read->keep_versions_days.has_value());
}

TEST(ConvertData, DaysAndModesThatAreNoneAreRefused) {
  for (const double days : {-1.0, 1e7, std::numeric_limits<double>::quiet_NaN()}) {
    v1::ApplyRetentionRequest message;
    message.set_keep_days(days);
    EXPECT_EQ(FromProto(message).error().field, "keep_days");
    message.clear_keep_days();
    message.set_keep_versions_days(days);
    EXPECT_EQ(FromProto(message).error().field, "keep_versions_days");
  }
  v1::RestoreRequest::Header header;
  header.set_mode(static_cast<v1::RestoreRequest::Mode>(17));
  EXPECT_EQ(FromProto(header).error().field, "header.mode");
}

}  // namespace
}  // namespace exemplar::rpc
