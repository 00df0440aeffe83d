#pragma once
#include <filesystem>
#include <memory>

#include "exemplar/api/data.hpp"
#include "exemplar/api/services.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"

namespace exemplar::recorder {

struct RecordingsOptions {
  std::filesystem::path data_dir;  ///< the recorder's; folders within belong to it as well
  /// Recordings that ended so long ago go by themselves; 0: never. Those in folders within stay.
  double keep_days = 0;
};

/// What operators do with the files that a recorder has written: persons, erasure, retention,
/// backup. A recording that is being written is left alone. Where retention is set, a thread of its
/// own applies it at once and every hour. Thread-safe.
class Recordings : public api::DataApi {
 public:
  /// Clears away what a restoring that broke off has left. All must outlive this.
  static Result<std::unique_ptr<Recordings>> Create(api::RecorderApi& recorder, const Clock& clock,
                                                    Log& log, const RecordingsOptions& options);
};

}  // namespace exemplar::recorder
