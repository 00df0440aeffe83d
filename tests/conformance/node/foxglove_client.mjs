// A client of the Foxglove WebSocket protocol that is not ours: the messages by @foxglove/ws-protocol, their bytes by
// @foxglove/omgidl-serialization. Reads commands, one JSON object a line, and answers each with one.
//
//   node foxglove_client.mjs URL SUBPROTOCOL
//
//   {"do": "greeting"}                                    server info, channels, services
//   {"do": "subscribe", "topic": T}
//   {"do": "collect", "topic": T, "count": N}             the next N messages, decoded
//   {"do": "call", "service": NAME, "request": {...}}     its answer, or {"failure": WHY}
//   {"do": "publish", "topic": T, "type": NAME, "message": {...}}
//   {"do": "status"}                                      the next status message that was not told yet
//   {"do": "control", "play": BOOL, "speed": X, "seek": "NS" or null, "id": ID}     foxglove.sdk.v1 only
//   {"do": "played"}                                      the state that ended a playback, messages by topic
import readline from "node:readline";
import protocol from "@foxglove/ws-protocol";
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader } from "@foxglove/omgidl-serialization";
import { WebSocket } from "ws";

const { FoxgloveClient } = protocol;
const [url, subprotocol] = process.argv.slice(2);
const plain = (_key, value) => {
  if (typeof value === "bigint") return value.toString();
  if (ArrayBuffer.isView(value)) return value.length > 100 ? value.length : Array.from(value);
  return value;
};
const answer = (value) => console.log(JSON.stringify(value, plain));

// The package knows neither the newer subprotocol's name nor its state of playback: those are read here.
const socket = new WebSocket(url, [subprotocol]);
const states = [];
const raw = (message, isBinary) => {
  const data = Buffer.from(message);
  if (!isBinary || data[0] !== 5) return false;
  const idLength = data.readUInt32LE(15);
  states.push({
    status: data[1],
    time: data.readBigUInt64LE(2),
    speed: data.readFloatLE(10),
    sought: data[14] !== 0,
    id: data.subarray(19, 19 + idLength).toString(),
  });
  return true;
};
const emit = socket.emit.bind(socket);
socket.emit = (event, ...rest) => (event === "message" && raw(...rest) ? true : emit(event, ...rest));

const client = new FoxgloveClient({ ws: socket });
const channels = new Map(); // by topic
const services = new Map(); // by name
const readers = new Map(); // by subscription
const received = new Map(); // by topic
const answers = new Map(); // by call
const statuses = [];
let info;
let waiting = [];
const changed = () => {
  const woken = waiting;
  waiting = [];
  for (const wake of woken) wake();
};
const until = async (condition) => {
  const end = Date.now() + 90000;
  while (!condition()) {
    if (Date.now() > end) throw new Error("waited in vain");
    await new Promise((wake) => {
      waiting.push(wake);
      setTimeout(wake, 1000);
    });
  }
};

client.on("error", (error) => statuses.push({ level: 9, message: String(error) }));
client.on("serverInfo", (event) => ((info = event), changed()));
client.on("status", (event) => (statuses.push(event), changed()));
client.on("advertise", (list) => {
  for (const channel of list) channels.set(channel.topic, channel);
  changed();
});
client.on("unadvertise", (ids) => {
  for (const [topic, channel] of channels) if (ids.includes(channel.id)) channels.delete(topic);
});
client.on("advertiseServices", (list) => {
  for (const service of list) services.set(service.name, service);
  changed();
});
client.on("serviceCallResponse", (event) => {
  answers.set(event.callId, JSON.parse(new TextDecoder().decode(event.data)));
  changed();
});
client.on("serviceCallFailure", (event) => (answers.set(event.callId, { failure: event.message }), changed()));
client.on("message", (event) => {
  const { topic, reader } = readers.get(event.subscriptionId);
  received.get(topic).push({ time: event.timestamp, message: reader.readMessage(event.data) });
  changed();
});

let calls = 0;
const encode = (value) => new TextEncoder().encode(JSON.stringify(value));
const commands = {
  async greeting() {
    await until(() => info && channels.size > 0 && (services.size > 0 || !info.capabilities.includes("services")));
    return { info, channels: [...channels.values()], services: [...services.values()], subprotocol: socket.protocol };
  },
  async subscribe({ topic }) {
    await until(() => channels.has(topic));
    const channel = channels.get(topic);
    const reader = new MessageReader(channel.schemaName, parseIDL(channel.schema));
    received.set(topic, []);
    readers.set(client.subscribe(channel.id), { topic, reader });
    return {};
  },
  async collect({ topic, count }) {
    const list = received.get(topic);
    await until(() => list.length >= count);
    return list.splice(0, count);
  },
  async call({ service, request }) {
    const id = ++calls;
    const serviceId = services.get(service)?.id ?? 4711;
    const bytes = encode(request);
    client.sendServiceCallRequest({ serviceId, callId: id, encoding: "json", data: new DataView(bytes.buffer) });
    await until(() => answers.has(id));
    return answers.get(id);
  },
  async publish({ topic, type, message }) {
    const channel = client.advertise({ topic, encoding: "json", schemaName: type });
    client.sendMessage(channel, encode(message));
    return {};
  },
  async status() {
    await until(() => statuses.length > 0);
    return statuses.shift();
  },
  async control({ play, speed, seek, id }) {
    const bytes = Buffer.alloc(19 + id.length);
    bytes[0] = 3;
    bytes[1] = play ? 0 : 1;
    bytes.writeFloatLE(speed, 2);
    bytes[6] = seek === null ? 0 : 1;
    bytes.writeBigUInt64LE(BigInt(seek ?? 0), 7);
    bytes.writeUInt32LE(id.length, 15);
    bytes.write(id, 19);
    socket.send(bytes);
    await until(() => states.some((state) => state.id === id));
    return states.find((state) => state.id === id);
  },
  async played() {
    await until(() => states.some((state) => state.status === 3));
    const counts = {};
    for (const [topic, list] of received) counts[topic] = list.length;
    return { state: states.find((state) => state.status === 3), counts };
  },
};

socket.on("close", () => process.exit(0));
for await (const line of readline.createInterface({ input: process.stdin })) {
  const command = JSON.parse(line);
  try {
    answer(await commands[command.do](command));
  } catch (error) {
    answer({ error: String(error), statuses });
  }
}
process.exit(0);
