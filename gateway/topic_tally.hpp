#pragma once
#include <deque>
#include <optional>
#include <string>
#include <unordered_map>

#include "exemplar/api/topics.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/sample_header.hpp"
#include "exemplar/ircp/sequence_set.hpp"

namespace exemplar::gateway {

/// What came on one topic, and what of it is missing: by the numbers in the samples where the type
/// has them, else by those of the protocol; and by the last number that the writer's program says
/// to have sent, so that what is lost at the end counts as well. Thread-compatible.
class TopicTally {
 public:
  void SetType(const ircp::RawTopic& topic);
  void Add(const ircp::RawSample& sample, Duration steady_now);
  /// From a status sample of the participant that `status_writer` belongs to: its writer `source`
  /// of this topic had sent so many. Counts after a second: samples may still be on their way.
  void AddAnnounced(const std::string& status_writer, const std::string& source, std::uint64_t sent,
                    Duration steady_now);
  /// Sets received, lost and the rates.
  void Describe(api::TopicInfo& info, Duration steady_now) const;

 private:
  struct Announcement {
    std::uint64_t sent = 0;
    Duration at{0};
  };
  struct WriterEntry {
    ircp::SequenceSet numbers;
    std::uint64_t ended_instances = 0;  ///< use up a number of the protocol
    std::string source;                 ///< its name in the samples
    Duration heard{0};
    std::uint64_t announced = 0;        ///< long enough ago
    std::deque<Announcement> lately{};  ///< oldest first

    std::uint64_t AnnouncedBy(Duration steady_now) const;
    std::uint64_t Lost(Duration steady_now) const;
  };
  std::optional<ircp::HeaderLayout> header_;
  std::unordered_map<std::string, WriterEntry> writers_;
  std::uint64_t gone_received_ = 0;  ///< of writers that are not kept any more
  std::uint64_t gone_lost_ = 0;
  Duration window_start_{0};
  double samples_in_window_ = 0;
  double bytes_in_window_ = 0;
  double rate_hz_ = 0;
  double bytes_per_s_ = 0;
};

}  // namespace exemplar::gateway
