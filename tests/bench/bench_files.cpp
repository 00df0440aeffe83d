// Reading trials and writing recordings, each beside the least that any program must do for them.
// Prints a JSON list of rows as tests/bench/run collects them.

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>

#include "exemplar/demonstration/csv.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/recording/writer.hpp"
#include "long_presses.hpp"

namespace exemplar {
namespace {

constexpr const char* kName = "bench_files";
constexpr int kRounds = 5;

double Seconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

nlohmann::json Row(const std::string& name, double value, const std::string& unit,
                   const std::string& peer, double peer_value) {
  return {{"name", name}, {"value", value},           {"unit", unit},
          {"peer", peer}, {"peer_value", peer_value}, {"ratio", value / peer_value}};
}

// Lines and numbers, and nothing else.
double RawRead(const std::string& text) {
  std::istringstream lines(text);
  double sum = 0;
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    const char* at = line.c_str();
    while (*at != '\0') {
      char* end = nullptr;
      sum += std::strtod(at, &end);
      at = *end == ',' ? end + 1 : end;
      if (end == line.c_str()) break;
    }
  }
  return sum;
}

int ReadCsvs(const kinematics::RobotDescription& robot, nlohmann::json& rows) {
  const std::vector<learning::NamedTrial> trials = bench::MakeLongPresses(robot, 10, 3);
  std::vector<std::string> texts;
  double samples = 0;
  for (const learning::NamedTrial& named : trials) {
    texts.push_back(demonstration::WriteCsv(named.trial));
    samples += static_cast<double>(named.trial.joints.size());
  }
  double best = 1e300, best_raw = 1e300;
  for (int round = 0; round < kRounds; ++round) {
    best = std::min(best, Seconds([&] {
                      for (const std::string& text : texts) {
                        if (!demonstration::ReadCsv(text, "trial.csv")) std::abort();
                      }
                    }));
    best_raw = std::min(best_raw, Seconds([&] {
                          for (const std::string& text : texts) {
                            if (RawRead(text) == 0) std::abort();
                          }
                        }));
  }
  rows.push_back(
      Row("csv_rows_read", samples / best, "rows/s", "getline and strtod", samples / best_raw));
  return 0;
}

Status WriteRecording(const std::filesystem::path& file, recording::Compression compression,
                      int messages, const recording::Bytes& data) {
  auto sink = recording::FileSink::Create(file);
  if (!sink) return sink.error();
  auto writer = recording::Writer::Create(**sink, {.compression = compression});
  if (!writer) return writer.error();
  Status done = (*writer)->AddSchema({.id = 1, .name = "Sample", .encoding = "omgidl", .data = {}});
  if (!done) return done;
  done = (*writer)->AddChannel(
      {.id = 1, .schema_id = 1, .topic = "ircp/suit", .message_encoding = "cdr", .metadata = {}});
  if (!done) return done;
  for (int i = 0; i < messages; ++i) {
    recording::MessageView message;
    message.channel_id = 1;
    message.sequence = static_cast<std::uint32_t>(i);
    message.log_time = Stamp::FromNanoseconds(i * 1000LL);
    message.publish_time = message.log_time;
    message.data = data;
    done = (*writer)->Write(message);
    if (!done) return done;
  }
  return (*writer)->Close();
}

void RawWrite(const std::filesystem::path& file, int messages, const recording::Bytes& data) {
  const int descriptor = open(file.c_str(), O_CREAT | O_WRONLY | O_TRUNC | O_CLOEXEC, 0644);
  recording::Bytes block;
  for (int i = 0; i < messages; ++i) {
    block.insert(block.end(), data.begin(), data.end());
    if (block.size() < (1u << 20) && i + 1 < messages) continue;
    if (write(descriptor, block.data(), block.size()) != static_cast<ssize_t>(block.size())) {
      std::abort();
    }
    block.clear();
  }
  if (fsync(descriptor) != 0) std::abort();
  close(descriptor);
}

int WriteMcap(const std::filesystem::path& folder, nlohmann::json& rows) {
  constexpr int kMessages = 200'000;
  recording::Bytes data(400);  // 42 joints and a header
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i * 37 + i / 8);
  const std::filesystem::path file = folder / "bench.mcap";
  for (const auto& [name, compression] :
       {std::pair{"mcap_messages_written", recording::Compression::kNone},
        std::pair{"mcap_messages_written_zstd", recording::Compression::kZstd}}) {
    double best = 1e300, best_raw = 1e300;
    for (int round = 0; round < kRounds; ++round) {
      std::filesystem::remove(file);
      Status done;
      best = std::min(best,
                      Seconds([&] { done = WriteRecording(file, compression, kMessages, data); }));
      if (!done) return program::Fail(kName, done.error());
      best_raw =
          std::min(best_raw, Seconds([&] { RawWrite(folder / "bench.raw", kMessages, data); }));
    }
    rows.push_back(Row(name, kMessages / best, "messages/s", "write() and fsync of the same bytes",
                       kMessages / best_raw));
  }
  return 0;
}

}  // namespace
}  // namespace exemplar

int main(int argc, char** argv) {
  using namespace exemplar;
  std::string robot_folder, folder;
  program::Options options(kName, "Measures the readers and writers of files",
                           "bench_files --robot deploy/models/leonardo --folder /tmp", {});
  options.Add("--robot", robot_folder, "a folder of deploy/models").Required();
  options.Add("--folder", folder, "where files may be written").Required();
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  const auto robot = kinematics::ReadRobotDescription(robot_folder);
  if (!robot) return program::Fail(kName, robot.error());
  nlohmann::json rows = nlohmann::json::array();
  if (const int failed = ReadCsvs(*robot, rows); failed != 0) return failed;
  if (const int failed = WriteMcap(folder, rows); failed != 0) return failed;
  std::printf("%s\n", rows.dump().c_str());
  return 0;
}
