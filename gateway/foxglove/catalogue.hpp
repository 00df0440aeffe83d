#pragma once
// Which channel stands for which topic.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/api/topics.hpp"
#include "gateway/foxglove/protocol.hpp"

namespace exemplar::gateway::foxglove {

/// Ids are never used twice. Thread-compatible.
class Catalogue {
 public:
  struct Change {
    std::optional<std::uint32_t> gone;
    std::optional<ChannelInfo> come;
  };
  /// A topic without schema gets no channel: nobody could read its bytes. One whose type or schema
  /// is another now gets another channel.
  Change Update(const api::TopicInfo& topic);
  std::uint32_t AddOwn(ChannelInfo channel);

  std::vector<ChannelInfo> channels() const;
  /// nullptr when there is none.
  const ChannelInfo* Find(std::uint32_t id) const;
  /// Whether the channel is a topic's, not one of the bridge's own.
  bool IsTopic(std::uint32_t id) const;

 private:
  std::uint32_t next_ = 1;
  std::map<std::uint32_t, ChannelInfo> channels_;
  std::map<std::string, std::uint32_t> by_topic_;
};

}  // namespace exemplar::gateway::foxglove
