#pragma once
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "exemplar/ircp/bus.hpp"
#include "exemplar/recording/writer.hpp"
#include "recorder/loss_ledger.hpp"

namespace exemplar::recorder {

/// What stands in the file's "exemplar.recording" metadata.
struct RecordingInfo {
  std::string name;
  std::string station;
  Stamp started;
  std::map<std::string, std::string> metadata;  ///< the caller's: operator, skill, notes, ...
  int part = 0;                                 ///< of a recording that is split, from 1; else 0
  std::string previous_file;                    ///< of the part before, without folder
};

/// One recording as MCAP: a channel for each writer of a topic (its metadata names writer, source,
/// type and quality of service, as a replay needs them), schemas as flattened IDL ("omgidl"),
/// messages as "cdr"; log time is reception, publish time the source's stamp, sequence the low 32
/// bits of the protocol's number. Metadata records:
///   exemplar.recording   name, station, times; of a part its number and its neighbours' files
///   exemplar.trial       the caller's
///   exemplar.losses      one a writer and topic: received, lost by cause, since the recording (not
///                        the part) began; again whenever they grew, so the last of a writer counts
///   exemplar.clock       one a program: how its clock stands to ours, now and then
///   exemplar.pause, exemplar.resume, exemplar.event   when, and what came with it
/// Thread-compatible.
class RecordingFile {
 public:
  /// The sink must outlive the file. `scratch`: as recording::Writer takes it.
  static Result<std::unique_ptr<RecordingFile>> Create(
      recording::ByteSink& sink, recording::WriterOptions options, const RecordingInfo& info,
      std::unique_ptr<recording::ByteScratch> scratch);

  /// `topic` as discovery knows it; without schema the message is written without one.
  Status Write(const ircp::RawTopic& topic, const std::string& source,
               const ircp::RawSample& sample);
  Status WriteLosses(const std::vector<WriterFigures>& losses);
  Status WriteMark(const std::string& name, recording::StringMap fields);
  /// Everything so far survives a kill when it returns.
  Status Flush();
  /// `more` goes into "exemplar.recording".
  Status Finish(Stamp stopped, const std::vector<WriterFigures>& losses,
                const recording::StringMap& more = {});

  std::uint64_t messages() const { return writer_->statistics().message_count; }
  std::uint64_t bytes() const { return writer_->bytes_written(); }

 private:
  RecordingFile(std::unique_ptr<recording::Writer> writer, RecordingInfo info)
      : writer_(std::move(writer)), info_(std::move(info)) {}
  Result<std::uint16_t> ChannelOf(const ircp::RawTopic& topic, const std::string& source,
                                  const ircp::RawSample& sample);
  Result<std::uint16_t> SchemaOf(const ircp::RawTopic& topic);

  std::unique_ptr<recording::Writer> writer_;
  RecordingInfo info_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> schemas_;  ///< by type and text
  struct ChannelOfTopic {
    std::string topic;
    std::uint16_t id = 0;
  };
  std::unordered_map<std::string, std::vector<ChannelOfTopic>> channels_;  ///< by writer
  std::uint16_t next_channel_ = 1;
  bool unsynced_ = false;
};

}  // namespace exemplar::recorder
