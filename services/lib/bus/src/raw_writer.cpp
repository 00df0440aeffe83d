#include <fastrtps/utils/md5.h>

#include <algorithm>
#include <utility>

#include "byte_endpoints.hpp"
#include "exemplar/ircp/sample_header.hpp"

namespace exemplar::bus {
namespace {

/// What a writer of a type that is not ours keeps for readers that are behind.
constexpr int kStrangersDepth = 2000;
/// For readers that are behind.
constexpr std::chrono::seconds kLongestWait{10};
constexpr std::string_view kOwnTypes = "exemplar::ircp::v1::";

/// The table's row for types of ours; what the topic says in any case.
TopicQos QosOfTopic(const ircp::RawTopic& topic) {
  TopicQos qos;
  qos.depth = kStrangersDepth;
  qos.max_instances = 1;
  qos.asynchronous = true;
  if (std::string_view(topic.type).starts_with(kOwnTypes)) {
    const std::string_view name = std::string_view(topic.type).substr(kOwnTypes.size());
    const std::span<const TopicQos> table = QosTable();
    const auto row = std::find_if(table.begin(), table.end(), [&](const TopicQos& candidate) {
      return candidate.type == name;
    });
    if (row != table.end()) qos = *row;
  }
  qos.reliable = topic.reliable;
  qos.transient_local = topic.transient_local;
  qos.keep_all = topic.reliable && !topic.transient_local;
  if (topic.keep_last > 0) {
    qos.depth = topic.keep_last;
    qos.keep_all = false;
  }
  qos.deadline = std::chrono::duration_cast<std::chrono::milliseconds>(topic.deadline);
  return qos;
}

class BytesWriter final : public ircp::RawWriter {
 public:
  BytesWriter(std::unique_ptr<ByteWriter> writer, std::optional<ircp::HeaderLayout> layout,
              bool reliable)
      : writer_(std::move(writer)), layout_(layout), reliable_(reliable) {}

  Status Write(std::span<const std::uint8_t> cdr, Stamp source_stamp) override {
    Bytes bytes;
    bytes.cdr.assign(cdr.begin(), cdr.end());
    bytes.source_stamp = source_stamp;
    // Where the keys are not known to us, all samples are one instance of this writer's history;
    // readers take the keys from the samples themselves.
    if (layout_) {
      if (const auto keys = ircp::ReadSampleKeys(cdr, *layout_)) {
        MD5 md5;
        md5.init();
        md5.update(keys->data(), static_cast<unsigned>(keys->size()));
        md5.finalize();
        std::copy(std::begin(md5.digest), std::end(md5.digest), bytes.key.begin());
      }
    }
    Status written = writer_->Write(bytes);
    if (written.ok() || !reliable_) return written;
    // Fast DDS 2.9 refuses the sample that fills a history; once the readers have it, there is
    // room.
    writer_->WaitForAcknowledgments(kLongestWait);
    return writer_->Write(bytes);
  }
  int matched_readers() const override { return writer_->matched_readers(); }
  bool WaitForAcknowledgments(Duration timeout) override {
    return writer_->WaitForAcknowledgments(timeout);
  }
  ircp::Guid guid() const override { return writer_->guid(); }

 private:
  const std::unique_ptr<ByteWriter> writer_;
  const std::optional<ircp::HeaderLayout> layout_;
  const bool reliable_;
};

}  // namespace

Result<std::unique_ptr<ircp::RawWriter>> OpenRawWriter(DdsStation& station,
                                                       const ircp::RawTopic& topic) {
  Result<std::unique_ptr<ByteWriter>> writer = station.MakeWriter(
      topic.topic, {.name = topic.type, .schema = topic.schema, .keyed = topic.keyed},
      QosOfTopic(topic));
  if (!writer.ok()) return writer.error();
  return std::unique_ptr<ircp::RawWriter>(std::make_unique<BytesWriter>(
      std::move(*writer), ircp::ReadHeaderLayout(topic.schema, topic.type), topic.reliable));
}

}  // namespace exemplar::bus
