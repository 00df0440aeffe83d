// Calls every method of every service of a server, with nothing but what its reflection tells: no .proto file and no code
// of ours. Prints a JSON object of method -> status code; what is wrong ends it with a stack trace.
//   node call_services.mjs HOST:PORT TRIAL.csv...
// With EXEMPLAR_TLS_CA over TLS, with EXEMPLAR_TLS_CERT and EXEMPLAR_TLS_KEY a certificate is shown, with EXEMPLAR_TOKEN a token.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { basename } from "node:path";
import * as grpc from "@grpc/grpc-js";
import { GrpcReflection } from "grpc-js-reflection-client";

const [address, ...files] = process.argv.slice(2);
const OK = grpc.status.OK;
const PRECONDITION = grpc.status.FAILED_PRECONDITION;
const PATIENCE_MS = 60_000; // for what a server learns by itself
const { EXEMPLAR_TLS_CA, EXEMPLAR_TLS_CERT, EXEMPLAR_TLS_KEY, EXEMPLAR_TOKEN } = process.env;
const read = (path) => (path ? readFileSync(path) : null);

/** What is shown to the server: nothing in plain text, else as the environment says. */
function credentials() {
  if (!EXEMPLAR_TLS_CA) return grpc.credentials.createInsecure();
  const ssl = grpc.credentials.createSsl(read(EXEMPLAR_TLS_CA), read(EXEMPLAR_TLS_KEY), read(EXEMPLAR_TLS_CERT));
  if (!EXEMPLAR_TOKEN) return ssl;
  const token = grpc.credentials.createFromMetadataGenerator((_, done) => {
    const metadata = new grpc.Metadata();
    metadata.set("authorization", `Bearer ${EXEMPLAR_TOKEN}`);
    done(null, metadata);
  });
  return grpc.credentials.combineChannelCredentials(ssl, token);
}

const shown = credentials();
const reflection = new GrpcReflection(address, shown, {}, "v1alpha");
const LOAD = { keepCase: true, longs: Number, enums: String, defaults: true, oneofs: true };

const at = (object, path) => path.split(".").reduce((place, name) => place[name], object);
const answers = {};

/** A stub made from the descriptors that the server sends. */
async function stub(service) {
  const descriptor = await reflection.getDescriptorBySymbol(service);
  const Service = at(descriptor.getPackageObject(LOAD), service);
  return { client: new Service(address, shown), methods: Service.service };
}

/** One call of any kind; all messages that came, or the error. */
function call({ client }, method, requests, { take = Infinity } = {}) {
  const list = Array.isArray(requests) ? requests : [requests];
  return new Promise((resolve) => {
    const messages = [];
    const deadline = Date.now() + 100_000;
    const ended = (error) => {
      const cut = error?.code === grpc.status.CANCELLED && messages.length >= take;
      answers[method.path.slice(1)] = error && !cut ? error.code : OK;
      resolve({ messages, error: cut ? null : error });
    };
    const answered = (error, message) => {
      if (message) messages.push(message);
      ended(error);
    };
    const name = method.path.split("/")[2];
    let stream;
    if (method.responseStream) {
      stream = method.requestStream ? client[name]({ deadline }) : client[name](list[0], { deadline });
      stream.on("data", (message) => {
        messages.push(message);
        if (messages.length === take) stream.cancel();
      });
      let failed = false;
      stream.on("error", (error) => {
        failed = true;
        ended(error);
      });
      stream.on("end", () => failed || setImmediate(() => failed || ended(null)));
    } else if (method.requestStream) {
      stream = client[name]({ deadline }, answered);
    } else {
      client[name](list[0], { deadline }, answered);
    }
    if (method.requestStream) {
      for (const request of list) stream.write(request);
      stream.end();
    }
  });
}

const file = (header, path) => [
  { header: { ...header, name: basename(path) } },
  { chunk: { data: readFileSync(path) } },
];
const skill = { name: "reflected", version: 0 };
const objects = [{ name: "target", pose: { position: { x: 0.55, y: -0.15, z: 0.06 } } }];
const query = { objects };
const execution = { skill, objects, speed: 1 };
let trial = "";
let version = 0;

