// The format's own conformance cases, where they are at hand.

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "mcap_json.hpp"

namespace exemplar::conformance {
namespace {

std::filesystem::path CaseFolder() {
  const char* variable = std::getenv("EXEMPLAR_DATA");
  const std::filesystem::path data =
      variable != nullptr ? std::filesystem::path(variable)
                          : std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "../shared/data";
  return data / "mcap_conformance";
}

std::string Slurp(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

struct Case {
  std::string name;
  bool padded = false;
  std::string json;
  recording::Bytes file;
};

std::vector<Case> Cases() {
  std::vector<Case> cases;
  if (!std::filesystem::is_directory(CaseFolder())) return cases;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(CaseFolder())) {
    if (entry.path().extension() != ".json") continue;
    std::filesystem::path mcap = entry.path();
    mcap.replace_extension(".mcap");
    const std::string bytes = Slurp(mcap);
    Case& c = cases.emplace_back();
    c.name = entry.path().stem().string();
    c.padded = (c.name + "-").find("-pad-") != std::string::npos;
    c.json = Slurp(entry.path());
    c.file.assign(bytes.begin(), bytes.end());
  }
  return cases;
}

std::string Records(const std::string& json) {
  const Result<std::string> records = NormalisedRecords(json);
  return records.ok() ? *records : "no JSON: " + records.error().message;
}

TEST(McapConformance, WritesEveryUnpaddedCaseToTheByte) {
  const std::vector<Case> cases = Cases();
  if (cases.empty()) GTEST_SKIP() << "no cases in " << CaseFolder();
  int written = 0;
  for (const Case& c : cases) {
    if (c.padded) continue;
    const Result<recording::Bytes> bytes = WriteCase(c.json);
    ASSERT_TRUE(bytes.ok()) << c.name << ": " << bytes.error().message;
    EXPECT_EQ(*bytes, c.file) << c.name;
    ++written;
  }
  EXPECT_GT(written, 0);
}

TEST(McapConformance, ReadsEveryCaseFrontToBack) {
  const std::vector<Case> cases = Cases();
  if (cases.empty()) GTEST_SKIP() << "no cases in " << CaseFolder();
  for (const Case& c : cases) {
    recording::MemorySource source(c.file);
    const Result<std::string> json = ReadStreamed(source);
    ASSERT_TRUE(json.ok()) << c.name << ": " << json.error().message;
    EXPECT_EQ(Records(*json), Records(c.json)) << c.name;
  }
}

TEST(McapConformance, ReadsEveryCaseByItsIndexes) {
  const std::vector<Case> cases = Cases();
  if (cases.empty()) GTEST_SKIP() << "no cases in " << CaseFolder();
  for (const Case& c : cases) {
    recording::MemorySource source(c.file);
    const Result<std::string> json = ReadIndexed(source);
    ASSERT_TRUE(json.ok()) << c.name << ": " << json.error().message;
    EXPECT_EQ(Records(*json), Records(c.json)) << c.name;
  }
}

/// Ten messages, every feature: what a case of the suite looks like.
std::string GeneratedCase(const std::string& features) {
  std::string records =
      R"({"type": "Header", "fields": [["library", "x"], ["profile", "p"]]},
         {"type": "Schema", "fields": [["data", ["4"]], ["encoding", "c"], ["id", "1"], ["name", "E"]]},
         {"type": "Channel", "fields": [["id", "7"], ["message_encoding", "a"],
          ["metadata", {"foo": "bar"}], ["schema_id", "1"], ["topic", "t"]]})";
  for (int i = 0; i < 10; ++i) {
    const std::string n = std::to_string(i);
    records += R"(, {"type": "Message", "fields": [["channel_id", "7"], ["data", [")" + n +
               R"("]], ["log_time", ")" + n + R"("], ["publish_time", "18446744073709551615"],
               ["sequence", ")" +
               n + R"("]]})";
  }
  return R"({"records": [)" + records +
         R"(, {"type": "DataEnd", "fields": []}], "meta": {"variant": {"features": [)" + features +
         "]}}}";
}

TEST(McapConformance, BothReadersGiveWhatAGeneratedCaseSays) {
  for (const std::string features :
       {R"("ch","mx","st","rsh","rch","ax","mdx","chx","sum")", R"("ch","chx","st")", R"("st")",
        R"("ch","mx")", R"("rsh","rch","sum")", ""}) {
    const std::string json = GeneratedCase(features);
    const Result<recording::Bytes> bytes = WriteCase(json);
    ASSERT_TRUE(bytes.ok()) << bytes.error().message;
    recording::MemorySource source(*bytes);
    const Result<std::string> streamed = ReadStreamed(source);
    const Result<std::string> indexed = ReadIndexed(source);
    ASSERT_TRUE(streamed.ok() && indexed.ok());
    EXPECT_EQ(Records(*streamed), Records(*indexed));
    // Up to DataEnd it is what the case holds.
    const std::string given = Records(json);
    const std::string data = given.substr(0, given.find("DataEnd"));
    EXPECT_EQ(Records(*streamed).substr(0, data.size()), data);
    // A case made of the answer gives the same bytes again.
    const std::string answer = streamed->substr(0, streamed->rfind('}')) +
                               R"(, "meta": {"variant": {"features": [)" + features + "]}}}";
    const Result<recording::Bytes> again = WriteCase(answer);
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(*again, *bytes);
  }
}

TEST(McapConformance, NamesWhatIsWrongWithACase) {
  using ::testing::HasSubstr;
  EXPECT_THAT(WriteCase("{").error().message, HasSubstr("not a conformance case"));
  EXPECT_THAT(WriteCase(R"({"records": 3})").error().message, HasSubstr("meta"));
  EXPECT_THAT(
      WriteCase(R"({"records": [], "meta": {"variant": {"features": []}}})").error().message,
      HasSubstr("no Header"));
}

}  // namespace
}  // namespace exemplar::conformance
