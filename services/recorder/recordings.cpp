#include "recorder/recordings.hpp"

#include <algorithm>
#include <array>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/security/digest.hpp"
#include "recorder/erased_file.hpp"
#include "recorder/recording_list.hpp"

namespace exemplar::recorder {
namespace {

namespace fs = std::filesystem;

constexpr const char* kErasedPart = "erased.json";
constexpr const char* kRecordingParts = "recordings/";
/// Where a restoring gathers its files.
constexpr const char* kGathering = ".restoring";

api::DataItem Item(const KeptRecording& recording, std::string action, std::string detail = {}) {
  return {.kind = "recording",
          .name = recording.name,
          .action = std::move(action),
          .detail = std::move(detail),
          .bytes = recording.bytes,
          .at = recording.end};
}

/// The file with what a label's writing may have left beside it.
Status Remove(const KeptRecording& recording) {
  std::error_code error;
  fs::remove(recording.path.string() + ".tail", error);
  fs::remove(recording.path, error);
  if (error) return Internal(recording.path.string() + ": cannot be deleted: " + error.message());
  return {};
}

class RecordingsImpl final : public Recordings {
 public:
  RecordingsImpl(api::RecorderApi& recorder, const Clock& clock, Log& log,
                 const RecordingsOptions& options)
      : recorder_(recorder), clock_(clock), log_(log), options_(options) {
    if (options_.keep_days <= 0) return;
    thread_ = std::jthread([this](const std::stop_token& stop) {
      do {
        const Result<api::DataReport> done = ApplyRetention({});
        if (!done.ok())
          log_.Warning("retention was not applied", {{"error", done.error().message}});
      } while (clock_.SleepFor(std::chrono::hours(1), stop));
    });
  }

  Result<std::vector<api::PersonInfo>> ListPersons() override {
    const Result<std::vector<KeptRecording>> all = ListRecordings(options_.data_dir);
    if (!all.ok()) return all.error();
    std::map<std::string, api::PersonInfo> persons;
    for (const KeptRecording& recording : *all) {
      api::PersonInfo& info = persons[recording.person];
      if (info.items == 0) info.first = recording.end;
      info.person = recording.person;
      ++info.items;
      info.bytes += recording.bytes;
      info.first = std::min(info.first, recording.end);
      info.last = std::max(info.last, recording.end);
    }
    std::vector<api::PersonInfo> list;
    list.reserve(persons.size());
    for (const auto& [person, info] : persons) list.push_back(info);
    return list;
  }

  Result<api::DataReport> Erase(const api::EraseRequest& request, const api::DataProgress& progress,
                                std::stop_token stop) override {
    if (const Status valid = api::CheckPerson(request.person, "person"); !valid.ok()) {
      return valid.error();
    }
    std::optional<Work> work;
    if (!request.dry_run) {
      Result<Work> begun = Work::Begin(*this, "another erasure");
      if (!begun.ok()) return begun.error();
      work.emplace(*std::move(begun));
    }
    const Result<std::string> active = ActiveFile();
    if (!active.ok()) return active.error();
    const Result<std::vector<KeptRecording>> all = ListRecordings(options_.data_dir);
    if (!all.ok()) return all.error();
    std::vector<KeptRecording> theirs;
    for (const KeptRecording& recording : *all) {
      if (recording.person != request.person) continue;
      if (recording.path == *active) {
        return FailedPrecondition("a recording of this person is under way; stop it first",
                                  "person");
      }
      theirs.push_back(recording);
    }
    api::DataReport report;
    if (!request.dry_run) {
      if (const Status noted = Note(request.person); !noted.ok()) return noted.error();
    }
    for (const KeptRecording& recording : theirs) {
      if (stop.stop_requested()) {
        return Error{ErrorCode::kCancelled, std::to_string(report.items.size()) + " of " +
                                                std::to_string(theirs.size()) +
                                                " recordings are deleted; run it again"};
      }
      if (!request.dry_run) {
        if (const Status removed = Remove(recording); !removed.ok()) return removed.error();
      }
      report.items.push_back(Item(recording, "deleted"));
      if (progress) {
        progress(static_cast<double>(report.items.size()) / static_cast<double>(theirs.size()),
                 "deleting recordings");
      }
    }
    if (request.dry_run || theirs.empty()) return report;
    if (const Status synced = SyncFolder(options_.data_dir); !synced.ok()) return synced.error();
    log_.Info("audit", {{"method", "erasure of a person"},
                        {"target", std::to_string(theirs.size()) + " recordings"},
                        {"outcome", "ok"}});
    return report;
  }

