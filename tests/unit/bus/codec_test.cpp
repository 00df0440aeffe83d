#include "exemplar/bus/codec.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <set>

#include "random_samples.hpp"

namespace exemplar::bus {
namespace {

using SampleTypes =
    ::testing::Types<ircp::SuitSample, ircp::EndEffectorSample, ircp::TactileSample,
                     ircp::CameraSample, ircp::ObjectSample, ircp::JointStateSample,
                     ircp::JointCommandSample, ircp::PlanSample, ircp::CommandSample,
                     ircp::StatusSample, ircp::SafetySample, ircp::ClockSample>;

template <class T>
class CodecTest : public ::testing::Test {
 protected:
  static T Random(std::uint64_t seed) {
    Rng rng(seed);
    T sample;
    Fill(rng, sample);
    return sample;
  }
};
TYPED_TEST_SUITE(CodecTest, SampleTypes);

TYPED_TEST(CodecTest, DecodesWhatItEncoded) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const TypeParam sample = this->Random(seed);
    const Result<TypeParam> decoded = Decode<TypeParam>(Encode(sample));
    ASSERT_TRUE(decoded.ok()) << seed << ": " << decoded.error().message;
    EXPECT_TRUE(Members(sample) == Members(*decoded)) << seed;
  }
}

TYPED_TEST(CodecTest, RefusesBytesThatAreCutAnywhere) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const std::vector<std::uint8_t> bytes = Encode(this->Random(seed));
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      const Result<TypeParam> decoded = Decode<TypeParam>(std::span(bytes).first(length));
      ASSERT_FALSE(decoded.ok()) << "seed " << seed << ", " << length << " of " << bytes.size();
      EXPECT_EQ(decoded.error().code, ErrorCode::kDataLoss);
      EXPECT_EQ(decoded.error().message.rfind(TypeNameOf<TypeParam>(), 0), 0u);
    }
  }
}

TYPED_TEST(CodecTest, TakesAnyBytesWithoutCrashing) {
  Rng rng(11);
  const std::vector<std::uint8_t> valid = Encode(this->Random(3));
  int decoded = 0;
  for (int i = 0; i < 3000; ++i) {
    std::vector<std::uint8_t> bytes = valid;
    for (std::uint64_t k = 1 + rng.Below(4); k > 0; --k) {
      bytes[rng.Below(bytes.size())] = static_cast<std::uint8_t>(rng.NextBits());
    }
    if (rng.Below(4) == 0) bytes = RandomBytes(rng, rng.Below(200));
    const Result<TypeParam> sample = Decode<TypeParam>(bytes);
    if (!sample.ok()) continue;
    ++decoded;
    // What it took is a sample like any other.
    EXPECT_TRUE(Decode<TypeParam>(Encode(*sample)).ok());
  }
  EXPECT_GT(decoded, 0);
}

TYPED_TEST(CodecTest, NamesAndDescribesItsType) {
  const std::string name(TypeNameOf<TypeParam>());
  EXPECT_EQ(name.rfind("exemplar::ircp::v1::", 0), 0u);
  const std::string schema(SchemaOf<TypeParam>());
  EXPECT_NE(schema.find("struct " + name.substr(name.rfind(':') + 1) + " {"), std::string::npos);
  EXPECT_EQ(schema.find("#include"), std::string::npos);
  EXPECT_LT(schema.size(), 60000u);  // more would stop discovery
}

TEST(CodecTest, KeyTellsSourcesAndObjectsApart) {
  std::set<std::array<std::uint8_t, 16>> keys;
  for (const char* source : {"a", "b"}) {
    for (const char* name : {"cup", "button"}) {
      ircp::ObjectSample object;
      object.header.source = source;
      object.name = name;
      keys.insert(KeyHashOf(object));
      object.header.seq = 7;
      object.frame = "base";
      keys.insert(KeyHashOf(object));
    }
  }
  EXPECT_EQ(keys.size(), 4u);
}

TEST(CodecTest, KeyIsTheMd5OfItsBigEndianCdr) {
  // md5 of 00 00 00 05 's' 'u' 'i' 't' 00, as md5sum prints it.
  ircp::SuitSample suit;
  suit.header.source = "suit";
  const std::array<std::uint8_t, 16> expected = {0xcf, 0xe9, 0x5e, 0x13, 0x07, 0x92, 0x53, 0x7b,
                                                 0xa5, 0x8f, 0x5d, 0xbf, 0x02, 0xa1, 0x35, 0x0c};
  EXPECT_EQ(KeyHashOf(suit), expected);
}

