#include "exemplar/program/options.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "exemplar/program/runtime.hpp"

namespace exemplar::program {
namespace {

std::optional<int> Parse(Options& options, std::vector<std::string> words) {
  words.insert(words.begin(), "exemplar-test");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  return options.Parse(static_cast<int>(argv.size()), argv.data());
}

class OptionsTest : public testing::Test {
 protected:
  std::string WriteConfig(const std::string& text) {
    const std::filesystem::path file =
        std::filesystem::path(testing::TempDir()) /
        (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".yaml");
    std::ofstream(file) << text;
    return file.string();
  }

  Options options_{"exemplar-test", "A program.", "", {.bus = true, .server = true}};
};

TEST_F(OptionsTest, FlagsOverrideTheConfigurationFile) {
  double rate = 1;
  options_.Add("--rate", rate, "speed");
  const std::string config = WriteConfig("domain: 7\nstation: lab\nrate: 4\n");
  ASSERT_FALSE(Parse(options_, {"--config", config, "--domain", "9"}));
  EXPECT_EQ(options_.common().domain, 9);
  EXPECT_EQ(options_.common().station, "lab");
  EXPECT_EQ(rate, 4);
}

TEST_F(OptionsTest, ListsComeFromYamlSequences) {
  std::vector<std::string> files;
  options_.Add("--replay", files, "trials");
  ASSERT_FALSE(Parse(options_, {"--config", WriteConfig("replay: [a.csv, b.csv]\n")}));
  EXPECT_EQ(files, (std::vector<std::string>{"a.csv", "b.csv"}));
}

TEST_F(OptionsTest, BadUsageIsExitCodeTwo) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Parse(options_, {"--domain", "many"}), 2);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("--domain"), std::string::npos);
}

TEST_F(OptionsTest, AnUnknownNameInTheFileIsRefused) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Parse(options_, {"--config", WriteConfig("statoin: lab\n")}), 2);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("statoin"), std::string::npos);
}

TEST_F(OptionsTest, ACheckAsksTheRunningProgramAndNeedsNoOtherOption) {
  std::string robot;
  options_.Add("--robot", robot, "folder").Required();
  auto server = MetricsServer::Create("127.0.0.1:0", {});
  ASSERT_TRUE(server.ok());
  const std::string port = std::to_string((*server)->port());
  EXPECT_EQ(Parse(options_, {"--check", "--metrics", "0.0.0.0:" + port}), 0);
  server->reset();
  testing::internal::CaptureStderr();
  EXPECT_EQ(Parse(options_, {"--check", "--metrics", "0.0.0.0:" + port}), 5);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("no healthy program answers on 0.0.0.0:"),
            std::string::npos);
}

TEST_F(OptionsTest, ACheckSaysThatItNeedsTheMetrics) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Parse(options_, {"--check"}), 2);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("--metrics"), std::string::npos);
}

TEST_F(OptionsTest, ASlipOfTheHandIsToldTheNearestName) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Parse(options_, {"--config", WriteConfig("domain: 3\nstatoin: lab\n")}), 2);
  std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("line 2: there is no option \"statoin\"; did you mean station?"),
            std::string::npos)
      << said;
  testing::internal::CaptureStderr();
  EXPECT_EQ(Parse(options_, {"--staton=lab"}), 2);
  said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("did you mean --station?"), std::string::npos) << said;
}

TEST_F(OptionsTest, BrokenYamlNamesItsLine) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Parse(options_, {"--config", WriteConfig("domain: 1\nstation: [a\n")}), 2);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("line"), std::string::npos);
}

TEST_F(OptionsTest, HelpAndVersionEndWithSuccess) {
  testing::internal::CaptureStdout();
  EXPECT_EQ(Parse(options_, {"--help"}), 0);
  const std::string help = testing::internal::GetCapturedStdout();
  EXPECT_NE(help.find("--station"), std::string::npos);
  EXPECT_NE(help.find("--port-file"), std::string::npos);
}

}  // namespace
}  // namespace exemplar::program
