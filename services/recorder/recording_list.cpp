#include "recorder/recording_list.hpp"

#include <algorithm>
#include <chrono>

#include "exemplar/base/text.hpp"
#include "exemplar/recording/about.hpp"
#include "exemplar/recording/append.hpp"
#include "exemplar/recording/file.hpp"
#include "recorder/recorder.hpp"

namespace exemplar::recorder {
namespace {

constexpr const char* kEnding = ".mcap";

Stamp WrittenAt(const std::filesystem::path& path) {
  std::error_code error;
  const auto written = std::filesystem::last_write_time(path, error);
  if (error) return {};
  const auto wall = std::chrono::file_clock::to_sys(written).time_since_epoch();
  return Stamp::FromNanoseconds(std::chrono::duration_cast<std::chrono::nanoseconds>(wall).count());
}

}  // namespace

KeptRecording DescribeRecording(const std::filesystem::path& path, const std::string& name) {
  KeptRecording recording;
  recording.path = path;
  recording.name = name;
  recording.end = WrittenAt(path);
  // One that cannot be completed is judged as it stands.
  static_cast<void>(recording::FinishAppend(path));
  const auto source = recording::FileSource::Open(path);
  if (!source.ok()) return recording;
  recording.bytes = (*source)->size();
  const Result<recording::About> about = recording::ReadAbout(**source);
  if (!about.ok()) return recording;
  recording.person = about->person();
  recording.begin = about->begin;
  if (about->end != Stamp()) recording.end = about->end;
  return recording;
}

Result<std::vector<KeptRecording>> ListRecordings(const std::filesystem::path& folder) {
  using Iterator = std::filesystem::recursive_directory_iterator;
  std::error_code error;
  std::vector<KeptRecording> recordings;
  for (Iterator entry(folder, error); !error && entry != Iterator(); entry.increment(error)) {
    const std::string file = entry->path().filename().string();
    std::error_code unknown;
    if (entry->is_directory(unknown)) {
      if (file.starts_with('.')) entry.disable_recursion_pending();
      continue;
    }
    if (!file.ends_with(kEnding) || !entry->is_regular_file(unknown)) continue;
    recordings.push_back(DescribeRecording(
        entry->path(), entry->path().lexically_relative(folder).generic_string()));
  }
  if (error) return Internal(folder.string() + ": cannot be listed: " + error.message());
  std::sort(recordings.begin(), recordings.end(),
            [](const KeptRecording& a, const KeptRecording& b) { return a.name < b.name; });
  return recordings;
}

Status CheckRecordingPath(const std::string& name) {
  const auto parts = Split(name, '/');
  const bool named = std::all_of(parts.begin(), parts.end(), [](std::string_view part) {
    return CheckRecordingName(std::string(part)).ok();
  });
  if (named && name.ends_with(kEnding)) return {};
  return InvalidArgument("the part \"" + name.substr(0, 200) + "\" is no recording of a backup",
                         "begin.name");
}

}  // namespace exemplar::recorder
