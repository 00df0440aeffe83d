// Any bytes go through the three readers of MCAP files. What can be recovered is a whole file.

#include <cstdlib>

#include "exemplar/recording/reader.hpp"
#include "exemplar/recording/recover.hpp"

namespace exemplar::recording {
namespace {

constexpr std::uint64_t kLargestRecord = 1u << 20;

void Require(bool condition) {
  if (!condition) std::abort();
}

void ReadStreamed(ByteView file, bool check_crcs, bool must_be_whole) {
  MemorySource source(file);
  ReaderOptions options;
  options.message_indexes = true;
  options.check_crcs = check_crcs;
  if (!must_be_whole) options.largest_record_bytes = kLargestRecord;
  const Result<std::unique_ptr<StreamReader>> reader = StreamReader::Create(source, options);
  Require(reader.ok() || !must_be_whole);
  if (!reader.ok()) return;
  while (true) {
    const Result<std::optional<Record>> record = (*reader)->Next();
    Require(record.ok() || !must_be_whole);
    if (!record.ok() || !record->has_value()) return;
  }
}

void ReadIndexed(ByteView file) {
  MemorySource source(file);
  ReaderOptions options;
  options.check_crcs = false;
  options.largest_record_bytes = kLargestRecord;
  const Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source, options);
  if (!reader.ok()) return;
  (void)(*reader)->ReadMessages({}, [](const Message&) { return true; });
  (void)(*reader)->ReadDataEnd();
  for (const AttachmentIndex& index : (*reader)->attachments()) {
    (void)(*reader)->ReadAttachment(index);
  }
  for (const MetadataIndex& index : (*reader)->metadata()) (void)(*reader)->ReadMetadata(index);
}

}  // namespace
}  // namespace exemplar::recording

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace exemplar::recording;
  const ByteView file(data, size);
  ReadStreamed(file, true, false);
  ReadStreamed(file, false, false);
  ReadIndexed(file);
  MemorySource source(file);
  MemorySink sink;
  if (Recover(source, sink).ok()) ReadStreamed(sink.bytes(), true, true);
  return 0;
}
