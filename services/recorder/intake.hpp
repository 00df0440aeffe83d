#pragma once
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "recorder/byte_window.hpp"
#include "recorder/loss_ledger.hpp"
#include "recorder/pre_buffer.hpp"
#include "recorder/reception_time.hpp"

namespace exemplar::recorder {

struct IntakeOptions {
  std::size_t queue_bytes = 0;
  Duration pre_buffer{0};
  std::size_t pre_buffer_bytes = 0;
  std::function<std::string(const std::string& type)> schema_of;
  std::function<Result<ircp::StatusSample>(std::span<const std::uint8_t> cdr)> decode_status;
};

/// Between the network's threads, which only count and queue, and the thread that writes. Without a
/// recording, samples go to the pre-buffer. Thread-safe; one thread takes.
class Intake {
 public:
  /// Clock and log must outlive it.
  Intake(const Clock& clock, Log& log, IntakeOptions options);

  // On threads of the network.
  void AddTopic(ircp::RawTopic topic);
  void Add(ircp::RawSample&& sample);

  /// From now on samples are queued. `with_past`: what the pre-buffer holds comes first.
  void Begin(bool with_past);
  /// What comes while it is paused is counted and left out.
  void SetPaused(bool paused);
  /// From now on samples go to the pre-buffer. What happened since Begin.
  std::vector<WriterFigures> End();
  /// Returns when all that was queued has been written or dropped.
  void WaitUntilDrained();

  /// Swaps what is queued into `batch` (which is emptied first). Waits up to `limit` for a batch
  /// that is worth it, less when somebody waits for the queue to drain.
  void Take(std::vector<Arrival>& batch, Duration limit, const std::stop_token& stop);
  /// What was taken last is out of the way; those from `dropped` on were not written.
  void Done(const std::vector<Arrival>& batch, std::size_t dropped);

  /// Since Begin.
  std::vector<WriterFigures> losses() const;
  bool HasAllAnnounced() const;
  std::uint64_t left_out() const;
  Duration buffered() const;
  struct ClockJumps {
    int count = 0;
    Duration correction{0};
  };
  ClockJumps clock_jumps();
  /// Topics, rates and losses.
  void Describe(api::RecorderStatus& status);

 private:
  enum class Mode { kBuffering, kQueueing, kPaused };

  const Clock& clock_;
  Log& log_;
  const IntakeOptions options_;
  const std::size_t waking_bytes_;

  mutable std::mutex mutex_;  ///< guards everything below
  std::condition_variable_any arrived_;
  std::condition_variable drained_;
  Mode mode_ = Mode::kBuffering;
  LossLedger ledger_;
  std::vector<WriterFigures> at_begin_;
  PreBuffer pre_buffer_;
  ReceptionTime reception_;
  ByteWindow window_;
  std::vector<Arrival> queue_;
  std::size_t queue_bytes_ = 0;  ///< of the batch that is being written as well
  bool taken_ = false;
  int hurried_ = 0;  ///< somebody waits for the queue to drain
  std::uint64_t left_out_ = 0;
};

}  // namespace exemplar::recorder
