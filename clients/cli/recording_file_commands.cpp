#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/recording/append.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/recording/reader.hpp"
#include "exemplar/recording/recover.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

constexpr const char* kLabels = "exemplar.labels";

struct Words {
  std::string file, output, format;
  std::vector<std::string> labels;
};

struct TopicInfo {
  std::string topic, type, encoding;
  std::uint64_t messages = 0;
};

struct FileInfo {
  std::uint64_t bytes = 0;
  std::string library;
  recording::Statistics statistics;
  std::vector<TopicInfo> topics;
  std::map<std::string, recording::StringMap> metadata;
  std::vector<std::string> attachments;
};

Result<FileInfo> ReadInfo(const std::string& path) {
  if (const Status whole = recording::FinishAppend(path); !whole) return whole.error();
  const auto file = recording::FileSource::Open(path);
  if (!file) return file.error();
  const auto opened = recording::IndexedReader::Open(**file);
  if (!opened) {
    Error error = WithPlace(opened.error(), path);
    if (error.code == ErrorCode::kDataLoss) {
      error.message += " (exemplar record recover makes a whole file of it)";
    }
    return error;
  }
  recording::IndexedReader& reader = **opened;
  if (!reader.statistics()) {
    return Error{ErrorCode::kDataLoss, path + " has no summary (exemplar record recover makes one)",
                 "FILE"};
  }
  FileInfo info;
  info.bytes = (*file)->size();
  info.library = reader.header().library;
  info.statistics = *reader.statistics();
  for (const auto& [id, channel] : reader.channels()) {
    const auto schema = reader.schemas().find(channel.schema_id);
    const auto count = info.statistics.channel_message_counts.find(id);
    info.topics.push_back(
        {.topic = channel.topic,
         .type = schema == reader.schemas().end() ? "" : schema->second.name,
         .encoding = channel.message_encoding,
         .messages = count == info.statistics.channel_message_counts.end() ? 0 : count->second});
  }
  for (const recording::MetadataIndex& index : reader.metadata()) {
    const Result<recording::Metadata> metadata = reader.ReadMetadata(index);
    if (!metadata) return WithPlace(metadata.error(), path);
    info.metadata[metadata->name] = metadata->metadata;
  }
  for (const recording::AttachmentIndex& index : reader.attachments()) {
    info.attachments.push_back(index.name);
  }
  return info;
}

double DurationS(const recording::Statistics& statistics) {
  return ToSeconds(statistics.message_end_time - statistics.message_start_time);
}

int Info(const Words& words) {
  const Result<FileInfo> info = ReadInfo(words.file);
  if (!info) return Fail(info.error());
  const recording::Statistics& statistics = info->statistics;
  if (words.format == "json") {
    nlohmann::json topics = nlohmann::json::array();
    for (const TopicInfo& topic : info->topics) {
      topics.push_back({{"topic", topic.topic},
                        {"type", topic.type},
                        {"encoding", topic.encoding},
                        {"messages", topic.messages}});
    }
    Print({{"file", words.file},
           {"bytes", info->bytes},
           {"library", info->library},
           {"start", ToIso8601(statistics.message_start_time)},
           {"duration_s", DurationS(statistics)},
           {"messages", statistics.message_count},
           {"chunks", statistics.chunk_count},
           {"topics", std::move(topics)},
           {"metadata", info->metadata},
           {"attachments", info->attachments}});
    return 0;
  }
  std::cout << "file      " << words.file << ", "
            << FormatFixed(1e-6 * static_cast<double>(info->bytes), 2) << " MB, by "
            << info->library << "\nstart     " << TimeText(statistics.message_start_time)
            << "\nduration  " << FormatFixed(DurationS(statistics), 3) << " s\nmessages  "
            << statistics.message_count << " in " << statistics.chunk_count << " chunks\n";
  Table topics({"TOPIC", "MESSAGES", "TYPE", "ENCODING"});
  for (const TopicInfo& topic : info->topics) {
    topics.Add({topic.topic, std::to_string(topic.messages), topic.type, topic.encoding});
  }
  std::cout << topics.Text();
  for (const auto& [name, entries] : info->metadata) {
    std::cout << "metadata " << name << '\n';
    for (const auto& [key, value] : entries) std::cout << "  " << key << " = " << value << '\n';
  }
  for (const std::string& name : info->attachments) std::cout << "attachment " << name << '\n';
  return 0;
}

