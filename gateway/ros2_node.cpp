#include "gateway/ros2_node.hpp"

#include <algorithm>
#include <utility>

namespace exemplar::gateway {

Ros2Node::Ros2Node(ircp::RawOutlet& outlet, std::string name) : outlet_(outlet) {
  node_.node_name = std::move(name);
}

void Ros2Node::AddTo(std::vector<ros2::Gid>& gids, const ros2::Gid& gid) {
  if (std::find(gids.begin(), gids.end(), gid) != gids.end()) return;
  gids.push_back(gid);
  changed_ = true;
}

void Ros2Node::Hear(std::span<const std::uint8_t> cdr) {
  const Result<ros2::ParticipantEntities> heard = ros2::DecodeParticipantEntities(cdr);
  if (!heard.ok() || layout_) return;
  layout_ = heard->layout;
}

Status Ros2Node::Tell() {
  if (!layout_ || !changed_) return {};
  if (writer_ == nullptr) {
    auto writer = outlet_.MakeRawWriter({.topic = std::string(ros2::kGraphTopic),
                                         .type = std::string(ros2::kGraphType),
                                         .schema = ros2::GraphSchema(*layout_),
                                         .partition = {},
                                         .keyed = false,
                                         .reliable = true,
                                         .transient_local = true,
                                         .keep_last = 1});
    if (!writer.ok()) return writer.error();
    writer_ = std::move(*writer);
  }
  changed_ = false;
  return writer_->Write(ros2::Encode({ros2::ParticipantOf(writer_->guid()), {node_}, *layout_}),
                        Stamp());
}

}  // namespace exemplar::gateway
