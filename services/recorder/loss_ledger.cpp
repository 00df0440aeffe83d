#include "recorder/loss_ledger.hpp"

#include <algorithm>
#include <tuple>

namespace exemplar::recorder {
namespace {

constexpr Duration kRateWindow = std::chrono::seconds(1);

/// The part of a writer's identity that all endpoints of one program share.
std::string ParticipantOf(const std::string& writer) { return writer.substr(0, writer.find('|')); }

std::uint64_t Since(std::uint64_t now, std::uint64_t before) {
  return now > before ? now - before : 0;  // a gap may have been filled in between
}

}  // namespace

std::vector<WriterFigures> Difference(const std::vector<WriterFigures>& now,
                                      const std::vector<WriterFigures>& before) {
  std::vector<WriterFigures> difference;
  for (const WriterFigures& writer : now) {
    WriterFigures figures = writer;
    const auto old = std::find_if(before.begin(), before.end(), [&](const WriterFigures& w) {
      return w.topic == writer.topic && w.writer == writer.writer;
    });
    if (old != before.end()) {
      figures.received = Since(writer.received, old->received);
      figures.lost_in_gaps = Since(writer.lost_in_gaps, old->lost_in_gaps);
      figures.lost_at_end = Since(writer.lost_at_end, old->lost_at_end);
      figures.dropped = Since(writer.dropped, old->dropped);
      if (figures.received == 0 && figures.lost() == 0) continue;
    }
    difference.push_back(std::move(figures));
  }
  return difference;
}

void LossLedger::AddTopic(const ircp::RawTopic& topic) {
  TopicEntry& entry = topics_[topic.topic];
  // A writer without schema does not take away what another one brought.
  if (!entry.topic.schema.empty() && topic.schema.empty()) return;
  entry.topic = topic;
  entry.header = ReadHeaderLayout(topic.schema, topic.type);
}

std::optional<HeaderLayout> LossLedger::HeaderOf(const std::string& topic) const {
  const auto found = topics_.find(topic);
  return found == topics_.end() ? std::nullopt : found->second.header;
}

const ircp::RawTopic* LossLedger::FindTopic(const std::string& topic) const {
  const auto found = topics_.find(topic);
  return found == topics_.end() ? nullptr : &found->second.topic;
}

void LossLedger::AddReceived(const ircp::RawSample& sample,
                             const std::optional<SampleHeader>& header, Duration steady_now) {
  TopicEntry& topic = topics_[sample.topic];
  if (topic.topic.topic.empty()) topic.topic.topic = sample.topic;
  WriterEntry& writer = topic.writers[sample.writer];
  if (header && sample.valid) {
    writer.source = header->source;
    writer.sequences.Insert(header->seq);
  } else if (!topic.header) {
    writer.sequences.Insert(sample.sequence);
    if (!sample.valid) ++writer.ended_instances;
  }
  if (!sample.valid) return;
  const Duration elapsed = steady_now - topic.window_start;
  if (elapsed >= kRateWindow) {
    topic.rate_hz =
        elapsed < 2 * kRateWindow ? static_cast<double>(topic.in_window) / ToSeconds(elapsed) : 0.0;
    topic.window_start = steady_now;
    topic.in_window = 0;
  }
  ++topic.in_window;
}

void LossLedger::AddDropped(const std::string& topic, const std::string& writer) {
  ++topics_[topic].writers[writer].dropped;
}

void LossLedger::AddAnnounced(const std::string& status_writer, const ircp::TopicCount& count) {
  announced_[{count.topic, ParticipantOf(status_writer), count.source}] = count.sent;
}

WriterFigures LossLedger::FiguresOf(const std::string& topic, const std::string& writer,
                                    const WriterEntry& entry) const {
  WriterFigures figures;
  figures.topic = topic;
  figures.writer = writer;
  figures.source = entry.source;
  figures.received = Since(entry.sequences.received(), entry.ended_instances + entry.dropped);
  figures.lost_in_gaps = entry.sequences.lost();
  figures.dropped = entry.dropped;
  figures.last = entry.sequences.highest();
  const auto announced = announced_.find({topic, ParticipantOf(writer), entry.source});
  if (announced != announced_.end() && !entry.source.empty()) {
    figures.announced = announced->second;
    figures.lost_at_end = Since(announced->second, figures.last);
  }
  return figures;
}

std::vector<WriterFigures> LossLedger::writers() const {
  std::vector<WriterFigures> all;
  for (const auto& [name, topic] : topics_) {
    for (const auto& [id, writer] : topic.writers) all.push_back(FiguresOf(name, id, writer));
  }
  return all;
}

bool LossLedger::HasAllAnnounced() const {
  for (const auto& [name, topic] : topics_) {
    for (const auto& [id, writer] : topic.writers) {
      if (FiguresOf(name, id, writer).lost_at_end > 0) return false;
    }
  }
  return true;
}

std::vector<api::TopicFigures> LossLedger::TopicFigures(Duration steady_now) const {
  std::vector<api::TopicFigures> all;
  for (const auto& [name, topic] : topics_) {
    api::TopicFigures figures;
    figures.topic = name;
    figures.type = topic.topic.type;
    figures.has_schema = !topic.topic.schema.empty();
    for (const auto& [id, writer] : topic.writers) {
      const WriterFigures w = FiguresOf(name, id, writer);
      figures.received += w.received;
      figures.lost += w.lost();
      figures.sent += w.sent();
    }
    const Duration elapsed = steady_now - topic.window_start;
    figures.rate_hz = elapsed < kRateWindow ? topic.rate_hz
                      : elapsed < 2 * kRateWindow
                          ? static_cast<double>(topic.in_window) / ToSeconds(elapsed)
                          : 0.0;
    all.push_back(std::move(figures));
  }
  return all;
}

}  // namespace exemplar::recorder
