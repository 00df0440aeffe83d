// What we send, read by a decoder that is not ours, from nothing but the schema that travels along.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "exemplar/bus/codec.hpp"
#include "unit/bus/random_samples.hpp"

namespace exemplar::bus {
namespace {

using nlohmann::json;

class SchemaTest : public ::testing::Test {
 protected:
  void SetUp() override {
    node_ = std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "tests/conformance/node";
    if (!std::filesystem::exists(node_ / "node_modules/@foxglove/omgidl-serialization") ||
        std::system("command -v node >/dev/null") != 0) {
      GTEST_SKIP() << "no independent decoder: run npm ci in " << node_;
    }
  }

  template <class Sample>
  Sample Queue(std::uint64_t seed) {
    Rng rng(seed);
    Sample sample;
    Fill(rng, sample);
    std::ostringstream hex;
    for (const std::uint8_t byte : Encode(sample)) {
      char digits[3];
      std::snprintf(digits, sizeof(digits), "%02x", byte);
      hex << digits;
    }
    lines_ +=
        json{{"type", TypeNameOf<Sample>()}, {"schema", SchemaOf<Sample>()}, {"cdr", hex.str()}}
            .dump() +
        "\n";
    return sample;
  }

  std::vector<json> Decoded() {
    const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                       ("exemplar-schema-" + std::to_string(getpid()) + ".jsonl");
    std::ofstream(file) << lines_;
    const std::string command =
        "node '" + (node_ / "read_samples.mjs").string() + "' '" + file.string() + "'";
    FILE* pipe = popen(command.c_str(), "r");
    std::string output;
    char buffer[4096];
    while (const std::size_t count = std::fread(buffer, 1, sizeof(buffer), pipe)) {
      output.append(buffer, count);
    }
    EXPECT_EQ(pclose(pipe), 0);
    std::filesystem::remove(file);
    std::vector<json> messages;
    std::istringstream stream(output);
    for (std::string line; std::getline(stream, line);) messages.push_back(json::parse(line));
    return messages;
  }

  static void ExpectHeader(const ircp::Header& header, const json& message) {
    EXPECT_EQ(message.at("source"), header.source);
    EXPECT_EQ(message.at("seq"), std::to_string(header.seq));
    EXPECT_EQ(message.at("stamp_ns"), std::to_string(header.stamp.nanoseconds()));
  }

  std::filesystem::path node_;
  std::string lines_;
};

TEST_F(SchemaTest, AnIndependentDecoderReadsEveryType) {
  const auto suit = Queue<ircp::SuitSample>(1);
  const auto tool = Queue<ircp::EndEffectorSample>(2);
  const auto tactile = Queue<ircp::TactileSample>(3);
  const auto camera = Queue<ircp::CameraSample>(4);
  const auto object = Queue<ircp::ObjectSample>(5);
  const auto state = Queue<ircp::JointStateSample>(6);
  const auto joints = Queue<ircp::JointCommandSample>(7);
  const auto command = Queue<ircp::CommandSample>(8);
  const auto status = Queue<ircp::StatusSample>(9);
  const auto safety = Queue<ircp::SafetySample>(10);
  const auto clock = Queue<ircp::ClockSample>(11);
  const auto plan = Queue<ircp::PlanSample>(12);
  const std::vector<json> messages = Decoded();
  ASSERT_EQ(messages.size(), 12u);
  const std::vector<ircp::Header> headers = {
      suit.header,   tool.header,    tactile.header, camera.header, object.header, state.header,
      joints.header, command.header, status.header,  safety.header, clock.header,  plan.header};
  for (std::size_t i = 0; i < headers.size(); ++i) ExpectHeader(headers[i], messages[i]);

  // The last fields: right only if everything before was read right.
  EXPECT_EQ(messages[0].at("names"), suit.names);
  EXPECT_EQ(messages[0].at("positions"), suit.positions);
  EXPECT_EQ(messages[1].at("base_T_tool").at("quaternion_xyzw").at(3),
            tool.base_T_tool.rotation.w());
  EXPECT_EQ(messages[1].at("label"), tool.label);
  EXPECT_EQ(messages[2].at("forces_n"), tactile.forces_n);
  EXPECT_EQ(messages[3].at("right"), camera.right);
  EXPECT_EQ(messages[4].at("rotation_variance_rad2"), object.rotation_variance_rad2);
  EXPECT_EQ(messages[5].at("command_seq"), std::to_string(state.command_seq));
  EXPECT_EQ(messages[6].at("validity_ns"), std::to_string(joints.validity.count()));
  EXPECT_EQ(messages[7].at("validity_ns"), std::to_string(command.validity.count()));
  ASSERT_EQ(messages[8].at("sent").size(), status.sent.size());
  EXPECT_EQ(messages[8].at("values").size(), status.values.size());
  EXPECT_EQ(messages[9].at("reset"), safety.reset);
  EXPECT_EQ(messages[10].at("third_ns"), std::to_string(clock.third.nanoseconds()));
  EXPECT_EQ(messages[11].at("tool_m"), plan.tool_m);
}

}  // namespace
}  // namespace exemplar::bus