  Result<api::DataReport> ApplyRetention(const api::RetentionRequest& request) override {
    std::optional<Work> work;
    if (!request.dry_run) {
      Result<Work> begun = Work::Begin(*this, "the removal of what is too old");
      if (!begun.ok()) return begun.error();
      work.emplace(*std::move(begun));
    }
    constexpr double kSecondsOfDay = 86'400;
    const double keep_days = request.keep_days.value_or(options_.keep_days);
    api::DataReport report;
    if (keep_days <= 0) {
      report.notices.emplace_back("nothing goes by age here: no --keep-days is set");
      return report;
    }
    const Result<std::string> active = ActiveFile();
    if (!active.ok()) return active.error();
    const Result<std::vector<KeptRecording>> all = ListRecordings(options_.data_dir);
    if (!all.ok()) return all.error();
    const Stamp now = clock_.Now();
    for (const KeptRecording& recording : *all) {
      const bool within = recording.name.find('/') != std::string::npos;
      if (within || recording.path == *active) continue;
      if (ToSeconds(now - recording.end) <= keep_days * kSecondsOfDay) continue;
      if (!request.dry_run) {
        if (const Status removed = Remove(recording); !removed.ok()) {
          report.notices.push_back(removed.error().message);
          continue;
        }
        log_.Info("audit", {{"caller", "retention"},
                            {"method", "deleted"},
                            {"target", "recording " + recording.name},
                            {"outcome", "ok"}});
      }
      report.items.push_back(Item(recording, "deleted"));
    }
    return report;
  }

  Status Backup(api::BackupSink& sink, std::stop_token stop) override {
    const Result<Work> work = Work::Begin(*this, "a backup");
    if (!work.ok()) return work.error();
    const Result<std::string> active = ActiveFile();
    if (!active.ok()) return active.error();
    Result<std::vector<KeptRecording>> all = ListRecordings(options_.data_dir);
    if (!all.ok()) return all.error();
    const Result<std::vector<api::ErasedPerson>> erased = LoadErased(options_.data_dir);
    if (!erased.ok()) return erased.error();
    const std::string list = WriteErased(*erased);
    api::BackupPlan plan;
    plan.service = "recorder";
    plan.schema = kSchema;
    plan.parts = 1;
    plan.bytes = list.size();
    std::erase_if(*all, [&](const KeptRecording& recording) {
      if (recording.path != *active) return false;
      plan.notices.push_back(recording.name + " is being recorded and was left out");
      return true;
    });
    for (const KeptRecording& recording : *all) {
      ++plan.parts;
      plan.bytes += recording.bytes;
    }
    plan.counts["recordings"] = all->size();
    if (Status begun = sink.Begin(plan); !begun.ok()) return begun;
    if (Status begun = sink.BeginPart({kErasedPart, list.size()}); !begun.ok()) return begun;
    if (Status sent = sink.Write(list); !sent.ok()) return sent;
    for (const KeptRecording& recording : *all) {
      if (Status sent = Send(recording, sink, stop); !sent.ok()) return sent;
    }
    return {};
  }

  Result<api::DataReport> Restore(const api::RestoreRequest& request,
                                  api::BackupSource& source) override {
    const Result<Work> work = Work::Begin(*this, "a restoring");
    if (!work.ok()) return work.error();
    if (request.plan.service != "recorder") {
      return InvalidArgument(
          "the backup is one of \"" + request.plan.service + "\", must be of \"recorder\"",
          "header.plan.service");
    }
    if (request.plan.schema > kSchema) {
      return FailedPrecondition("the backup has schema " + std::to_string(request.plan.schema) +
                                    ", written by a newer program; this one knows up to " +
                                    std::to_string(kSchema),
                                "header.plan.schema");
    }
    const Result<std::vector<KeptRecording>> there = ListRecordings(options_.data_dir);
    if (!there.ok()) return there.error();
    if (request.mode == api::RestoreMode::kEmptyOnly && !there->empty()) {
      return FailedPrecondition(
          "the recorder's folder holds recordings; say whether to merge or to replace them",
          "header.mode");
    }
    const Result<std::string> active = ActiveFile();
    if (!active.ok()) return active.error();
    if (request.mode == api::RestoreMode::kReplace && !active->empty()) {
      return FailedPrecondition("a recording is under way; stop it first");
    }
    const fs::path gathering = options_.data_dir / kGathering;
    std::error_code error;
    fs::remove_all(gathering, error);
    Result<api::DataReport> report = Gather(request, source, gathering, *there);
    fs::remove_all(gathering, error);
    return report;
  }

