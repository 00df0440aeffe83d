#pragma once
// Recordings for the tests, made from a seed.

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/recording/reader.hpp"
#include "exemplar/recording/writer.hpp"

namespace exemplar::recording {

struct SampleRecording {
  std::vector<Message> messages;  ///< in file order
  Bytes file;
};

inline Bytes RandomBytes(Rng& rng, std::size_t size) {
  Bytes bytes(size);
  // Few values, so that compression has something to do.
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(rng.Below(7));
  return bytes;
}

/// Three channels of two schemas (the third channel has none), `count` messages whose log times
/// go back a little now and then, one attachment and two metadata records.
inline SampleRecording MakeRecording(Rng& rng, int count, WriterOptions options,
                                     bool closed = true) {
  SampleRecording sample;
  MemorySink sink;
  Result<std::unique_ptr<Writer>> writer = Writer::Create(sink, options);
  EXPECT_TRUE(writer.ok());
  Writer& out = **writer;
  EXPECT_TRUE(out.AddSchema({1, "exemplar::Suit", "omgidl", RandomBytes(rng, 40)}).ok());
  EXPECT_TRUE(out.AddSchema({2, "exemplar::Tactile", "omgidl", RandomBytes(rng, 30)}).ok());
  EXPECT_TRUE(out.AddChannel({1, 1, "ircp/suit", "cdr", {{"writer", "a"}}}).ok());
  EXPECT_TRUE(out.AddChannel({2, 2, "ircp/tactile", "cdr", {}}).ok());
  EXPECT_TRUE(out.AddChannel({3, 0, "other", "cdr", {}}).ok());
  EXPECT_TRUE(out.Write(Metadata{"trial", {{"operator", "Ann"}, {"skill", "press"}}}).ok());
  std::int64_t now = 1'700'000'000'000'000'000;
  for (int i = 0; i < count; ++i) {
    now += static_cast<std::int64_t>(rng.Below(1'000'000));
    Message message;
    message.channel_id = static_cast<std::uint16_t>(1 + rng.Below(3));
    message.sequence = static_cast<std::uint32_t>(i);
    message.log_time = Stamp::FromNanoseconds(now - static_cast<std::int64_t>(rng.Below(300'000)));
    message.publish_time = Stamp::FromNanoseconds(now - 500'000);
    message.data = RandomBytes(rng, rng.Below(120));
    EXPECT_TRUE(out.Write(message).ok());
    sample.messages.push_back(std::move(message));
  }
  EXPECT_TRUE(out.Write(Attachment{Stamp(), Stamp(), "note.txt", "text/plain", {1, 2, 3}}).ok());
  EXPECT_TRUE(out.Write(Metadata{"losses", {{"ircp/suit", "0"}}}).ok());
  EXPECT_TRUE((closed ? out.Close() : out.Flush()).ok());
  sample.file = sink.bytes();
  return sample;
}

/// Everything up to the footer, or the error that came first.
inline Result<std::vector<Record>> ReadAll(ByteView file, ReaderOptions options = {}) {
  MemorySource source(file);
  Result<std::unique_ptr<StreamReader>> reader = StreamReader::Create(source, options);
  if (!reader.ok()) return reader.error();
  std::vector<Record> records;
  while (true) {
    Result<std::optional<Record>> record = (*reader)->Next();
    if (!record.ok()) return record.error();
    if (!record->has_value()) return records;
    records.push_back(std::move(**record));
  }
}

template <class Kind>
std::vector<Kind> Only(const std::vector<Record>& records) {
  std::vector<Kind> found;
  for (const Record& record : records) {
    if (const Kind* kind = std::get_if<Kind>(&record)) found.push_back(*kind);
  }
  return found;
}

}  // namespace exemplar::recording
