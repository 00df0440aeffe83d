#include "exemplar/diagnosis/diagnose.hpp"

namespace exemplar::diagnosis {
namespace {

using ircp::EndpointQos;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// The one policy that keeps the two apart.
std::string OnlyMismatch(const EndpointQos& offered, const EndpointQos& asked) {
  const std::vector<Mismatch> found = Compare(offered, asked);
  return found.size() == 1 ? found.front().policy : std::to_string(found.size()) + " mismatches";
}

TEST(CompareTest, EqualPoliciesMatch) {
  const EndpointQos qos{.reliable = true,
                        .durability = 1,
                        .deadline = std::chrono::milliseconds(100),
                        .exclusive_ownership = true,
                        .liveliness = 2,
                        .liveliness_lease = std::chrono::seconds(1),
                        .ordered_by_source = true,
                        .access_scope = 1,
                        .representations = {2}};
  EXPECT_THAT(Compare(qos, qos), IsEmpty());
}

TEST(CompareTest, WriterMayOfferMoreThanIsAsked) {
  EXPECT_THAT(Compare({.reliable = true,
                       .durability = 3,
                       .deadline = std::chrono::milliseconds(10),
                       .liveliness = 2,
                       .liveliness_lease = std::chrono::seconds(1),
                       .ordered_by_source = true,
                       .access_scope = 2,
                       .coherent_access = true,
                       .ordered_access = true},
                      {.deadline = std::chrono::milliseconds(20),
                       .latency_budget = std::chrono::milliseconds(1)}),
              IsEmpty());
}

TEST(CompareTest, NamesThePolicyThatIsAskedForAndNotOffered) {
  EXPECT_EQ(OnlyMismatch({}, {.reliable = true}), "reliability");
  EXPECT_EQ(OnlyMismatch({.durability = 0}, {.durability = 1}), "durability");
  EXPECT_EQ(OnlyMismatch({}, {.deadline = std::chrono::seconds(1)}), "deadline");
  EXPECT_EQ(
      OnlyMismatch({.deadline = std::chrono::seconds(2)}, {.deadline = std::chrono::seconds(1)}),
      "deadline");
  EXPECT_EQ(OnlyMismatch({.latency_budget = std::chrono::seconds(1)}, {}), "latency budget");
  EXPECT_EQ(OnlyMismatch({.exclusive_ownership = true}, {}), "ownership");
  EXPECT_EQ(OnlyMismatch({}, {.exclusive_ownership = true}), "ownership");
  EXPECT_EQ(OnlyMismatch({}, {.liveliness = 1}), "liveliness");
  EXPECT_EQ(OnlyMismatch({}, {.liveliness_lease = std::chrono::seconds(1)}), "liveliness");
  EXPECT_EQ(OnlyMismatch({}, {.ordered_by_source = true}), "destination order");
  EXPECT_EQ(OnlyMismatch({}, {.access_scope = 1}), "presentation");
  EXPECT_EQ(OnlyMismatch({}, {.coherent_access = true}), "presentation");
  EXPECT_EQ(OnlyMismatch({.representations = {2}}, {}), "data representation");
  EXPECT_EQ(OnlyMismatch({}, {.representations = {2}}), "data representation");
}

TEST(CompareTest, TellsEveryPolicyThatDiffers) {
  EXPECT_THAT(Compare({}, {.reliable = true, .durability = 1}), SizeIs(2));
}

TEST(CompareTest, ReaderOfTwoRepresentationsTakesEither) {
  EXPECT_THAT(Compare({.representations = {2}}, {.representations = {0, 2}}), IsEmpty());
  EXPECT_THAT(Compare({}, {.representations = {0, 2}}), IsEmpty());
}

TEST(PartitionsMeetTest, NamesMeetThemselvesAndPatternsThatMatch) {
  EXPECT_TRUE(PartitionsMeet({"lab"}, {"lab"}));
  EXPECT_TRUE(PartitionsMeet({"hall", "lab"}, {"lab"}));
  EXPECT_TRUE(PartitionsMeet({"lab-1"}, {"lab-?"}));
  EXPECT_TRUE(PartitionsMeet({"*"}, {"lab"}));
  EXPECT_FALSE(PartitionsMeet({"lab"}, {"Lab"}));
}

TEST(PartitionsMeetTest, NoPartitionMeetsOnlyTheUnnamedOne) {
  EXPECT_TRUE(PartitionsMeet({}, {}));
  EXPECT_TRUE(PartitionsMeet({}, {""}));
  EXPECT_FALSE(PartitionsMeet({}, {"lab"}));
  EXPECT_TRUE(PartitionsMeet({}, {"*"}));
}

TEST(PartitionsMeetTest, TwoPatternsNeverMeet) { EXPECT_FALSE(PartitionsMeet({"l*"}, {"l*"})); }

}  // namespace
}  // namespace exemplar::diagnosis
