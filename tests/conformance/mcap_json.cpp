#include "mcap_json.hpp"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>

namespace exemplar::conformance {
namespace {

using nlohmann::ordered_json;
using recording::Bytes;
using recording::Record;

// ---- records to JSON

std::string Text(std::uint64_t value) { return std::to_string(value); }
std::string Text(Stamp stamp) { return Text(static_cast<std::uint64_t>(stamp.nanoseconds())); }

ordered_json Numbers(const Bytes& bytes) {
  ordered_json numbers = ordered_json::array();
  for (const std::uint8_t byte : bytes) numbers.push_back(std::to_string(byte));
  return numbers;
}

ordered_json Map(const recording::StringMap& map) {
  ordered_json json = ordered_json::object();
  for (const auto& [key, value] : map) json[key] = value;
  return json;
}

ordered_json Map(const std::map<std::uint16_t, std::uint64_t>& map) {
  ordered_json json = ordered_json::object();
  for (const auto& [key, value] : map) json[std::to_string(key)] = Text(value);
  return json;
}

/// Fields in alphabetical order, as the cases have them.
ordered_json Fields(const char* type, std::map<std::string, ordered_json> fields) {
  ordered_json list = ordered_json::array();
  for (auto& [name, value] : fields) list.push_back(ordered_json::array({name, std::move(value)}));
  return {{"type", type}, {"fields", std::move(list)}};
}

struct ToJson {
  ordered_json operator()(const recording::Header& r) const {
    return Fields("Header", {{"library", r.library}, {"profile", r.profile}});
  }
  ordered_json operator()(const recording::Footer& r) const {
    return Fields("Footer", {{"summary_start", Text(r.summary_start)},
                             {"summary_offset_start", Text(r.summary_offset_start)},
                             {"summary_crc", Text(r.summary_crc)}});
  }
  ordered_json operator()(const recording::Schema& r) const {
    return Fields("Schema", {{"id", Text(r.id)},
                             {"name", r.name},
                             {"encoding", r.encoding},
                             {"data", Numbers(r.data)}});
  }
  ordered_json operator()(const recording::Channel& r) const {
    return Fields("Channel", {{"id", Text(r.id)},
                              {"schema_id", Text(r.schema_id)},
                              {"topic", r.topic},
                              {"message_encoding", r.message_encoding},
                              {"metadata", Map(r.metadata)}});
  }
  ordered_json operator()(const recording::Message& r) const {
    return Fields("Message", {{"channel_id", Text(r.channel_id)},
                              {"sequence", Text(r.sequence)},
                              {"log_time", Text(r.log_time)},
                              {"publish_time", Text(r.publish_time)},
                              {"data", Numbers(r.data)}});
  }
  ordered_json operator()(const recording::Chunk& r) const {
    return Fields("Chunk", {{"message_start_time", Text(r.message_start_time)},
                            {"message_end_time", Text(r.message_end_time)},
                            {"uncompressed_size", Text(r.uncompressed_size)},
                            {"uncompressed_crc", Text(r.uncompressed_crc)},
                            {"compression", r.compression},
                            {"records", Numbers(r.records)}});
  }
  ordered_json operator()(const recording::MessageIndex& r) const {
    ordered_json entries = ordered_json::array();
    for (const recording::MessageIndexEntry& entry : r.entries) {
      entries.push_back(ordered_json::array({Text(entry.log_time), Text(entry.offset)}));
    }
    return Fields("MessageIndex",
                  {{"channel_id", Text(r.channel_id)}, {"records", std::move(entries)}});
  }
  ordered_json operator()(const recording::ChunkIndex& r) const {
    return Fields("ChunkIndex", {{"message_start_time", Text(r.message_start_time)},
                                 {"message_end_time", Text(r.message_end_time)},
                                 {"chunk_start_offset", Text(r.chunk_start_offset)},
                                 {"chunk_length", Text(r.chunk_length)},
                                 {"message_index_offsets", Map(r.message_index_offsets)},
                                 {"message_index_length", Text(r.message_index_length)},
                                 {"compression", r.compression},
                                 {"compressed_size", Text(r.compressed_size)},
                                 {"uncompressed_size", Text(r.uncompressed_size)}});
  }
  ordered_json operator()(const recording::Attachment& r) const {
    return Fields("Attachment", {{"log_time", Text(r.log_time)},
                                 {"create_time", Text(r.create_time)},
                                 {"name", r.name},
                                 {"media_type", r.media_type},
                                 {"data", Numbers(r.data)}});
  }
  ordered_json operator()(const recording::AttachmentIndex& r) const {
    return Fields("AttachmentIndex", {{"offset", Text(r.offset)},
                                      {"length", Text(r.length)},
                                      {"log_time", Text(r.log_time)},
                                      {"create_time", Text(r.create_time)},
                                      {"data_size", Text(r.data_size)},
                                      {"name", r.name},
                                      {"media_type", r.media_type}});
  }
  ordered_json operator()(const recording::Statistics& r) const {
    return Fields("Statistics", {{"message_count", Text(r.message_count)},
                                 {"schema_count", Text(r.schema_count)},
                                 {"channel_count", Text(r.channel_count)},
                                 {"attachment_count", Text(r.attachment_count)},
                                 {"metadata_count", Text(r.metadata_count)},
                                 {"chunk_count", Text(r.chunk_count)},
                                 {"message_start_time", Text(r.message_start_time)},
                                 {"message_end_time", Text(r.message_end_time)},
                                 {"channel_message_counts", Map(r.channel_message_counts)}});
  }
  ordered_json operator()(const recording::Metadata& r) const {
    return Fields("Metadata", {{"name", r.name}, {"metadata", Map(r.metadata)}});
  }
  ordered_json operator()(const recording::MetadataIndex& r) const {
    return Fields("MetadataIndex",
                  {{"offset", Text(r.offset)}, {"length", Text(r.length)}, {"name", r.name}});
  }
  ordered_json operator()(const recording::SummaryOffset& r) const {
    return Fields("SummaryOffset", {{"group_opcode", Text(r.group_opcode)},
                                    {"group_start", Text(r.group_start)},
                                    {"group_length", Text(r.group_length)}});
  }
  ordered_json operator()(const recording::DataEnd& r) const {
    return Fields("DataEnd", {{"data_section_crc", Text(r.data_section_crc)}});
  }
};

Result<std::string> Print(const std::vector<Record>& records) {
  ordered_json list = ordered_json::array();
  for (const Record& record : records) list.push_back(std::visit(ToJson(), record));
  try {
    return ordered_json{{"records", std::move(list)}}.dump(2);
  } catch (const nlohmann::json::exception& e) {
    return InvalidArgument(std::string("a record's text is not UTF-8: ") + e.what());
  }
}

// ---- JSON to records; nlohmann's exceptions are caught by WriteCase.

template <class Number>
Number ParseNumber(const ordered_json& json) {
  const std::string text = json.is_number() ? json.dump() : json.get<std::string>();
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw nlohmann::json::other_error::create(501, "\"" + text + "\" is no number of this field",
                                              &json);
  }
  return value;
}

Stamp ParseStamp(const ordered_json& json) {
  return Stamp::FromNanoseconds(static_cast<std::int64_t>(ParseNumber<std::uint64_t>(json)));
}

Bytes ParseBytes(const ordered_json& json) {
  Bytes bytes;
  for (const ordered_json& number : json) bytes.push_back(ParseNumber<std::uint8_t>(number));
  return bytes;
}

std::map<std::string, ordered_json> FieldsOf(const ordered_json& record) {
  std::map<std::string, ordered_json> fields;
  for (const ordered_json& field : record.at("fields")) {
    fields[field.at(0).get<std::string>()] = field.at(1);
  }
  return fields;
}

Status WriteRecord(const std::string& type, std::map<std::string, ordered_json> f,
                   recording::Writer& writer) {
  if (type == "Schema") {
    return writer.AddSchema({ParseNumber<std::uint16_t>(f["id"]), f["name"].get<std::string>(),
                             f["encoding"].get<std::string>(), ParseBytes(f["data"])});
  }
  if (type == "Channel") {
    return writer.AddChannel(
        {ParseNumber<std::uint16_t>(f["id"]), ParseNumber<std::uint16_t>(f["schema_id"]),
         f["topic"].get<std::string>(), f["message_encoding"].get<std::string>(),
         f["metadata"].get<recording::StringMap>()});
  }
  if (type == "Message") {
    return writer.Write(recording::Message{
        ParseNumber<std::uint16_t>(f["channel_id"]), ParseNumber<std::uint32_t>(f["sequence"]),
        ParseStamp(f["log_time"]), ParseStamp(f["publish_time"]), ParseBytes(f["data"])});
  }
  if (type == "Attachment") {
    return writer.Write(recording::Attachment{
        ParseStamp(f["log_time"]), ParseStamp(f["create_time"]), f["name"].get<std::string>(),
        f["media_type"].get<std::string>(), ParseBytes(f["data"])});
  }
  if (type == "Metadata") {
    return writer.Write(recording::Metadata{f["name"].get<std::string>(),
                                            f["metadata"].get<recording::StringMap>()});
  }
  return InvalidArgument("record type \"" + type + "\" does not stand in a data section");
}

recording::WriterOptions OptionsOf(const std::set<std::string>& features) {
  recording::WriterOptions options;
  options.library = "";
  options.compression = recording::Compression::kNone;
  options.chunk_bytes = 1u << 30;
  options.chunks = features.contains("ch");
  options.message_indexes = features.contains("mx");
  options.chunk_indexes = features.contains("chx");
  options.attachment_indexes = features.contains("ax");
  options.metadata_indexes = features.contains("mdx");
  options.statistics = features.contains("st");
  options.repeated_schemas = features.contains("rsh");
  options.repeated_channels = features.contains("rch");
  options.summary_offsets = features.contains("sum");
  return options;
}

/// The data section's records in file order, where indexes lead to all of them.
Result<std::optional<std::vector<Record>>> DataByIndexes(recording::IndexedReader& reader) {
  const std::optional<recording::Statistics>& counts = reader.statistics();
  const bool complete = counts && counts->chunk_count == reader.chunks().size() &&
                        counts->attachment_count == reader.attachments().size() &&
                        counts->metadata_count == reader.metadata().size() &&
                        (counts->message_count == 0 || counts->chunk_count > 0);
  if (!complete) return std::optional<std::vector<Record>>();
  std::map<std::uint64_t, std::vector<Record>> by_offset;
  std::uint64_t messages = 0;
  for (const recording::ChunkIndex& index : reader.chunks()) {
    Result<std::vector<Record>> records = reader.ReadChunk(index);
    if (!records.ok()) return records.error();
    messages += static_cast<std::uint64_t>(std::count_if(
        records->begin(), records->end(),
        [](const Record& record) { return std::holds_alternative<recording::Message>(record); }));
    by_offset[index.chunk_start_offset] = std::move(*records);
  }
  if (messages != counts->message_count) return std::optional<std::vector<Record>>();
  for (const recording::AttachmentIndex& index : reader.attachments()) {
    Result<recording::Attachment> attachment = reader.ReadAttachment(index);
    if (!attachment.ok()) return attachment.error();
    by_offset[index.offset].emplace_back(std::move(*attachment));
  }
  for (const recording::MetadataIndex& index : reader.metadata()) {
    Result<recording::Metadata> metadata = reader.ReadMetadata(index);
    if (!metadata.ok()) return metadata.error();
    by_offset[index.offset].emplace_back(std::move(*metadata));
  }
  std::vector<Record> records;
  for (auto& [offset, group] : by_offset) {
    std::move(group.begin(), group.end(), std::back_inserter(records));
  }
  return std::optional(std::move(records));
}

}  // namespace

