#include "recorder/recorder.hpp"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "recorder/byte_window.hpp"
#include "recorder/folder.hpp"
#include "recorder/loss_ledger.hpp"
#include "recorder/part_files.hpp"
#include "recorder/pre_buffer.hpp"
#include "recorder/state.hpp"

namespace exemplar::recorder {
namespace {

constexpr Duration kPoll = std::chrono::milliseconds(10);
constexpr Duration kLossInterval = std::chrono::seconds(1);

class RecorderImpl final : public Recorder {
 public:
  RecorderImpl(const Clock& clock, Log& log, StatusDecoder decode_status, RecorderOptions options)
      : clock_(clock),
        log_(log),
        decode_status_(std::move(decode_status)),
        options_(std::move(options)),
        pre_buffer_(options_.pre_buffer,
                    std::min(options_.pre_buffer_bytes, options_.queue_bytes / 2)) {}

  ~RecorderImpl() override {
    Close();
    tap_.reset();  // no callback comes after this
  }

  Status Open(ircp::RawBus& bus) {
    ircp::RawTapOptions tap;
    tap.wanted = options_.wanted;
    tap.on_topic = [this](const ircp::RawTopic& topic) { OnTopic(topic); };
    tap.on_sample = [this](ircp::RawSample&& sample) { OnSample(std::move(sample)); };
    Result<std::unique_ptr<ircp::RawTap>> made = bus.MakeTap(std::move(tap));
    if (!made.ok()) return made.error();
    tap_ = std::move(*made);
    {
      const std::lock_guard lock(mutex_);
      opening_ = true;
      detail_ = "waits for writers of " + Join(options_.expected_topics, ", ");
    }
    OpenIfMatched();
    writer_thread_ = std::jthread([this](std::stop_token stop) { WriteLoop(std::move(stop)); });
    return {};
  }

  Result<api::RecorderStatus> Start(const api::RecordStart& request) override {
    const std::lock_guard control(control_mutex_);
    if (const Status can = CheckNext(Event::kStart); !can.ok()) return can.error();
    if (const Status there = AwaitWriters(request); !there.ok()) return there.error();
    OpenIfMatched();
    if (const Status begun = Begin(request, false); !begun.ok()) return begun.error();
    return Changed();
  }

  Result<api::RecorderStatus> MarkEvent(const api::RecordEvent& event) override {
    const std::lock_guard control(control_mutex_);
    if (const Status can = CheckNext(Event::kMark); !can.ok()) return can.error();
    const Stamp at = clock_.Now();
    Duration before{0};
    if (!HasFile()) {
      api::RecordStart start;
      start.name = event.name;
      start.metadata = event.metadata;
      {
        const std::lock_guard lock(mutex_);
        before = pre_buffer_.length(clock_.Steady());
      }
      if (const Status begun = Begin(start, true); !begun.ok()) return begun.error();
    }
    const Status marked =
        WriteMark("exemplar.event", {{"at", ToIso8601(at)},
                                     {"note", event.note},
                                     {"kept_before_s", FormatFixed(ToSeconds(before), 3)}});
    if (!marked.ok()) return marked.error();
    return Changed();
  }

 private:
  /// Precondition: control_mutex_ is held. `with_past`: what the pre-buffer holds comes first.
  Status Begin(const api::RecordStart& request, bool with_past) {
    if (const Status can = CheckNext(Event::kStart); !can.ok()) return can.error();
    const Stamp now = clock_.Now();
    const std::string name = request.name.empty() ? NameFromTime(now) : request.name;
    if (const Status valid = CheckRecordingName(name); !valid.ok()) return valid.error();
    if (!(request.split_s >= 0)) {
      return InvalidArgument(
          "split_s is " + FormatDouble(request.split_s) + ", must not be negative", "split_s");
    }
    const SplitLimits limits{
        .bytes = request.split_bytes > 0 ? request.split_bytes : options_.split_bytes,
        .length = request.split_s > 0 ? FromSeconds(request.split_s) : options_.split_length};
    RecordingInfo info;
    info.name = name;
    info.station = options_.station;
    info.started = now;
    info.metadata = request.metadata;
    Result<std::unique_ptr<PartFiles>> file = PartFiles::Create(
        options_.data_dir, std::move(info), limits, options_.file, clock_, [this] {
          const std::lock_guard lock(mutex_);
          return Difference(ledger_.writers(), at_start_);
        });
    if (!file.ok()) return file.error();
    const std::string path = (*file)->path().string();
    {
      const std::lock_guard lock_file(file_mutex_);
      file_ = std::move(*file);
      last_flush_ = clock_.Steady();
      last_losses_ = last_flush_;
      losses_written_ = 0;
    }
    {
      const std::lock_guard lock(mutex_);
      const Duration steady = clock_.Steady();
      const auto figures = [this] { return ledger_.writers(); };
      if (with_past) {
        PreBuffer::Content past = pre_buffer_.Take(steady, figures);
        at_start_ = std::move(past.figures);
        queue_ = std::move(past.arrivals);
        queue_bytes_ = past.bytes;
      } else {
        pre_buffer_.Clear();
        at_start_ = figures();
      }
      state_ = State::kRecording;
      detail_ = "recording " + name;
      path_ = path;
      failure_.reset();
      recorded_before_ = Duration(0);
      recording_since_ = steady;
      messages_ = 0;
      bytes_ = 0;
      part_ = limits.any() ? 1 : 0;
      pauses_ = 0;
      left_out_ = 0;
      arrived_.notify_one();
    }
    log_.Info("recording", {{"file", path}});
    return {};
  }

