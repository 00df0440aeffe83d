import { deepEqual, equal, ok, rejects } from "node:assert/strict";
import { test } from "node:test";
import * as THREE from "three";
import { Client } from "../src/client";
import { CallError, errorOf, explain } from "../src/errors";
import { bytes, mm, number, toNumber } from "../src/format";
import { Backoff, LatestOnly } from "../src/latest";
import { LineSplitter } from "../src/lines";
import { base64, objectsOf } from "../src/panels/skill";
import { judgeTeleoperation } from "../src/panels/teleop";
import { blend, positionsOf, rowMaxima, thin, tube } from "../src/tube";
import { cornersOf, frameOf } from "../src/view/frame";
import type { SkillReport, TeleoperationResult } from "../src/types";

test("lines come whole wherever the pieces end, letters of several bytes too", () => {
  const splitter = new LineSplitter();
  const sent = new TextEncoder().encode('{"a":"é"}\n\n{"b":2}\n{"c"');
  const lines: string[] = [];
  for (const byte of sent) lines.push(...splitter.push(Uint8Array.of(byte)));
  deepEqual(lines, ['{"a":"é"}', '{"b":2}']);
  deepEqual(splitter.end(), ['{"c"']);
  deepEqual(splitter.end(), []);
});

test("errors keep the service's words, and others get a sentence", () => {
  const refused = errorOf(412, '{"code":"failed_precondition","message":"forearm in table","field":"objects[0]"}');
  equal(refused.code, "failed_precondition");
  equal(explain(refused), "forearm in table (objects[0])");
  equal(errorOf(502, "<html>").code, "internal");
  ok(errorOf(500, "").message.includes("500"));
  ok(explain(new CallError("permission_denied", "needs the role execute"), "ben").startsWith("The login ben may not"));
  equal(explain(new CallError("unavailable", "x", "", true)), "The gateway does not answer.");
});

test("of questions asked meanwhile only the last is answered", async () => {
  const asked: number[] = [];
  const gates: (() => void)[] = [];
  const latest = new LatestOnly<number>(async (value) => {
    asked.push(value);
    await new Promise<void>((resolve) => gates.push(resolve));
  });
  for (let i = 0; i < 5; ++i) latest.ask(i);
  ok(latest.busy);
  gates.shift()?.();
  await new Promise((resolve) => setImmediate(resolve));
  gates.shift()?.();
  await new Promise((resolve) => setImmediate(resolve));
  deepEqual(asked, [0, 4]);
  ok(!latest.busy);
});

test("waits grow up to a bound and begin anew", () => {
  const backoff = new Backoff(100, 350);
  deepEqual([backoff.wait_ms(), backoff.wait_ms(), backoff.wait_ms(), backoff.wait_ms()], [100, 200, 350, 350]);
  backoff.succeeded();
  equal(backoff.wait_ms(), 100);
});

test("a tube's rings lie at their radius about the line and close", () => {
  const points = Float32Array.from([0, 0, 0, 0, 0, 1, 0, 1, 2, 0, 1, 2, 1, 1, 2]);
  const radii = [0.1, 0.2, 0.3, 0.3, 0];
  const { positions, indices } = tube(points, radii, 8);
  equal(positions.length, 5 * 8 * 3);
  for (let i = 0; i < 5; ++i) {
    for (let s = 0; s < 8; ++s) {
      const at = 3 * (8 * i + s);
      const d = Math.hypot(...[0, 1, 2].map((k) => (positions[at + k] ?? 0) - (points[3 * i + k] ?? 0)));
      ok(Math.abs(d - (radii[i] ?? 0)) < 1e-6, `${i} ${s}: ${d}`);
    }
  }
  equal(Math.max(...indices), 39);
  equal(tube(points.subarray(0, 3), radii).indices.length, 0);
});

test("paths are thinned with both ends kept", () => {
  deepEqual(thin(3, 10), [0, 1, 2]);
  const rows = thin(1000, 11);
  equal(rows.length, 11);
  deepEqual([rows[0], rows[10]], [0, 999]);
  deepEqual([...positionsOf([1, 2, 3, 9, 4, 5, 6, 9], 4)], [1, 2, 3, 4, 5, 6]);
});

test("colours stay within their ends whatever the weights", () => {
  deepEqual([...blend([0, 0, 0], [1, 1, 1], [-1, 0.5, 7, Number.NaN])], [0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 0, 0, 0]);
  deepEqual([...rowMaxima([0.25, 0.5, 0.75, 0], 2, 2)], [0.5, 0.75]);
});