/// Adds to the labels that the file has; an empty value takes one away.
int Label(const Words& words) {
  const auto changes = ParsePairs(words.labels, "LABEL");
  if (!changes) return FailUsage(changes.error());
  Result<FileInfo> info = ReadInfo(words.file);
  if (!info) return Fail(info.error());
  recording::StringMap labels = info->metadata[kLabels];
  for (const auto& [name, value] : *changes) {
    if (value.empty()) {
      labels.erase(name);
    } else {
      labels[name] = value;
    }
  }
  const Status added = recording::AppendMetadata(words.file, {kLabels, labels});
  if (!added) return Fail(added.error());
  if (words.format == "json") {
    Print({{"file", words.file}, {"labels", labels}});
    return 0;
  }
  for (const auto& [name, value] : labels) std::cout << name << " = " << value << '\n';
  return 0;
}

int Recover(const Words& words) {
  if (const Status whole = recording::FinishAppend(words.file); !whole) return Fail(whole.error());
  const std::filesystem::path input = words.file;
  std::filesystem::path output = words.output;
  if (output.empty()) {
    output = input.parent_path() / (input.stem().string() + ".recovered.mcap");
  }
  const auto source = recording::FileSource::Open(input);
  if (!source) return Fail(source.error());
  const auto sink = recording::FileSink::Create(output);
  if (!sink) return Fail(sink.error());
  const Result<recording::RecoveryReport> report = recording::Recover(**source, **sink);
  if (!report) {
    std::error_code ignored;
    std::filesystem::remove(output, ignored);
    return Fail(WithPlace(report.error(), words.file));
  }
  if (words.format == "json") {
    Print({{"output", output.string()},
           {"was_whole", report->was_whole},
           {"messages", report->messages},
           {"attachments", report->attachments},
           {"metadata", report->metadata},
           {"damaged_chunks", report->damaged_chunks},
           {"bytes_left_out", report->bytes_left_out},
           {"notices", report->notices}});
    return 0;
  }
  std::cout << output.string() << ": " << report->messages << " messages"
            << (report->was_whole ? "; the file was whole" : "") << '\n';
  if (report->damaged_chunks > 0 || report->bytes_left_out > 0) {
    std::cout << "left out: " << report->damaged_chunks << " damaged chunks, "
              << report->bytes_left_out << " bytes at the end\n";
  }
  for (const std::string& notice : report->notices) std::cerr << "notice: " << notice << '\n';
  return 0;
}

}  // namespace

void AddRecordingFileCommands(Command& record) {
  auto words = std::make_shared<Words>();
  Command command = record.Add("info", "Shows what a recording holds; needs no server",
                               {"exemplar record info trial-001.mcap"});
  command.Argument("FILE", words->file, "MCAP");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([words] { return Info(*words); });

  words = std::make_shared<Words>();
  command = record.Add("label",
                       "Writes labels into a recording (success, phase, notes, ...): its messages "
                       "stay as they are; NAME= takes a label away. Needs no server",
                       {"exemplar record label trial-001.mcap success=yes phase=press",
                        "exemplar record label trial-001.mcap notes="});
  command.Argument("FILE", words->file, "MCAP");
  command.Arguments("NAME=VALUE", words->labels, "one or several");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([words] { return Label(*words); });

  words = std::make_shared<Words>();
  command = record.Add("recover",
                       "Makes a whole file of one whose recorder was killed; needs no server. The "
                       "damaged file is left as it is",
                       {"exemplar record recover trial-001.mcap",
                        "exemplar record recover cut.mcap --output whole.mcap"});
  command.Argument("FILE", words->file, "MCAP");
  command.Option("--output", "FILE", words->output, "default: NAME.recovered.mcap beside it");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([words] { return Recover(*words); });
}

}  // namespace exemplar::cli