 public:
  Result<api::RecorderStatus> Stop() override {
    const std::lock_guard control(control_mutex_);
    return StopHeld();
  }

  /// Precondition: control_mutex_ is held.
  Result<api::RecorderStatus> StopHeld() {
    bool stopped_already = false;
    {
      const std::lock_guard lock(mutex_);
      const Result<State> next = Next(state_, Event::kStop);
      if (!next.ok()) return next.error();
      if (failure_) return *failure_;
      stopped_already = state_ == State::kStopped;
    }
    if (stopped_already) return Snapshot();
    Settle();
    std::vector<WriterFigures> losses;
    {
      std::unique_lock lock(mutex_);
      if (failure_) return *failure_;
      SetStateLocked(State::kStopped, "closing");
      drained_.wait(lock, [&] { return queue_.empty() && !writing_; });
      losses = Difference(ledger_.writers(), at_start_);
    }
    Status finished;
    {
      const std::lock_guard lock_file(file_mutex_);
      if (file_ != nullptr) {
        finished = file_->Finish(losses, PauseFigures());
        const std::lock_guard lock(mutex_);
        NoteFileLocked();
      }
      file_.reset();
    }
    {
      const std::lock_guard lock(mutex_);
      if (failure_) finished = *failure_;
      detail_ = finished.ok() ? "recorded " + std::to_string(messages_) + " messages"
                              : finished.error().message;
      log_.Info("recorded", {{"file", path_},
                             {"messages", messages_},
                             {"bytes", bytes_},
                             {"lost", TotalLost(losses)}});
    }
    const api::RecorderStatus status = Changed();
    if (!finished.ok()) return finished.error();
    return status;
  }

  Result<api::RecorderStatus> Pause() override {
    return Switch(Event::kPause, "paused", "exemplar.pause");
  }
  Result<api::RecorderStatus> Resume() override {
    return Switch(Event::kResume, "recording", "exemplar.resume");
  }

  void Close() override {
    const std::lock_guard control(control_mutex_);
    if (HasFile()) {
      if (const Result<api::RecorderStatus> stopped = StopHeld(); !stopped.ok()) {
        log_.Error("recording not closed", {{"error", stopped.error().message}});
      }
    }
    {
      const std::lock_guard lock(mutex_);
      if (state_ == State::kClosed && !opening_) return;
      opening_ = false;
      SetStateLocked(State::kClosed, "closed");
    }
    Changed();
  }

  Result<api::RecorderStatus> GetStatus() override { return Snapshot(); }

 private:
  static std::uint64_t TotalLost(const std::vector<WriterFigures>& writers) {
    std::uint64_t lost = 0;
    for (const WriterFigures& writer : writers) lost += writer.lost();
    return lost;
  }

  // ---- on threads of the network

  void OnTopic(ircp::RawTopic topic) {
    if (topic.schema.empty()) topic.schema = options_.schema_of(topic.type);
    {
      const std::lock_guard lock(mutex_);
      ledger_.AddTopic(topic);
    }
    if (topic.schema.empty()) {
      log_.Warning("topic without schema: its bytes are recorded as they are",
                   {{"topic", topic.topic}, {"type", topic.type}});
    }
  }

