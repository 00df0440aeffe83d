#pragma once
#include <string_view>

#include "exemplar/base/result.hpp"
#include "exemplar/demonstration/trial.hpp"

namespace exemplar::bus {

/// Makes a trial of an MCAP recording of the ircp topics (see ircp/trial_builder.hpp). `bytes` is
/// the whole file, `source` names it in errors and in the trial.
///
/// Where the recorder measured that a program's clock differs from its own, the program's stamps
/// are brought onto the recorder's clock, and a notice says so.
/// Samples that stand twice (same writer and number) count once. Notices say what was lost on each
/// topic ("ircp/suit: 3 samples lost"), and which topics are not ours and were left alone.
/// Errors: not MCAP, damaged or never closed (`exemplar record recover` helps), a sample that is
/// not of its topic's type (with channel and place), neither joints nor tool poses.
Result<demonstration::Trial> ReadTrialFromMcap(std::string_view bytes, std::string_view source);

}  // namespace exemplar::bus
