#include "shared_writers.hpp"

#include <algorithm>
#include <iterator>
#include <set>

namespace exemplar::joining {
namespace {

std::string WriterOf(const recording::Channel& channel) {
  return FieldOf(channel.metadata, "writer");
}

}  // namespace

bool NumberSet::Insert(std::uint64_t number) {
  auto after = intervals_.upper_bound(number);
  const auto before = after == intervals_.begin() ? intervals_.end() : std::prev(after);
  if (before != intervals_.end() && number <= before->second) return false;
  const bool joins_before = before != intervals_.end() && before->second + 1 == number;
  const bool joins_after = after != intervals_.end() && number + 1 == after->first;
  std::uint64_t last = number;
  if (joins_after) {
    last = after->second;
    intervals_.erase(after);
  }
  if (joins_before) {
    before->second = last;
  } else {
    intervals_.emplace(number, last);
  }
  ++size_;
  return true;
}

std::uint64_t NumberSet::MissingBetween(std::uint64_t first, std::uint64_t last) const {
  std::uint64_t missing = last - first + 1;
  for (const auto& [begin, end] : intervals_) {
    const std::uint64_t low = std::max(begin, first);
    const std::uint64_t high = std::min(end, last);
    if (low <= high) missing -= high - low + 1;
  }
  return missing;
}

SharedWriters::SharedWriters(const std::vector<Facts>& files) : files_(files) {
  std::set<Writer> met;
  for (const Facts& file : files) {
    std::set<Writer> of_file;
    for (const auto& [id, channel] : file.reader->channels()) {
      if (!WriterOf(channel).empty()) of_file.insert({channel.topic, WriterOf(channel)});
    }
    for (const Writer& writer : of_file) {
      if (!met.insert(writer).second) shared_.try_emplace(writer);
    }
  }
}

bool SharedWriters::Take(std::size_t file, const Writer& writer, std::uint64_t number) {
  const auto found = shared_.find(writer);
  if (found == shared_.end()) return true;
  const auto [range, first] = found->second.ranges.try_emplace(file, number, number);
  if (!first) {
    range->second.first = std::min(range->second.first, number);
    range->second.second = std::max(range->second.second, number);
  }
  return found->second.numbers.Insert(number);
}

std::vector<recording::StringMap> SharedWriters::Losses() const {
  std::map<Writer, recording::StringMap> all;
  std::map<Writer, std::uint64_t> announced;
  for (const Facts& file : files_) {
    for (const auto& [writer, fields] : file.losses) {
      all.try_emplace(writer, fields);
      announced[writer] = std::max(announced[writer], CountOf(fields, "announced"));
    }
  }
  for (const auto& [writer, heard] : shared_) {
    std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
    for (const auto& [file, range] : heard.ranges) ranges.push_back(range);
    if (ranges.empty()) continue;
    std::sort(ranges.begin(), ranges.end());
    std::uint64_t missing = 0;
    std::pair<std::uint64_t, std::uint64_t> covered = ranges.front();
    for (const auto& range : ranges) {
      if (range.first > covered.second) {  // nobody recorded in between
        missing += heard.numbers.MissingBetween(covered.first, covered.second);
        covered = range;
      }
      covered.second = std::max(covered.second, range.second);
    }
    missing += heard.numbers.MissingBetween(covered.first, covered.second);
    const std::uint64_t last = covered.second;
    recording::StringMap& fields = all[writer];
    fields["topic"] = writer.first;
    fields["writer"] = writer.second;
    fields["received"] = std::to_string(heard.numbers.size());
    fields["lost_in_gaps"] = std::to_string(missing);
    fields["lost_at_end"] = std::to_string(announced[writer] > last ? announced[writer] - last : 0);
    fields["dropped_by_recorder"] = "0";
    fields["last"] = std::to_string(last);
    if (announced[writer] > 0) fields["announced"] = std::to_string(announced[writer]);
  }
  std::vector<recording::StringMap> losses;
  for (auto& entry : all) losses.push_back(std::move(entry.second));
  return losses;
}

}  // namespace exemplar::joining
