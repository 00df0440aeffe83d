// Writes cases like those of the format's conformance suite with the format's own record builder: NAME.mcap
// beside NAME.json, for every combination of features. They go beyond the suite: several messages and channels,
// empty data, odd names, times that need all 64 bits, attachments and metadata together.
//
//   node make_cases.mjs FOLDER
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { McapChunkBuilder, McapRecordBuilder, McapStreamReader, Opcode } from "@mcap/core";
import { crc32 } from "@foxglove/crc";

const MAX = 18446744073709551615n;
const message = (channelId, sequence, logTime, publishTime, data) => ({
  type: "Message", channelId, sequence, logTime, publishTime, data: new Uint8Array(data),
});
const channel = (id, schemaId, topic, messageEncoding, metadata = []) => ({
  type: "Channel", id, schemaId, topic, messageEncoding, metadata: new Map(metadata),
});
const schema = (id, name, data) => ({ type: "Schema", id, name, encoding: "c", data: new Uint8Array(data) });
const metadata = (name, entries) => ({ type: "Metadata", name, metadata: new Map(entries) });
const attachment = (logTime, createTime, name, mediaType, data) => ({
  type: "Attachment", logTime, createTime, name, mediaType, data: new Uint8Array(data),
});

const inputs = {
  TenMessages: [
    schema(1, "Example", [4, 5, 6]),
    channel(1, 1, "example", "a", [["foo", "bar"]]),
    ...Array.from({ length: 10 }, (_, i) => message(1, i, BigInt(i), 1n, [i])),
  ],
  TwoChannels: [
    schema(1, "Ex\u00e4mple \u{1f600}", []),
    channel(1, 1, "a", "", [["", "empty"], ["\n\"x\\", "\u0001\u7f8e"]]),
    channel(2, 0, "b", "cdr"),
    ...Array.from({ length: 9 }, (_, i) =>
      message(1 + (i % 2), 4294967295 - i, 9007199254740993n + BigInt((i * 7) % 5), MAX, i % 3 ? Array(i).fill(i) : [])),
  ],
  HugeTimes: [
    channel(65535, 0, "b", "cdr"),
    ...[5n, MAX, 9223372036854775808n].map((time, i) => message(65535, i, time, time, [1])),
  ],
  Mixed: [
    attachment(2n, 9007199254740993n, 'fi"le', "text/plain", []),
    metadata("", [["a\u2028", "b\t"]]),
    attachment(MAX, 1n, "", "", Array(300).fill(255)),
    metadata("two", []),
  ],
};

