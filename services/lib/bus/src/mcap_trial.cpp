#include "exemplar/bus/mcap_trial.hpp"

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/bus/codec.hpp"
#include "exemplar/ircp/clock_relation.hpp"
#include "exemplar/ircp/sequence_set.hpp"
#include "exemplar/ircp/trial_builder.hpp"
#include "exemplar/recording/reader.hpp"

namespace exemplar::bus {
namespace {

using demonstration::Trial;

class TrialReader {
 public:
  TrialReader(std::string_view source, std::map<std::string, ircp::ClockTrack> clocks)
      : source_(source), clocks_(std::move(clocks)) {}

  Status Take(const recording::Record& record) {
    if (const auto* schema = std::get_if<recording::Schema>(&record)) {
      schema_names_[schema->id] = schema->name;
    } else if (const auto* channel = std::get_if<recording::Channel>(&record)) {
      channels_[channel->id] = *channel;
    } else if (const auto* message = std::get_if<recording::Message>(&record)) {
      return TakeMessage(*message);
    } else if (const auto* metadata = std::get_if<recording::Metadata>(&record)) {
      TakeMetadata(*metadata);
    }
    return {};
  }

  Result<Trial> Build() const {
    Result<Trial> trial = builder_.Build(source_);
    if (!trial.ok()) return trial;
    std::vector<std::string>& notices = trial->notices;
    std::map<std::string, std::uint64_t> lost = lost_at_end_;
    for (const auto& [who, numbers] : numbers_) lost[std::get<0>(who)] += numbers.lost();
    for (const auto& [topic, count] : lost) {
      if (count > 0) notices.push_back(topic + ": " + std::to_string(count) + " samples lost");
    }
    for (const auto& [topic, count] : repeated_) {
      notices.push_back(topic + ": " + std::to_string(count) + " samples stood twice");
    }
    for (const auto& [name, value] : labels_) {
      notices.push_back("label " + name + ": " + value);
    }
    for (const std::string& participant : set_right_) {
      const ircp::ClockRelation& last = clocks_.at(participant).relations().back();
      notices.push_back("clock of " + last.program + ": " + FormatFixed(ToSeconds(last.offset), 6) +
                        " s ahead of the recorder's, within " +
                        FormatFixed(ToSeconds(last.uncertainty), 6) + " s; taken off its stamps");
    }
    for (const std::string& topic : strangers_) {
      notices.push_back(topic + ": not a topic of ours, left alone");
    }
    return trial;
  }

 private:
  Status TakeMessage(const recording::Message& message) {
    const auto found = channels_.find(message.channel_id);
    if (found == channels_.end()) {
      return Error{ErrorCode::kDataLoss, source_ + ": a message of channel " +
                                             std::to_string(message.channel_id) +
                                             ", which the file does not describe"};
    }
    const recording::Channel& channel = found->second;
    const std::uint64_t place = ++messages_[channel.id];
    Status taken = TakeAs<ircp::SuitSample, ircp::EndEffectorSample, ircp::TactileSample,
                          ircp::ObjectSample, ircp::JointStateSample>(channel, message);
    if (taken.ok()) return taken;
    return WithPlace(taken.error(),
                     source_ + ": channel " + channel.topic + ", message " + std::to_string(place));
  }

  /// Adds the message to the trial if its topic is that of one of the types.
  template <class First, class... Rest>
  Status TakeAs(const recording::Channel& channel, const recording::Message& message) {
    if (channel.topic == First::kTopic) return TakeSample<First>(channel, message);
    if constexpr (sizeof...(Rest) > 0) {
      return TakeAs<Rest...>(channel, message);
    } else {
      // Commands, pictures and the like are ours, but no part of a trial.
      if (!channel.topic.starts_with("ircp/")) strangers_.insert(channel.topic);
      return {};
    }
  }

  template <class Sample>
  Status TakeSample(const recording::Channel& channel, const recording::Message& message) {
    const std::string type = TypeOf(channel);
    if (channel.message_encoding != "cdr" || type != TypeNameOf<Sample>()) {
      return Error{ErrorCode::kDataLoss, "carries type \"" + type + "\" as \"" +
                                             channel.message_encoding + "\", expected " +
                                             std::string(TypeNameOf<Sample>()) + " as cdr"};
    }
    Result<Sample> sample = Decode<Sample>(message.data);
    if (!sample.ok()) return sample.error();
    const auto named = channel.metadata.find("writer");
    const std::string writer =
        named == channel.metadata.end() ? std::to_string(channel.id) : named->second;
    const ircp::Header& header = sample->header;
    if (header.seq != 0 && !numbers_[{channel.topic, header.source, writer}].Insert(header.seq)) {
      ++repeated_[channel.topic];
      return {};
    }
    SetRight(ircp::ParticipantOf(writer), message.log_time, sample->header.stamp);
    builder_.Add(*sample);
    return {};
  }

