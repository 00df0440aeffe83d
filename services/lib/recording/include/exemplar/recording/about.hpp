#pragma once
// What a recording says about itself in its metadata.

#include <string>

#include "exemplar/recording/records.hpp"

namespace exemplar::recording {

struct About {
  StringMap recording;  ///< "exemplar.recording": name, station, started, ...
  StringMap trial;      ///< "exemplar.trial": what the caller of the recorder said
  StringMap labels;     ///< "exemplar.labels": what was said afterwards
  bool closed = false;  ///< false: nobody ended the file; what stands before its messages counts
  Stamp begin;          ///< log times of the first and the last message; zero where the file
  Stamp end;            ///< does not say them

  /// Whose demonstration it is; empty: unknown.
  std::string person() const;
};

/// By the file's indexes where it has them; of records of one name the last counts. Errors: not
/// MCAP at all, bytes that cannot be read.
Result<About> ReadAbout(ByteSource& source);

}  // namespace exemplar::recording
