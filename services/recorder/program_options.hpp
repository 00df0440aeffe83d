#pragma once
#include <string>
#include <vector>

#include "exemplar/program/options.hpp"
#include "recorder/recorder.hpp"

namespace exemplar::recorder {

/// The recorder's own flags.
class ProgramOptions {
 public:
  void AddTo(program::Options& options);
  /// Fails when the schema folder cannot be read.
  Status Apply(RecorderOptions& settings) const;
  double keep_days() const { return keep_days_; }

 private:
  bool all_topics_ = false;
  double split_mb_ = 0;
  double split_s_ = 0;
  double flush_ms_ = 100;
  double pre_buffer_s_ = 10;
  double pre_buffer_mb_ = 32;
  std::vector<std::string> expected_;
  std::string schema_dir_;
  double keep_days_ = 0;
};

}  // namespace exemplar::recorder
