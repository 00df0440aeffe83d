#pragma once
// Recordings that several recorders made of one trial, as one file on one time base.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/recording/reader.hpp"
#include "exemplar/recording/writer.hpp"

namespace exemplar::joining {

struct Input {
  std::string name;  ///< in errors and in the joined file
  recording::ByteSource* source = nullptr;
};

struct JoinOptions {
  /// Files between whose clocks nothing was measured are taken as recorded by one clock, instead of
  /// being refused.
  bool same_clock = false;
  recording::WriterOptions file = {};
};

/// What became of one input.
struct JoinedFile {
  std::string name;
  Duration offset{0};  ///< its clock minus the first file's, at its first message
  double drift = 0;    ///< seconds a second, by which the offset grew over the file
  Duration uncertainty{0};
  /// Whose clock relates it to the first file's: a program's name, or "the same clock".
  std::string through;
  std::uint64_t messages = 0;  ///< of it in the joined file
  std::uint64_t repeated = 0;  ///< that another file had, too
};

struct JoinReport {
  std::vector<JoinedFile> files;
  std::uint64_t messages = 0;
  std::uint64_t lost = 0;  ///< in none of the files
  std::vector<std::string> notices;
};

/// Log times become the first file's clock; messages' bytes, publish times and sequences stay as
/// they are, and "exemplar.clock" says how every program's clock stands to the first recorder's. A
/// sample that several recorders received (same writer, same number) stands once, at its earliest
/// time. Losses count what no recorder received between the first and the last sample that any did.
/// Metadata and labels are merged, the first file's values first; where another one differs, it is
/// kept as "NAME (FILE)" with a notice. "exemplar.joined" describes each input. Works through a
/// second at a time: memory does not grow with the files.
///
/// Errors name file and place: not MCAP, damaged, never closed, of another station, or no measured
/// relation between clocks (see JoinOptions::same_clock).
Result<JoinReport> Join(std::span<const Input> inputs, recording::ByteSink& out,
                        const JoinOptions& options = {});

}  // namespace exemplar::joining
