// A writer that sends what it should not: readers refuse it and go on.

#include <gtest/gtest.h>

#include <atomic>

#include "byte_endpoints.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/participant.hpp"
#include "support/dds_domain.hpp"
#include "support/eventually.hpp"

namespace exemplar::bus {
namespace {

/// Keeps count of the lines.
class LineLog final : public Log {
 public:
  void Write(LogLevel, std::string_view event, Fields) override {
    if (event == "samples refused") ++lines;
  }
  std::atomic<int> lines = 0;
};

/// As the protocol delivers it: filled up with zeros to whole words of four bytes, so that nobody
/// can tell a sample that was cut within its last word from one that ends in zeros.
std::vector<std::uint8_t> Padded(std::vector<std::uint8_t> cdr) {
  cdr.resize((cdr.size() + 3) / 4 * 4, 0);
  return cdr;
}

TEST(GarbageTest, MalformedSamplesAreRefusedAndTheNextGoodOneArrives) {
  const testing::DdsDomain domain;
  LineLog log;
  ParticipantOptions options;
  options.domain = domain.number();
  options.station = "lab";
  const auto stranger = DdsStation::Create(options);
  options.log = &log;
  const auto participant = Participant::Create(options);
  ASSERT_TRUE(stranger.ok() && participant.ok());

  std::atomic<std::uint64_t> good = 0;
  const auto reader = (*participant)
                          ->MakeReader<ircp::SuitSample>(
                              [&](const ircp::SuitSample&, const ircp::Reception&) { ++good; });
  ASSERT_TRUE(reader.ok());
  const TypeInfo type{TypeNameOf<ircp::SuitSample>(), SchemaOf<ircp::SuitSample>()};
  const auto writer = (*stranger)->MakeWriter(ircp::SuitSample::kTopic, type, QosOfType("Suit"));
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(testing::Eventually([&] { return (*writer)->matched_readers() == 1; }));

  ircp::SuitSample sample;
  sample.header.source = "suit";
  sample.header.seq = 1;
  sample.names = {"shoulder"};
  sample.positions = {0.5};
  const std::vector<std::uint8_t> valid = Encode(sample);
  Rng rng(5);
  constexpr int kSamples = 300;
  std::uint64_t bad = 0;
  std::uint64_t whole = 0;
  for (int i = 0; i < kSamples; ++i) {
    Bytes bytes;
    bytes.key = KeyHashOf(sample);
    if (i % 3 == 0) {  // cut anywhere
      const std::size_t cut =
          4 + static_cast<std::size_t>(rng.Uniform() * static_cast<double>(valid.size() - 4));
      bytes.cdr.assign(valid.begin(), valid.begin() + static_cast<std::ptrdiff_t>(cut));
    } else if (i % 3 == 1) {  // a length of four thousand million
      bytes.cdr = valid;
      std::fill_n(bytes.cdr.begin() + 4, 4, std::uint8_t{0xff});
    } else {  // noise behind an encapsulation header
      bytes.cdr = {0, 1, 0, 0};
      for (int k = 0; k < 200; ++k) {
        bytes.cdr.push_back(static_cast<std::uint8_t>(rng.Uniform() * 255));
      }
    }
    ++(Decode<ircp::SuitSample>(Padded(bytes.cdr)).ok() ? whole : bad);
    ASSERT_TRUE((*writer)->Write(bytes).ok());
  }
  ASSERT_GT(bad, 290U);
  ASSERT_GT(whole, 0U);
  Bytes bytes{valid, KeyHashOf(sample)};
  ASSERT_TRUE((*writer)->Write(bytes).ok());
  EXPECT_TRUE(testing::Eventually([&] { return good + (*reader)->refused() == kSamples + 1; }));
  EXPECT_EQ((*reader)->refused(), bad);
  EXPECT_EQ(good, whole + 1);
  EXPECT_LT(log.lines, 60);  // one a second, however slow this machine
}

}  // namespace
}  // namespace exemplar::bus