/// ircp/safety with source "s", seq 1, stamp 2 ns, dead man held, in big-endian CDR by hand.
TEST(CodecTest, ReadsBigEndianBytes) {
  const std::vector<std::uint8_t> bytes = {0, 0, 0, 0,                // CDR_BE
                                           0, 0, 0, 2, 's', 0,        // source
                                           0, 0,                      // up to a multiple of 8
                                           0, 0, 0, 0, 0,   0, 0, 1,  // seq
                                           0, 0, 0, 0, 0,   0, 0, 2,  // stamp_ns
                                           1, 0, 0};
  const Result<ircp::SafetySample> sample = Decode<ircp::SafetySample>(bytes);
  ASSERT_TRUE(sample.ok()) << sample.error().message;
  EXPECT_EQ(sample->header.source, "s");
  EXPECT_EQ(sample->header.seq, 1u);
  EXPECT_EQ(sample->header.stamp, Stamp::FromNanoseconds(2));
  EXPECT_TRUE(sample->dead_man_held);
  EXPECT_FALSE(sample->reset);
}

TEST(CodecTest, DoesNotAllocateWhatALengthClaims) {
  ircp::TactileSample sample;
  sample.header.source = "t";
  sample.sensors = {"tip"};
  sample.forces_n = {1.0};
  std::vector<std::uint8_t> bytes = Encode(sample);
  // The last 12 bytes are padding or length, then one double: claim 500 million of them.
  const std::uint32_t claimed = 500'000'000;
  bool refused = false;
  for (std::size_t at = 4; at + 4 <= bytes.size(); at += 4) {
    std::vector<std::uint8_t> lying = bytes;
    std::memcpy(lying.data() + at, &claimed, 4);
    const Result<ircp::TactileSample> decoded = Decode<ircp::TactileSample>(lying);
    refused =
        refused || (!decoded.ok() && decoded.error().message.find("are due") != std::string::npos);
  }
  EXPECT_TRUE(refused);
}

TEST(CodecTest, RefusesOtherEncapsulationsAndLeftovers) {
  ircp::SafetySample sample;
  sample.header.source = "panel";
  std::vector<std::uint8_t> bytes = Encode(sample);
  std::vector<std::uint8_t> parameter_list = bytes;
  parameter_list[1] = 3;
  EXPECT_FALSE(Decode<ircp::SafetySample>(parameter_list).ok());
  bytes.resize(bytes.size() + 3);
  EXPECT_TRUE(Decode<ircp::SafetySample>(bytes).ok());  // padding of the middleware
  bytes.resize(bytes.size() + 1);
  const Result<ircp::SafetySample> longer = Decode<ircp::SafetySample>(bytes);
  ASSERT_FALSE(longer.ok());
  EXPECT_NE(longer.error().message.find("4 bytes are left over"), std::string::npos);
}

TEST(CodecTest, RefusesStringsThatDoNotEndWithTheirOnlyNul) {
  ircp::SafetySample sample;
  sample.header.source = "panel";
  const std::vector<std::uint8_t> bytes = Encode(sample);
  for (const auto& [at, value] : {std::pair<std::size_t, std::uint8_t>{8, 0}, {13, 'x'}}) {
    std::vector<std::uint8_t> changed = bytes;
    changed[at] = value;
    const Result<ircp::SafetySample> decoded = Decode<ircp::SafetySample>(changed);
    ASSERT_FALSE(decoded.ok()) << at;
    EXPECT_NE(decoded.error().message.find("byte 8: a string"), std::string::npos);
  }
}

TEST(CodecTest, RefusesSamplesThatBreakTheirInvariants) {
  ircp::SuitSample sample;
  sample.header.source = "suit";
  sample.names = {"elbow"};
  sample.positions = {std::numeric_limits<double>::infinity()};
  const Result<ircp::SuitSample> decoded = Decode<ircp::SuitSample>(Encode(sample));
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(decoded.error().message.find("elbow"), std::string::npos);
}

}  // namespace
}  // namespace exemplar::bus
