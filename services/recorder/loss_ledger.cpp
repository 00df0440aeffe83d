#include "recorder/loss_ledger.hpp"

#include <algorithm>
#include <tuple>

#include "exemplar/ircp/clock_relation.hpp"

namespace exemplar::recorder {
namespace {

constexpr Duration kRateWindow = std::chrono::seconds(1);
/// Programs announce each second.
constexpr Duration kSilence = std::chrono::seconds(2);

std::uint64_t Since(std::uint64_t now, std::uint64_t before) {
  return now > before ? now - before : 0;  // a gap may have been filled in between
}

}  // namespace

std::vector<WriterFigures> Difference(const std::vector<WriterFigures>& now,
                                      const std::vector<WriterFigures>& before) {
  std::map<std::pair<std::string_view, std::string_view>, const WriterFigures*> known;
  for (const WriterFigures& writer : before) known[{writer.topic, writer.writer}] = &writer;
  std::vector<WriterFigures> difference;
  for (const WriterFigures& writer : now) {
    WriterFigures figures = writer;
    if (const auto old = known.find({writer.topic, writer.writer}); old != known.end()) {
      figures.received = Since(writer.received, old->second->received);
      figures.lost_in_gaps = Since(writer.lost_in_gaps, old->second->lost_in_gaps);
      figures.lost_at_end = Since(writer.lost_at_end, old->second->lost_at_end);
      figures.dropped = Since(writer.dropped, old->second->dropped);
      if (figures.received == 0 && figures.lost() == 0) continue;
    }
    difference.push_back(std::move(figures));
  }
  return difference;
}

LossLedger::TopicEntry& LossLedger::EntryOf(const std::string& topic) {
  TopicEntry& entry = topics_[topic];
  if (entry.topic == nullptr) {
    ircp::RawTopic unknown;
    unknown.topic = topic;
    entry.topic = std::make_shared<const ircp::RawTopic>(std::move(unknown));
  }
  return entry;
}

LossLedger::WriterEntry& LossLedger::EntryOf(const std::string& topic, const std::string& writer) {
  WriterEntry*& known = by_writer_[writer];
  if (known != nullptr && known->topic->topic->topic == topic) return *known;
  TopicEntry& of_topic = EntryOf(topic);
  known = &of_topic.writers[writer];
  known->topic = &of_topic;
  return *known;
}

void LossLedger::AddTopic(ircp::RawTopic topic) {
  TopicEntry& entry = EntryOf(topic.topic);
  // A writer without schema does not take away what another one brought.
  if (!entry.topic->schema.empty() && topic.schema.empty()) return;
  entry.header = ircp::ReadHeaderLayout(topic.schema, topic.type);
  entry.topic = std::make_shared<const ircp::RawTopic>(std::move(topic));
}

LossLedger::Known LossLedger::AddReceived(const ircp::RawSample& sample, Duration steady_now) {
  WriterEntry& writer = EntryOf(sample.topic, sample.writer);
  TopicEntry& topic = *writer.topic;
  writer.heard = steady_now;
  if (!topic.header) {
    writer.sequences.Insert(sample.sequence);
    if (!sample.valid) ++writer.ended_instances;
  } else if (sample.valid) {
    if (auto header = ircp::ReadSampleHeader(sample.cdr, *topic.header)) {
      writer.source = std::move(header->source);
      writer.sequences.Insert(header->seq);
    }
  }
  if (!sample.valid) return {topic.topic, writer.source};
  const Duration elapsed = steady_now - topic.window_start;
  if (elapsed >= kRateWindow) {
    topic.rate_hz =
        elapsed < 2 * kRateWindow ? static_cast<double>(topic.in_window) / ToSeconds(elapsed) : 0.0;
    topic.window_start = steady_now;
    topic.in_window = 0;
  }
  ++topic.in_window;
  return {topic.topic, writer.source};
}

void LossLedger::AddDropped(const std::string& topic, const std::string& writer) {
  ++EntryOf(topic, writer).dropped;
}

void LossLedger::AddAnnounced(const std::string& status_writer, const ircp::TopicCount& count,
                              Duration steady_now) {
  announced_[{count.topic, ircp::ParticipantOf(status_writer), count.source}] = {count.sent,
                                                                                 steady_now};
}

const LossLedger::Announcement* LossLedger::AnnouncedOf(const std::string& topic,
                                                        const std::string& writer,
                                                        const WriterEntry& entry) const {
  if (entry.source.empty()) return nullptr;
  const auto found = announced_.find({topic, ircp::ParticipantOf(writer), entry.source});
  return found == announced_.end() ? nullptr : &found->second;
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
  if (const Announcement* announced = AnnouncedOf(topic, writer, entry)) {
    figures.announced = announced->sent;
    figures.lost_at_end = Since(announced->sent, figures.last);
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

bool LossLedger::HasAllAnnounced(Duration steady_now) const {
  for (const auto& [name, topic] : topics_) {
    for (const auto& [id, writer] : topic.writers) {
      const Announcement* const announced = AnnouncedOf(name, id, writer);
      if (announced == nullptr || announced->sent <= writer.sequences.highest()) continue;
      if (steady_now - std::max(announced->at, writer.heard) < kSilence) return false;
    }
  }
  return true;
}

std::vector<api::TopicFigures> LossLedger::TopicFigures(Duration steady_now) const {
  std::vector<api::TopicFigures> all;
  for (const auto& [name, topic] : topics_) {
    api::TopicFigures figures;
    figures.topic = name;
    figures.type = topic.topic->type;
    figures.has_schema = !topic.topic->schema.empty();
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
