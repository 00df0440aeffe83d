#include "gateway/foxglove/catalogue.hpp"

#include <utility>

namespace exemplar::gateway::foxglove {

Catalogue::Change Catalogue::Update(const api::TopicInfo& topic) {
  Change change;
  if (topic.schema.empty()) return change;
  const auto known = by_topic_.find(topic.topic);
  if (known != by_topic_.end()) {
    const ChannelInfo& channel = channels_.at(known->second);
    if (channel.schema_name == topic.type && channel.schema == topic.schema) return change;
    change.gone = known->second;
    channels_.erase(known->second);
  }
  const ChannelInfo channel{
      .id = next_++, .topic = topic.topic, .schema_name = topic.type, .schema = topic.schema};
  by_topic_[topic.topic] = channel.id;
  channels_[channel.id] = channel;
  change.come = channel;
  return change;
}

std::uint32_t Catalogue::AddOwn(ChannelInfo channel) {
  channel.id = next_++;
  const std::uint32_t id = channel.id;
  channels_[id] = std::move(channel);
  return id;
}

std::vector<ChannelInfo> Catalogue::channels() const {
  std::vector<ChannelInfo> all;
  for (const auto& entry : channels_) all.push_back(entry.second);
  return all;
}

const ChannelInfo* Catalogue::Find(std::uint32_t id) const {
  const auto found = channels_.find(id);
  return found == channels_.end() ? nullptr : &found->second;
}

bool Catalogue::IsTopic(std::uint32_t id) const {
  const ChannelInfo* channel = Find(id);
  if (channel == nullptr) return false;
  const auto found = by_topic_.find(channel->topic);
  return found != by_topic_.end() && found->second == id;
}

}  // namespace exemplar::gateway::foxglove
