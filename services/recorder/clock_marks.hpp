#pragma once
#include <functional>
#include <vector>

#include "exemplar/ircp/clock_relation.hpp"
#include "recorder/part_files.hpp"

namespace exemplar::recorder {

/// Writes how the programs' clocks stand to the recorder's into its files: "exemplar.clock", one a
/// program, soon after a file's beginning, at growing intervals up to a minute, and at its end.
/// Thread-compatible.
class ClockMarks {
 public:
  using Clocks = std::function<std::vector<ircp::ClockRelation>()>;
  /// What is added to the recorder's wall clock to make log times of it.
  using Correction = std::function<Duration()>;
  ClockMarks(Clocks clocks, Correction correction)
      : clocks_(std::move(clocks)), correction_(std::move(correction)) {}

  /// A recording begins.
  void Reset();
  Status WriteIfDue(PartFiles& file, Duration steady_now);
  Status Write(PartFiles& file);

 private:
  const Clocks clocks_;
  const Correction correction_;
  int part_ = -1;  ///< that the last marks went into
  Duration next_{0};
  Duration interval_{0};
};

}  // namespace exemplar::recorder
