"""The gateway before real services: an operator's whole work through its one address, curl, and clients that behave badly.

Runs in a network namespace of its own (made by run_isolated).
"""

import base64
import json
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile
import threading
import time
import unittest
import urllib.error
import urllib.request

import trials
from processes import BINARIES, Programs, exemplar, wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = "obstacles: []\nbuttons:\n  - {name: target, position: [0.55, -0.15, 0.05], height: 0.02, radius: 0.02}\n"
OBJECT = "target=0.55,-0.15,0.05,0,0,0,1"
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06)]


class GatewayTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-gateway-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.programs = Programs(cls.folder, "94")
        cls.addClassCleanup(cls.programs.end)
        scene = cls.folder / "scene.yaml"
        scene.write_text(SCENE, encoding="utf-8")
        cls.programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", scene, "--cameras", "off")
        cls.recorder, recorder = cls.programs.recorder()
        cls.recorder_address = recorder
        _, learning = cls.server("exemplar-learning", "--data-dir", cls.folder / "skills", "--robot", ROBOT, bus=False)
        _, executor = cls.server("exemplar-executor", "--robot", ROBOT, "--scene", scene, "--learning", learning)
        http_port = cls.folder / "http-port"
        cls.gateway, cls.address = cls.server(
            "exemplar-gateway", "--learning", learning, "--executor", executor, "--recorder", recorder,
            "--http", "127.0.0.1:0", "--http-port-file", http_port, "--publish", "ircp/suit",
        )  # fmt: skip
        wait_for(lambda: http_port.exists() and http_port.read_text().strip(), "the gateway's HTTP port")
        cls.http = "http://127.0.0.1:" + http_port.read_text().strip()
        cls.files = trials.write_set(cls.folder / "trials", BUTTONS)
        cls.cli("trial", "submit", "--skill", "press", *cls.files)
        cls.cli("skill", "learn", "press")
        wait_for(lambda: cls.cli("robot", "status").get("joint_names"), "the robot's joint state")

    @classmethod
    def server(cls, program, *words, bus=True):
        port_file = cls.folder / f"port-{len(cls.programs.running)}"
        process = cls.programs.start(program, "--listen", "127.0.0.1:0", "--port-file", port_file, *words, bus=bus)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), f"the port of {program}")
        return process, "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]

    @classmethod
    def cli(cls, *words):
        return exemplar("--server", cls.address, *words)

    def ask(self, path, body=None, **headers):
        """Status, header fields and JSON of a call."""
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        request = urllib.request.Request(self.http + path, data=data, headers={k.replace("_", "-"): v for k, v in headers.items()})
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                return answer.status, answer.headers, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.headers, error.read().decode()

    def metrics(self):
        rows = (line.rpartition(" ") for line in self.ask("/metrics")[2].splitlines() if not line.startswith("#"))
        return {name: float(value) for name, _, value in rows}

    # ---- an operator's work ----

    def test_an_operator_needs_one_address(self):
        self.cli("record", "start", "--name", "through-the-gateway")
        self.assertEqual(len(self.cli("trial", "list")), len(BUTTONS))
        motion = self.cli("skill", "query", "press", "--object", OBJECT)
        self.assertGreater(len(motion["time_s"]), 100)
        done = self.cli("skill", "execute", "press", "--object", OBJECT, "--wait")
        self.assertEqual(done["state"], "done", self.programs.logs())
        status = self.cli("record", "stop")
        self.assertEqual(status["lost"], 0)
        self.assertTrue((self.folder / "data" / "through-the-gateway.mcap").exists())

    def test_errors_come_through_as_the_services_gave_them(self):
        done = subprocess.run([BINARIES / "exemplar", "--server", self.address, "skill", "show", "nothing"], capture_output=True, text=True, timeout=20)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("nothing", done.stderr)

    # ---- HTTP ----

    def test_the_examples_of_the_documentation_run(self):
        if not shutil.which("curl"):
            self.skipTest("curl is not installed")
        text = (ROOT / "docs" / "gateway.md").read_text(encoding="utf-8")
        examples = re.findall(r"^curl .*$", text, re.MULTILINE)
        self.assertGreater(len(examples), 8)
        for example in examples:
            with self.subTest(example):
                command = example.replace("http://127.0.0.1:8080", self.http)
                done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
                self.assertEqual(done.returncode, 0, done.stdout[:2000] + done.stderr)

    def test_calls_as_json_do_what_the_command_line_does(self):
        status, headers, text = self.ask("/exemplar.v1.SkillService/Get?skill.name=press", X_Request_Id="mine-7")
        self.assertEqual(status, 200, text)
        self.assertEqual(headers["X-Request-Id"], "mine-7")
        header = {"header": {"skill": "from-http", "name": "a.csv"}}
        chunk = {"chunk": {"data": base64.b64encode(self.files[0].read_bytes()).decode()}}
        body = (json.dumps(header) + "\n" + json.dumps(chunk) + "\n").encode()
        status, _, text = self.ask("/exemplar.v1.TrialService/Submit", body)
        self.assertEqual(status, 200, text)
        trial = json.loads(text)["trial"]
        self.assertEqual(trial["skill"], "from-http")
        self.assertEqual(self.ask("/exemplar.v1.TrialService/Delete", {"id": trial["id"]})[0], 200)

    def test_progress_streams_line_by_line(self):
        status, headers, text = self.ask("/exemplar.v1.SkillService/Learn", {"name": "press"})
        self.assertEqual(status, 200, text)
        self.assertEqual(headers["Content-Type"], "application/x-ndjson")
        lines = [json.loads(line) for line in text.splitlines()]
        self.assertIn("progress", lines[0])
        self.assertNotIn("error", lines[-1])

    def test_json_errors_name_code_message_and_place(self):
        for body, status, code, part in (
            (b'{"skill":\n {"name" "press"}}', 400, "invalid_argument", "line 2, column 16"),
            (b'{"skill": {"nam": "press"}}', 400, "invalid_argument", "did you mean name?"),
            (b'{"skill": {"name": "nothing"}}', 404, "not_found", "nothing"),
            (b"\xff\xfe", 400, "invalid_argument", "line 1"),
        ):
            got, _, text = self.ask("/exemplar.v1.SkillService/Get", body)
            error = json.loads(text)
            self.assertEqual((got, error["code"]), (status, code), text)
            self.assertIn(part, error["message"])
        self.assertEqual(self.ask("/exemplar.v1.SkillService/Nothing", {})[0], 404)
        self.assertEqual(self.ask("/exemplar.v9.SkillService/Get", {})[0], 404)

    def test_openapi_describes_every_call(self):
        document = json.loads(self.ask("/openapi.json")[2])
        for service in ("TrialService/Submit", "SkillService/Query", "ExecutorService/Execute", "RecorderService/Start", "TopicService/Subscribe"):
            self.assertIn(f"/exemplar.v1.{service}", document["paths"])
        text = json.dumps(document)
        for name in set(re.findall(r"#/components/schemas/([\w.]+)", text)):
            self.assertIn(name, document["components"]["schemas"])

    # ---- topics ----

    def test_topics_are_listed_and_streamed(self):
        topics = {topic["topic"]: topic for topic in json.loads(self.ask("/exemplar.v1.TopicService/List")[2])["topics"]}
        state = topics["ircp/joint_state"]
        self.assertEqual(state["type"], "exemplar::ircp::v1::JointState")
        self.assertIn("struct JointState", state["schema"])
        self.assertGreater(state["rate_hz"], 10)
        self.assertEqual(state["writers"], 1)
        self.assertEqual(state["lost"], "0")
        sample = self.first_sample({"topics": ["ircp/joint_state"], "content": "CONTENT_JSON"})
        values = json.loads(sample["json"])
        self.assertEqual(len(values["names"]), len(values["positions"]))

    def first_sample(self, request):
        data = json.dumps(request).encode()
        with urllib.request.urlopen(urllib.request.Request(self.http + "/exemplar.v1.TopicService/Subscribe", data=data), timeout=20) as stream:
            for line in stream:
                for sample in json.loads(line)["samples"]:
                    return sample

    def test_clients_publish_where_they_may(self):
        got = []
        listener = threading.Thread(target=lambda: got.append(self.first_sample({"topics": ["ircp/suit"], "content": "CONTENT_JSON"})))
        listener.start()
        sample = {"names": ["elbow"], "positions": [0.5]}
        while listener.is_alive():
            status, _, text = self.ask("/exemplar.v1.TopicService/Publish", {"topic": "ircp/suit", "json": json.dumps(sample)})
            self.assertEqual(status, 200, text)
            listener.join(0.2)
        values = json.loads(got[0]["json"])
        self.assertEqual((values["names"], values["positions"], values["source"]), (["elbow"], [0.5], "gateway"))
        status, _, text = self.ask("/exemplar.v1.TopicService/Publish", {"topic": "ircp/joint_command", "json": "{}"})
        self.assertEqual((status, json.loads(text)["field"]), (400, "topic"), text)
        status, _, text = self.ask("/exemplar.v1.TopicService/Publish", {"topic": "ircp/suit", "json": '{"names": 5}'})
        self.assertEqual((status, json.loads(text)["field"]), (400, "json.names"), text)
        self.assertGreaterEqual(self.metrics()["exemplar_gateway_publications_refused_total"], 2)

    # ---- clients that behave badly ----

    def test_everyone_is_served_on_whatever_some_do(self):
        host, port = self.http.removeprefix("http://").split(":")
        grpc_port = int(self.address.rsplit(":", 1)[1])
        half_open = [socket.create_connection((host, int(port))) for _ in range(50)]
        half_open += [socket.create_connection((host, grpc_port)) for _ in range(50)]
        for client in half_open:
            self.addCleanup(client.close)
        for number, client in enumerate(half_open[:50]):
            client.send(b"POST /exemplar.v1.SkillService/Get HTTP/1.1\r\nContent-Le"[: 3 + number])
        for client in half_open[50:]:
            client.send(b"PRI * HTTP/2.0\r\n\r\nSM")
        before = self.metrics()
        begin, connected = time.monotonic(), 0
        for number in range(1000):
            with socket.socket() as client:
                client.settimeout(2)
                client.connect((host, grpc_port if number % 2 else int(port)))
                connected += 1
        self.assertEqual(connected, 1000)
        self.assertLess(time.monotonic() - begin, 20)
        with socket.create_connection((host, grpc_port)) as client:
            client.sendall(b"\x00\x01garbage" * 10000)
        self.retry("/healthz")
        with socket.create_connection((host, int(port)), timeout=20) as client:
            client.sendall(b"POST /exemplar.v1.SkillService/Get HTTP/1.1\r\nHost: a\r\nContent-Length: %d\r\n\r\n" % (17 << 20))
            self.assertIn(b" 413 ", client.recv(100))
        self.assertEqual(self.retry("/exemplar.v1.SkillService/List")[0], 200)
        self.assertEqual(self.cli("skill", "show", "press")["skill"], "press")
        after = self.metrics()
        self.assertGreater(after["exemplar_http_connections_total"] + after["exemplar_http_refused_connections_total"],
                           before["exemplar_http_connections_total"] + 100)
    def retry(self, path):
        """As ask, once the limit of connections a second allows it."""
        answers = []

        def done():
            try:
                answers.append(self.ask(path))
            except OSError:
                return False
            return True

        wait_for(done, path)
        return answers[0]

    def test_a_stalled_client_misses_and_nobody_waits(self):
        host, port = self.http.removeprefix("http://").split(":")
        body = json.dumps({"topics": ["*"], "queue": 5}).encode()
        others = self.metrics()["exemplar_gateway_subscriptions"]
        with socket.socket() as stalled:
            stalled.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            stalled.connect((host, int(port)))
            stalled.sendall(b"POST /exemplar.v1.TopicService/Subscribe HTTP/1.1\r\nHost: a\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
            wait_for(lambda: self.metrics()["exemplar_gateway_missed_total"] > 0, "a sample to be missed", 60)
            self.assertIsNotNone(self.first_sample({"topics": ["ircp/joint_state"]}))
        wait_for(lambda: self.metrics()["exemplar_gateway_subscriptions"] <= others, "the stalled client to be given up", 60)


class LostBackendTest(unittest.TestCase):
    def test_a_backend_that_goes_is_named_and_comes_back(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-gateway-"))
        self.addCleanup(shutil.rmtree, folder)
        programs = Programs(folder, "93")
        self.addCleanup(programs.end)
        recorder, address = programs.recorder()
        port_file, http_file = folder / "gateway-port", folder / "http-port"
        programs.start("exemplar-gateway", "--recorder", address, "--port-file", port_file, "--http", "127.0.0.1:0", "--http-port-file", http_file)
        wait_for(lambda: http_file.exists(), "the gateway")
        gateway = "127.0.0.1:" + port_file.read_text().strip()

        def health():
            with urllib.request.urlopen(f"http://127.0.0.1:{http_file.read_text().strip()}/healthz", timeout=5) as answer:
                return json.loads(answer.read())["status"]

        wait_for(lambda: health() == "ok", "the recorder to serve")
        recorder.kill()
        recorder.wait()
        wait_for(lambda: health() == "degraded", "the gateway to notice")
        done = subprocess.run([BINARIES / "exemplar", "--server", gateway, "record", "status"], capture_output=True, text=True, timeout=20)
        self.assertEqual(done.returncode, 5, done.stderr)
        self.assertIn(f"recorder ({address})", done.stderr)
        programs.start("exemplar-recorder", "--listen", address, "--data-dir", folder / "again")
        wait_for(lambda: health() == "ok", "the recorder to be back")
        self.assertEqual(exemplar("--server", gateway, "record", "status")["state"], "ready")


if __name__ == "__main__":
    unittest.main()
