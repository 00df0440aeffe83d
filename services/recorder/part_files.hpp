#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/recording/file.hpp"
#include "recorder/recording_file.hpp"

namespace exemplar::recorder {

/// When the next file begins; 0 is never.
struct SplitLimits {
  std::uint64_t bytes = 0;
  Duration length{0};
  bool any() const { return bytes > 0 || length > Duration(0); }
};

/// The files of one recording: NAME.mcap, or NAME_0001.mcap, NAME_0002.mcap, ... where it is split.
/// Each sample stands in exactly one of them. Thread-compatible.
class PartFiles {
 public:
  using Losses = std::function<std::vector<WriterFigures>()>;
  /// kAlreadyExists where a file of this name, or a part of one, is there. `losses` are asked when
  /// a part ends; the clock must outlive this.
  static Result<std::unique_ptr<PartFiles>> Create(const std::filesystem::path& folder,
                                                   RecordingInfo info, SplitLimits limits,
                                                   recording::WriterOptions options,
                                                   const Clock& clock, Losses losses);

  Status Write(const ircp::RawTopic& topic, const std::string& source,
               const ircp::RawSample& sample);
  Status WriteLosses(const std::vector<WriterFigures>& losses);
  Status WriteMark(const std::string& name, recording::StringMap fields);
  Status Flush();
  Status Finish(const std::vector<WriterFigures>& losses, const recording::StringMap& more);

  const std::filesystem::path& path() const { return path_; }
  int part() const { return info_.part; }
  /// Of all parts.
  std::uint64_t messages() const { return messages_before_ + file_->messages(); }
  std::uint64_t bytes() const { return bytes_before_ + file_->bytes(); }

 private:
  PartFiles(std::filesystem::path folder, RecordingInfo info, SplitLimits limits,
            recording::WriterOptions options, const Clock& clock, Losses losses);
  Status OpenPart();
  Status SplitIfDue();

  const std::filesystem::path folder_;
  RecordingInfo info_;
  const SplitLimits limits_;
  const recording::WriterOptions options_;
  const Clock& clock_;
  const Losses losses_;
  std::filesystem::path path_;
  std::unique_ptr<recording::FileSink> sink_;
  std::unique_ptr<RecordingFile> file_;
  Duration part_begun_{0};
  std::uint64_t messages_before_ = 0;
  std::uint64_t bytes_before_ = 0;
};

}  // namespace exemplar::recorder