  void OnSample(ircp::RawSample&& sample) {
    std::optional<HeaderLayout> layout;
    bool is_status = false;
    {
      const std::lock_guard lock(mutex_);
      layout = ledger_.HeaderOf(sample.topic);
      const ircp::RawTopic* topic = ledger_.FindTopic(sample.topic);
      is_status = topic != nullptr && topic->type == "exemplar::ircp::v1::Status";
    }
    std::optional<SampleHeader> header;
    if (layout && sample.valid) header = ReadSampleHeader(sample.cdr, *layout);
    std::vector<ircp::TopicCount> announced;
    if (is_status && sample.valid) {
      Result<ircp::StatusSample> status = decode_status_(sample.cdr);
      if (status.ok()) announced = std::move(status->sent);
    }
    const std::lock_guard lock(mutex_);
    const Duration now = clock_.Steady();
    const bool has_file = HasFileLocked();
    if (!has_file) pre_buffer_.Prepare(now, [this] { return ledger_.writers(); });
    ledger_.AddReceived(sample, header, now);
    for (const ircp::TopicCount& count : announced) ledger_.AddAnnounced(sample.writer, count);
    window_.Add(sample.cdr.size(), now);
    if (!sample.valid) return;
    if (!has_file) {
      pre_buffer_.Add({std::move(sample), header ? std::move(header->source) : std::string()}, now);
      return;
    }
    if (state_ == State::kPaused) {
      ++left_out_;
      return;
    }
    if (queue_bytes_ + sample.cdr.size() > options_.queue_bytes) {
      ledger_.AddDropped(sample.topic, sample.writer);
      return;
    }
    queue_bytes_ += sample.cdr.size();
    queue_.push_back({std::move(sample), header ? std::move(header->source) : std::string()});
    arrived_.notify_one();
  }

  // ---- on the writer's thread

  void WriteLoop(std::stop_token stop) {
    while (true) {
      std::deque<Arrival> batch;
      {
        std::unique_lock lock(mutex_);
        arrived_.wait_for(lock, stop, options_.flush_interval / 2, [&] { return !queue_.empty(); });
        if (stop.stop_requested() && queue_.empty()) return;
        batch.swap(queue_);
        writing_ = true;
      }
      OpenIfMatched();
      const std::size_t written_bytes = WriteBatch(batch);
      {
        const std::lock_guard lock(mutex_);
        queue_bytes_ -= written_bytes;
        writing_ = false;
      }
      drained_.notify_all();
    }
  }

  std::size_t WriteBatch(const std::deque<Arrival>& batch) {
    std::size_t bytes = 0;
    for (const Arrival& arrival : batch) bytes += arrival.sample.cdr.size();
    const std::lock_guard lock_file(file_mutex_);
    if (file_ == nullptr) {
      const std::lock_guard lock(mutex_);
      for (const Arrival& lost : batch) ledger_.AddDropped(lost.sample.topic, lost.sample.writer);
      return bytes;
    }
    for (auto arrival = batch.begin(); arrival != batch.end(); ++arrival) {
      const Status written =
          file_->Write(TopicOf(arrival->sample), arrival->source, arrival->sample);
      if (written.ok()) continue;
      {
        const std::lock_guard lock(mutex_);
        for (auto lost = arrival; lost != batch.end(); ++lost) {
          ledger_.AddDropped(lost->sample.topic, lost->sample.writer);
        }
      }
      Fail(written.error());
      return bytes;
    }
    if (const Status kept = KeepPromises(); !kept.ok()) Fail(kept.error());
    if (file_ != nullptr) {
      const std::lock_guard lock(mutex_);
      NoteFileLocked();
    }
    return bytes;
  }

  /// Precondition: both the file's lock and the inner one are held, and there is a file.
  void NoteFileLocked() {
    messages_ = file_->messages();
    bytes_ = file_->bytes();
    part_ = file_->part();
    path_ = file_->path().string();
  }

  ircp::RawTopic TopicOf(const ircp::RawSample& sample) {
    const std::lock_guard lock(mutex_);
    const ircp::RawTopic* topic = ledger_.FindTopic(sample.topic);
    if (topic != nullptr) return *topic;
    ircp::RawTopic unknown;
    unknown.topic = sample.topic;
    return unknown;
  }

  /// Syncs, and notes new losses, when it is time. Precondition: file_mutex_ is held.
  Status KeepPromises() {
    const Duration now = clock_.Steady();
    // Half of it, as a sample may have waited for the other half.
    if (now - last_flush_ < options_.flush_interval / 2) return {};
    last_flush_ = now;
    if (now - last_losses_ >= kLossInterval) {
      last_losses_ = now;
      std::vector<WriterFigures> losses;
      {
        const std::lock_guard lock(mutex_);
        losses = Difference(ledger_.writers(), at_start_);
      }
      std::erase_if(losses, [](const WriterFigures& writer) { return writer.lost() == 0; });
      const std::uint64_t lost = TotalLost(losses);
      if (lost != losses_written_) {
        losses_written_ = lost;
        if (const Status s = file_->WriteLosses(losses); !s.ok()) return s;
      }
    }
    return file_->Flush();
  }

