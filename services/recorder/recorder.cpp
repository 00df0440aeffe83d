#include "recorder/recorder.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "exemplar/api/data.hpp"
#include "exemplar/ircp/simulated_time.hpp"
#include "recorder/clock_marks.hpp"
#include "recorder/folder.hpp"
#include "recorder/intake.hpp"
#include "recorder/part_files.hpp"
#include "recorder/state.hpp"

namespace exemplar::recorder {
namespace {

constexpr Duration kPoll = std::chrono::milliseconds(10);
/// Losses go into the file at the latest after so long: at once where they begin, seldom where they
/// go on, so that they do not make the file long.
constexpr Duration kFirstLossInterval = std::chrono::seconds(1);
constexpr Duration kLongestLossInterval = std::chrono::seconds(10);

class RecorderImpl final : public Recorder {
 public:
  RecorderImpl(const Clock& clock, Log& log, StatusDecoder decode_status, RecorderOptions options)
      : clock_(clock),
        real_(ircp::RealTimeOf(clock)),
        log_(log),
        options_(std::move(options)),
        intake_(clock, log,
                {.queue_bytes = options_.queue_bytes,
                 .pre_buffer = options_.pre_buffer,
                 .pre_buffer_bytes = options_.pre_buffer_bytes,
                 .schema_of = options_.schema_of,
                 .decode_status = std::move(decode_status)}),
        clock_marks_(options_.clocks, [this] { return intake_.clock_jumps().correction; }) {}

  ~RecorderImpl() override {
    Close();
    tap_.reset();  // no callback comes after this
  }

