#include "exemplar/replay/player.hpp"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/ircp/sample_header.hpp"
#include "pace.hpp"

namespace exemplar::replay {
namespace {

constexpr double kSlowest = 1e-3;
constexpr double kFastest = 1e3;

Status CheckRate(double rate) {
  if (rate >= kSlowest && rate <= kFastest) return {};
  return InvalidArgument("rate is " + FormatDouble(rate) + ", must lie between 0.001 and 1000",
                         "rate");
}

std::string Value(const recording::StringMap& map, const std::string& name) {
  const auto found = map.find(name);
  return found == map.end() ? std::string() : found->second;
}

/// What the recorder noted of a channel's writer; what an older file lacks is taken as most
/// writers have it.
ircp::RawTopic TopicOf(const recording::Channel& channel, const recording::Schema* schema) {
  ircp::RawTopic topic;
  topic.topic = channel.topic;
  topic.type = Value(channel.metadata, "type");
  if (schema != nullptr && schema->encoding == "omgidl") {
    topic.schema.assign(schema->data.begin(), schema->data.end());
    if (topic.type.empty()) topic.type = schema->name;
  }
  const std::string keyed = Value(channel.metadata, "keyed");
  topic.keyed = keyed.empty() ? topic.schema.find("@key") != std::string::npos : keyed == "true";
  topic.reliable = Value(channel.metadata, "reliability") != "best_effort";
  topic.transient_local = Value(channel.metadata, "durability") == "transient_local";
  const double deadline_s = ParseDouble(Value(channel.metadata, "deadline_s")).value_or(0);
  constexpr double kLongestDeadlineS = 1e6;
  if (deadline_s > 0 && deadline_s < kLongestDeadlineS) topic.deadline = FromSeconds(deadline_s);
  return topic;
}

/// One recorded writer.
struct Voice {
  ircp::RawTopic topic;
  std::optional<ircp::HeaderLayout> layout;
  std::unique_ptr<ircp::RawWriter> writer;
};

class RecordingPlayer final : public Player {
 public:
  RecordingPlayer(const Clock& clock, PlayOptions options,
                  std::unique_ptr<recording::IndexedReader> reader)
      : options_(std::move(options)), reader_(std::move(reader)), clock_(clock) {}

  Status Open(ircp::RawOutlet& network) {
    const std::optional<recording::Statistics>& statistics = reader_->statistics();
    if (reader_->chunks().empty() || !statistics) {
      return Error{ErrorCode::kDataLoss,
                   "the recording has no index (exemplar record recover makes one)", "FILE"};
    }
    begin_ = statistics->message_start_time;
    length_ = statistics->message_end_time - begin_;
    if (const Status in_range = CheckOptions(); !in_range.ok()) return in_range;
    for (const auto& [id, channel] : reader_->channels()) {
      const auto count = statistics->channel_message_counts.find(id);
      const std::uint64_t messages =
          count == statistics->channel_message_counts.end() ? 0 : count->second;
      if (const Status added = AddChannel(channel, messages, network); !added.ok()) return added;
    }
    if (voices_.empty()) {
      return InvalidArgument("the recording has nothing to play: " + LeftOut(), "topic");
    }
    pace_.emplace(clock_, options_.start, length_, options_.rate, options_.paused);
    return {};
  }

  Status Run(std::stop_token stop) override {
    ++passes_;
    recording::MessageQuery query;
    for (const auto& entry : voices_) query.topics.insert(entry.second.topic.topic);
    if (options_.end) query.end = begin_ + *options_.end;
    while (true) {
      query.start = begin_ + pace_->Begin();
      Pace::Turn turn = Pace::Turn::kDue;
      const Status read = reader_->ReadMessages(query, [&](const recording::Message& message) {
        const auto voice = voices_.find(message.channel_id);
        if (voice == voices_.end()) return true;
        turn = pace_->Await(message.log_time - begin_, stop);
        if (turn != Pace::Turn::kDue) return false;
        Send(voice->second, message);
        return true;
      });
      if (!read.ok() || turn == Pace::Turn::kStopped) {
        done_ = true;
        return read;
      }
      if (turn == Pace::Turn::kSought) continue;
      if (!options_.loop || stop.stop_requested()) break;
      pace_->Restart(options_.start);
      ++passes_;
    }
    done_ = true;
    return {};
  }

  void Pause() override { pace_->Pause(); }
  void Resume() override { pace_->Resume(); }
  void Step() override { pace_->Step(); }
  void Seek(Duration position) override { pace_->Seek(position); }
  Status SetRate(double rate) override {
    if (const Status in_range = CheckRate(rate); !in_range.ok()) return in_range;
    pace_->SetRate(rate);
    return {};
  }

  PlayStatus status() const override {
    PlayStatus status;
    status.state = done_ ? "done" : pace_->paused() ? "paused" : "playing";
    status.position = pace_->position();
    status.length = length_;
    status.rate = pace_->rate();
    status.passes = passes_;
    status.sent = sent_;
    status.refused = refused_;
    status.latest = pace_->latest();
    status.mean_lateness = pace_->mean_lateness();
    return status;
  }

  const std::vector<TopicPlan>& topics() const override { return topics_; }

  std::vector<std::string> UnreadTopics() const override {
    std::vector<std::string> unread;
    for (const auto& [id, voice] : voices_) {
      if (voice.writer->matched_readers() > 0) continue;
      if (std::find(unread.begin(), unread.end(), voice.topic.topic) == unread.end()) {
        unread.push_back(voice.topic.topic);
      }
    }
    return unread;
  }

