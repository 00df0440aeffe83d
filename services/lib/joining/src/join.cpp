#include "exemplar/joining/join.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/ircp/sample_header.hpp"
#include "facts.hpp"
#include "shared_writers.hpp"
#include "time_bases.hpp"

namespace exemplar::joining {
namespace {

constexpr Duration kWindow = std::chrono::seconds(1);
constexpr int kMostWindows = 1'000'000;  // of files that lie years apart
constexpr std::uint16_t kLastId = std::numeric_limits<std::uint16_t>::max();

class Joiner {
 public:
  Joiner(std::vector<Facts> files, std::vector<TimeBase> bases, recording::Writer& writer)
      : files_(std::move(files)),
        bases_(std::move(bases)),
        writer_(writer),
        shared_(files_),
        channels_(files_.size()) {}

  Result<JoinReport> Run() {
    Describe();
    for (const auto& step :
         {&Joiner::WriteMessages, &Joiner::WriteAttachments, &Joiner::WriteMetadata}) {
      if (const Status done = (this->*step)(); !done.ok()) return done.error();
    }
    if (const Status closed = writer_.Close(); !closed.ok()) return closed.error();
    return std::move(report_);
  }

 private:
  /// What a channel of an input is in the joined file.
  struct NewChannel {
    std::uint16_t id = 0;
    SharedWriters::Writer writer;
    std::optional<ircp::HeaderLayout> header;
  };
  struct Waiting {
    std::size_t file = 0;
    recording::Message message;
  };

  Stamp Start(std::size_t i) const { return files_[i].reader->statistics()->message_start_time; }
  Stamp End(std::size_t i) const { return files_[i].reader->statistics()->message_end_time; }
  bool HasMessages(std::size_t i) const {
    return files_[i].reader->statistics()->message_count > 0;
  }

  void Describe() {
    for (std::size_t i = 0; i < files_.size(); ++i) {
      const Duration offset = Start(i) - bases_[i].to_first(Start(i));
      const Duration at_end = End(i) - bases_[i].to_first(End(i));
      const double length_s = ToSeconds(End(i) - Start(i));
      report_.files.push_back({.name = files_[i].name,
                               .offset = offset,
                               .drift = length_s > 0 ? ToSeconds(at_end - offset) / length_s : 0,
                               .uncertainty = bases_[i].uncertainty,
                               .through = bases_[i].through});
      if (CountOf(files_[i].recording, "left_out") > 0) {
        report_.notices.push_back(files_[i].name +
                                  ": was paused; what it left out counts as lost where another "
                                  "file shares the writer");
      }
    }
  }

  /// A second at a time, so that memory is bounded by it.
  Status WriteMessages() {
    std::optional<Stamp> begin;
    Stamp end;
    for (std::size_t i = 0; i < files_.size(); ++i) {
      if (!HasMessages(i)) continue;
      begin = std::min(begin.value_or(bases_[i].to_first(Start(i))), bases_[i].to_first(Start(i)));
      end = std::max(end, bases_[i].to_first(End(i)));
    }
    if (!begin) return {};
    const Duration step = std::max<Duration>(kWindow, (end - *begin) / kMostWindows);
    std::vector<std::optional<Stamp>> from(files_.size());
    bool last = false;
    for (Stamp window = *begin + step; !last; window = window + step) {
      last = window > end;
      std::vector<Waiting> waiting;
      for (std::size_t i = 0; i < files_.size(); ++i) {
        std::optional<Stamp> until;
        if (!last) until = bases_[i].from_first(window);
        if (until && from[i]) until = std::max(*until, *from[i]);
        if (const Status read = Read(i, from[i], until, waiting); !read.ok()) return read;
        from[i] = until;
      }
      if (const Status written = Write(waiting); !written.ok()) return written;
    }
    return {};
  }

  Status Read(std::size_t i, std::optional<Stamp> from, std::optional<Stamp> until,
              std::vector<Waiting>& waiting) {
    if (!HasMessages(i)) return {};
    const Status read = files_[i].reader->ReadMessages(
        {.topics = {}, .start = from, .end = until}, [&](const recording::Message& message) {
          waiting.push_back({i, message});
          waiting.back().message.log_time = bases_[i].to_first(message.log_time);
          return true;
        });
    return read.ok() ? read : WithPlace(read.error(), files_[i].name);
  }

  Status Write(std::vector<Waiting>& waiting) {
    std::stable_sort(waiting.begin(), waiting.end(), [](const Waiting& a, const Waiting& b) {
      return a.message.log_time < b.message.log_time;
    });
    for (Waiting& one : waiting) {
      const Result<NewChannel*> channel = ChannelOf(one.file, one.message.channel_id);
      if (!channel.ok()) return WithPlace(channel.error(), files_[one.file].name);
      std::uint64_t number = one.message.sequence;
      if ((*channel)->header) {
        const auto header = ircp::ReadSampleHeader(one.message.data, *(*channel)->header);
        if (header) number = header->seq;
      }
      if (!shared_.Take(one.file, (*channel)->writer, number)) {
        ++report_.files[one.file].repeated;
        continue;
      }
      one.message.channel_id = (*channel)->id;
      if (const Status written = writer_.Write(one.message); !written.ok()) return written;
      ++report_.files[one.file].messages;
      ++report_.messages;
    }
    return {};
  }

