"""Foxglove's own client library before a real station: topics, robot, plan, services, a recording that it steers.

Runs in a network namespace of its own (made by run_isolated).
"""

import json
import pathlib
import shutil
import socket
import subprocess
import tempfile
import unittest
import urllib.request

import trials
from processes import Programs, exemplar, wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
NODE = ROOT / "tests" / "conformance" / "node"
ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = "obstacles: []\nbuttons:\n  - {name: target, position: [0.55, -0.15, 0.05], height: 0.02, radius: 0.02}\n"
TARGET = {"name": "target", "pose": {"position": {"x": 0.55, "y": -0.15, "z": 0.05}, "rotation": {"w": 1}}}
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06)]


class Client:
    """One connection of the npm client."""

    def __init__(self, url, subprotocol):
        self.process = subprocess.Popen(
            ["node", "foxglove_client.mjs", url, subprotocol], cwd=NODE, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __call__(self, do, **words):
        self.process.stdin.write(json.dumps({"do": do, **words}) + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        if isinstance(answer, dict) and "error" in answer:
            raise AssertionError(f"{do} {words}: {answer}")
        return answer

    def first(self, topic):
        self("subscribe", topic=topic)
        return self("collect", topic=topic, count=1)[0]["message"]

    def end(self):
        self.process.stdin.close()
        self.process.wait(60)
        self.process.stdout.close()


class FoxgloveTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if not shutil.which("node") or not (NODE / "node_modules" / "@foxglove" / "ws-protocol").exists():
            raise unittest.SkipTest("tests/conformance/node has no node_modules: run npm ci there")
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-foxglove-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.programs = Programs(cls.folder, "92")
        cls.addClassCleanup(cls.programs.end)
        scene = cls.folder / "scene.yaml"
        scene.write_text(SCENE, encoding="utf-8")
        # The simulated time waits for the executor: how busy the machine is does not matter.
        cls.programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", scene, "--cameras", "off", "--track-hz", "20", "--in-step-with", "executor")
        _, recorder = cls.programs.recorder()
        learning = cls.server("exemplar-learning", "--data-dir", cls.folder / "skills", "--robot", ROBOT, bus=False)
        executor = cls.server("exemplar-executor", "--robot", ROBOT, "--scene", scene, "--learning", learning, "--clock", "network")
        port_file = cls.folder / "http-port"
        cls.address = cls.server(
            "exemplar-gateway", "--learning", learning, "--executor", executor, "--recorder", recorder, "--robot", ROBOT,
            "--http", "127.0.0.1:0", "--http-port-file", port_file, "--recordings", cls.folder / "data", "--publish", "ircp/suit",
        )  # fmt: skip
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), "the HTTP port")
        cls.port = int(port_file.read_text())
        exemplar("--server", cls.address, "trial", "submit", "--skill", "press", *trials.write_set(cls.folder / "trials", BUTTONS))
        exemplar("--server", cls.address, "skill", "learn", "press")
        wait_for(lambda: exemplar("--server", cls.address, "robot", "status").get("joint_names"), "the robot's joint state")

    @classmethod
    def server(cls, program, *words, bus=True):
        port_file = cls.folder / f"port-{len(cls.programs.running)}"
        cls.programs.start(program, "--listen", "127.0.0.1:0", "--port-file", port_file, *words, bus=bus)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), f"the port of {program}")
        return "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]

    def client(self, path="/", subprotocol="foxglove.websocket.v1"):
        client = Client(f"ws://127.0.0.1:{self.port}{path}", subprotocol)
        self.addCleanup(client.end)
        return client

    def metrics(self):
        with urllib.request.urlopen(f"http://127.0.0.1:{self.port}/metrics", timeout=60) as answer:
            rows = (line.rpartition(" ") for line in answer.read().decode().splitlines() if not line.startswith("#"))
            return {name: float(value) for name, _, value in rows}

    def test_topics_are_decoded_by_their_schema(self):
        client = self.client()
        greeting = client("greeting")
        self.assertIn("services", greeting["info"]["capabilities"])
        encodings = {(channel["encoding"], channel["schemaEncoding"]) for channel in greeting["channels"]}
        self.assertEqual(encodings, {("cdr", "omgidl")})
        client("subscribe", topic="ircp/joint_state")
        states = [entry["message"] for entry in client("collect", topic="ircp/joint_state", count=100)]
        numbers = [int(state["seq"]) for state in states]
        self.assertEqual(numbers, list(range(numbers[0], numbers[0] + 100)))
        self.assertEqual(len(states[0]["names"]), len(states[0]["positions"]))

    def test_the_robot_and_what_is_around_it_are_a_scene(self):
        client = self.client(subprotocol="foxglove.sdk.v1")
        self.assertEqual(client("greeting")["subprotocol"], "foxglove.sdk.v1")
        robot = client.first("exemplar/robot")
        frames = {entity["frame_id"] for entity in robot["entities"]}
        shapes = sum(len(entity[kind]) for entity in robot["entities"] for kind in ("cubes", "cylinders", "spheres", "models"))
        self.assertGreater(shapes, 6)
        transforms = client.first("exemplar/transforms")["transforms"]
        children = {transform["child_frame_id"] for transform in transforms}
        parents = {transform["parent_frame_id"] for transform in transforms}
        self.assertLessEqual(frames, children | parents)
        for transform in transforms:
            self.assertAlmostEqual(sum(value**2 for value in transform["rotation"].values()), 1, places=9)
        target = client.first("exemplar/objects")["entities"][0]
        self.assertEqual(target["texts"][0]["text"], "target")
        self.assertAlmostEqual(target["cubes"][0]["pose"]["position"]["x"], 0.55, places=2)

    def test_a_plan_is_made_drawn_and_carried_out(self):
        client = self.client()
        client("greeting")
        execution = {"skill": {"name": "press"}, "objects": [TARGET]}
        plan = client("call", service="/executor/plan", request={"execution": execution})
        self.assertNotIn("failure", plan, self.programs.logs())
        done = client("call", service="/executor/execute", request={"execution": execution})
        self.assertEqual(done["result"]["state"], "done", done)
        drawn = client.first("exemplar/plan")["entities"][0]
        line = drawn["lines"][0]
        self.assertGreater(len(line["points"]), 50)
        lowest = min(line["points"], key=lambda point: point["z"])
        self.assertLess(abs(lowest["x"] - 0.55) + abs(lowest["y"] + 0.15), 0.03)
        refused = client("call", service="/executor/execute", request={"execution": {"skill": {"name": "nothing"}, "objects": [TARGET]}})
        self.assertIn("nothing", refused["failure"])
        self.assertIn("no service of id 4711", client("call", service="/none", request={})["failure"])
        status = client("call", service="/executor/status", request={})
        self.assertEqual(len(status["joint_names"]), 7)

    def test_a_recording_is_made_and_then_steered(self):
        client = self.client()
        client("greeting")
        started = client("call", service="/recorder/start", request={"name": "show"})
        self.assertNotIn("failure", started)
        client("subscribe", topic="ircp/joint_state")
        client("collect", topic="ircp/joint_state", count=100)
        client("call", service="/recorder/event", request={"note": "halfway"})
        client("call", service="/recorder/stop", request={})
        info = exemplar("record", "info", self.folder / "data" / "show.mcap")
        recorded = {entry["topic"]: entry["messages"] for entry in info["topics"]}

        viewer = self.client("/foxglove/recordings/show.mcap", "foxglove.sdk.v1")
        greeting = viewer("greeting")["info"]
        self.assertIn("playbackControl", greeting["capabilities"])
        viewer("subscribe", topic="ircp/joint_state")
        begin, end = (greeting[name]["sec"] * 10**9 + greeting[name]["nsec"] for name in ("dataStartTime", "dataEndTime"))
        self.assertEqual(viewer("control", play=False, speed=1, seek=None, id="a")["status"], 1)
        sought = viewer("control", play=False, speed=1, seek=str((begin + end) // 2), id="b")
        self.assertEqual((sought["sought"], int(sought["time"])), (True, (begin + end) // 2))
        viewer("control", play=True, speed=20, seek=str(begin), id="c")
        played = viewer("played")
        self.assertEqual(int(played["state"]["time"]), end)
        self.assertEqual(played["counts"]["ircp/joint_state"], recorded["ircp/joint_state"])

    def test_clients_that_behave_badly_are_refused_and_others_served_on(self):
        client = self.client()
        client("greeting")
        before = self.metrics()
        client("publish", topic="ircp/joint_command", type="exemplar::ircp::v1::JointCommand", message={})
        self.assertIn("ircp/joint_command", client("status")["message"])
        half_open = socket.create_connection(("127.0.0.1", self.port))
        self.addCleanup(half_open.close)
        half_open.sendall(b"GET /foxglove HTTP/1.1\r\nUpgra")
        page = socket.create_connection(("127.0.0.1", self.port))
        page.sendall(
            b"GET /foxglove HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\nOrigin: http://evil.example\r\n\r\n"
        )
        self.assertIn(b" 403 ", page.recv(4096))
        page.close()
        for number in range(1000):
            hasty = socket.socket()
            hasty.bind(("127.0.0.2", 0))
            hasty.connect(("127.0.0.1", self.port))
            hasty.close()
        client("subscribe", topic="ircp/joint_state")
        self.assertEqual(len(client("collect", topic="ircp/joint_state", count=50)), 50)
        after = self.metrics()
        self.assertGreater(after["exemplar_http_refused_connections_total"], before["exemplar_http_refused_connections_total"])
        self.assertEqual(after["exemplar_http_refused_origins_total"], before["exemplar_http_refused_origins_total"] + 1)
        self.assertGreater(after["exemplar_gateway_foxglove_refused_total"], before["exemplar_gateway_foxglove_refused_total"])


if __name__ == "__main__":
    unittest.main()