 private:
  static constexpr int kSchema = 1;

  /// The right to do one of these things.
  class Work {
   public:
    static Result<Work> Begin(RecordingsImpl& recordings, const std::string& what) {
      const std::lock_guard lock(recordings.mutex_);
      if (!recordings.under_way_.empty()) {
        return FailedPrecondition(recordings.under_way_ +
                                  " is under way; try again when it is done");
      }
      recordings.under_way_ = what;
      return Work(recordings);
    }
    Work(Work&& other) noexcept : recordings_(std::exchange(other.recordings_, nullptr)) {}
    Work& operator=(Work&&) = delete;
    ~Work() {
      if (recordings_ == nullptr) return;
      const std::lock_guard lock(recordings_->mutex_);
      recordings_->under_way_.clear();
    }

   private:
    explicit Work(RecordingsImpl& recordings) : recordings_(&recordings) {}
    RecordingsImpl* recordings_;
  };

  /// Empty: nothing is being recorded.
  Result<std::string> ActiveFile() {
    const Result<api::RecorderStatus> status = recorder_.GetStatus();
    if (!status.ok()) return status.error();
    const bool open = status->state == "recording" || status->state == "paused";
    return open ? status->file : std::string();
  }

  /// Keeps the person's hash.
  Status Note(const std::string& person) {
    Result<std::vector<api::ErasedPerson>> erased = LoadErased(options_.data_dir);
    if (!erased.ok()) return erased.error();
    constexpr std::size_t kSaltBytes = 16;
    const std::string salt =
        erased->empty() ? security::RandomText(kSaltBytes) : erased->front().salt;
    erased->push_back({salt, security::PersonHash(salt, person), clock_.Now()});
    return SaveErased(options_.data_dir, *std::move(erased));
  }

  static Status Send(const KeptRecording& recording, api::BackupSink& sink,
                     const std::stop_token& stop) {
    const auto file = recording::FileSource::Open(recording.path);
    if (!file.ok()) return file.error();
    if (Status begun = sink.BeginPart({kRecordingParts + recording.name, recording.bytes});
        !begun.ok()) {
      return begun;
    }
    std::vector<std::uint8_t> buffer(std::size_t{1} << 20);
    for (std::uint64_t offset = 0; offset < recording.bytes;) {
      if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the backup was cancelled"};
      const std::size_t wanted = std::min<std::uint64_t>(buffer.size(), recording.bytes - offset);
      const Result<std::size_t> read = (*file)->Read(offset, {buffer.data(), wanted});
      if (!read.ok()) return read.error();
      if (*read < wanted) return Changed(recording);
      if (Status sent = sink.Write({reinterpret_cast<const char*>(buffer.data()), wanted});
          !sent.ok()) {
        return sent;
      }
      offset += wanted;
    }
    std::error_code error;
    if (fs::file_size(recording.path, error) != recording.bytes) return Changed(recording);
    return {};
  }
  static Error Changed(const KeptRecording& recording) {
    return Unavailable(recording.name + " was changed while it was copied; begin the backup anew");
  }

  /// Takes all parts into a folder, then each file to its place.
  Result<api::DataReport> Gather(const api::RestoreRequest& request, api::BackupSource& source,
                                 const fs::path& gathering,
                                 const std::vector<KeptRecording>& there) {
    Result<std::vector<api::ErasedPerson>> erased = LoadErased(options_.data_dir);
    if (!erased.ok()) return erased.error();
    erased->insert(erased->end(), request.erased.begin(), request.erased.end());
    std::vector<KeptRecording> came;
    for (;;) {
      const Result<std::optional<api::BackupPart>> part = source.NextPart();
      if (!part.ok()) return part.error();
      if (!*part) break;
      const std::string& name = (*part)->name;
      if (name == kErasedPart) {
        const Result<std::vector<api::ErasedPerson>> more = ReadErasedPart(source);
        if (!more.ok()) return more.error();
        erased->insert(erased->end(), more->begin(), more->end());
        continue;
      }
      const std::string prefix = kRecordingParts;
      const std::string path = name.starts_with(prefix) ? name.substr(prefix.size()) : "";
      if (const Status valid = CheckRecordingPath(path); !valid.ok()) return valid.error();
      if (const Status kept = Take(source, gathering / path); !kept.ok()) return kept.error();
      came.push_back(DescribeRecording(gathering / path, path));
    }
    return Place(request, came, there, *erased);
  }

