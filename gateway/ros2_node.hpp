#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "exemplar/base/result.hpp"
#include "exemplar/ircp/raw_writer.hpp"
#include "exemplar/ros2/graph.hpp"

namespace exemplar::gateway {

/// The bridge as a node that ROS 2 tools list. Says nothing before it has heard a neighbour, since
/// the messages of Humble and of later releases have one name and two layouts: it talks as the
/// neighbour does. Thread-compatible.
class Ros2Node {
 public:
  /// In the namespace "/". `outlet` outlives it.
  explicit Ros2Node(ircp::RawOutlet& outlet, std::string name);

  /// Endpoints of the node. Told with the next Tell.
  void AddWriter(const ros2::Gid& writer) { AddTo(node_.writers, writer); }
  void AddReader(const ros2::Gid& reader) { AddTo(node_.readers, reader); }
  /// What somebody wrote on ros_discovery_info, perhaps this node itself.
  void Hear(std::span<const std::uint8_t> cdr);
  /// What changed, where there is somebody to hear it.
  Status Tell();

 private:
  void AddTo(std::vector<ros2::Gid>& gids, const ros2::Gid& gid);

  ircp::RawOutlet& outlet_;
  ros2::NodeEntities node_;
  std::unique_ptr<ircp::RawWriter> writer_;
  std::optional<ros2::GidLayout> layout_;  ///< of the neighbours
  bool changed_ = true;
};

}  // namespace exemplar::gateway