/** What operators do with a service's data: its own backup is put back into it. */
function data() {
  let backup = [];
  return {
    ListPersons: { send: {}, check: ([answer]) => assert.ok(Array.isArray(answer.persons)) },
    Backup: {
      send: {},
      check: (parts) => {
        assert.ok(parts[0].plan.service);
        backup = parts;
      },
    },
    Restore: {
      send: () => [
        { header: { plan: backup[0].plan, mode: "MODE_MERGE" } },
        ...backup.slice(1).map(({ begin, chunk }) => (begin ? { begin } : { chunk })),
        { commit: true },
      ],
      check: ([answer]) => assert.ok(answer.report.items.every((item) => item.action)),
    },
    ApplyRetention: { send: { dry_run: true } },
    ErasePerson: { send: { person: "nobody" }, check: (parts) => assert.ok(parts.at(-1).report) },
  };
}

/** Service -> method -> what is sent, what may come. Each service's methods are called in this order. */
const SCRIPT = {
  TrialService: {
    Submit: {
      each: files.map((path) => file({ skill: skill.name }, path)),
      check: ([answer]) => {
        trial = answer.trial.id;
        assert.match(trial, /^trial-/);
      },
    },
    List: { send: { skill: skill.name }, check: ([answer]) => assert.equal(answer.trials.length, files.length) },
    Get: { send: () => ({ id: trial }), check: ([answer]) => assert.equal(answer.trial.id, trial) },
    SetPerson: { send: () => ({ id: trial, person: "user03" }) },
    Load: { send: () => ({ id: trial }), check: ([answer]) => assert.ok(answer.trial) },
    Segments: { send: () => [{ header: { id: trial } }] },
    Export: {
      send: () => ({ id: trial }),
      check: (parts) => assert.match(Buffer.concat(parts.map((part) => part.chunk.data)).toString(), /^time_s,/),
    },
  },
  SkillService: {
    Learn: {
      send: { name: skill.name },
      check: (parts) => {
        assert.ok(parts.slice(0, -1).every((part) => part.part === "progress"));
        assert.equal(parts.at(-1).report.trials.length, files.length);
      },
    },
    Get: { send: { skill }, check: ([answer]) => assert.equal(answer.report.skill, skill.name) },
    List: { send: {}, check: ([answer]) => assert.ok(answer.skills.some((one) => one.name === skill.name)) },
    Versions: {
      send: { name: skill.name },
      check: ([answer]) => {
        version = answer.versions[0].version;
        assert.ok(answer.versions.at(-1).current);
      },
    },
    Query: { send: { skill, query }, check: ([answer]) => assert.ok(answer.motion.time_s.length > 100) },
    QueryStream: {
      send: [1, 2, 3].map((tag) => ({ skill, query, tag })),
      check: (parts) => assert.deepEqual(parts.map((part) => [part.tag, part.answer]), [1, 2, 3].map((tag) => [tag, "motion"])),
    },
    Evaluate: { send: file({ skill }, files[0]), check: ([answer]) => assert.ok(answer.frechet_m < 0.1) },
    Suggest: { send: { skill, count: 2 }, check: ([answer]) => assert.ok(answer.places.length > 0) },
    Export: {
      send: { skill },
      check: (parts) => JSON.parse(Buffer.concat(parts.map((part) => part.chunk.data)).toString()),
    },
    Rollback: { send: () => ({ name: skill.name, version }) },
  },
  ExecutorService: {
    GetStatus: { send: {}, check: ([answer]) => assert.equal(answer.joint_names.length, 7) },
    SetSpeed: { send: { factor: 1 } },
    Plan: { send: { execution }, check: ([answer]) => assert.ok(answer.plan.duration_s > 0) },
    Execute: {
      send: { execution },
      check: (parts) => {
        assert.ok(parts.slice(0, -1).every((part) => part.feedback));
        assert.equal(parts.at(-1).result.state, "done");
      },
    },
    // Nothing moves any more: these may be refused, and say so.
    Pause: { send: {}, may: [OK, PRECONDITION] },
    Resume: { send: {}, may: [OK, PRECONDITION] },
    Cancel: { send: {}, may: [OK, PRECONDITION] },
    // Nobody publishes a suit.
    Teleoperate: { send: { detached: true }, may: [OK, PRECONDITION, grpc.status.UNAVAILABLE] },
    EndTeleoperation: { send: {}, may: [OK, PRECONDITION] },
    Stop: { send: {} },
    Reset: { send: {} },
  },
  RecorderService: {
    GetStatus: { send: {}, check: ([answer]) => assert.match(answer.status.state, /^(ready|stopped)$/) },
    Start: { send: { name: `reflected-${process.pid}` }, check: ([answer]) => assert.equal(answer.status.state, "recording") },
    MarkEvent: { send: { note: "a mark" } },
    Pause: { send: {}, check: ([answer]) => assert.equal(answer.status.state, "paused") },
    Resume: { send: {} },
    Stop: { send: {}, check: ([answer]) => assert.match(answer.status.file, /reflected.*\.mcap$/) },
  },
  LearningDataService: data(),
  RecorderDataService: data(),
  TopicService: {
    // Who has just started learns of the robot from the network.
    List: { send: {}, until: ([answer]) => answer.topics.some((one) => one.topic === "ircp/joint_state") },
    Subscribe: {
      send: { topics: ["ircp/joint_state"], content: "CONTENT_JSON" },
      take: 2,
      check: (parts) => assert.ok(parts.some((part) => part.samples.some((one) => JSON.parse(one.json).positions))),
    },
    // The gateway was allowed none.
    Publish: { send: { topic: "ircp/safety", json: "{}" }, may: [PRECONDITION, grpc.status.PERMISSION_DENIED] },
  },
};
const LAST = {
  SkillService: { Delete: { send: { name: skill.name } } },
  TrialService: { Delete: { send: () => ({ id: trial }) } },
};

