#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "exemplar/api/topics.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/dynamic_data/type.hpp"
#include "exemplar/ircp/raw_writer.hpp"

namespace exemplar::gateway {

struct TopicHubOptions;

/// Writes samples of clients onto the station's topics. Thread-safe.
class Publisher {
 public:
  /// All outlive it.
  Publisher(ircp::RawOutlet& outlet, const Clock& clock, const TopicHubOptions& options)
      : outlet_(outlet), clock_(clock), options_(options) {}

  bool MayPublish(const std::string& topic) const;
  /// `discovered`: what the topic's writers say of it; nullptr: it has none.
  Status Publish(const api::TopicPublication& publication, const ircp::RawTopic* discovered);

 private:
  struct Outgoing {
    ircp::RawTopic topic;
    std::shared_ptr<const dynamic_data::Type> type;  ///< null without schema; shared by its members
    std::unique_ptr<ircp::RawWriter> writer;
    std::mutex mutex;  ///< numbers go out in order
    std::uint64_t sent = 0;
  };
  Result<ircp::RawTopic> TopicOf(const api::TopicPublication& publication,
                                 const ircp::RawTopic* discovered) const;
  Result<Outgoing*> Open(const api::TopicPublication& publication,
                         const ircp::RawTopic* discovered);
  Result<std::vector<std::uint8_t>> BytesOf(const api::TopicPublication& publication,
                                            Outgoing& outgoing, bool& numbered) const;

  ircp::RawOutlet& outlet_;
  const Clock& clock_;
  const TopicHubOptions& options_;
  std::mutex mutex_;
  std::map<std::string, std::unique_ptr<Outgoing>> outgoing_;  ///< by topic
};

}  // namespace exemplar::gateway
