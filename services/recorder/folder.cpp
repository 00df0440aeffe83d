#include "recorder/folder.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "recorder/recorder.hpp"

namespace exemplar::recorder {
namespace {

constexpr std::size_t kLongestName = 200;

}  // namespace

std::string NameFromTime(Stamp stamp) {
  std::string name;
  for (const char c : ToIso8601(stamp)) {
    if (c != '-' && c != ':') name += c;
  }
  return name;
}

Status MakeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return InvalidArgument(folder.string() + ": cannot be made: " + error.message(), "data_dir");
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    return FailedPrecondition(folder.string() + ": cannot be written: " + std::strerror(errno),
                              "data_dir");
  }
  return {};
}

Status CheckRecordingName(const std::string& name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  if (name.empty() || name.front() == '.' || name.size() > kLongestName ||
      !std::all_of(name.begin(), name.end(), allowed)) {
    return InvalidArgument(
        "name \"" + name.substr(0, kLongestName) +
            "\" cannot name a file: letters, digits, '.', '_' and '-', at most " +
            std::to_string(kLongestName) + ", not beginning with a dot",
        "name");
  }
  return {};
}

}  // namespace exemplar::recorder
