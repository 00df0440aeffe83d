#pragma once
// The recorder's behaviour: topics in, MCAP files out.

#include <filesystem>
#include <functional>
#include <memory>

#include "exemplar/api/services.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/clock_relation.hpp"
#include "exemplar/recording/writer.hpp"

namespace exemplar::recorder {

struct RecorderOptions {
  std::filesystem::path data_dir;  ///< made when absent; one file NAME.mcap a recording
  std::string station;             ///< noted in the files
  /// Which topics are received at all.
  std::function<bool(const ircp::RawTopic&)> wanted = [](const ircp::RawTopic& topic) {
    return topic.topic.starts_with("ircp/");
  };
  /// Of these, topics that are not.
  std::vector<std::string> unwanted = {};
  /// Samples between network and disk may take this much; what comes beyond is dropped and counted.
  std::size_t queue_bytes = std::size_t{64} << 20;
  /// What came before an event and is kept for it: at least this long, as far as these bytes allow
  /// (half of queue_bytes at the most).
  Duration pre_buffer = std::chrono::seconds(10);
  std::size_t pre_buffer_bytes = std::size_t{32} << 20;
  /// A new file after this much, where a start says nothing else; 0: never.
  std::uint64_t split_bytes = 0;
  Duration split_length{0};
  /// Ready once each of these has a writer; every start waits for them as for its own.
  std::vector<std::string> expected_topics = {};
  /// Flattened IDL by type name, for writers that bring none.
  std::function<std::string(const std::string& type)> schema_of = [](const std::string&) {
    return std::string();
  };
  /// What was received reaches the disk, synced, after this long at the most.
  Duration flush_interval = std::chrono::milliseconds(100);
  /// Stop() waits this long at the most for what writers have announced but is still on its way.
  Duration settle_time = std::chrono::milliseconds(500);
  recording::WriterOptions file = {};
  /// How the programs' clocks stand to ours, for the files.
  std::function<std::vector<ircp::ClockRelation>()> clocks = [] {
    return std::vector<ircp::ClockRelation>();
  };
  /// Told of each change of state; may ask the recorder for its status and nothing else.
  std::function<void(const std::string& state, const std::string& detail)> on_change =
      [](const std::string&, const std::string&) {};
};

/// Decodes a sample of exemplar::ircp::v1::Status, which announces how much its writer has sent.
using StatusDecoder = std::function<Result<ircp::StatusSample>(std::span<const std::uint8_t> cdr)>;

/// Records all wanted topics of a station, each sample's bytes untouched. Thread-safe.
///
/// Callbacks of the network only count and queue; one thread of its own writes. A failing disk
/// stops the recording with what is written intact and a state that says why.
class Recorder : public api::RecorderApi {
 public:
  /// Fails when data_dir cannot be made or written. The ports must outlive the recorder.
  static Result<std::unique_ptr<Recorder>> Create(ircp::RawBus& bus, const Clock& clock, Log& log,
                                                  StatusDecoder decode_status,
                                                  RecorderOptions options);
  ~Recorder() override = default;
  /// Closes an open file; every command is refused from then on. The destructor does the same.
  virtual void Close() = 0;
};

/// Whether a text can be a file's name: letters, digits, '.', '_', '-', not beginning with a dot.
Status CheckRecordingName(const std::string& name);

}  // namespace exemplar::recorder