  /// Precondition: file_mutex_ is held.
  void Fail(const Error& error) {
    log_.Error("recording failed", {{"error", error.message}});
    file_.reset();
    {
      const std::lock_guard lock(mutex_);
      failure_ = error;
      SetStateLocked(State::kStopped, "stopped by a failure: " + error.message +
                                          "; what was written before is whole");
    }
    Changed();
  }

  // ---- on threads of callers

  Status AwaitWriters(const api::RecordStart& request) {
    if (request.timeout_s < 0 || !(request.timeout_s < 3600)) {
      return InvalidArgument(
          "timeout_s is " + std::to_string(request.timeout_s) + ", must lie between 0 and 3600",
          "timeout_s");
    }
    std::vector<std::string> expected = options_.expected_topics;
    expected.insert(expected.end(), request.expected_topics.begin(), request.expected_topics.end());
    const Duration deadline = clock_.Steady() + FromSeconds(request.timeout_s);
    while (true) {
      std::vector<std::string> missing;
      for (const std::string& topic : expected) {
        if (tap_->matched_writers(topic) == 0) missing.push_back(topic);
      }
      if (missing.empty()) return {};
      if (clock_.Steady() >= deadline) {
        return Error{ErrorCode::kDeadlineExceeded,
                     "no writer of " + Join(missing, ", ") + " after " +
                         FormatDouble(request.timeout_s) + " s",
                     "expected_topics"};
      }
      clock_.SleepFor(kPoll);
    }
  }

  /// Waits for samples that were sent before the stop but have not come yet.
  void Settle() {
    const Duration deadline = clock_.Steady() + options_.settle_time;
    do {
      clock_.SleepFor(kPoll);
      const std::lock_guard lock(mutex_);
      if (ledger_.HasAllAnnounced()) return;
    } while (clock_.Steady() < deadline);
  }

  Result<api::RecorderStatus> Switch(Event event, const std::string& detail,
                                     const std::string& mark) {
    const std::lock_guard control(control_mutex_);
    bool changed = false;
    {
      std::unique_lock lock(mutex_);
      const Result<State> next = Next(state_, event);
      if (!next.ok()) return next.error();
      changed = *next != state_;
      if (changed) SetStateLocked(*next, detail);
      if (changed && event == Event::kPause) {
        ++pauses_;
        drained_.wait(lock, [&] { return queue_.empty() && !writing_; });
      }
    }
    if (changed) {
      recording::StringMap fields = PauseFigures();
      fields["at"] = ToIso8601(clock_.Now());
      if (const Status s = WriteMark(mark, std::move(fields)); !s.ok()) return s.error();
    }
    return Changed();
  }

  recording::StringMap PauseFigures() {
    const std::lock_guard lock(mutex_);
    return {{"pauses", std::to_string(pauses_)}, {"left_out", std::to_string(left_out_)}};
  }

  /// A record about what happened; a failing disk ends the recording.
  Status WriteMark(const std::string& name, recording::StringMap fields) {
    const std::lock_guard lock_file(file_mutex_);
    if (file_ == nullptr) {
      const std::lock_guard lock(mutex_);
      return failure_ ? Status(*failure_) : FailedPrecondition("no file is open");
    }
    Status written = file_->WriteMark(name, std::move(fields));
    if (written.ok()) written = file_->Flush();
    if (!written.ok()) Fail(written.error());
    return written;
  }

  /// A recorder that waits for its writers can be told to start: the start waits, too.
  Status CheckNext(Event event) {
    const std::lock_guard lock(mutex_);
    const State state = opening_ && event == Event::kStart ? State::kReady : state_;
    const Result<State> next = Next(state, event);
    return next.ok() ? Status() : Status(next.error());
  }

  /// On to ready, once the expected writers are there. No lock may be held but control_mutex_.
  void OpenIfMatched() {
    {
      const std::lock_guard lock(mutex_);
      if (!opening_) return;
    }
    for (const std::string& topic : options_.expected_topics) {
      if (tap_->matched_writers(topic) == 0) return;
    }
    {
      const std::lock_guard lock(mutex_);
      if (!opening_) return;
      opening_ = false;
      state_ = State::kReady;
      detail_ = "listening";
    }
    Changed();
  }

