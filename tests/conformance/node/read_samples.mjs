// Decodes samples by their schema with an independent decoder. The file has one JSON object a line:
// {"type", "schema" (IDL text), "cdr" (hexadecimal)}; the answer one a line: the decoded message, whole
// numbers of 64 bits as text.
//
//   node read_samples.mjs FILE
import { readFile } from "node:fs/promises";
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader } from "@foxglove/omgidl-serialization";

const plain = (_key, value) => {
  if (typeof value === "bigint") return value.toString();
  if (ArrayBuffer.isView(value)) return Array.from(value);
  return value;
};

for (const line of (await readFile(process.argv[2], "utf8")).trim().split("\n")) {
  const { type, schema, cdr } = JSON.parse(line);
  const reader = new MessageReader(type, parseIDL(schema));
  console.log(JSON.stringify(reader.readMessage(new Uint8Array(Buffer.from(cdr, "hex"))), plain));
}
