#pragma once
// A check of XML that is small and strict enough for what the library writes.

#include <string>
#include <string_view>
#include <vector>

namespace exemplar::figures {

/// Empty, or what is wrong: tags that do not nest, attributes without quotes, bare ampersands,
/// numbers that are none.
inline std::string WrongIn(std::string_view xml) {
  std::vector<std::string> open;
  std::size_t at = 0;
  while (at < xml.size()) {
    if (xml[at] == '&') {
      const std::size_t end = xml.find(';', at);
      const std::string_view name =
          end == std::string_view::npos ? std::string_view() : xml.substr(at + 1, end - at - 1);
      if (name != "amp" && name != "lt" && name != "gt" && name != "quot") return "a bare &";
    }
    if (xml[at] == '>') return "a bare >";
    if (xml[at] != '<') {
      ++at;
      continue;
    }
    const std::size_t end = xml.find('>', at);
    if (end == std::string_view::npos) return "a tag without end";
    const std::string_view tag = xml.substr(at + 1, end - at - 1);
    at = end + 1;
    std::size_t quotes = 0;
    for (const char c : tag) quotes += c == '"';
    if (quotes % 2 != 0 || tag.find('<') != std::string_view::npos) {
      return "quotes of " + std::string(tag);
    }
    if (tag.find("nan") != std::string_view::npos || tag.find("inf") != std::string_view::npos) {
      return "a number in " + std::string(tag);
    }
    const std::string name(tag.substr(0, tag.find_first_of(" /", 1)));
    if (tag.starts_with('/')) {
      if (open.empty() || "/" + open.back() != tag) return "the end tag " + std::string(tag);
      open.pop_back();
    } else if (!tag.ends_with('/')) {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "no end of " + open.back();
}

}  // namespace exemplar::figures