  /// A stamp of another machine's clock becomes the recorder's.
  void SetRight(const std::string& participant, Stamp received, Stamp& stamp) {
    const auto clock = clocks_.find(participant);
    if (clock == clocks_.end() || !clock->second.Differs()) return;
    if (!ircp::IsOfOurTime(stamp) || !ircp::IsOfOurTime(received)) return;
    stamp = stamp - clock->second.OffsetAt(received);
    set_right_.insert(participant);
  }

  std::string TypeOf(const recording::Channel& channel) const {
    const auto schema = schema_names_.find(channel.schema_id);
    if (schema != schema_names_.end()) return schema->second;
    const auto named = channel.metadata.find("type");
    return named == channel.metadata.end() ? std::string() : named->second;
  }

  /// The recorder's figures; of several about one writer, the sum cannot grow by a repetition.
  void TakeMetadata(const recording::Metadata& metadata) {
    if (metadata.name == "exemplar.labels") labels_ = metadata.metadata;  // the last one counts
    if (metadata.name != "exemplar.losses") return;
    const auto value = [&](const char* name) {
      const auto found = metadata.metadata.find(name);
      return found == metadata.metadata.end() ? std::string() : found->second;
    };
    const std::string topic = value("topic");
    const std::optional<long long> at_end = ParseInteger(value("lost_at_end"));
    if (topic.empty() || !at_end || *at_end < 0) return;
    const auto lost = static_cast<std::uint64_t>(*at_end);
    std::uint64_t& before = lost_at_end_of_[{topic, value("writer")}];
    std::uint64_t& sum = lost_at_end_[topic];
    sum = sum - before + lost;
    before = lost;
  }

  const std::string source_;
  ircp::TrialBuilder builder_;
  std::map<std::uint16_t, std::string> schema_names_;
  std::map<std::uint16_t, recording::Channel> channels_;
  std::map<std::uint16_t, std::uint64_t> messages_;
  /// What came, by topic, source and writer.
  std::map<std::tuple<std::string, std::string, std::string>, ircp::SequenceSet> numbers_;
  std::map<std::string, std::uint64_t> repeated_;
  std::map<std::string, std::uint64_t> lost_at_end_;
  std::map<std::pair<std::string, std::string>, std::uint64_t> lost_at_end_of_;
  recording::StringMap labels_;
  std::set<std::string> strangers_;
  const std::map<std::string, ircp::ClockTrack> clocks_;  ///< by participant
  std::set<std::string> set_right_;
};

Error NotWhole(const Error& error, std::string_view source) {
  Error placed = WithPlace(error, source);
  placed.message += "; `exemplar record recover` makes a whole recording of what can be read";
  return placed;
}

/// How the programs' clocks stood to the recorder's; empty where the file does not tell.
Result<std::map<std::string, ircp::ClockTrack>> ReadClocks(recording::ByteSource& file) {
  std::map<std::string, ircp::ClockTrack> clocks;
  const auto reader = recording::IndexedReader::Open(file);
  if (!reader.ok()) return clocks;  // what is wrong is said by who reads the messages
  for (const recording::MetadataIndex& index : (*reader)->metadata()) {
    if (index.name != "exemplar.clock") continue;
    const Result<recording::Metadata> metadata = (*reader)->ReadMetadata(index);
    if (!metadata.ok()) return metadata.error();
    Result<ircp::ClockRelation> relation = ircp::ClockRelationFromFields(metadata->metadata);
    if (!relation.ok()) return WithPlace(relation.error(), "metadata exemplar.clock");
    clocks[relation->participant].Add(std::move(*relation));
  }
  return clocks;
}

}  // namespace

Result<Trial> ReadTrialFromMcap(std::string_view bytes, std::string_view source) {
  recording::MemorySource file({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  Result<std::unique_ptr<recording::StreamReader>> reader = recording::StreamReader::Create(file);
  if (!reader.ok()) return WithPlace(reader.error(), source);
  Result<std::map<std::string, ircp::ClockTrack>> clocks = ReadClocks(file);
  if (!clocks.ok()) return WithPlace(clocks.error(), source);
  TrialReader trial(source, std::move(*clocks));
  while (true) {
    Result<std::optional<recording::Record>> record = (*reader)->Next();
    if (!record.ok()) return NotWhole(record.error(), source);
    if (!record->has_value()) break;
    if (Status taken = trial.Take(**record); !taken.ok()) return taken.error();
  }
  return trial.Build();
}

}  // namespace exemplar::bus
