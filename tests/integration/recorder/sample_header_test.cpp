#include "exemplar/ircp/sample_header.hpp"

#include <gmock/gmock.h>

#include "cdr.hpp"
#include "exemplar/base/rng.hpp"

namespace exemplar::ircp {
namespace {

using recorder::HeaderIdl;
using recorder::SampleBytes;

TEST(SampleHeader, IsReadInEitherByteOrderForAnyNameLength) {
  for (const bool little_endian : {true, false}) {
    std::string source;
    for (int length = 0; length < 20; ++length, source += 'x') {
      const std::uint64_t seq = 0x0123456789ABCDEFu + source.size();
      const auto header = ReadSampleHeader(SampleBytes(source, seq, 0, little_endian));
      ASSERT_TRUE(header.has_value());
      EXPECT_EQ(header->source, source);
      EXPECT_EQ(header->seq, seq);
    }
  }
}

TEST(SampleHeader, IsFoundBehindFurtherKeys) {
  const std::optional<HeaderLayout> layout = ReadHeaderLayout(
      HeaderIdl("EndEffector", "  @key string hand;\n"), "exemplar::ircp::v1::EndEffector");
  ASSERT_TRUE(layout.has_value());
  EXPECT_EQ(layout->keys, 2);
  // source "ab", hand "left", seq 9: the second string begins at 8, the number at 24.
  const std::vector<std::uint8_t> cdr = {0, 1, 0, 0, 3,   0,   0,   0,   'a', 'b', 0, 0,
                                         5, 0, 0, 0, 'l', 'e', 'f', 't', 0,   0,   0, 0,
                                         0, 0, 0, 0, 9,   0,   0,   0,   0,   0,   0, 0};
  const std::optional<SampleHeader> header = ReadSampleHeader(cdr, *layout);
  ASSERT_TRUE(header.has_value());
  EXPECT_EQ(header->source, "ab");
  EXPECT_EQ(header->seq, 9u);
}

TEST(SampleHeader, HasALayoutOnlyWhereTheTypeBeginsSo) {
  EXPECT_EQ(ReadHeaderLayout(HeaderIdl("Suit"), "exemplar::ircp::v1::Suit")->keys, 1);
  EXPECT_FALSE(ReadHeaderLayout(HeaderIdl("Suit"), "exemplar::ircp::v1::Camera").has_value());
  EXPECT_FALSE(ReadHeaderLayout(HeaderIdl("Suit"), "Part").has_value());
  EXPECT_FALSE(ReadHeaderLayout("struct X { unsigned long long seq; };", "X").has_value());
  EXPECT_FALSE(ReadHeaderLayout("struct X { @key string source;", "X").has_value());
  EXPECT_FALSE(ReadHeaderLayout("", "X").has_value());
}

TEST(SampleHeader, IsAbsentWhereTheBytesAreCut) {
  const std::vector<std::uint8_t> whole = SampleBytes("suit", 7, 0);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(ReadSampleHeader(std::span(whole).first(size)).has_value()) << size;
  }
}

TEST(SampleHeader, IsNotReadBeyondTheBytesWhateverTheyAre) {
  Rng rng(1);
  for (int i = 0; i < 20'000; ++i) {
    std::vector<std::uint8_t> noise(rng.Below(40));
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(rng.Below(6));
    const auto header = ReadSampleHeader(noise);
    if (header) {
      EXPECT_LT(header->source.size(), noise.size());
    }
  }
}

}  // namespace
}  // namespace exemplar::ircp