Result<Bytes> WriteCase(const std::string& case_json) {
  try {
    const ordered_json json = ordered_json::parse(case_json);
    const std::set<std::string> features =
        json.at("meta").at("variant").at("features").get<std::set<std::string>>();
    recording::WriterOptions options = OptionsOf(features);
    recording::MemorySink sink;
    std::unique_ptr<recording::Writer> writer;
    for (const ordered_json& record : json.at("records")) {
      const std::string type = record.at("type").get<std::string>();
      std::map<std::string, ordered_json> fields = FieldsOf(record);
      if (type == "Header") {
        options.library = fields["library"].get<std::string>();
        options.profile = fields["profile"].get<std::string>();
        Result<std::unique_ptr<recording::Writer>> created =
            recording::Writer::Create(sink, options);
        if (!created.ok()) return created.error();
        writer = std::move(*created);
        continue;
      }
      if (writer == nullptr) return InvalidArgument("the first record is not a Header");
      if (type == "DataEnd") break;
      const Status written = WriteRecord(type, std::move(fields), *writer);
      if (!written.ok()) return written.error();
    }
    if (writer == nullptr) return InvalidArgument("there is no Header record");
    if (const Status closed = writer->Close(); !closed.ok()) return closed.error();
    return sink.bytes();
  } catch (const nlohmann::json::exception& e) {
    return InvalidArgument(std::string("not a conformance case: ") + e.what());
  }
}

