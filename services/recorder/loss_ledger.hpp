#pragma once
// Who sent how much, and what of it is missing. Losses are counted from numbers, never guessed.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "exemplar/api/services.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/sample_header.hpp"
#include "exemplar/ircp/sequence_set.hpp"

namespace exemplar::recorder {

/// One writer of one topic, since the first sample that came from it.
struct WriterFigures {
  std::string topic;
  std::string writer;  ///< its identity on the network
  std::string source;  ///< its name in the samples; empty for strangers' types
  std::uint64_t received = 0;
  std::uint64_t lost_in_gaps = 0;  ///< numbers missing between those that came
  std::uint64_t lost_at_end = 0;   ///< announced by the writer, behind the last one that came
  std::uint64_t dropped = 0;       ///< came, but the recorder's own queue was full
  std::uint64_t last = 0;          ///< highest number that came
  std::optional<std::uint64_t> announced;  ///< the last number it said to have sent

  std::uint64_t lost() const { return lost_in_gaps + lost_at_end + dropped; }
  /// Since the first one that came, as far as the writer has told.
  std::uint64_t sent() const { return received + lost(); }
};

/// What happened between two looks at the same ledger.
std::vector<WriterFigures> Difference(const std::vector<WriterFigures>& now,
                                      const std::vector<WriterFigures>& before);

/// Thread-compatible.
class LossLedger {
 public:
  void AddTopic(ircp::RawTopic topic);

  /// What is known of a sample's topic, and its source where its type tells one.
  struct Known {
    std::shared_ptr<const ircp::RawTopic> topic;  ///< shared with the samples on their way
    std::string source;
  };
  /// Counts by the numbers in the samples where the type has them, else by those of the protocol.
  /// Samples that only end an instance use up a number of the protocol and none of the samples'.
  Known AddReceived(const ircp::RawSample& sample, Duration steady_now);
  void AddDropped(const std::string& topic, const std::string& writer);
  /// From a status sample of the participant that `status_writer` belongs to.
  void AddAnnounced(const std::string& status_writer, const ircp::TopicCount& count,
                    Duration steady_now);

  std::vector<WriterFigures> writers() const;
  /// Whether everything that was announced by writers seen here has come or is known as lost. Of a
  /// writer that has not been heard for two seconds, nor its announcements, nothing more is
  /// awaited.
  bool HasAllAnnounced(Duration steady_now) const;
  /// `writers_now` of a topic come from the network.
  std::vector<api::TopicFigures> TopicFigures(Duration steady_now) const;

 private:
  struct TopicEntry;
  struct Announcement {
    std::uint64_t sent = 0;
    Duration at{0};
  };
  struct WriterEntry {
    TopicEntry* topic = nullptr;
    std::string source;
    Duration heard{0};
    ircp::SequenceSet sequences;
    std::uint64_t dropped = 0;
    std::uint64_t ended_instances = 0;
  };
  struct TopicEntry {
    std::shared_ptr<const ircp::RawTopic> topic;
    std::optional<ircp::HeaderLayout> header;
    std::map<std::string, WriterEntry> writers;
    Duration window_start{0};
    std::uint64_t in_window = 0;
    double rate_hz = 0;
  };
  TopicEntry& EntryOf(const std::string& topic);
  WriterEntry& EntryOf(const std::string& topic, const std::string& writer);
  const Announcement* AnnouncedOf(const std::string& topic, const std::string& writer,
                                  const WriterEntry& entry) const;
  WriterFigures FiguresOf(const std::string& topic, const std::string& writer,
                          const WriterEntry& entry) const;

  std::map<std::string, TopicEntry> topics_;
  /// The last topic of each writer: most have one.
  std::unordered_map<std::string, WriterEntry*> by_writer_;
  /// By topic, participant and source.
  std::map<std::tuple<std::string, std::string, std::string>, Announcement> announced_;
};

}  // namespace exemplar::recorder
