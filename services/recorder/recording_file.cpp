#include "recorder/recording_file.hpp"

#include <limits>

#include "exemplar/base/text.hpp"

namespace exemplar::recorder {
namespace {

constexpr std::uint16_t kLastId = std::numeric_limits<std::uint16_t>::max();

recording::Metadata AboutWriter(const WriterFigures& figures) {
  recording::StringMap fields = {{"topic", figures.topic},
                                 {"writer", figures.writer},
                                 {"source", figures.source},
                                 {"received", std::to_string(figures.received)},
                                 {"lost_in_gaps", std::to_string(figures.lost_in_gaps)},
                                 {"lost_at_end", std::to_string(figures.lost_at_end)},
                                 {"dropped_by_recorder", std::to_string(figures.dropped)},
                                 {"last", std::to_string(figures.last)}};
  if (figures.announced) fields["announced"] = std::to_string(*figures.announced);
  return {"exemplar.losses", std::move(fields)};
}

recording::StringMap AboutRecording(const RecordingInfo& info) {
  recording::StringMap fields = {
      {"name", info.name}, {"station", info.station}, {"started", ToIso8601(info.started)}};
  if (info.part > 0) fields["part"] = std::to_string(info.part);
  if (!info.previous_file.empty()) fields["previous_file"] = info.previous_file;
  return fields;
}

}  // namespace

Result<std::unique_ptr<RecordingFile>> RecordingFile::Create(
    recording::ByteSink& sink, recording::WriterOptions options, const RecordingInfo& info,
    std::unique_ptr<recording::ByteScratch> scratch) {
  Result<std::unique_ptr<recording::Writer>> writer =
      recording::Writer::Create(sink, std::move(options), std::move(scratch));
  if (!writer.ok()) return writer.error();
  const recording::Metadata about{"exemplar.recording", AboutRecording(info)};
  if (const Status s = (*writer)->Write(about); !s.ok()) return s.error();
  if (!info.metadata.empty()) {
    const recording::Metadata trial{"exemplar.trial", info.metadata};
    if (const Status s = (*writer)->Write(trial); !s.ok()) return s.error();
  }
  std::unique_ptr<RecordingFile> file(new RecordingFile(std::move(*writer), info));
  file->unsynced_ = true;
  if (const Status s = file->Flush(); !s.ok()) return s.error();
  return file;
}

Result<std::uint16_t> RecordingFile::SchemaOf(const ircp::RawTopic& topic) {
  if (topic.schema.empty()) return std::uint16_t{0};
  const auto [known, inserted] = schemas_.try_emplace({topic.type, topic.schema}, std::uint16_t{0});
  if (!inserted) return known->second;
  if (schemas_.size() > kLastId) {
    return Error{ErrorCode::kResourceExhausted, "more than 65535 schemas in one file"};
  }
  known->second = static_cast<std::uint16_t>(schemas_.size());
  recording::Schema schema{known->second, topic.type, "omgidl", {}};
  schema.data.assign(topic.schema.begin(), topic.schema.end());
  if (const Status added = writer_->AddSchema(schema); !added.ok()) return added.error();
  return known->second;
}

Result<std::uint16_t> RecordingFile::ChannelOf(const ircp::RawTopic& topic,
                                               const std::string& source,
                                               const ircp::RawSample& sample) {
  std::vector<ChannelOfTopic>& of_writer = channels_[sample.writer];
  for (const ChannelOfTopic& channel : of_writer) {
    if (channel.topic == sample.topic) return channel.id;
  }
  if (next_channel_ == kLastId) {
    return Error{ErrorCode::kResourceExhausted, "more than 65535 writers in one file"};
  }
  Result<std::uint16_t> schema = SchemaOf(topic);
  if (!schema.ok()) return schema.error();
  recording::Channel channel{next_channel_, *schema, sample.topic, "cdr", {}};
  channel.metadata = {{"writer", sample.writer},
                      {"type", topic.type},
                      {"keyed", topic.keyed ? "true" : "false"},
                      {"reliability", topic.reliable ? "reliable" : "best_effort"},
                      {"durability", topic.transient_local ? "transient_local" : "volatile"}};
  if (topic.deadline > Duration(0)) {
    channel.metadata["deadline_s"] = FormatDouble(ToSeconds(topic.deadline));
  }
  if (!source.empty()) channel.metadata["source"] = source;
  if (const Status added = writer_->AddChannel(channel); !added.ok()) return added.error();
  of_writer.push_back({sample.topic, next_channel_});
  return next_channel_++;
}

Status RecordingFile::Write(const ircp::RawTopic& topic, const std::string& source,
                            const ircp::RawSample& sample) {
  const Result<std::uint16_t> channel = ChannelOf(topic, source, sample);
  if (!channel.ok()) return channel.error();
  recording::MessageView message;
  message.channel_id = *channel;
  message.sequence = static_cast<std::uint32_t>(sample.sequence);
  message.log_time = sample.received;
  message.publish_time = sample.source_stamp;
  message.data = sample.cdr;
  unsynced_ = true;
  return writer_->Write(message);
}

Status RecordingFile::Flush() {
  if (!unsynced_) return {};
  unsynced_ = false;
  return writer_->Flush();
}

Status RecordingFile::WriteLosses(const std::vector<WriterFigures>& losses) {
  for (const WriterFigures& figures : losses) {
    unsynced_ = true;
    if (const Status s = writer_->Write(AboutWriter(figures)); !s.ok()) return s;
  }
  return {};
}

Status RecordingFile::WriteMark(const std::string& name, recording::StringMap fields) {
  unsynced_ = true;
  return writer_->Write(recording::Metadata{name, std::move(fields)});
}

Status RecordingFile::Finish(Stamp stopped, const std::vector<WriterFigures>& losses,
                             const recording::StringMap& more) {
  if (const Status s = WriteLosses(losses); !s.ok()) return s;
  std::uint64_t lost = 0;
  for (const WriterFigures& figures : losses) lost += figures.lost();
  recording::StringMap fields = AboutRecording(info_);
  fields["stopped"] = ToIso8601(stopped);
  fields["messages"] = std::to_string(messages());
  fields["lost"] = std::to_string(lost);
  fields.insert(more.begin(), more.end());
  if (const Status s = writer_->Write(recording::Metadata{"exemplar.recording", fields}); !s.ok())
    return s;
  return writer_->Close();
}

}  // namespace exemplar::recorder