Result<std::string> ReadStreamed(recording::ByteSource& source) {
  Result<std::unique_ptr<recording::StreamReader>> reader = recording::StreamReader::Create(source);
  if (!reader.ok()) return reader.error();
  std::vector<Record> records;
  while (true) {
    Result<std::optional<Record>> record = (*reader)->Next();
    if (!record.ok()) return record.error();
    if (!record->has_value()) return Print(records);
    records.push_back(std::move(**record));
  }
}

Result<std::string> ReadIndexed(recording::ByteSource& source) {
  Result<std::unique_ptr<recording::IndexedReader>> reader = recording::IndexedReader::Open(source);
  if (!reader.ok()) return reader.error();
  Result<std::optional<std::vector<Record>>> data = DataByIndexes(**reader);
  if (!data.ok()) return data.error();
  if (!data->has_value()) return ReadStreamed(source);

  std::vector<Record> records = {(*reader)->header()};
  std::move((*data)->begin(), (*data)->end(), std::back_inserter(records));
  Result<recording::DataEnd> data_end = (*reader)->ReadDataEnd();
  if (!data_end.ok()) return data_end.error();
  records.emplace_back(*data_end);
  records.insert(records.end(), (*reader)->summary().begin(), (*reader)->summary().end());
  records.emplace_back((*reader)->footer());
  return Print(records);
}

Result<std::string> NormalisedRecords(const std::string& json) {
  try {
    std::string lines;
    const ordered_json document = ordered_json::parse(json);
    for (const ordered_json& record : document.at("records")) {
      lines += record.at("type").get<std::string>();
      for (const auto& [name, value] : FieldsOf(record)) lines += " " + name + "=" + value.dump();
      lines += "\n";
    }
    return lines;
  } catch (const nlohmann::json::exception& e) {
    return InvalidArgument(e.what());
  }
}

}  // namespace exemplar::conformance
