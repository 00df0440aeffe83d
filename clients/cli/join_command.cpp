#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/joining/join.hpp"
#include "exemplar/recording/append.hpp"
#include "exemplar/recording/file.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

struct Words {
  std::vector<std::string> files;
  std::string output, format;
  bool same_clock = false;
};

Result<joining::JoinReport> JoinFiles(const Words& words) {
  std::vector<std::unique_ptr<recording::FileSource>> sources;
  std::vector<joining::Input> inputs;
  for (const std::string& name : words.files) {
    if (const Status whole = recording::FinishAppend(name); !whole) return whole.error();
    auto source = recording::FileSource::Open(name);
    if (!source) return source.error();
    inputs.push_back({name, source->get()});
    sources.push_back(std::move(*source));
  }
  const auto sink = recording::FileSink::Create(words.output);
  if (!sink) return sink.error();
  Result<joining::JoinReport> report =
      joining::Join(inputs, **sink, {.same_clock = words.same_clock});
  if (!report) {
    std::error_code ignored;
    std::filesystem::remove(words.output, ignored);
  }
  return report;
}

int Join(const Words& words) {
  const Result<joining::JoinReport> report = JoinFiles(words);
  if (!report) return Fail(report.error());
  if (words.format == "json") {
    nlohmann::json files = nlohmann::json::array();
    for (const joining::JoinedFile& file : report->files) {
      files.push_back({{"file", file.name},
                       {"offset_s", ToSeconds(file.offset)},
                       {"drift_ppm", 1e6 * file.drift},
                       {"uncertainty_s", ToSeconds(file.uncertainty)},
                       {"through", file.through},
                       {"messages", file.messages},
                       {"repeated", file.repeated}});
    }
    Print({{"output", words.output},
           {"messages", report->messages},
           {"lost", report->lost},
           {"files", std::move(files)},
           {"notices", report->notices}});
    return 0;
  }
  std::cout << words.output << ": " << report->messages << " messages, " << report->lost
            << " lost\n";
  Table files(
      {"FILE", "MESSAGES", "REPEATED", "CLOCK AHEAD S", "DRIFT PPM", "WITHIN S", "THROUGH"});
  for (const joining::JoinedFile& file : report->files) {
    files.Add({file.name, std::to_string(file.messages), std::to_string(file.repeated),
               FormatFixed(ToSeconds(file.offset), 6), FormatFixed(1e6 * file.drift, 1),
               FormatFixed(ToSeconds(file.uncertainty), 6), file.through});
  }
  std::cout << files.Text();
  for (const std::string& notice : report->notices) std::cerr << "notice: " << notice << '\n';
  return 0;
}

}  // namespace

void AddJoinCommand(Command& record) {
  const auto words = std::make_shared<Words>();
  Command command = record.Add(
      "join",
      "Makes one recording of several that were made of one trial; needs no server\n\n"
      "Recorders on different machines have a clock each: what the others have is brought to the\n"
      "first one's.",
      {"exemplar record join suit-machine.mcap robot-machine.mcap -o trial-001.mcap"});
  command.Arguments("FILE", words->files, "MCAP; several");
  command.Option("-o,--output", "FILE", words->output, "the new file").Required();
  command.Flag("--same-clock", words->same_clock,
               "take clocks for one between which nothing was measured");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([words] { return Join(*words); });
}

}  // namespace exemplar::cli