  std::vector<ircp::TopicCount> sent() const override {
    const std::lock_guard lock(mutex_);
    std::vector<ircp::TopicCount> counts;
    for (const auto& [who, last] : last_sent_) counts.push_back({who.first, who.second, last});
    return counts;
  }

  bool WaitForAcknowledgments(Duration timeout) override {
    const Duration deadline = clock_.Steady() + timeout;
    bool all = true;
    for (const auto& [id, voice] : voices_) {
      const Duration left = std::max(Duration(0), deadline - clock_.Steady());
      all = voice.writer->WaitForAcknowledgments(left) && all;
    }
    return all;
  }

 private:
  Status CheckOptions() const {
    if (const Status rate = CheckRate(options_.rate); !rate.ok()) return rate;
    if (options_.start < Duration(0) || options_.start > length_) {
      return InvalidArgument("start is " + FormatFixed(ToSeconds(options_.start), 3) +
                                 " s, must lie between 0 and the recording's " +
                                 FormatFixed(ToSeconds(length_), 3) + " s",
                             "start");
    }
    if (options_.end && *options_.end <= options_.start) {
      return InvalidArgument("end is " + FormatFixed(ToSeconds(*options_.end), 3) +
                                 " s, must be behind the start at " +
                                 FormatFixed(ToSeconds(options_.start), 3) + " s",
                             "end");
    }
    return {};
  }

  /// Why a channel cannot be played; empty: it can.
  std::string Obstacle(const recording::Channel& channel, const ircp::RawTopic& topic) const {
    if (!options_.wanted(channel.topic)) return "not chosen";
    if (channel.message_encoding != "cdr") {
      return "its messages are \"" + channel.message_encoding + "\", not cdr";
    }
    return topic.type.empty() ? "the recording does not tell its type" : std::string();
  }

  Status AddChannel(const recording::Channel& channel, std::uint64_t messages,
                    ircp::RawOutlet& network) {
    const auto schema = reader_->schemas().find(channel.schema_id);
    Voice voice;
    voice.topic = TopicOf(channel, schema == reader_->schemas().end() ? nullptr : &schema->second);
    const std::string obstacle = Obstacle(channel, voice.topic);
    auto plan = std::find_if(topics_.begin(), topics_.end(), [&](const TopicPlan& known) {
      return known.topic == channel.topic && known.left_out == obstacle;
    });
    if (plan == topics_.end()) {
      plan = topics_.insert(topics_.end(), {channel.topic, voice.topic.type, 0, obstacle});
    }
    plan->messages += messages;
    if (!obstacle.empty()) return {};
    auto writer = network.MakeRawWriter(voice.topic);
    if (!writer.ok()) return writer.error();
    voice.layout = ircp::ReadHeaderLayout(voice.topic.schema, voice.topic.type);
    voice.writer = std::move(*writer);
    voices_[channel.id] = std::move(voice);
    return {};
  }

  std::string LeftOut() const {
    std::vector<std::string> reasons;
    for (const TopicPlan& plan : topics_)
      reasons.push_back(plan.topic + " (" + plan.left_out + ")");
    return reasons.empty() ? "it has no topics" : "left out are " + Join(reasons, ", ");
  }

  void Send(Voice& voice, const recording::Message& message) {
    if (!voice.writer->Write(message.data, message.publish_time).ok()) {
      ++refused_;
      return;
    }
    ++sent_;
    if (!voice.layout) return;
    const auto header = ircp::ReadSampleHeader(message.data, *voice.layout);
    if (!header) return;
    const std::lock_guard lock(mutex_);
    std::uint64_t& last = last_sent_[{voice.topic.topic, header->source}];
    last = std::max(last, header->seq);
  }

  const PlayOptions options_;
  const std::unique_ptr<recording::IndexedReader> reader_;  ///< after Open of Run's thread alone
  const Clock& clock_;
  Stamp begin_;
  Duration length_{0};
  std::vector<TopicPlan> topics_;
  std::map<std::uint16_t, Voice> voices_;
  std::optional<Pace> pace_;
  std::atomic<std::uint64_t> sent_ = 0;
  std::atomic<std::uint64_t> refused_ = 0;
  std::atomic<int> passes_ = 0;
  std::atomic<bool> done_ = false;
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, std::string>, std::uint64_t> last_sent_;  ///< guarded by mutex_
};

}  // namespace

bool HoldsMeasurements(const std::string& topic) {
  if (!topic.starts_with("ircp/")) return true;
  return !topic.ends_with("/command") && !topic.ends_with("/status") &&
         topic != "ircp/joint_command" && topic != "ircp/plan" && topic != "ircp/safety" &&
         topic != "ircp/clock";
}

Result<std::unique_ptr<Player>> Player::Create(recording::ByteSource& file,
                                               ircp::RawOutlet& network, const Clock& clock,
                                               PlayOptions options) {
  auto reader = recording::IndexedReader::Open(file);
  if (!reader.ok()) return reader.error();
  auto player = std::make_unique<RecordingPlayer>(clock, std::move(options), std::move(*reader));
  if (const Status opened = player->Open(network); !opened.ok()) return opened.error();
  return std::unique_ptr<Player>(std::move(player));
}

}  // namespace exemplar::replay
