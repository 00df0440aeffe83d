"""The gateway before real services: an operator's whole work through its one address, curl, and clients that behave badly.

Runs in a network namespace of its own (made by run_isolated).
"""

import base64
import http.client
import json
import pathlib
import re
import shutil
import socket
import ssl
import subprocess
import tempfile
import threading
import unittest
import urllib.error
import urllib.request

import trials
from processes import BINARIES, Programs, exemplar, wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROBOT = ROOT / "deploy" / "models" / "arm7"
PRESS = ROOT / "deploy" / "config" / "rail_press.yaml"
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
        # The simulated time waits for the executor: how busy the machine is does not matter.
        cls.programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", scene, "--cameras", "off", "--in-step-with", "executor")
        cls.recorder, recorder = cls.programs.recorder()
        cls.recorder_address = recorder
        _, learning = cls.server("exemplar-learning", "--data-dir", cls.folder / "skills", "--robot", ROBOT, bus=False)
        _, executor = cls.server("exemplar-executor", "--robot", ROBOT, "--scene", scene, "--learning", learning, "--clock", "network")
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
            with urllib.request.urlopen(request, timeout=60) as answer:
                return answer.status, answer.headers, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.headers, error.read().decode()

    def metrics(self):
        rows = (line.rpartition(" ") for line in self.ask("/metrics")[2].splitlines() if not line.startswith("#"))
        return {name: float(value) for name, _, value in rows}

    # ---- an operator's work ----

    def test_an_operator_needs_one_address(self):
        self.cli("record", "start", "--name", "through-the-gateway", "--topic", "ircp/joint_command", "--wait", "60")
        self.assertEqual(len(self.cli("trial", "list")), len(BUTTONS))
        motion = self.cli("skill", "query", "press", "--object", OBJECT)
        self.assertGreater(len(motion["time_s"]), 100)
        done = self.cli("skill", "execute", "press", "--object", OBJECT, "--wait")
        self.assertEqual(done["state"], "done", self.programs.logs())
        status = self.cli("record", "stop")
        self.assertEqual(status["lost"], 0)
        self.assertTrue((self.folder / "data" / "through-the-gateway.mcap").exists())

    def test_errors_come_through_as_the_services_gave_them(self):
        done = subprocess.run([BINARIES / "exemplar", "--server", self.address, "skill", "show", "nothing"], capture_output=True, text=True, timeout=60)
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
        def told():
            topics = json.loads(self.ask("/exemplar.v1.TopicService/List")[2])["topics"]
            return next((topic for topic in topics if topic["topic"] == "ircp/joint_state"), {"rate_hz": 0})

        wait_for(lambda: told()["rate_hz"] > 10, "a second of joint states")
        state = told()
        self.assertEqual(state["type"], "exemplar::ircp::v1::JointState")
        self.assertIn("struct JointState", state["schema"])
        self.assertEqual(state["writers"], 1)
        self.assertEqual(state["lost"], "0")
        sample = self.first_sample({"topics": ["ircp/joint_state"], "content": "CONTENT_JSON"})
        values = json.loads(sample["json"])
        self.assertEqual(len(values["names"]), len(values["positions"]))

    def first_sample(self, request):
        data = json.dumps(request).encode()
        with urllib.request.urlopen(urllib.request.Request(self.http + "/exemplar.v1.TopicService/Subscribe", data=data), timeout=60) as stream:
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
        for number in range(1000):
            with socket.create_connection((host, grpc_port if number % 2 else int(port)), timeout=60):
                pass
        with socket.create_connection((host, grpc_port), timeout=60) as client:
            client.sendall(b"\x00\x01garbage" * 10000)
        self.retry(lambda: self.ask("/healthz"))

        def answer(request):
            with socket.create_connection((host, int(port)), timeout=60) as client:
                client.sendall(request)
                return client.recv(100)

        huge = b"POST /exemplar.v1.SkillService/Get HTTP/1.1\r\nHost: a\r\nContent-Length: %d\r\n\r\n" % (17 << 20)
        self.assertIn(b" 413 ", self.retry(lambda: answer(huge)))
        self.assertEqual(self.retry(lambda: self.ask("/exemplar.v1.SkillService/List"))[0], 200)
        self.assertEqual(self.cli("skill", "show", "press")["skill"], "press")
        self.assertEqual(self.retry(lambda: self.ask("/healthz", Origin="https://elsewhere.example"))[0], 403)
        for subprotocol in ("foxglove.websocket.v9", ""):
            upgrade = (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                       b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: %s\r\n\r\n" % subprotocol.encode())  # fmt: skip
            self.assertIn(b" 400 ", self.retry(lambda upgrade=upgrade: answer(upgrade)))

        def grown(name, by):
            return self.metrics()[f"exemplar_http_{name}_total"] >= before[f"exemplar_http_{name}_total"] + by

        self.assertTrue(grown("bad_requests", 1))  # the huge one
        self.assertTrue(grown("refused_origins", 1))
        self.assertTrue(grown("refused_requests", 2))  # of another version
        wait_for(lambda: grown("timeouts", 50), "the half-open requests to be cut")

    def retry(self, ask):
        """The answer, once the limit of connections a second allows one."""
        answers = []

        def done():
            try:
                answers.append(ask())
            except (OSError, http.client.HTTPException):
                return False
            return bool(answers[-1])

        wait_for(done, "the gateway to answer")
        return answers[-1]

    def test_a_stalled_client_misses_and_nobody_waits(self):
        host, port = self.http.removeprefix("http://").split(":")
        body = json.dumps({"topics": ["*"], "queue": 5}).encode()
        others = self.metrics()["exemplar_gateway_subscriptions"]
        with socket.socket() as stalled:
            stalled.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            stalled.connect((host, int(port)))
            stalled.sendall(b"POST /exemplar.v1.TopicService/Subscribe HTTP/1.1\r\nHost: a\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
            wait_for(lambda: self.metrics()["exemplar_gateway_missed_total"] > 0, "a sample to be missed")
            self.assertIsNotNone(self.first_sample({"topics": ["ircp/joint_state"]}))
        wait_for(lambda: self.metrics()["exemplar_gateway_subscriptions"] <= others, "the stalled client to be given up", 90)


class OnlookerTest(unittest.TestCase):
    def test_a_capture_waits_for_its_readers_and_not_for_the_gateway(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-gateway-"))
        self.addCleanup(shutil.rmtree, folder)
        programs = Programs(folder, "93")
        self.addCleanup(programs.end)
        port_file = folder / "http-port"
        programs.start("exemplar-gateway", "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--http-port-file", port_file)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), "the gateway")
        gateway = f"http://127.0.0.1:{port_file.read_text().strip()}/exemplar.v1.TopicService/List"

        def sent():
            """The topic as the gateway knows it, or nothing."""
            with urllib.request.urlopen(gateway, timeout=60) as answer:
                return {topic["topic"]: topic for topic in json.loads(answer.read())["topics"]}.get("ircp/end_effector")

        trial = trials.write_set(folder / "trials", BUTTONS[:1])[0]
        with open(trial, encoding="utf-8") as stream:
            samples = sum(1 for _ in stream) - 1
        capture = programs.start("exemplar-capture-suit", "--replay", trial)
        wait_for(lambda: sent() and sent()["writers"], "the gateway to hear the capture")
        _, recorder = programs.recorder()
        self.assertEqual(capture.wait(60), 0, programs.logs())
        recorded = {topic["topic"]: topic["received"] for topic in exemplar("--server", recorder, "record", "status")["topics"]}
        self.assertEqual(recorded["ircp/end_effector"], samples, programs.logs())


class WebSocket:
    """A client of Foxglove's protocol over TLS: whole, short frames only."""

    def __init__(self, connection, path, origin=None):
        self.connection, self.read = connection, b""
        lines = [f"GET {path} HTTP/1.1", "Host: 127.0.0.1", "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                 "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Protocol: foxglove.websocket.v1"]  # fmt: skip
        connection.sendall("\r\n".join([*lines, *([f"Origin: {origin}"] if origin else []), "", ""]).encode())
        while b"\r\n\r\n" not in self.read:
            self.read += connection.recv(4096)
        head, _, self.read = self.read.partition(b"\r\n\r\n")
        self.status = int(head.split()[1])

    def take(self, size):
        while len(self.read) < size:
            more = self.connection.recv(1 << 16)
            if not more:
                raise EOFError("the gateway closed the WebSocket")
            self.read += more
        taken, self.read = self.read[:size], self.read[size:]
        return taken

    def send(self, first, payload):
        size = bytes([0x80 | len(payload)]) if len(payload) < 126 else bytes([0x80 | 126]) + len(payload).to_bytes(2, "big")
        self.connection.sendall(bytes([first]) + size + bytes(4) + payload)

    def say(self, **message):
        self.send(0x81, json.dumps(message).encode())

    def call(self, service, request):
        """A service call's answer: its JSON, or the failure's text."""
        self.send(0x82, bytes([2]) + service.to_bytes(4, "little") + bytes([1, 0, 0, 0, 4, 0, 0, 0]) + b"json" + json.dumps(request).encode())
        while True:
            answer = self.next()
            if isinstance(answer, bytes) and answer[0] == 3:
                return json.loads(answer[17:])
            if isinstance(answer, dict) and answer["op"] == "serviceCallFailure":
                return answer["message"]

    def next(self):
        """A text as JSON, anything else as bytes."""
        first, size = self.take(2)
        if size >= 126:
            size = int.from_bytes(self.take(2 if size == 126 else 8), "big")
        payload = self.take(size)
        return json.loads(payload) if first == 0x81 else payload

    def hear(self, op):
        while True:
            message = self.next()
            if isinstance(message, dict) and message["op"] == op:
                return message


class AccessTest(unittest.TestCase):
    """HTTPS, gRPC over TLS and WebSockets under one access file; the recorder behind judges the same people."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-gateway-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.programs = Programs(cls.folder, "93")
        cls.addClassCleanup(cls.programs.end)
        station = cls.folder / "station"
        cls.security("init", station, "--station", "test")
        for member in ("gateway", "recorder"):
            cls.security("issue", station, member, "--role", member, "--host", "127.0.0.1")
        cls.tokens = {}
        for role in ("observe", "record", "administer"):
            said = cls.security("token", station, f"{role}r", "--role", role)
            cls.tokens[role] = re.search(r"exm_\S+", said).group()
        cls.authority = station / "members" / "gateway" / "ca.pem"

        def identity(member):
            folder = station / "members" / member
            return "--tls-cert", folder / "cert.pem", "--tls-key", folder / "key.pem", "--access", station / "access.yaml"

        _, recorder = cls.programs.recorder(*identity("recorder"), "--tls-client-ca", cls.authority)
        port_file, http_file = cls.folder / "grpc-port", cls.folder / "http-port"
        cls.programs.start(
            "exemplar-gateway", *identity("gateway"), "--tls-ca", cls.authority, "--recorder", recorder, "--publish", "ircp/suit",
            "--listen", "127.0.0.1:0", "--port-file", port_file, "--http", "127.0.0.1:0", "--http-port-file", http_file,
        )  # fmt: skip
        wait_for(lambda: http_file.exists() and http_file.read_text().strip(), "the gateway's ports")
        cls.grpc = "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]
        cls.http_port = int(http_file.read_text())
        cls.tls = ssl.create_default_context(cafile=cls.authority)

    @staticmethod
    def security(*words):
        done = subprocess.run([str(word) for word in (BINARIES / "exemplar", "security", *words)], capture_output=True, text=True, timeout=60)
        if done.returncode != 0:
            raise AssertionError(f"{words}: {done.stderr}")
        return done.stdout

    def ask(self, path, body=None, **headers):
        """Status, header fields and JSON of a call."""
        url = f"https://127.0.0.1:{self.http_port}{path}"
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(url, data=data, headers={name.replace("_", "-"): value for name, value in headers.items()})
        try:
            with urllib.request.urlopen(request, timeout=60, context=self.tls) as answer:
                return answer.status, answer.headers, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.headers, error.read().decode()

    def as_role(self, role, path, body=None):
        status, _, text = self.ask(path, body, Authorization=f"Bearer {self.tokens[role]}")
        return status, json.loads(text)

    def open(self, path, **options):
        tcp = socket.create_connection(("127.0.0.1", self.http_port), timeout=60)
        connection = self.tls.wrap_socket(tcp, server_hostname="127.0.0.1")
        self.addCleanup(connection.close)
        return WebSocket(connection, path, **options)

    def test_http_calls_are_judged_by_role(self):
        get, start, stop = (f"/exemplar.v1.RecorderService/{method}" for method in ("GetStatus", "Start", "Stop"))
        for bearer in (None, "Bearer exm_wrong"):
            status, headers, _ = self.ask(get, **({"Authorization": bearer} if bearer else {}))
            self.assertEqual((status, headers["WWW-Authenticate"]), (401, 'Bearer realm="exemplar"'))
        self.assertEqual(self.as_role("observe", get)[0], 200)
        status, refusal = self.as_role("observe", start, {"name": "http"})
        self.assertEqual((status, refusal["code"]), (403, "permission_denied"))
        self.assertIn("observer", refusal["message"])
        self.assertIn("record", refusal["message"])
        status, answer = self.as_role("record", start, {"name": "http"})
        self.assertEqual(status, 200, answer)
        self.assertEqual(self.as_role("record", stop, {})[0], 200)

    def test_topics_are_watched_by_observers_and_written_by_administrators(self):
        service = "/exemplar.v1.TopicService/"
        self.assertEqual(self.ask(service + "List")[0], 401)
        self.assertEqual(self.ask(service + "Subscribe", {})[0], 401)
        wait_for(lambda: "ircp/recorder/status" in str(self.as_role("observe", service + "List")), "the recorder's topic in the list")
        sample = {"topic": "ircp/suit", "json": '{"names": ["elbow"], "positions": [0.5]}'}
        for role, expected in (("observe", 403), ("record", 403), ("administer", 200)):
            self.assertEqual(self.as_role(role, service + "Publish", sample)[0], expected, role)

    def test_grpc_calls_are_judged_by_the_same_roles(self):
        def run(role, *words):
            command = [BINARIES / "exemplar", "--server", self.grpc, "--tls-ca", self.authority, *words]
            token = ["--token", self.tokens[role]] if role else []
            return subprocess.run([str(word) for word in [*command, *token]], capture_output=True, text=True, timeout=60)

        self.assertNotEqual(run(None, "record", "status").returncode, 0)
        self.assertEqual(run("observe", "record", "status").returncode, 0)
        self.assertEqual(run("observe", "watch", "--count", "1", "ircp/recorder/status").returncode, 0)
        refused = run("observe", "record", "start", "--name", "grpc")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("observer", refused.stderr)
        self.assertEqual(run("record", "record", "start", "--name", "grpc").returncode, 0)
        self.assertEqual(run("record", "record", "stop").returncode, 0)

    def test_websockets_are_judged_call_by_call(self):
        self.assertEqual(self.open("/").status, 401)
        self.assertIn(self.open("/?token=exm_wrong").status, (401, 429))  # 429 soon after another wrong one
        self.assertEqual(self.open(f"/?token={self.tokens['observe']}", origin="https://elsewhere.example").status, 403)
        for role, may_record, may_publish in (("observe", False, False), ("record", True, False), ("administer", True, True)):
            with self.subTest(role):
                client = self.open(f"/?token={self.tokens[role]}")
                self.assertEqual(client.status, 101)
                self.assertEqual("clientPublish" in client.hear("serverInfo")["capabilities"], may_publish)
                services = {service["name"]: service["id"] for service in client.hear("advertiseServices")["services"]}
                self.assertIn('"state"', json.dumps(client.call(services["/recorder/status"], {})))
                started = client.call(services["/recorder/start"], {"name": f"socket-{role}"})
                self.assertEqual(isinstance(started, dict), may_record, started)
                if may_record:
                    self.assertIsInstance(client.call(services["/recorder/stop"], {}), dict)
                else:
                    self.assertIn("observer", started)
                client.say(op="advertise", channels=[{"id": 1, "topic": "ircp/suit", "encoding": "json", "schemaName": "exemplar::ircp::v1::Suit"}])
                if not may_publish:
                    self.assertIn("publish", client.hear("status")["message"])

    def test_a_browser_logs_in_with_a_cookie_and_proves_its_page(self):
        status, headers, _ = self.ask("/exemplar.v1.RecorderService/GetStatus", Accept="text/html")
        self.assertEqual(status, 200)  # urllib has followed to the page of the login
        status, headers, text = self.ask("/login", {"token": self.tokens["record"]}, Content_Type="application/json")
        self.assertEqual(status, 200, text)
        cookie = headers["Set-Cookie"]
        for part in ("Secure", "HttpOnly", "SameSite=Strict"):
            self.assertIn(part, cookie)
        session = {"Cookie": cookie.split(";")[0]}
        self.assertEqual(self.ask("/exemplar.v1.RecorderService/GetStatus", **session)[0], 200)
        start = "/exemplar.v1.RecorderService/Start"
        self.assertEqual(self.ask(start, {"name": "forged"}, **session)[0], 403)
        csrf = json.loads(self.ask("/session", **session)[2])["csrf"]
        self.assertEqual(self.ask(start, {"name": "forged"}, X_CSRF_Token="guess", **session)[0], 403)
        self.assertEqual(self.ask(start, {"name": "mine"}, X_CSRF_Token=csrf, **session)[0], 200)
        self.assertEqual(self.ask("/exemplar.v1.RecorderService/Stop", {}, X_CSRF_Token=csrf, **session)[0], 200)
        self.assertEqual(self.ask("/logout", {}, X_CSRF_Token=csrf, **session)[0], 200)
        self.assertEqual(self.ask("/exemplar.v1.RecorderService/GetStatus", **session)[0], 401)

    def test_refusals_are_counted(self):
        with socket.create_connection(("127.0.0.1", self.http_port), timeout=60) as plain:
            plain.sendall(b"GET / HTTP/1.1\r\n\r\n")
            plain.shutdown(socket.SHUT_WR)
        self.ask("/exemplar.v1.RecorderService/GetStatus")
        self.ask("/healthz", Origin="https://elsewhere.example")
        self.assertEqual(self.ask("/metrics")[0], 401)

        def figures():
            status, _, text = self.ask("/metrics", Authorization=f"Bearer {self.tokens['observe']}")
            self.assertEqual(status, 200)
            rows = (line.rpartition(" ") for line in text.splitlines() if not line.startswith("#"))
            return {name: float(value) for name, _, value in rows}

        for name in ("tls_failures", "refused_requests", "refused_origins"):
            wait_for(lambda name=name: figures()[f"exemplar_http_{name}_total"] >= 1, name)


class SimulatedTimeTest(unittest.TestCase):
    def test_clients_are_told_the_simulated_time(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-gateway-"))
        self.addCleanup(shutil.rmtree, folder)
        programs = Programs(folder, "93")
        self.addCleanup(programs.end)
        http_file = folder / "http-port"
        programs.start(
            "exemplar-gateway", "--clock", "network", "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--http-port-file", http_file
        )
        epoch_s = 1_000_000_000
        programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", PRESS, "--cameras", "off", "--pace", "5", "--epoch-s", str(epoch_s))
        wait_for(lambda: http_file.exists() and http_file.read_text().strip(), "the gateway's HTTP port")
        connection = socket.create_connection(("127.0.0.1", int(http_file.read_text())), timeout=60)
        self.addCleanup(connection.close)
        client = WebSocket(connection, "/")
        self.assertIn("time", client.hear("serverInfo")["capabilities"])
        channel = None
        while channel is None:
            channel = next((entry["id"] for entry in client.hear("advertise")["channels"] if entry["topic"] == "ircp/joint_state"), None)
        client.say(op="subscribe", subscriptions=[{"id": 1, "channelId": channel}])
        told = {1: [], 2: []}  # of messages, and of the time itself
        while min(len(times) for times in told.values()) < 3:
            message = client.next()
            if isinstance(message, bytes) and message[0] in told:
                at = 5 if message[0] == 1 else 1
                told[message[0]].append(int.from_bytes(message[at : at + 8], "little") * 1e-9 - epoch_s)
        for times in told.values():
            self.assertEqual(times, sorted(times))
            self.assertGreater(times[0], 0)
            self.assertLess(times[-1], 3600)
        self.assertGreater(told[2][-1], told[2][0])


class LostBackendTest(unittest.TestCase):
    def test_a_backend_that_goes_is_named_and_comes_back(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-gateway-"))
        self.addCleanup(shutil.rmtree, folder)
        programs = Programs(folder, "93")
        self.addCleanup(programs.end)
        recorder, address = programs.recorder()
        port_file, http_file = folder / "gateway-port", folder / "http-port"
        programs.start("exemplar-gateway", "--recorder", address, "--port-file", port_file, "--http", "127.0.0.1:0", "--http-port-file", http_file)
        wait_for(lambda: http_file.exists() and port_file.exists(), "the gateway")
        gateway = "127.0.0.1:" + port_file.read_text().strip()

        def health():
            with urllib.request.urlopen(f"http://127.0.0.1:{http_file.read_text().strip()}/healthz", timeout=60) as answer:
                return json.loads(answer.read())["status"]

        wait_for(lambda: health() == "ok", "the recorder to serve")
        recorder.kill()
        recorder.wait()
        wait_for(lambda: health() == "degraded", "the gateway to notice")
        done = subprocess.run([BINARIES / "exemplar", "--server", gateway, "record", "status"], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 5, done.stderr)
        self.assertIn(f"recorder ({address})", done.stderr)
        programs.start("exemplar-recorder", "--listen", address, "--data-dir", folder / "again")
        wait_for(lambda: health() == "ok", "the recorder to be back")
        self.assertEqual(exemplar("--server", gateway, "record", "status")["state"], "ready")


if __name__ == "__main__":
    unittest.main()