  static Result<std::vector<api::ErasedPerson>> ReadErasedPart(api::BackupSource& source) {
    std::string json;
    for (;;) {
      const Result<std::string> bytes = source.Read();
      if (!bytes.ok()) return bytes.error();
      if (bytes->empty()) return ReadErased(json);
      constexpr std::size_t kLargest = std::size_t{64} << 20;
      if (json.size() + bytes->size() > kLargest) {
        return InvalidArgument(std::string(kErasedPart) + " is too long", "begin.bytes");
      }
      json += *bytes;
    }
  }

  static Status Take(api::BackupSource& source, const fs::path& path) {
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    if (error) return Internal(path.parent_path().string() + ": " + error.message());
    const auto sink = recording::FileSink::Create(path);
    if (!sink.ok()) return sink.error();
    for (;;) {
      const Result<std::string> bytes = source.Read();
      if (!bytes.ok()) return bytes.error();
      if (bytes->empty()) return (*sink)->Sync();
      const auto* data = reinterpret_cast<const std::uint8_t*>(bytes->data());
      if (Status written = (*sink)->Write({data, bytes->size()}); !written.ok()) return written;
    }
  }

  Result<api::DataReport> Place(const api::RestoreRequest& request,
                                const std::vector<KeptRecording>& came,
                                const std::vector<KeptRecording>& there,
                                const std::vector<api::ErasedPerson>& erased) {
    api::DataReport report;
    if (const Status saved = SaveErased(options_.data_dir, erased); !saved.ok()) {
      return saved.error();
    }
    if (request.mode == api::RestoreMode::kReplace) {
      for (const KeptRecording& recording : there) {
        if (const Status removed = Remove(recording); !removed.ok()) return removed.error();
      }
    }
    security::PersonHasher hasher;
    for (const KeptRecording& recording : came) {
      const bool gone =
          std::any_of(erased.begin(), erased.end(), [&](const api::ErasedPerson& person) {
            return !recording.person.empty() && recording.begin <= person.erased &&
                   hasher.Hash(person.salt, recording.person) == person.hash;
          });
      if (gone) {
        report.items.push_back(Item(recording, "left out", "its person was erased"));
        continue;
      }
      const fs::path place = options_.data_dir / recording.name;
      std::error_code error;
      fs::create_directories(place.parent_path(), error);
      // A link, unlike a renaming, never replaces what is there.
      fs::create_hard_link(recording.path, place, error);
      if (error == std::errc::file_exists) {
        report.items.push_back(Item(recording, "kept", "a recording of that name was there"));
        continue;
      }
      if (error) return Internal(place.string() + ": cannot be restored: " + error.message());
      report.items.push_back(Item(recording, "restored"));
    }
    if (const Status synced = SyncFolder(options_.data_dir); !synced.ok()) return synced.error();
    return report;
  }

  api::RecorderApi& recorder_;
  const Clock& clock_;
  Log& log_;
  const RecordingsOptions options_;
  std::mutex mutex_;
  std::string under_way_;  ///< empty: nothing
  std::jthread thread_;    ///< the last member: it uses the others
};

}  // namespace

Result<std::unique_ptr<Recordings>> Recordings::Create(api::RecorderApi& recorder,
                                                       const Clock& clock, Log& log,
                                                       const RecordingsOptions& options) {
  RecordingsOptions made = options;
  std::error_code error;
  made.data_dir = fs::absolute(options.data_dir, error).lexically_normal();
  fs::remove_all(made.data_dir / kGathering, error);
  return std::unique_ptr<Recordings>(std::make_unique<RecordingsImpl>(recorder, clock, log, made));
}

}  // namespace exemplar::recorder
