#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/ircp/clock_relation.hpp"
#include "exemplar/recording/append.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/recording/reader.hpp"
#include "exemplar/recording/recover.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

constexpr const char* kLabels = "exemplar.labels";
constexpr const char* kLosses = "exemplar.losses";
constexpr const char* kClock = "exemplar.clock";

struct Words {
  std::string file, output, format;
  std::vector<std::string> labels;
};

struct TopicInfo {
  std::string topic, type, encoding;
  std::uint64_t messages = 0;
};

/// What a writer of a topic sent, and how much of it is missing why.
struct LossInfo {
  std::string topic, writer, source;
  std::uint64_t received = 0;
  std::uint64_t lost_in_gaps = 0;
  std::uint64_t lost_at_end = 0;
  std::uint64_t dropped = 0;
};

struct FileInfo {
  std::uint64_t bytes = 0;
  std::string library;
  recording::Statistics statistics;
  std::vector<TopicInfo> topics;
  std::map<std::string, recording::StringMap> metadata;  ///< the last of each name
  std::vector<LossInfo> losses;
  std::vector<ircp::ClockRelation> clocks;  ///< the last of each program
  std::vector<std::string> attachments;
};

LossInfo LossesFrom(const recording::StringMap& fields) {
  const auto text = [&](const char* name) {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string() : found->second;
  };
  const auto number = [&](const char* name) {
    return static_cast<std::uint64_t>(std::max(0LL, ParseInteger(text(name)).value_or(0)));
  };
  return {.topic = text("topic"),
          .writer = text("writer"),
          .source = text("source"),
          .received = number("received"),
          .lost_in_gaps = number("lost_in_gaps"),
          .lost_at_end = number("lost_at_end"),
          .dropped = number("dropped_by_recorder")};
}

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
  std::map<std::pair<std::string, std::string>, LossInfo> losses;  // the last of a writer counts
  std::map<std::string, ircp::ClockRelation> clocks;
  for (const recording::MetadataIndex& index : reader.metadata()) {
    const Result<recording::Metadata> metadata = reader.ReadMetadata(index);
    if (!metadata) return WithPlace(metadata.error(), path);
    if (metadata->name == kLosses) {
      LossInfo of_writer = LossesFrom(metadata->metadata);
      losses[{of_writer.topic, of_writer.writer}] = std::move(of_writer);
    } else if (metadata->name == kClock) {
      const auto relation = ircp::ClockRelationFromFields(metadata->metadata);
      if (!relation) return WithPlace(relation.error(), path + ": metadata " + kClock);
      clocks[relation->participant] = *relation;
    } else {
      info.metadata[metadata->name] = metadata->metadata;
    }
  }
  for (auto& entry : losses) info.losses.push_back(std::move(entry.second));
  for (auto& entry : clocks) info.clocks.push_back(std::move(entry.second));
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
    nlohmann::json losses = nlohmann::json::array();
    for (const LossInfo& of_writer : info->losses) {
      losses.push_back({{"topic", of_writer.topic},
                        {"source", of_writer.source},
                        {"writer", of_writer.writer},
                        {"received", of_writer.received},
                        {"lost_in_gaps", of_writer.lost_in_gaps},
                        {"lost_at_end", of_writer.lost_at_end},
                        {"dropped_by_recorder", of_writer.dropped}});
    }
    nlohmann::json clocks = nlohmann::json::array();
    for (const ircp::ClockRelation& clock : info->clocks) {
      clocks.push_back({{"program", clock.program},
                        {"participant", clock.participant},
                        {"offset_s", ToSeconds(clock.offset)},
                        {"drift_ppm", 1e6 * clock.drift},
                        {"uncertainty_s", ToSeconds(clock.uncertainty)},
                        {"exchanges", clock.exchanges},
                        {"jumps", clock.epoch}});
    }
    Print({{"file", words.file},
           {"bytes", info->bytes},
           {"library", info->library},
           {"start", ToIso8601(statistics.message_start_time)},
           {"duration_s", DurationS(statistics)},
           {"messages", statistics.message_count},
           {"chunks", statistics.chunk_count},
           {"topics", std::move(topics)},
           {"losses", std::move(losses)},
           {"clocks", std::move(clocks)},
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
  if (!info->losses.empty()) {
    Table losses({"TOPIC", "SOURCE", "RECEIVED", "IN GAPS", "AT END", "BY RECORDER", "WRITER"});
    for (const LossInfo& of_writer : info->losses) {
      losses.Add({of_writer.topic, of_writer.source, std::to_string(of_writer.received),
                  std::to_string(of_writer.lost_in_gaps), std::to_string(of_writer.lost_at_end),
                  std::to_string(of_writer.dropped), of_writer.writer});
    }
    std::cout << "lost\n" << losses.Text(2);
  }
  if (!info->clocks.empty()) {
    Table clocks(
        {"PROGRAM", "AHEAD S", "WITHIN S", "DRIFT PPM", "EXCHANGES", "JUMPS", "PARTICIPANT"});
    for (const ircp::ClockRelation& clock : info->clocks) {
      clocks.Add({clock.program, FormatFixed(ToSeconds(clock.offset), 6),
                  FormatFixed(ToSeconds(clock.uncertainty), 6), FormatFixed(1e6 * clock.drift, 1),
                  std::to_string(clock.exchanges), std::to_string(clock.epoch), clock.participant});
    }
    std::cout << "clocks beside the recorder's\n" << clocks.Text(2);
  }
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
  const std::filesystem::path folder = output.has_parent_path() ? output.parent_path() : ".";
  auto scratch = recording::FileScratch::Create(folder);
  if (!scratch) return Fail(scratch.error());
  const Result<recording::RecoveryReport> report =
      recording::Recover(**source, **sink, {}, std::move(*scratch));
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
                       "Writes labels into a recording, or takes them away; needs no server\n\n"
                       "Success, phase, notes and what else is to be known of it; its messages "
                       "stay as they are.\n"
                       "NAME= takes a label away.",
                       {"exemplar record label trial-001.mcap success=yes phase=press",
                        "exemplar record label trial-001.mcap notes="});
  command.Argument("FILE", words->file, "MCAP");
  command.Arguments("NAME=VALUE", words->labels, "one or several");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([words] { return Label(*words); });

  words = std::make_shared<Words>();
  command = record.Add("recover",
                       "Makes a whole file of one whose recorder was killed; needs no server\n\n"
                       "The damaged file is left as it is.",
                       {"exemplar record recover trial-001.mcap",
                        "exemplar record recover cut.mcap --output whole.mcap"});
  command.Argument("FILE", words->file, "MCAP");
  command.Option("--output", "FILE", words->output, "default: NAME.recovered.mcap beside it");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([words] { return Recover(*words); });
}

}  // namespace exemplar::cli
