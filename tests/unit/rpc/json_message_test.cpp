// What json_message_fuzz does at length, in short and seeded.

#include "json_message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"
#include "exemplar/v1/executor.pb.h"

namespace exemplar::rpc {
namespace {

constexpr const char* kExecution =
    R"({"execution": {"skill": {"name": "pr\u00e4ss \ud83d\ude00", "version": 2}, "objects":
    [{"name": "target", "pose": {"position": {"x": 0.45, "y": -2e-1, "z": "NaN"}}}], "speed": 0.5,
    "follow": true}, "detached": false})";

/// What was read goes over the wire, and is the same when it was written and read again.
void ExpectWhole(const v1::ExecuteRequest& message, const std::string& json) {
  v1::ExecuteRequest received;
  ASSERT_TRUE(received.ParseFromString(message.SerializeAsString())) << json;
  const auto written = WriteJson(message);
  ASSERT_TRUE(written.ok()) << json;
  v1::ExecuteRequest again;
  ASSERT_TRUE(ReadJson(*written, 1, again).ok()) << json;
  EXPECT_EQ(*WriteJson(again), *written) << json;
}

TEST(JsonMessage, IsTheSameWhenItWasWrittenAndReadAgain) {
  v1::ExecuteRequest message;
  ASSERT_TRUE(ReadJson(kExecution, 1, message).ok());
  EXPECT_EQ(message.execution().skill().name(), "pr\u00e4ss \U0001F600");
  ExpectWhole(message, kExecution);
}

TEST(JsonMessage, IsWholeOrRefusedWhateverComes) {
  Rng rng(21);
  int taken = 0;
  for (int round = 0; round < 5000; ++round) {
    std::string json = kExecution;
    for (std::size_t changes = 1 + rng.Below(3); changes > 0; --changes) {
      const std::size_t at = rng.Below(json.size());
      switch (rng.Below(4)) {
        case 0:
          json[at] = static_cast<char>(rng.Below(256));
          break;
        case 1:
          json.erase(at, 1 + rng.Below(6));
          break;
        case 2:
          json.insert(at, 1, static_cast<char>(rng.Below(256)));
          break;
        default:
          json.insert(at, json.substr(rng.Below(json.size()), rng.Below(20)));
      }
    }
    v1::ExecuteRequest message;
    const Status read = ReadJson(json, 1, message);
    if (!read.ok()) {
      ASSERT_FALSE(read.error().message.empty());
      continue;
    }
    ++taken;
    ASSERT_NO_FATAL_FAILURE(ExpectWhole(message, json));
  }
  EXPECT_GT(taken, 0);
}

}  // namespace
}  // namespace exemplar::rpc
