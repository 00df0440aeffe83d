#include "recorder/pre_buffer.hpp"

#include <iterator>
#include <utility>

namespace exemplar::recorder {
namespace {

/// Of the length and of the bytes: as finely as old samples go out.
constexpr int kSegments = 16;

}  // namespace

PreBuffer::PreBuffer(Duration length, std::size_t bytes) : length_(length), limit_bytes_(bytes) {}

void PreBuffer::Prepare(Duration steady_now, const Figures& figures) {
  if (length_ <= Duration(0)) return;
  DropOld(steady_now);
  const bool open = !segments_.empty() &&
                    steady_now - segments_.back().begin < length_ / kSegments &&
                    segments_.back().bytes < limit_bytes_ / kSegments;
  if (open) return;
  Segment& segment = segments_.emplace_back();
  segment.begin = steady_now;
  segment.end = steady_now;
  segment.figures = figures();
}

void PreBuffer::Add(Arrival arrival, Duration steady_now) {
  if (segments_.empty()) return;
  Segment& segment = segments_.back();
  const std::size_t bytes = arrival.sample.cdr.size();
  segment.end = steady_now;
  segment.bytes += bytes;
  bytes_ += bytes;
  segment.arrivals.push_back(std::move(arrival));
  DropOld(steady_now);
}

void PreBuffer::DropOld(Duration steady_now) {
  while (!segments_.empty() &&
         (bytes_ > limit_bytes_ || segments_.front().end < steady_now - length_)) {
    bytes_ -= segments_.front().bytes;
    segments_.pop_front();
  }
}

PreBuffer::Content PreBuffer::Take(Duration steady_now, const Figures& figures) {
  DropOld(steady_now);
  Content content;
  content.bytes = bytes_;
  content.figures = segments_.empty() ? figures() : std::move(segments_.front().figures);
  for (Segment& segment : segments_) {
    content.arrivals.insert(content.arrivals.end(),
                            std::make_move_iterator(segment.arrivals.begin()),
                            std::make_move_iterator(segment.arrivals.end()));
  }
  Clear();
  return content;
}

void PreBuffer::Clear() {
  segments_.clear();
  bytes_ = 0;
}

Duration PreBuffer::length(Duration steady_now) const {
  return segments_.empty() ? Duration(0) : steady_now - segments_.front().begin;
}

}  // namespace exemplar::recorder
