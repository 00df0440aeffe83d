#pragma once
// Trial files of either format as values, and what is said about a trial.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/demonstration/trial.hpp"

namespace exemplar::learning_service {

/// Reads a trial from the bytes of an MCAP recording; `source` names it in errors.
using McapTrialReader =
    std::function<Result<demonstration::Trial>(std::string_view bytes, std::string_view source)>;

/// CSV or MCAP: told by the content, which the name's ending may not contradict. The error's field
/// is "file".
Result<demonstration::Trial> ReadTrialFile(std::string_view name, std::string_view bytes,
                                           const McapTrialReader& read_mcap);

/// The person whom an MCAP recording names in its metadata ("exemplar.labels", the last one, before
/// "exemplar.trial": "person"); empty where it names none or is no MCAP file.
std::string PersonOfFile(std::string_view bytes);

/// The same for trials that SameContent holds equal, other for others but for chance.
std::string TrialFingerprint(const demonstration::Trial& trial);

/// "joints (9)", "end effector", "object target", ...
std::vector<std::string> StreamNames(const demonstration::Trial& trial);
/// Of the densest stream.
std::uint64_t SampleCount(const demonstration::Trial& trial);

}  // namespace exemplar::learning_service