test("numbers are told as people read them", () => {
  deepEqual([number(undefined, 2), number(Number.NaN, 2), mm(0.01234), bytes(999), bytes(1234567)], ["–", "–", "12.3 mm", "999 B", "1.23 MB"]);
  equal(toNumber("18446744073709551615"), 18446744073709551615);
  equal(base64(new Uint8Array(70000).fill(65)).length, 4 * Math.ceil(70000 / 3));
});

test("a skill's objects stand where the trials had the target on average", () => {
  const trial = (x: number) => ({ id: "", source: "", duration_s: 1, notes: [], target_pose: { position: { x, y: 1, z: 2 } } });
  const report = { target: "cup", contacts: [{ object: "cup" }, { object: "tray" }], trials: [trial(1), trial(2)] } as unknown as SkillReport;
  deepEqual(objectsOf(report), ["cup", "tray"].map((name) => ({ name, pose: { position: { x: 1.5, y: 1, z: 2 } } })));
});

test("calls carry the page's token, streams end with their error, and a gateway that is gone is told", async () => {
  const seen: RequestInit[] = [];
  const answers = [
    new Response('{"name":"anna","csrf":"abc"}'),
    new Response('{"progress":{"fraction":1}}\n{"error":{"code":"cancelled","message":"stopped"}}\n'),
    new Response('{"code":"permission_denied","message":"needs teach"}', { status: 403 }),
  ];
  const client = new Client(async (_path, init) => {
    seen.push(init ?? {});
    const answer = answers.shift();
    if (answer === undefined) throw new TypeError("failed to fetch");
    return answer;
  });
  ok(await client.greet());
  const messages: unknown[] = [];
  await rejects(client.stream("SkillService/Learn", {}, (message) => messages.push(message)), { code: "cancelled" });
  equal(messages.length, 1);
  equal((seen[1]?.headers as Record<string, string>)["X-CSRF-Token"], "abc");
  await rejects(client.call("SkillService/Learn"), { code: "permission_denied" });
  let loggedOut = 0;
  client.onLoggedOut = () => ++loggedOut;
  answers.push(new Response('{"code":"unauthenticated","message":"not known"}', { status: 401 }));
  await rejects(client.call("SkillService/List"), { code: "unauthenticated" });
  equal(loggedOut, 1);
  await rejects(client.call("SkillService/List"), { code: "unavailable", unreachable: true });
});

test("how teleoperation ended is a sentence, with what happened in it", () => {
  const result: TeleoperationResult = { state: "done", detail: "", duration_s: 20, following_s: 12.34, holds: "1", blocks: "0", touch_max_n: 3, clearance_m: 0.014 };
  equal(judgeTeleoperation(result), "Ended. The robot followed for 12.3 s of 20.0 s, held 1 time; touch up to 3.0 N, 14.0 mm clear at the nearest.");
  const stopped = judgeTeleoperation({ ...result, state: "protective_stop", detail: "stopped by a client", holds: "0", blocks: "2" });
  equal(stopped.startsWith("protective stop: stopped by a client. The robot followed for 12.3 s of 20.0 s, blocked 2 times;"), true);
});

test("a framed view shows all its points and wastes no room", () => {
  const up = new THREE.Vector3(0, 0, 1);
  const boxes = [new THREE.Box3(new THREE.Vector3(0, -0.5, 0), new THREE.Vector3(0.9, 0.4, 0.7)), new THREE.Box3(new THREE.Vector3(-3, 2, 0), new THREE.Vector3(-2.9, 2.1, 4))];
  for (const box of boxes) {
    for (const aspect of [0.5, 1, 2.2]) {
      for (const towards of [new THREE.Vector3(0.9, -0.9, 0.66), new THREE.Vector3(-0.01, 0, 1.7)]) {
        const points = cornersOf(box);
        const frame = frameOf(points, towards, up, 38, aspect, 0.05);
        const camera = new THREE.PerspectiveCamera(38, aspect, 0.02, 50);
        camera.up.copy(up);
        camera.position.copy(frame.position);
        camera.lookAt(frame.target);
        camera.updateMatrixWorld(true);
        const seen = points.map((point) => point.clone().project(camera));
        const [x, y] = [seen.map((p) => p.x), seen.map((p) => p.y)];
        const [width, height] = [Math.max(...x) - Math.min(...x), Math.max(...y) - Math.min(...y)];
        for (const p of seen) ok(Math.abs(p.x) < 0.9 + 1e-6 && Math.abs(p.y) < 0.9 + 1e-6, `${p.x} ${p.y}`);
        ok(Math.max(width, height) > 1.7, `${width} by ${height} of 1.8 for ${aspect}`);
      }
    }
  }
  deepEqual(cornersOf(new THREE.Box3()), []);
});