  Result<NewChannel*> ChannelOf(std::size_t file, std::uint16_t id) {
    NewChannel& known = channels_[file][id];
    if (known.id != 0) return &known;
    const recording::IndexedReader& reader = *files_[file].reader;
    const auto channel = reader.channels().find(id);
    if (channel == reader.channels().end()) {
      return Error{ErrorCode::kDataLoss,
                   "a message of channel " + std::to_string(id) + ", which the file lacks"};
    }
    recording::Schema schema;
    if (const auto found = reader.schemas().find(channel->second.schema_id);
        found != reader.schemas().end()) {
      schema = found->second;
    }
    recording::Channel made = channel->second;
    const auto key = std::tuple(made.topic, FieldOf(made.metadata, "writer"), made.message_encoding,
                                schema.name, schema.encoding, schema.data,
                                FieldOf(made.metadata, "writer").empty() ? file : 0);
    known.writer = {made.topic, FieldOf(made.metadata, "writer")};
    known.header = ircp::ReadHeaderLayout(
        {reinterpret_cast<const char*>(schema.data.data()), schema.data.size()}, schema.name);
    if (const auto there = channel_ids_.find(key); there != channel_ids_.end()) {
      known.id = there->second;
      return &known;
    }
    if (channel_ids_.size() + 1 == kLastId) {
      return Error{ErrorCode::kResourceExhausted, "more than 65534 channels in one file"};
    }
    const Result<std::uint16_t> schema_id = SchemaOf(schema);
    if (!schema_id.ok()) return schema_id.error();
    made.schema_id = *schema_id;
    made.id = static_cast<std::uint16_t>(channel_ids_.size() + 1);
    if (const Status added = writer_.AddChannel(made); !added.ok()) return added.error();
    channel_ids_[key] = made.id;
    known.id = made.id;
    return &known;
  }

  Result<std::uint16_t> SchemaOf(const recording::Schema& schema) {
    if (schema.id == 0) return std::uint16_t{0};
    const auto [known, added] =
        schema_ids_.try_emplace(std::tuple(schema.name, schema.encoding, schema.data),
                                static_cast<std::uint16_t>(schema_ids_.size() + 1));
    if (!added) return known->second;
    recording::Schema made = schema;
    made.id = known->second;
    if (const Status written = writer_.AddSchema(made); !written.ok()) return written.error();
    return known->second;
  }

  Status WriteAttachments() {
    for (std::size_t i = 0; i < files_.size(); ++i) {
      for (const recording::AttachmentIndex& index : files_[i].reader->attachments()) {
        Result<recording::Attachment> attachment = files_[i].reader->ReadAttachment(index);
        if (!attachment.ok()) return WithPlace(attachment.error(), files_[i].name);
        attachment->log_time = bases_[i].to_first(attachment->log_time);
        if (const Status written = writer_.Write(*attachment); !written.ok()) return written;
      }
    }
    return {};
  }

  Status WriteMetadata() {
    if (const Status s = Put("exemplar.trial", Merged(&Facts::trial)); !s.ok()) return s;
    if (const Status s = Put("exemplar.labels", Merged(&Facts::labels)); !s.ok()) return s;
    for (std::size_t i = 0; i < files_.size(); ++i) {
      for (const recording::Metadata& other : files_[i].others) {
        recording::StringMap fields = other.metadata;
        fields.emplace("file", files_[i].name);
        fields.emplace("clock_ahead_s", FormatFixed(ToSeconds(report_.files[i].offset), 9));
        if (const Status s = Put(other.name, std::move(fields)); !s.ok()) return s;
      }
    }
    if (const Status s = WriteClocks(); !s.ok()) return s;
    for (recording::StringMap& fields : shared_.Losses()) {
      report_.lost += CountOf(fields, "lost_in_gaps") + CountOf(fields, "lost_at_end") +
                      CountOf(fields, "dropped_by_recorder");
      if (const Status s = Put("exemplar.losses", std::move(fields)); !s.ok()) return s;
    }
    std::string names;
    for (std::size_t i = 0; i < files_.size(); ++i) {
      const JoinedFile& file = report_.files[i];
      recording::StringMap fields = files_[i].recording;
      fields["file"] = file.name;
      fields["offset_ns"] = std::to_string(file.offset.count());
      fields["drift_ppm"] = FormatDouble(file.drift * 1e6);
      fields["uncertainty_ns"] = std::to_string(file.uncertainty.count());
      fields["through"] = file.through;
      fields["messages_taken"] = std::to_string(file.messages);
      fields["messages_repeated"] = std::to_string(file.repeated);
      if (const Status s = Put("exemplar.joined", std::move(fields)); !s.ok()) return s;
      names += (names.empty() ? "" : ", ") + file.name;
    }
    recording::StringMap about = files_.front().recording;
    about["joined_from"] = names;
    about["messages"] = std::to_string(report_.messages);
    about["lost"] = std::to_string(report_.lost);
    return Put("exemplar.recording", std::move(about));
  }

