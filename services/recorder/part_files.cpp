#include "recorder/part_files.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace exemplar::recorder {
namespace {

std::string FileName(const std::string& name, int part) {
  if (part == 0) return name + ".mcap";
  char number[16];
  std::snprintf(number, sizeof number, "_%04d", part);
  return name + number + ".mcap";
}

/// A later part must not meet a file that an older recording left.
Status CheckNoParts(const std::filesystem::path& folder, const std::string& name) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string file = entry.path().filename().string();
    if (!file.starts_with(name + '_') || !file.ends_with(".mcap")) continue;
    const std::string number = file.substr(name.size() + 1, file.size() - name.size() - 6);
    const bool all_digits =
        std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; });
    if (number.size() < 4 || !all_digits) continue;
    return Error{ErrorCode::kAlreadyExists, entry.path().string() + ": is there already", "name"};
  }
  return {};
}

}  // namespace

PartFiles::PartFiles(std::filesystem::path folder, RecordingInfo info, SplitLimits limits,
                     recording::WriterOptions options, const Clock& clock, Losses losses)
    : folder_(std::move(folder)),
      info_(std::move(info)),
      limits_(limits),
      options_(std::move(options)),
      clock_(clock),
      losses_(std::move(losses)) {}

Result<std::unique_ptr<PartFiles>> PartFiles::Create(const std::filesystem::path& folder,
                                                     RecordingInfo info, SplitLimits limits,
                                                     recording::WriterOptions options,
                                                     const Clock& clock, Losses losses) {
  if (limits.any()) {
    if (const Status free = CheckNoParts(folder, info.name); !free.ok()) return free.error();
    info.part = 1;
  }
  std::unique_ptr<PartFiles> files(
      new PartFiles(folder, std::move(info), limits, std::move(options), clock, std::move(losses)));
  if (const Status opened = files->OpenPart(); !opened.ok()) return opened.error();
  return files;
}

Status PartFiles::OpenPart() {
  const std::filesystem::path path = folder_ / FileName(info_.name, info_.part);
  Result<std::unique_ptr<recording::FileSink>> sink = recording::FileSink::Create(path);
  if (!sink.ok()) return sink.error();
  Result<std::unique_ptr<recording::FileScratch>> scratch = recording::FileScratch::Create(folder_);
  if (!scratch.ok()) return scratch.error();
  Result<std::unique_ptr<RecordingFile>> file =
      RecordingFile::Create(**sink, options_, info_, std::move(*scratch));
  if (!file.ok()) return file.error();
  file_ = std::move(*file);  // before the sink that the old one writes to
  sink_ = std::move(*sink);
  path_ = path;
  part_begun_ = clock_.Steady();
  return {};
}

Status PartFiles::SplitIfDue() {
  const bool due =
      file_->messages() > 0 &&
      ((limits_.bytes > 0 && file_->bytes() >= limits_.bytes) ||
       (limits_.length > Duration(0) && clock_.Steady() - part_begun_ >= limits_.length));
  if (!due) return {};
  const std::string next = FileName(info_.name, info_.part + 1);
  if (const Status s = file_->Finish(clock_.Now(), losses_(), {{"next_file", next}}); !s.ok()) {
    return s;
  }
  messages_before_ += file_->messages();
  bytes_before_ += file_->bytes();
  info_.previous_file = path_.filename().string();
  ++info_.part;
  return OpenPart();
}

Status PartFiles::Write(const ircp::RawTopic& topic, const std::string& source,
                        const ircp::RawSample& sample) {
  if (const Status split = SplitIfDue(); !split.ok()) return split;
  return file_->Write(topic, source, sample);
}

Status PartFiles::WriteLosses(const std::vector<WriterFigures>& losses) {
  return file_->WriteLosses(losses);
}

Status PartFiles::WriteMark(const std::string& name, recording::StringMap fields) {
  return file_->WriteMark(name, std::move(fields));
}

Status PartFiles::Flush() { return file_->Flush(); }

Status PartFiles::Finish(const std::vector<WriterFigures>& losses,
                         const recording::StringMap& more) {
  return file_->Finish(clock_.Now(), losses, more);
}

}  // namespace exemplar::recorder
