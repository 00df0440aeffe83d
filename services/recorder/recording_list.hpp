#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::recorder {

/// One MCAP file below a folder.
struct KeptRecording {
  std::filesystem::path path;
  std::string name;  ///< relative to the folder, with '/'
  std::uint64_t bytes = 0;
  std::string person;  ///< empty: unknown
  Stamp begin;         ///< of its messages; zero where the file does not say
  Stamp end;           ///< likewise; else when the file was last written
};

/// All of them, by name; what no MCAP reader takes has no person. A label that was being written
/// when its program was killed is completed first. Temporary folders (".NAME") are passed over.
Result<std::vector<KeptRecording>> ListRecordings(const std::filesystem::path& folder);

/// Of one file, as ListRecordings says it.
KeptRecording DescribeRecording(const std::filesystem::path& path, const std::string& name);

/// Whether `name` may be a path below the folder: each part as CheckRecordingName has it, ".mcap"
/// at its end.
Status CheckRecordingPath(const std::string& name);

}  // namespace exemplar::recorder
