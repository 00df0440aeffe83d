#include "gateway/topic_tally.hpp"

#include <utility>

#include "exemplar/ircp/clock_relation.hpp"

namespace exemplar::gateway {
namespace {

constexpr Duration kWindow = std::chrono::seconds(1);
/// Writers that are followed one by one; programs that are started again come as new ones.
constexpr std::size_t kMostWriters = 1024;
/// As long may a sample take that was announced.
constexpr Duration kSettled = std::chrono::seconds(1);
/// Of a writer's announcements, at most as many are kept until they count.
constexpr std::size_t kMostLately = 8;

}  // namespace

std::uint64_t TopicTally::WriterEntry::AnnouncedBy(Duration steady_now) const {
  std::uint64_t settled = announced;
  for (const Announcement& one : lately) {
    if (steady_now - one.at >= kSettled) settled = one.sent;
  }
  return settled;
}

std::uint64_t TopicTally::WriterEntry::Lost(Duration steady_now) const {
  const std::uint64_t sent = AnnouncedBy(steady_now);
  return numbers.lost() + (sent > numbers.highest() ? sent - numbers.highest() : 0);
}

void TopicTally::SetType(const ircp::RawTopic& topic) {
  header_ = ircp::ReadHeaderLayout(topic.schema, topic.type);
}

void TopicTally::Add(const ircp::RawSample& sample, Duration steady_now) {
  if (writers_.size() >= kMostWriters && writers_.count(sample.writer) == 0) {
    for (const auto& [name, writer] : writers_) {
      gone_received_ += writer.numbers.received() - writer.ended_instances;
      gone_lost_ += writer.Lost(steady_now);
    }
    writers_.clear();
  }
  WriterEntry& writer = writers_[sample.writer];
  writer.heard = steady_now;
  if (!header_) {
    if (writer.numbers.Insert(sample.sequence) && !sample.valid) ++writer.ended_instances;
  } else if (sample.valid) {
    if (auto header = ircp::ReadSampleHeader(sample.cdr, *header_)) {
      writer.numbers.Insert(header->seq);
      writer.source = std::move(header->source);
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

void TopicTally::AddAnnounced(const std::string& status_writer, const std::string& source,
                              std::uint64_t sent, Duration steady_now) {
  const std::string participant = ircp::ParticipantOf(status_writer);
  // A program that opened its writer anew speaks of the new one.
  WriterEntry* latest = nullptr;
  for (auto& [name, writer] : writers_) {
    if (writer.source != source || ircp::ParticipantOf(name) != participant) continue;
    if (latest == nullptr || writer.heard >= latest->heard) latest = &writer;
  }
  if (latest == nullptr) return;
  latest->announced = latest->AnnouncedBy(steady_now);
  std::erase_if(latest->lately, [&](const auto& one) { return steady_now - one.at >= kSettled; });
  // The oldest stay, so that some count even of a program that announces all the time.
  if (latest->lately.size() >= kMostLately) latest->lately.pop_back();
  latest->lately.push_back({sent, steady_now});
}

void TopicTally::Describe(api::TopicInfo& info, Duration steady_now) const {
  info.received = gone_received_;
  info.lost = gone_lost_;
  for (const auto& [name, writer] : writers_) {
    info.received += writer.numbers.received() - writer.ended_instances;
    info.lost += writer.Lost(steady_now);
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
