#include "recorder/intake.hpp"

#include <algorithm>
#include <utility>

namespace exemplar::recorder {
namespace {

constexpr const char* kStatusType = "exemplar::ircp::v1::Status";
/// The writer's thread is not woken for each sample: it looks often enough by itself, unless this
/// part of the queue is full.
constexpr std::size_t kWakingPart = 8;

}  // namespace

Intake::Intake(const Clock& clock, Log& log, IntakeOptions options)
    : clock_(clock),
      log_(log),
      options_(std::move(options)),
      waking_bytes_(std::max<std::size_t>(1, options_.queue_bytes / kWakingPart)),
      pre_buffer_(options_.pre_buffer,
                  std::min(options_.pre_buffer_bytes, options_.queue_bytes / 2)),
      reception_(clock) {}

void Intake::AddTopic(ircp::RawTopic topic) {
  if (topic.schema.empty()) topic.schema = options_.schema_of(topic.type);
  if (topic.schema.empty()) {
    log_.Warning("topic without schema: its bytes are recorded as they are",
                 {{"topic", topic.topic}, {"type", topic.type}});
  }
  const std::lock_guard lock(mutex_);
  ledger_.AddTopic(std::move(topic));
}

void Intake::Add(ircp::RawSample&& sample) {
  const std::size_t bytes = sample.cdr.size();
  const std::lock_guard lock(mutex_);
  const Duration now = clock_.Steady();
  if (mode_ == Mode::kBuffering) {
    pre_buffer_.Prepare(now, [this] { return ledger_.writers(); });
  }
  LossLedger::Known known = ledger_.AddReceived(sample, now);
  if (sample.valid && known.topic->type == kStatusType) {
    const Result<ircp::StatusSample> status = options_.decode_status(sample.cdr);
    if (status.ok()) {
      for (const ircp::TopicCount& count : status->sent) {
        ledger_.AddAnnounced(sample.writer, count, now);
      }
    }
  }
  window_.Add(bytes, now);
  if (!sample.valid) return;
  sample.received = reception_.Mend(sample.received);
  switch (mode_) {
    case Mode::kBuffering:
      pre_buffer_.Add({std::move(sample), std::move(known.topic), std::move(known.source)}, now);
      return;
    case Mode::kPaused:
      ++left_out_;
      return;
    case Mode::kQueueing:
      break;
  }
  if (queue_bytes_ + bytes > options_.queue_bytes) {
    ledger_.AddDropped(sample.topic, sample.writer);
    return;
  }
  const bool wake = queue_bytes_ < waking_bytes_ && queue_bytes_ + bytes >= waking_bytes_;
  queue_bytes_ += bytes;
  queue_.push_back({std::move(sample), std::move(known.topic), std::move(known.source)});
  if (wake) arrived_.notify_one();
}

void Intake::Begin(bool with_past) {
  const std::lock_guard lock(mutex_);
  const auto figures = [this] { return ledger_.writers(); };
  if (with_past) {
    PreBuffer::Content past = pre_buffer_.Take(clock_.Steady(), figures);
    at_begin_ = std::move(past.figures);
    queue_.assign(std::make_move_iterator(past.arrivals.begin()),
                  std::make_move_iterator(past.arrivals.end()));
    queue_bytes_ = past.bytes;
  } else {
    pre_buffer_.Clear();
    reception_.Reset();
    at_begin_ = figures();
  }
  left_out_ = 0;
  mode_ = Mode::kQueueing;
}

void Intake::SetPaused(bool paused) {
  const std::lock_guard lock(mutex_);
  if (mode_ != Mode::kBuffering) mode_ = paused ? Mode::kPaused : Mode::kQueueing;
}

std::vector<WriterFigures> Intake::End() {
  const std::lock_guard lock(mutex_);
  mode_ = Mode::kBuffering;
  return Difference(ledger_.writers(), at_begin_);
}

void Intake::WaitUntilDrained() {
  std::unique_lock lock(mutex_);
  ++hurried_;
  arrived_.notify_one();
  drained_.wait(lock, [this] { return queue_.empty() && !taken_; });
  --hurried_;
}

void Intake::Take(std::vector<Arrival>& batch, Duration limit, const std::stop_token& stop) {
  batch.clear();
  std::unique_lock lock(mutex_);
  arrived_.wait_for(lock, stop, limit, [this] {
    return queue_bytes_ >= waking_bytes_ || (hurried_ > 0 && !queue_.empty());
  });
  batch.swap(queue_);
  taken_ = true;
}

void Intake::Done(const std::vector<Arrival>& batch, std::size_t dropped) {
  std::size_t bytes = 0;
  for (const Arrival& arrival : batch) bytes += arrival.sample.cdr.size();
  const std::lock_guard lock(mutex_);
  for (std::size_t i = dropped; i < batch.size(); ++i) {
    ledger_.AddDropped(batch[i].sample.topic, batch[i].sample.writer);
  }
  queue_bytes_ -= bytes;
  taken_ = false;
  drained_.notify_all();
}

std::vector<WriterFigures> Intake::losses() const {
  const std::lock_guard lock(mutex_);
  return Difference(ledger_.writers(), at_begin_);
}

bool Intake::HasAllAnnounced() const {
  const std::lock_guard lock(mutex_);
  return ledger_.HasAllAnnounced(clock_.Steady());
}

std::uint64_t Intake::left_out() const {
  const std::lock_guard lock(mutex_);
  return left_out_;
}

Duration Intake::buffered() const {
  const std::lock_guard lock(mutex_);
  return mode_ == Mode::kBuffering ? pre_buffer_.length(clock_.Steady()) : Duration(0);
}

Intake::ClockJumps Intake::clock_jumps() {
  const std::lock_guard lock(mutex_);
  reception_.Look();
  return {reception_.jumps(), reception_.correction()};
}

void Intake::Describe(api::RecorderStatus& status) {
  const std::lock_guard lock(mutex_);
  const Duration now = clock_.Steady();
  status.topics = ledger_.TopicFigures(now);
  for (const api::TopicFigures& topic : status.topics) {
    status.lost += topic.lost;
    status.rate_hz += topic.rate_hz;
  }
  status.bytes_per_s = window_.PerSecond(now);
  status.left_out = left_out_;
  if (mode_ == Mode::kBuffering) status.buffered_s = ToSeconds(pre_buffer_.length(now));
}

}  // namespace exemplar::recorder
