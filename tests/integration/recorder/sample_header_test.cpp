#include "recorder/sample_header.hpp"

#include <gmock/gmock.h>

#include "cdr.hpp"
#include "exemplar/base/rng.hpp"

namespace exemplar::recorder {
namespace {

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
}  // namespace exemplar::recorder