  /// Precondition: mutex_ is held.
  void SetStateLocked(State state, std::string detail) {
    const Duration now = clock_.Steady();
    if (state_ == State::kRecording) recorded_before_ += now - recording_since_;
    recording_since_ = now;
    state_ = state;
    detail_ = std::move(detail);
  }

  bool HasFileLocked() const { return state_ == State::kRecording || state_ == State::kPaused; }
  bool HasFile() {
    const std::lock_guard lock(mutex_);
    return HasFileLocked();
  }

  /// Precondition: mutex_ is held.
  api::RecorderStatus StatusLocked() {
    const Duration now = clock_.Steady();
    api::RecorderStatus status;
    status.state = ToString(state_);
    status.detail = detail_;
    status.file = path_;
    Duration recorded = recorded_before_;
    if (state_ == State::kRecording) recorded += now - recording_since_;
    status.duration_s = ToSeconds(recorded);
    status.messages = messages_;
    status.bytes = bytes_;
    status.topics = ledger_.TopicFigures(now);
    for (const api::TopicFigures& topic : status.topics) {
      status.lost += topic.lost;
      status.rate_hz += topic.rate_hz;
    }
    status.bytes_per_s = window_.PerSecond(now);
    status.part = part_;
    status.pauses = pauses_;
    status.left_out = left_out_;
    if (!HasFileLocked()) status.buffered_s = ToSeconds(pre_buffer_.length(now));
    return status;
  }

  /// The tap is asked without the lock: it calls back under locks of its own.
  api::RecorderStatus Snapshot() {
    api::RecorderStatus status;
    {
      const std::lock_guard lock(mutex_);
      status = StatusLocked();
    }
    for (api::TopicFigures& topic : status.topics) {
      topic.writers = tap_->matched_writers(topic.topic);
    }
    std::error_code unknown;
    const std::filesystem::space_info space = std::filesystem::space(options_.data_dir, unknown);
    if (!unknown) status.disk_free_bytes = space.available;
    return status;
  }

  /// Tells the listener; no lock may be held but control_mutex_ and file_mutex_.
  api::RecorderStatus Changed() {
    const api::RecorderStatus status = Snapshot();
    options_.on_change(status.state, status.detail);
    return status;
  }

  const Clock& clock_;
  Log& log_;
  StatusDecoder decode_status_;
  RecorderOptions options_;
  std::unique_ptr<ircp::RawTap> tap_;

  // Taken in this order: control, file, then the inner one.
  std::mutex control_mutex_;  ///< one command at a time
  std::mutex file_mutex_;     ///< the file and its bookkeeping
  std::mutex mutex_;          ///< everything below it

  std::unique_ptr<PartFiles> file_;
  Duration last_flush_{0};
  Duration last_losses_{0};
  std::uint64_t losses_written_ = 0;

  State state_ = State::kClosed;
  bool opening_ = false;  ///< on the network, but not ready: waits for its writers
  std::string detail_;
  std::optional<Error> failure_;  ///< of the last recording
  std::string path_;
  std::uint64_t messages_ = 0;
  std::uint64_t bytes_ = 0;
  int part_ = 0;
  int pauses_ = 0;
  std::uint64_t left_out_ = 0;
  PreBuffer pre_buffer_;
  ByteWindow window_;
  Duration recorded_before_{0};  ///< of this recording, before the last pause
  Duration recording_since_{0};
  LossLedger ledger_;
  std::vector<WriterFigures> at_start_;
  std::deque<Arrival> queue_;
  std::size_t queue_bytes_ = 0;
  bool writing_ = false;
  std::condition_variable_any arrived_;
  std::condition_variable drained_;

  std::jthread writer_thread_;
};

}  // namespace

Result<std::unique_ptr<Recorder>> Recorder::Create(ircp::RawBus& bus, const Clock& clock, Log& log,
                                                   StatusDecoder decode_status,
                                                   RecorderOptions options) {
  if (const Status made = MakeFolder(options.data_dir); !made.ok()) return made.error();
  options.data_dir = std::filesystem::absolute(options.data_dir).lexically_normal();
  auto recorder =
      std::make_unique<RecorderImpl>(clock, log, std::move(decode_status), std::move(options));
  if (const Status opened = recorder->Open(bus); !opened.ok()) return opened.error();
  return std::unique_ptr<Recorder>(std::move(recorder));
}

}  // namespace exemplar::recorder
