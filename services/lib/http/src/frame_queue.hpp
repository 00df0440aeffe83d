#pragma once
// What waits to be sent to one WebSocket client.

#include <deque>
#include <optional>

#include "exemplar/http/server.hpp"

namespace exemplar::http {

/// Frames leave in the order in which they came. Thread-compatible.
class FrameQueue {
 public:
  struct Bounds {
    std::size_t droppable_bytes;
    std::size_t droppable_frames;
    std::size_t firm_bytes;
  };
  explicit FrameQueue(Bounds bounds) : bounds_(bounds) {}

  /// The tags of droppable frames that went to make room, oldest first (the new one's own if it is
  /// longer than the whole room); nullopt when a firm frame has no room.
  std::optional<std::vector<std::uint64_t>> Push(Frame frame);
  std::optional<Frame> Pop();
  /// Throws the droppable ones away.
  void KeepFirm();

  bool empty() const { return frames_.empty(); }
  std::size_t bytes() const { return droppable_bytes_ + firm_bytes_; }
  std::size_t frames() const { return frames_.size(); }

 private:
  /// The oldest droppable frame's tag.
  std::uint64_t DropOne();

  Bounds bounds_;
  std::deque<Frame> frames_;
  std::size_t first_droppable_ = 0;  ///< none stands before it
  std::size_t droppable_bytes_ = 0;
  std::size_t droppable_frames_ = 0;
  std::size_t firm_bytes_ = 0;
};

std::size_t SizeOf(const Frame& frame);

}  // namespace exemplar::http