/** The file as the suite's own generator would put it together. */
function fileOf(features, records) {
  const builder = new McapRecordBuilder({ padRecords: features.has("pad") });
  const here = () => BigInt(builder.length);
  builder.writeMagic();
  builder.writeHeader({ profile: "", library: "" });
  const chunk = features.has("ch") ? new McapChunkBuilder({ useMessageIndex: features.has("mx") }) : undefined;
  const statistics = {
    messageCount: 0n, schemaCount: 0, channelCount: 0, attachmentCount: 0, metadataCount: 0, chunkCount: 0,
    messageStartTime: 0n, messageEndTime: 0n, channelMessageCounts: new Map(),
  };
  const metadataIndexes = [], attachmentIndexes = [], chunkIndexes = [];
  for (const record of records) {
    const offset = here();
    if (record.type === "Schema") {
      statistics.schemaCount++;
      chunk ? chunk.addSchema(record) : builder.writeSchema(record);
    } else if (record.type === "Channel") {
      statistics.channelCount++;
      chunk ? chunk.addChannel(record) : builder.writeChannel(record);
    } else if (record.type === "Message") {
      const first = statistics.messageCount++ === 0n;
      if (first || record.logTime < statistics.messageStartTime) statistics.messageStartTime = record.logTime;
      if (first || record.logTime > statistics.messageEndTime) statistics.messageEndTime = record.logTime;
      const counts = statistics.channelMessageCounts;
      counts.set(record.channelId, (counts.get(record.channelId) ?? 0n) + 1n);
      chunk ? chunk.addMessage(record) : builder.writeMessage(record);
    } else if (record.type === "Attachment") {
      statistics.attachmentCount++;
      const length = builder.writeAttachment(record);
      attachmentIndexes.push({ ...record, offset, length, dataSize: BigInt(record.data.byteLength) });
    } else {
      statistics.metadataCount++;
      metadataIndexes.push({ name: record.name, offset, length: builder.writeMetadata(record) });
    }
  }
  if (chunk && chunk.numMessages > 0) {
    statistics.chunkCount++;
    const content = chunk.buffer.slice();
    const times = { messageStartTime: chunk.messageStartTime, messageEndTime: chunk.messageEndTime };
    const size = BigInt(content.length);
    const chunkStartOffset = here();
    const chunkLength = builder.writeChunk(
      { ...times, uncompressedSize: size, uncompressedCrc: crc32(content), compression: "", records: content });
    const messageIndexOffsets = new Map();
    const indexStart = here();
    if (features.has("mx")) {
      for (const index of chunk.indices) {
        messageIndexOffsets.set(index.channelId, here());
        builder.writeMessageIndex(index);
      }
    }
    chunkIndexes.push({
      ...times, chunkStartOffset, chunkLength, messageIndexOffsets, messageIndexLength: here() - indexStart,
      compression: "", compressedSize: size, uncompressedSize: size,
    });
  }
  builder.writeDataEnd({ dataSectionCrc: crc32(builder.buffer) });

  const summaryStart = here();
  const groups = [];
  const group = (wanted, groupOpcode, write) => {
    if (!wanted) return;
    const groupStart = here();
    write();
    if (here() > groupStart) groups.push({ groupOpcode, groupStart, groupLength: here() - groupStart });
  };
  const only = (type) => records.filter((record) => record.type === type);
  group(features.has("rsh"), Opcode.SCHEMA, () => only("Schema").forEach((r) => builder.writeSchema(r)));
  group(features.has("rch"), Opcode.CHANNEL, () => only("Channel").forEach((r) => builder.writeChannel(r)));
  group(features.has("st"), Opcode.STATISTICS, () => builder.writeStatistics(statistics));
  group(features.has("mdx"), Opcode.METADATA_INDEX, () => metadataIndexes.forEach((r) => builder.writeMetadataIndex(r)));
  group(features.has("ax"), Opcode.ATTACHMENT_INDEX,
    () => attachmentIndexes.forEach((r) => builder.writeAttachmentIndex(r)));
  group(features.has("chx"), Opcode.CHUNK_INDEX, () => chunkIndexes.forEach((r) => builder.writeChunkIndex(r)));
  const offsetStart = here();
  if (features.has("sum")) groups.forEach((r) => builder.writeSummaryOffset(r));

  const footer = {
    summaryStart: groups.length > 0 ? summaryStart : 0n,
    summaryOffsetStart: features.has("sum") && groups.length > 0 ? offsetStart : 0n,
  };
  const head = new DataView(new ArrayBuffer(25));
  head.setUint8(0, Opcode.FOOTER);
  head.setBigUint64(1, 20n, true);
  head.setBigUint64(9, footer.summaryStart, true);
  head.setBigUint64(17, footer.summaryOffsetStart, true);
  const covered = new Uint8Array([...builder.buffer.slice(Number(summaryStart)), ...new Uint8Array(head.buffer)]);
  builder.writeFooter({ ...footer, summaryCrc: crc32(covered) });
  builder.writeMagic();
  return builder.buffer.slice();
}

function plain(value) {
  if (typeof value === "bigint" || typeof value === "number") return String(value);
  if (value instanceof Uint8Array) return Array.from(value, String);
  if (value instanceof Map) return Object.fromEntries([...value].map(([key, v]) => [String(key), plain(v)]));
  return value;
}

/** The case as the format's own reader tells it. */
function caseOf(bytes, features) {
  const snake = (name) => name.replace(/[A-Z]/g, (letter) => "_" + letter.toLowerCase());
  const reader = new McapStreamReader({ includeChunks: false, validateCrcs: true });
  reader.append(bytes);
  const records = [];
  for (let record; (record = reader.nextRecord()); ) {
    const { type, crc, ...fields } = record;
    if (type === "MessageIndex") continue;
    records.push({ type, fields: Object.entries(fields).map(([name, value]) => [snake(name), plain(value)]).sort() });
  }
  return JSON.stringify({ records, meta: { variant: { features: [...features] } } });
}

const folder = process.argv[2];
for (const [name, records] of Object.entries(inputs)) {
  const all = name === "Mixed" ? ["st", "ax", "mdx", "sum", "pad"] : ["ch", "mx", "chx", "st", "rsh", "rch", "sum", "pad"];
  for (let bits = 0; bits < 1 << all.length; ++bits) {
    const features = new Set(all.filter((_, i) => bits & (1 << i)));
    if (!features.has("ch") && (features.has("mx") || features.has("chx"))) continue;
    const bytes = fileOf(features, records);
    const stem = join(folder, [name, ...[...features].sort()].join("-"));
    writeFileSync(`${stem}.mcap`, bytes);
    writeFileSync(`${stem}.json`, caseOf(bytes, features));
  }
}
