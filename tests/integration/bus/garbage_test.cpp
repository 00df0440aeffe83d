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

/// Counts what was refused.
class RefusalLog final : public Log {
 public:
  void Write(LogLevel, std::string_view event, Fields) override {
    if (event == "sample refused") ++refused;
  }
  std::atomic<int> refused = 0;
};

TEST(GarbageTest, MalformedSamplesAreRefusedAndTheNextGoodOneArrives) {
  const testing::DdsDomain domain;
  RefusalLog log;
  ParticipantOptions options;
  options.domain = domain.number();
  options.station = "lab";
  const auto stranger = DdsStation::Create(options);
  options.log = &log;
  const auto participant = Participant::Create(options);
  ASSERT_TRUE(stranger.ok() && participant.ok());

  std::atomic<int> good = 0;
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
  constexpr int kBad = 300;
  int sent = 0;
  while (sent < kBad) {
    Bytes bytes;
    bytes.key = KeyHashOf(sample);
    if (sent % 3 == 0) {  // cut; writers send whole words of four bytes
      const std::size_t cut =
          4 +
          4 * static_cast<std::size_t>(rng.Uniform() * static_cast<double>(valid.size() / 4 - 2));
      bytes.cdr.assign(valid.begin(), valid.begin() + static_cast<std::ptrdiff_t>(cut));
    } else if (sent % 3 == 1) {  // a length of four thousand million
      bytes.cdr = valid;
      std::fill_n(bytes.cdr.begin() + 4, 4, std::uint8_t{0xff});
    } else {  // noise behind an encapsulation header
      bytes.cdr = {0, 1, 0, 0};
      for (int i = 0; i < 200; ++i) {
        bytes.cdr.push_back(static_cast<std::uint8_t>(rng.Uniform() * 255));
      }
    }
    ASSERT_FALSE(Decode<ircp::SuitSample>(bytes.cdr).ok());
    ASSERT_TRUE((*writer)->Write(bytes).ok());
    ++sent;
  }
  Bytes bytes{valid, KeyHashOf(sample)};
  ASSERT_TRUE((*writer)->Write(bytes).ok());
  EXPECT_TRUE(testing::Eventually([&] { return good == 1; }));
  EXPECT_EQ(log.refused, kBad);
}

}  // namespace
}  // namespace exemplar::bus