  Status Open(ircp::RawBus& bus) {
    ircp::RawTapOptions tap;
    tap.wanted = [this](const ircp::RawTopic& topic) {
      const std::vector<std::string>& unwanted = options_.unwanted;
      return options_.wanted(topic) &&
             std::find(unwanted.begin(), unwanted.end(), topic.topic) == unwanted.end();
    };
    tap.on_topic = [this](const ircp::RawTopic& topic) { intake_.AddTopic(topic); };
    tap.on_sample = [this](ircp::RawSample&& sample) { intake_.Add(std::move(sample)); };
    Result<std::unique_ptr<ircp::RawTap>> made = bus.MakeTap(std::move(tap));
    if (!made.ok()) return made.error();
    tap_ = std::move(*made);
    {
      const std::lock_guard lock(mutex_);
      opening_ = true;
      detail_ = "waits for writers of " + Join(options_.expected_topics, ", ");
    }
    OpenIfMatched();
    writer_thread_ = std::jthread([this](const std::stop_token& stop) { WriteLoop(stop); });
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
      before = intake_.buffered();
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
    if (const auto person = request.metadata.find("person"); person != request.metadata.end()) {
      if (const Status valid = api::CheckPerson(person->second, "metadata.person"); !valid.ok()) {
        return valid.error();
      }
    }
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
    Result<std::unique_ptr<PartFiles>> file =
        PartFiles::Create(options_.data_dir, std::move(info), limits, options_.file, clock_,
                          [this] { return intake_.losses(); });
    if (!file.ok()) return file.error();
    const std::string path = (*file)->path().string();
    {
      const std::lock_guard lock_file(file_mutex_);
      file_ = std::move(*file);
      last_flush_ = real_.Steady();
      last_losses_ = last_flush_;
      loss_interval_ = kFirstLossInterval;
      losses_written_.clear();
      jumps_written_ = 0;
      clock_marks_.Reset();
    }
    {
      const std::lock_guard lock(mutex_);
      state_ = State::kRecording;
      detail_ = "recording " + name;
      path_ = path;
      failure_.reset();
      recorded_before_ = Duration(0);
      recording_since_ = clock_.Steady();
      messages_ = 0;
      bytes_ = 0;
      part_ = limits.any() ? 1 : 0;
      pauses_ = 0;
      intake_.Begin(with_past);
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
      const std::lock_guard lock(mutex_);
      if (failure_) return *failure_;
      SetStateLocked(State::kStopped, "closing");
      losses = intake_.End();
    }
    intake_.WaitUntilDrained();
    Status finished;
    {
      const std::lock_guard lock_file(file_mutex_);
      if (file_ != nullptr) {
        finished = NoteClockJumps();
        if (finished.ok()) {
          finished = clock_marks_.Write(*file_);
        }
        if (finished.ok()) finished = file_->Finish(losses, PauseFigures());
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

  // ---- on the writer's thread

  void WriteLoop(const std::stop_token& stop) {
    std::vector<Arrival> batch;
    while (true) {
      intake_.Take(batch, options_.flush_interval / 2, stop);
      if (stop.stop_requested() && batch.empty()) return;
      OpenIfMatched();
      intake_.Done(batch, WriteBatch(batch));
    }
  }

  /// How many were written.
  std::size_t WriteBatch(const std::vector<Arrival>& batch) {
    const std::lock_guard lock_file(file_mutex_);
    if (file_ == nullptr) return 0;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const Arrival& arrival = batch[i];
      const Status written = file_->Write(*arrival.topic, arrival.source, arrival.sample);
      if (written.ok()) continue;
      Fail(written.error());
      return i;
    }
    Status kept = NoteClockJumps();
    if (kept.ok()) kept = KeepPromises();
    if (!kept.ok()) Fail(kept.error());
    if (file_ != nullptr) {
      const std::lock_guard lock(mutex_);
      NoteFileLocked();
    }
    return batch.size();
  }

  /// Precondition: both the file's lock and the inner one are held, and there is a file.
  void NoteFileLocked() {
    messages_ = file_->messages();
    bytes_ = file_->bytes();
    part_ = file_->part();
    path_ = file_->path().string();
  }

  /// Precondition: file_mutex_ is held, and there is a file.
  Status NoteClockJumps() {
    const Intake::ClockJumps jumps = intake_.clock_jumps();
    if (jumps.count == jumps_written_) return {};
    jumps_written_ = jumps.count;
    log_.Warning("the clock was set: log times keep their old base",
                 {{"seconds", ToSeconds(-jumps.correction)}});
    return file_->WriteMark("exemplar.clock_jump", {{"at", ToIso8601(clock_.Now())},
                                                    {"jumps", std::to_string(jumps.count)},
                                                    {"added_to_log_times_s",
                                                     FormatFixed(ToSeconds(jumps.correction), 9)}});
  }

  /// Of writers that have lost more than the file says. Precondition: file_mutex_ is held.
  std::vector<WriterFigures> NewLosses() {
    std::vector<WriterFigures> losses = intake_.losses();
    std::erase_if(losses, [this](const WriterFigures& writer) {
      std::uint64_t& written = losses_written_[{writer.topic, writer.writer}];
      return std::exchange(written, writer.lost()) == writer.lost();
    });
    return losses;
  }

  /// Syncs, and notes new losses, when it is time. Precondition: file_mutex_ is held.
  Status KeepPromises() {
    const Duration now = real_.Steady();
    // A sample has waited for half of the interval at the most, and the next look is as far away.
    if (now - last_flush_ < options_.flush_interval / 4) return {};
    last_flush_ = now;
    if (now - last_losses_ >= loss_interval_) {
      last_losses_ = now;
      loss_interval_ = std::min(2 * loss_interval_, kLongestLossInterval);
      if (const Status s = file_->WriteLosses(NewLosses()); !s.ok()) return s;
    }
    if (const Status s = clock_marks_.WriteIfDue(*file_, clock_.Steady()); !s.ok()) return s;
    return file_->Flush();
  }

  /// Precondition: file_mutex_ is held.
  void Fail(const Error& error) {
    log_.Error("recording failed", {{"error", error.message}});
    file_.reset();
    {
      const std::lock_guard lock(mutex_);
      failure_ = error;
      intake_.End();
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
    const Duration deadline = real_.Steady() + FromSeconds(request.timeout_s);
    while (true) {
      std::vector<std::string> missing;
      for (const std::string& topic : expected) {
        if (tap_->matched_writers(topic) == 0) missing.push_back(topic);
      }
      if (missing.empty()) return {};
      if (real_.Steady() >= deadline) {
        return Error{ErrorCode::kDeadlineExceeded,
                     "no writer of " + Join(missing, ", ") + " after " +
                         FormatDouble(request.timeout_s) + " s",
                     "expected_topics"};
      }
      real_.SleepFor(kPoll);
    }
  }

  /// Waits for samples that were sent before the stop but have not come yet.
  void Settle() {
    const Duration deadline = real_.Steady() + options_.settle_time;
    do {
      real_.SleepFor(kPoll);
      if (intake_.HasAllAnnounced()) return;
    } while (real_.Steady() < deadline);
  }

  Result<api::RecorderStatus> Switch(Event event, const std::string& detail,
                                     const std::string& mark) {
    const std::lock_guard control(control_mutex_);
    bool changed = false;
    {
      const std::lock_guard lock(mutex_);
      const Result<State> next = Next(state_, event);
      if (!next.ok()) return next.error();
      changed = *next != state_;
      if (changed) {
        SetStateLocked(*next, detail);
        intake_.SetPaused(event == Event::kPause);
        if (event == Event::kPause) ++pauses_;
      }
    }
    if (changed) {
      if (event == Event::kPause) intake_.WaitUntilDrained();
      recording::StringMap fields = PauseFigures();
      fields["at"] = ToIso8601(clock_.Now());
      if (const Status s = WriteMark(mark, std::move(fields)); !s.ok()) return s.error();
    }
    return Changed();
  }

  recording::StringMap PauseFigures() {
    const std::lock_guard lock(mutex_);
    return {{"pauses", std::to_string(pauses_)}, {"left_out", std::to_string(intake_.left_out())}};
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
    status.part = part_;
    status.pauses = pauses_;
    return status;
  }

  /// The tap is asked without the lock: it calls back under locks of its own.
  api::RecorderStatus Snapshot() {
    api::RecorderStatus status;
    {
      const std::lock_guard lock(mutex_);
      status = StatusLocked();
    }
    intake_.Describe(status);
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
  const Clock& real_;  ///< for what the network and the disk take
  Log& log_;
  const RecorderOptions options_;
  Intake intake_;
  std::unique_ptr<ircp::RawTap> tap_;

  // Taken in this order: control, file, then the inner one; the intake's own comes last.
  std::mutex control_mutex_;  ///< one command at a time
  std::mutex file_mutex_;     ///< the file and its bookkeeping
  std::mutex mutex_;          ///< everything below it

  std::unique_ptr<PartFiles> file_;
  Duration last_flush_{0};
  Duration last_losses_{0};
  Duration loss_interval_{0};
  std::map<std::pair<std::string, std::string>, std::uint64_t> losses_written_;
  int jumps_written_ = 0;
  ClockMarks clock_marks_;

  State state_ = State::kClosed;
  bool opening_ = false;  ///< on the network, but not ready: waits for its writers
  std::string detail_;
  std::optional<Error> failure_;  ///< of the last recording
  std::string path_;
  std::uint64_t messages_ = 0;
  std::uint64_t bytes_ = 0;
  int part_ = 0;
  int pauses_ = 0;
  Duration recorded_before_{0};  ///< of this recording, before the last pause
  Duration recording_since_{0};
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
