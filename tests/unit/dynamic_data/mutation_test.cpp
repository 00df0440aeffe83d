// What the fuzzer does at length, in short and seeded: nothing crashes, and what is taken is kept.

#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"
#include "exemplar/dynamic_data/json.hpp"
#include "sample_types.hpp"

namespace exemplar::dynamic_data {
namespace {

constexpr int kRounds = 20000;

template <class Bytes>
void Mutate(Bytes& bytes, Rng& rng) {
  using Byte = typename Bytes::value_type;
  const int changes = 1 + static_cast<int>(rng.Below(4));
  for (int i = 0; i < changes && !bytes.empty(); ++i) {
    const std::size_t at = rng.Below(bytes.size());
    switch (rng.Below(4)) {
      case 0:
        bytes[at] = static_cast<Byte>(rng.Below(256));
        break;
      case 1:
        bytes.erase(bytes.begin() + static_cast<long>(at));
        break;
      case 2:
        bytes.insert(bytes.begin() + static_cast<long>(at), static_cast<Byte>(rng.Below(256)));
        break;
      default:
        bytes.resize(at);
    }
  }
}

TEST(Mutations, BytesThatAreTakenComeBackFromTheirJson) {
  const auto type = *ParseType(kIdl, "lab::v1::Sample");
  Rng rng(11);
  int taken = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::uint8_t> bytes = SampleBytes();
    Mutate(bytes, rng);
    const auto json = ToJson(*type, bytes);
    ASSERT_EQ(json.ok(), Check(*type, bytes).ok());
    if (!json.ok()) continue;
    ++taken;
    const auto again = FromJson(*type, *json);
    // A char of half a character has no JSON that reads back.
    if (again.ok()) {
      ASSERT_EQ(*ToJson(*type, *again), *json);
    }
  }
  EXPECT_GT(taken, kRounds / 100);
}

TEST(Mutations, JsonThatIsTakenIsASample) {
  const auto type = *ParseType(kIdl, "lab::v1::Sample");
  Rng rng(12);
  int taken = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::string json = kSampleJson;
    Mutate(json, rng);
    const auto bytes = FromJson(*type, json);
    if (!bytes.ok()) {
      ASSERT_FALSE(bytes.error().message.empty());
      continue;
    }
    ++taken;
    ASSERT_TRUE(ToJson(*type, *bytes).ok()) << json;
  }
  EXPECT_GT(taken, 0);
}

TEST(Mutations, AnyIdlIsReadOrRefused) {
  Rng rng(13);
  for (int round = 0; round < kRounds / 4; ++round) {
    std::string idl = kIdl;
    Mutate(idl, rng);
    const auto type = ParseType(idl, "lab::v1::Sample");
    if (type.ok()) (void)ToJson(**type, SampleBytes());
  }
}

}  // namespace
}  // namespace exemplar::dynamic_data
