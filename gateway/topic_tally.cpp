#include "gateway/topic_tally.hpp"

namespace exemplar::gateway {
namespace {

constexpr Duration kWindow = std::chrono::seconds(1);
/// Writers that are followed one by one; programs that are started again come as new ones.
constexpr std::size_t kMostWriters = 1024;

}  // namespace

void TopicTally::SetType(const ircp::RawTopic& topic) {
  header_ = ircp::ReadHeaderLayout(topic.schema, topic.type);
}

void TopicTally::Add(const ircp::RawSample& sample, Duration steady_now) {
  if (writers_.size() >= kMostWriters && writers_.count(sample.writer) == 0) {
    for (const auto& [name, writer] : writers_) {
      gone_received_ += writer.numbers.received() - writer.ended_instances;
      gone_lost_ += writer.numbers.lost();
    }
    writers_.clear();
  }
  WriterEntry& writer = writers_[sample.writer];
  if (!header_) {
    if (writer.numbers.Insert(sample.sequence) && !sample.valid) ++writer.ended_instances;
  } else if (sample.valid) {
    if (const auto header = ircp::ReadSampleHeader(sample.cdr, *header_)) {
      writer.numbers.Insert(header->seq);
    }
  }
  if (!sample.valid) return;
  if (const Duration elapsed = steady_now - window_start_; elapsed >= kWindow) {
    const bool just_over = elapsed < 2 * kWindow;
    rate_hz_ = just_over ? samples_in_window_ / ToSeconds(elapsed) : 0;
    bytes_per_s_ = just_over ? bytes_in_window_ / ToSeconds(elapsed) : 0;
    window_start_ = steady_now;
    samples_in_window_ = 0;
    bytes_in_window_ = 0;
  }
  ++samples_in_window_;
  bytes_in_window_ += static_cast<double>(sample.cdr.size());
}

void TopicTally::Describe(api::TopicInfo& info, Duration steady_now) const {
  info.received = gone_received_;
  info.lost = gone_lost_;
  for (const auto& [name, writer] : writers_) {
    info.received += writer.numbers.received() - writer.ended_instances;
    info.lost += writer.numbers.lost();
  }
  const Duration elapsed = steady_now - window_start_;
  if (elapsed < kWindow) {
    info.rate_hz = rate_hz_;
    info.bytes_per_s = bytes_per_s_;
  } else if (elapsed < 2 * kWindow) {
    info.rate_hz = samples_in_window_ / ToSeconds(elapsed);
    info.bytes_per_s = bytes_in_window_ / ToSeconds(elapsed);
  }
}

}  // namespace exemplar::gateway
