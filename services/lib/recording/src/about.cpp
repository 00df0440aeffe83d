#include "exemplar/recording/about.hpp"

#include <utility>

#include "exemplar/recording/reader.hpp"

namespace exemplar::recording {
namespace {

void Take(Metadata metadata, About& about) {
  if (metadata.name == "exemplar.recording") about.recording = std::move(metadata.metadata);
  if (metadata.name == "exemplar.trial") about.trial = std::move(metadata.metadata);
  if (metadata.name == "exemplar.labels") about.labels = std::move(metadata.metadata);
}

/// Record by record, to the end or the first damage. `head_only`: to the first message.
Result<About> Scan(ByteSource& source, bool head_only) {
  Result<std::unique_ptr<StreamReader>> reader =
      StreamReader::Create(source, {.expanded_chunks = false, .check_crcs = false});
  if (!reader) return reader.error();
  About about;
  for (;;) {
    Result<std::optional<Record>> record = (*reader)->Next();
    if (!record) return about;
    if (!*record) {
      about.closed = true;
      return about;
    }
    const bool messages =
        std::holds_alternative<Chunk>(**record) || std::holds_alternative<Message>(**record);
    if (messages && head_only) return about;
    if (auto* metadata = std::get_if<Metadata>(&**record)) Take(std::move(*metadata), about);
  }
}

}  // namespace

std::string About::person() const {
  for (const StringMap* map : {&labels, &trial}) {
    const auto found = map->find("person");
    if (found != map->end()) return found->second;
  }
  return {};
}

Result<About> ReadAbout(ByteSource& source) {
  const Result<std::unique_ptr<IndexedReader>> reader = IndexedReader::Open(source);
  if (!reader) return Scan(source, true);
  const std::optional<Statistics>& statistics = (*reader)->statistics();
  const bool indexed = statistics && statistics->metadata_count == (*reader)->metadata().size();
  if (!indexed) return Scan(source, false);
  About about;
  about.closed = true;
  about.begin = statistics->message_start_time;
  about.end = statistics->message_end_time;
  for (const MetadataIndex& index : (*reader)->metadata()) {
    if (index.name != "exemplar.recording" && index.name != "exemplar.trial" &&
        index.name != "exemplar.labels") {
      continue;
    }
    Result<Metadata> metadata = (*reader)->ReadMetadata(index);
    if (!metadata) return Scan(source, false);
    Take(*std::move(metadata), about);
  }
  return about;
}

}  // namespace exemplar::recording