  /// The first file's values count; others stand beside them under the file's name.
  recording::StringMap Merged(recording::StringMap Facts::*part) {
    recording::StringMap merged;
    for (const Facts& file : files_) {
      for (const auto& [name, value] : file.*part) {
        const auto [known, added] = merged.try_emplace(name, value);
        if (added || known->second == value) continue;
        merged[name + " (" + file.name + ")"] = value;
        report_.notices.push_back(file.name + ": " + name + " is \"" + value + "\", elsewhere \"" +
                                  known->second + "\"");
      }
    }
    return merged;
  }

  /// Every clock against the first recorder's: what it has measured itself, else what another
  /// recorder has, and the other recorders' own.
  Status WriteClocks() {
    std::map<std::string, ircp::ClockTrack> clocks = files_.front().clocks;
    const std::string& observer = files_.front().observer;
    for (std::size_t i = 1; i < files_.size(); ++i) {
      const Facts& file = files_[i];
      const TimeBase& base = bases_[i];
      const auto ahead = [&](Stamp time) { return time - base.to_first(time); };
      std::map<std::string, ircp::ClockTrack> found;
      for (const auto& [participant, track] : file.clocks) {
        if (clocks.count(participant) != 0) continue;
        for (ircp::ClockRelation relation : track.relations()) {
          relation.offset += ahead(relation.at);
          relation.uncertainty += base.uncertainty;
          relation.at = base.to_first(relation.at);
          relation.since = base.to_first(relation.since);
          relation.observer = observer;
          found[participant].Add(std::move(relation));
        }
      }
      if (!file.observer.empty() && clocks.count(file.observer) == 0 &&
          found.count(file.observer) == 0) {
        for (const Stamp time : {Start(i), End(i)}) {
          found[file.observer].Add({.participant = file.observer,
                                    .program = "recorder",
                                    .observer = observer,
                                    .at = base.to_first(time),
                                    .offset = ahead(time),
                                    .drift = report_.files[i].drift,
                                    .uncertainty = base.uncertainty,
                                    .since = base.to_first(Start(i))});
        }
      }
      clocks.merge(found);
    }
    for (const auto& [participant, track] : clocks) {
      for (const ircp::ClockRelation& relation : track.relations()) {
        if (const Status s = Put("exemplar.clock", ircp::ToFields(relation)); !s.ok()) return s;
      }
    }
    return {};
  }

  Status Put(const std::string& name, recording::StringMap fields) {
    if (fields.empty()) return {};
    return writer_.Write(recording::Metadata{name, std::move(fields)});
  }

  const std::vector<Facts> files_;
  const std::vector<TimeBase> bases_;
  recording::Writer& writer_;
  SharedWriters shared_;
  JoinReport report_;
  std::vector<std::map<std::uint16_t, NewChannel>> channels_;  ///< by file and the file's id
  std::map<std::tuple<std::string, std::string, std::string, std::string, std::string,
                      recording::Bytes, std::size_t>,
           std::uint16_t>
      channel_ids_;
  std::map<std::tuple<std::string, std::string, recording::Bytes>, std::uint16_t> schema_ids_;
};

Status CheckTogether(std::span<const Facts> files) {
  for (const Facts& file : files) {
    const recording::Statistics& statistics = *file.reader->statistics();
    if (statistics.message_count > 0 && (!ircp::IsOfOurTime(statistics.message_start_time) ||
                                         !ircp::IsOfOurTime(statistics.message_end_time))) {
      return Error{ErrorCode::kDataLoss,
                   file.name + ": statistics: log times are of no time of ours", "FILE"};
    }
    const std::string station = FieldOf(file.recording, "station");
    const std::string of_first = FieldOf(files.front().recording, "station");
    if (!station.empty() && !of_first.empty() && station != of_first) {
      return InvalidArgument(file.name + ": was recorded in station \"" + station + "\", " +
                                 files.front().name + " in \"" + of_first + "\"",
                             "FILE");
    }
  }
  return {};
}

}  // namespace

Result<JoinReport> Join(std::span<const Input> inputs, recording::ByteSink& out,
                        const JoinOptions& options) {
  if (inputs.empty()) return InvalidArgument("no files to join", "FILE");
  std::vector<Facts> files;
  for (const Input& input : inputs) {
    Result<Facts> facts = ReadFacts(input);
    if (!facts.ok()) return facts.error();
    files.push_back(std::move(*facts));
  }
  if (const Status fit = CheckTogether(files); !fit.ok()) return fit.error();
  Result<std::vector<TimeBase>> bases = RelateToFirst(files, options.same_clock);
  if (!bases.ok()) return bases.error();
  Result<std::unique_ptr<recording::Writer>> writer = recording::Writer::Create(out, options.file);
  if (!writer.ok()) return writer.error();
  return Joiner(std::move(files), std::move(*bases), **writer).Run();
}

}  // namespace exemplar::joining
