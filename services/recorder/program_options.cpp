#include "recorder/program_options.hpp"

#include <algorithm>
#include <utility>

#include "recorder/schema_folder.hpp"

namespace exemplar::recorder {

void ProgramOptions::AddTo(program::Options& options) {
  options.Add("--all-topics", all_topics_, "record every topic, not only those under ircp/")
      .Add("--split-mb", split_mb_, "a new file after so many megabytes; 0: never")
      .MinMax(0, 1e9)
      .Add("--split-s", split_s_, "a new file after so many seconds; 0: never")
      .MinMax(0, 1e6)
      .Add("--flush-ms", flush_ms_, "what was received is on the disk after so many milliseconds")
      .MinMax(2, 1e4)
      .Add("--pre-buffer-s", pre_buffer_s_, "seconds that an event keeps from before it")
      .MinMax(0, 3600)
      .Add("--pre-buffer-mb", pre_buffer_mb_, "megabytes that they may take")
      .MinMax(0, 1e4)
      .Add("--expect", expected_, "ready once this topic has a writer; several times")
      .Add("--schema-dir", schema_dir_, "IDL files, for topics whose writers bring no schema")
      .Add("--keep-days", keep_days_, "recordings go so many days after their end; 0: never")
      .MinMax(0, 1e5);
}

Status ProgramOptions::Apply(RecorderOptions& settings) const {
  constexpr double kMega = 1e6;
  settings.split_bytes = static_cast<std::uint64_t>(split_mb_ * kMega);
  settings.flush_interval = FromSeconds(1e-3 * flush_ms_);
  settings.split_length = FromSeconds(split_s_);
  settings.pre_buffer = FromSeconds(pre_buffer_s_);
  settings.pre_buffer_bytes = static_cast<std::size_t>(pre_buffer_mb_ * kMega);
  settings.queue_bytes = std::max(settings.queue_bytes, 2 * settings.pre_buffer_bytes);
  settings.expected_topics = expected_;
  if (all_topics_) settings.wanted = [](const ircp::RawTopic&) { return true; };
  if (schema_dir_.empty()) return {};
  auto schemas = ReadSchemaFolder(schema_dir_);
  if (!schemas.ok()) return schemas.error();
  settings.schema_of = [known = std::move(*schemas)](const std::string& type) {
    const auto found = known.find(type);
    return found == known.end() ? std::string() : found->second;
  };
  return {};
}

}  // namespace exemplar::recorder
