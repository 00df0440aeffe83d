#include "facts.hpp"

#include <optional>

#include "exemplar/base/text.hpp"

namespace exemplar::joining {
namespace {

Status TakeMetadata(recording::Metadata metadata, Facts& facts) {
  if (metadata.name == "exemplar.recording") {
    facts.recording = std::move(metadata.metadata);
  } else if (metadata.name == "exemplar.trial") {
    facts.trial = std::move(metadata.metadata);
  } else if (metadata.name == "exemplar.labels") {
    facts.labels = std::move(metadata.metadata);
  } else if (metadata.name == "exemplar.losses") {
    const std::pair who{FieldOf(metadata.metadata, "topic"), FieldOf(metadata.metadata, "writer")};
    facts.losses[who] = std::move(metadata.metadata);
  } else if (metadata.name == "exemplar.clock") {
    Result<ircp::ClockRelation> relation = ircp::ClockRelationFromFields(metadata.metadata);
    if (!relation.ok()) return WithPlace(relation.error(), "metadata exemplar.clock");
    facts.observer = relation->observer;
    facts.clocks[relation->participant].Add(std::move(*relation));
  } else {
    facts.others.push_back(std::move(metadata));
  }
  return {};
}

}  // namespace

std::string FieldOf(const recording::StringMap& fields, const std::string& name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string() : found->second;
}

std::uint64_t CountOf(const recording::StringMap& fields, const std::string& name) {
  const std::optional<long long> count = ParseInteger(FieldOf(fields, name));
  return count && *count > 0 ? static_cast<std::uint64_t>(*count) : 0;
}

Result<Facts> ReadFacts(const Input& input) {
  Facts facts;
  facts.name = input.name;
  Result<std::unique_ptr<recording::IndexedReader>> opened =
      recording::IndexedReader::Open(*input.source);
  if (!opened.ok()) {
    Error error = WithPlace(opened.error(), input.name);
    if (error.code == ErrorCode::kDataLoss) {
      error.message += " (exemplar record recover makes a whole file of it)";
    }
    return error;
  }
  facts.reader = std::move(*opened);
  if (!facts.reader->statistics()) {
    return Error{ErrorCode::kDataLoss,
                 input.name + ": has no statistics (exemplar record recover makes them)", "FILE"};
  }
  for (const recording::MetadataIndex& index : facts.reader->metadata()) {
    Result<recording::Metadata> metadata = facts.reader->ReadMetadata(index);
    if (!metadata.ok()) return WithPlace(metadata.error(), input.name);
    if (const Status taken = TakeMetadata(std::move(*metadata), facts); !taken.ok()) {
      return WithPlace(taken.error(), input.name);
    }
  }
  return facts;
}

}  // namespace exemplar::joining
