#include "compression.hpp"

#include "sample_recording.hpp"

namespace exemplar::recording {
namespace {

constexpr std::uint64_t kNoLimit = 1u << 30;

class CompressionTest : public ::testing::TestWithParam<Compression> {
 protected:
  Bytes Compressed(const Bytes& bytes) const {
    Bytes out;
    EXPECT_TRUE(Compress(GetParam(), 1, bytes, out).ok());
    return out;
  }
};

TEST_P(CompressionTest, GivesBackWhatWentIn) {
  Rng rng(1);
  for (const std::size_t size : {0u, 1u, 100u, 70'000u, 1'500'000u}) {
    const Bytes bytes = RandomBytes(rng, size);
    const Result<Decompressed> out = Decompress(NameOf(GetParam()), Compressed(bytes), size);
    ASSERT_TRUE(out.ok());
    EXPECT_TRUE(out->whole) << out->fault;
    EXPECT_EQ(out->bytes, bytes);
  }
}

TEST_P(CompressionTest, GivesABeginningOfWhatIsCut) {
  Rng rng(2);
  const Bytes bytes = RandomBytes(rng, 1'500'000);
  Bytes cut = Compressed(bytes);
  cut.resize(cut.size() * 2 / 3);
  const Result<Decompressed> out = Decompress(NameOf(GetParam()), cut, kNoLimit);
  ASSERT_TRUE(out.ok());
  EXPECT_GT(out->bytes.size(), bytes.size() / 3);
  ASSERT_LT(out->bytes.size(), bytes.size());
  EXPECT_TRUE(std::equal(out->bytes.begin(), out->bytes.end(), bytes.begin()));
}

TEST_P(CompressionTest, NeverGivesMoreThanTheLimit) {
  const Bytes bytes(3'000'000, 0);
  const Result<Decompressed> out = Decompress(NameOf(GetParam()), Compressed(bytes), 1000);
  ASSERT_TRUE(out.ok());
  EXPECT_FALSE(out->whole);
  EXPECT_EQ(out->bytes.size(), 1000u);
}

TEST_P(CompressionTest, SurvivesNoise) {
  Rng rng(3);
  for (int i = 0; i < 500; ++i) {
    Bytes noise = Compressed(RandomBytes(rng, 300));
    for (int flips = 0; flips < 3 && !noise.empty(); ++flips) {
      noise[rng.Below(noise.size())] = static_cast<std::uint8_t>(rng.Below(256));
    }
    const Result<Decompressed> out = Decompress(NameOf(GetParam()), noise, 1000);
    ASSERT_TRUE(out.ok());
    EXPECT_LE(out->bytes.size(), 1000u);
  }
}

INSTANTIATE_TEST_SUITE_P(All, CompressionTest,
                         ::testing::Values(Compression::kNone, Compression::kZstd,
                                           Compression::kLz4));

TEST(Decompress, NamesAnUnknownCompression) {
  const Result<Decompressed> out = Decompress("brotli", {}, kNoLimit);
  ASSERT_FALSE(out.ok());
  EXPECT_THAT(out.error().message, ::testing::HasSubstr("\"brotli\""));
}

}  // namespace
}  // namespace exemplar::recording
