// Reads an MCAP recording with the format's own reader and decodes every message by the schema inside
// the file. Prints one JSON object: per topic the schema's name, the number of messages, the first and
// the last decoded one. Exit code 1 with a sentence on stderr if anything does not fit.
//
//   node read_recording.mjs FILE.mcap
import { open } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "./file_handle_readable.mjs";
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader } from "@foxglove/omgidl-serialization";
import { decompress } from "fzstd";

const file = process.argv[2];
if (!file) {
  console.error("usage: node read_recording.mjs FILE.mcap");
  process.exit(2);
}

const plain = (_key, value) => {
  if (typeof value === "bigint") return value.toString();
  if (ArrayBuffer.isView(value)) return Array.from(value, (v) => (typeof v === "bigint" ? v.toString() : v));
  return value;
};

const handle = await open(file, "r");
try {
  const reader = await McapIndexedReader.Initialize({
    readable: new FileHandleReadable(handle),
    decompressHandlers: { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) },
  });
  const decoders = new Map();
  for (const schema of reader.schemasById.values()) {
    if (schema.encoding !== "omgidl") throw new Error(`schema ${schema.name}: encoding is ${schema.encoding}, not omgidl`);
    const definitions = parseIDL(new TextDecoder().decode(schema.data));
    decoders.set(schema.id, new MessageReader(schema.name, definitions));
  }
  const topics = {};
  let last = 0n;
  for await (const message of reader.readMessages()) {
    if (message.logTime < last) throw new Error(`log times run backwards at ${message.logTime}`);
    last = message.logTime;
    const channel = reader.channelsById.get(message.channelId);
    if (channel.messageEncoding !== "cdr") throw new Error(`${channel.topic}: messages are ${channel.messageEncoding}, not cdr`);
    const decoder = decoders.get(channel.schemaId);
    if (!decoder) throw new Error(`${channel.topic}: no schema`);
    const value = decoder.readMessage(message.data);
    const topic = (topics[channel.topic] ??= { schema: reader.schemasById.get(channel.schemaId).name, count: 0, first: value });
    topic.count += 1;
    topic.last = value;
  }
  const counted = Object.values(topics).reduce((sum, topic) => sum + topic.count, 0);
  if (BigInt(counted) !== reader.statistics?.messageCount) {
    throw new Error(`the statistics say ${reader.statistics?.messageCount} messages, ${counted} were read`);
  }
  const metadata = [];
  for await (const record of reader.readMetadata()) metadata.push({ name: record.name, values: Object.fromEntries(record.metadata) });
  console.log(JSON.stringify({ topics, metadata }, plain));
} catch (error) {
  console.error(`${file}: ${error.message}`);
  process.exitCode = 1;
} finally {
  await handle.close();
}
