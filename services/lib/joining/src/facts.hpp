#pragma once
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/ircp/clock_relation.hpp"
#include "exemplar/joining/join.hpp"

namespace exemplar::joining {

/// What a recording says of itself.
struct Facts {
  std::string name;
  std::unique_ptr<recording::IndexedReader> reader;
  recording::StringMap recording;  ///< "exemplar.recording"
  recording::StringMap trial;
  recording::StringMap labels;
  /// By topic and writer; the last of each counts.
  std::map<std::pair<std::string, std::string>, recording::StringMap> losses;
  std::map<std::string, ircp::ClockTrack> clocks;  ///< by participant
  std::string observer;                            ///< the recorder's participant, where known
  std::vector<recording::Metadata> others;
};

Result<Facts> ReadFacts(const Input& input);

/// The field, or an empty text.
std::string FieldOf(const recording::StringMap& fields, const std::string& name);
/// The field as a count; 0 where it is none.
std::uint64_t CountOf(const recording::StringMap& fields, const std::string& name);

}  // namespace exemplar::joining
