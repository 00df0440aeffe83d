#include "sent_counts.hpp"

#include <charconv>

namespace exemplar::ircp {

std::string CountsToText(const std::vector<TopicCount>& counts) {
  std::string text;
  for (const TopicCount& count : counts) {
    if (!text.empty()) text += '\n';
    text += count.topic + ' ' + count.source + ' ' + std::to_string(count.sent);
  }
  return text;
}

std::vector<TopicCount> CountsFromText(std::string_view text) {
  std::vector<TopicCount> counts;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    const std::size_t first = line.find(' ');  // no topic has a space, a source may
    const std::size_t last = line.rfind(' ');
    if (first == std::string_view::npos || first == last) continue;
    TopicCount count;
    const char* const begin = line.data() + last + 1;
    const char* const stop = line.data() + line.size();
    const auto [parsed, error] = std::from_chars(begin, stop, count.sent);
    if (error != std::errc() || parsed != stop) continue;
    count.topic = line.substr(0, first);
    count.source = line.substr(first + 1, last - first - 1);
    counts.push_back(std::move(count));
  }
  return counts;
}

std::uint64_t CountOf(const std::vector<TopicCount>& counts, std::string_view topic,
                      std::string_view source) {
  for (const TopicCount& count : counts) {
    if (count.topic == topic && count.source == source) return count.sent;
  }
  return 0;
}

}  // namespace exemplar::ircp