async function health(names) {
  // A service of gRPC's own; its messages come by reflection as well where the server has them, else by these two numbers.
  const send = (name) => {
    const bytes = Buffer.from(name);
    return bytes.length ? Buffer.concat([Buffer.from([0x0a, bytes.length]), bytes]) : Buffer.alloc(0);
  };
  const client = new grpc.Client(address, shown);
  for (const name of ["", ...names]) {
    const state = await new Promise((resolve, reject) =>
      client.makeUnaryRequest("/grpc.health.v1.Health/Check", send, (bytes) => bytes, name, (error, bytes) =>
        error ? reject(new Error(`health of "${name}": ${error.details}`)) : resolve(bytes),
      ),
    );
    assert.deepEqual([...state], [0x08, 1], `health of "${name}"`);
    answers["grpc.health.v1.Health/Check"] = OK;
  }
  await assert.rejects(
    new Promise((resolve, reject) =>
      client.makeUnaryRequest("/grpc.health.v1.Health/Check", send, (bytes) => bytes, "exemplar.v1.Nothing", (error) =>
        error ? reject(error) : resolve(),
      ),
    ),
    { code: grpc.status.NOT_FOUND },
  );
}

async function run(services, script) {
  for (const [name, calls] of Object.entries(script)) {
    const own = services[name];
    if (!own) continue;
    for (const [method, { send, each, may = [OK], check, take, until = () => true }] of Object.entries(calls)) {
      assert.ok(own.methods[method], `${name} has no ${method}`);
      for (const one of each ?? [send]) {
        const request = typeof one === "function" ? one() : one;
        const deadline = Date.now() + PATIENCE_MS;
        let { messages, error } = await call(own, own.methods[method], request, { take });
        while (!error && !until(messages)) {
          assert.ok(Date.now() < deadline, `${name}/${method} never answered what was waited for: ${JSON.stringify(messages)}`);
          await new Promise((resolve) => setTimeout(resolve, 50));
          ({ messages, error } = await call(own, own.methods[method], request, { take }));
        }
        const code = error ? error.code : OK;
        assert.ok(may.includes(code), `${name}/${method}: ${code} ${error?.details}`);
        if (code === OK) check?.(messages);
        else assert.ok(error.details, `${name}/${method} failed without a word`);
      }
    }
  }
}

const names = (await reflection.listServices("*")).filter((name) => name.startsWith("exemplar.v1."));
assert.ok(names.length > 0, "the server's reflection tells of no service of ours");
const services = {};
for (const name of names) services[name.split(".").at(-1)] = await stub(name);
await health(names);
await run(services, SCRIPT);
if (services.SkillService) {
  const { error } = await call(services.SkillService, services.SkillService.methods.Get, { skill: { name: "nothing" } });
  assert.equal(error.code, grpc.status.NOT_FOUND);
  assert.match(error.details, /nothing/);
  assert.ok(error.metadata.get("grpc-status-details-bin").length > 0, "an error without details");
}
await run(services, LAST);
for (const [name, { methods }] of Object.entries(services)) {
  for (const method of Object.values(methods)) {
    assert.ok(method.path.slice(1) in answers, `${name}: ${method.path} was not called`);
  }
}
console.log(JSON.stringify(answers));
process.exit(0);
