#include "frame_queue.hpp"

#include <utility>

namespace exemplar::http {

std::size_t SizeOf(const Frame& frame) { return frame.head.size() + frame.body.size(); }

std::uint64_t FrameQueue::DropOne() {
  while (!frames_[first_droppable_].droppable) ++first_droppable_;
  const auto oldest = frames_.begin() + static_cast<std::ptrdiff_t>(first_droppable_);
  const std::uint64_t tag = oldest->tag;
  droppable_bytes_ -= SizeOf(*oldest);
  --droppable_frames_;
  frames_.erase(oldest);
  return tag;
}

std::optional<std::vector<std::uint64_t>> FrameQueue::Push(Frame frame) {
  const std::size_t size = SizeOf(frame);
  std::vector<std::uint64_t> dropped;
  if (!frame.droppable) {
    if (firm_bytes_ + size > bounds_.firm_bytes) return std::nullopt;
    firm_bytes_ += size;
    frames_.push_back(std::move(frame));
    return dropped;
  }
  if (size > bounds_.droppable_bytes || bounds_.droppable_frames == 0) {
    dropped.push_back(frame.tag);
    return dropped;
  }
  while (droppable_bytes_ + size > bounds_.droppable_bytes ||
         droppable_frames_ >= bounds_.droppable_frames) {
    dropped.push_back(DropOne());
  }
  droppable_bytes_ += size;
  ++droppable_frames_;
  frames_.push_back(std::move(frame));
  return dropped;
}

std::optional<Frame> FrameQueue::Pop() {
  if (frames_.empty()) return std::nullopt;
  Frame frame = std::move(frames_.front());
  frames_.pop_front();
  if (first_droppable_ > 0) --first_droppable_;
  if (frame.droppable) {
    droppable_bytes_ -= SizeOf(frame);
    --droppable_frames_;
  } else {
    firm_bytes_ -= SizeOf(frame);
  }
  return frame;
}

void FrameQueue::KeepFirm() {
  std::erase_if(frames_, [](const Frame& frame) { return frame.droppable; });
  first_droppable_ = 0;
  droppable_bytes_ = 0;
  droppable_frames_ = 0;
}

}  // namespace exemplar::http
