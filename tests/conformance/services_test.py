"""Every service as a stranger's client sees it: npm's gRPC, which learns the services from their reflection.

Real programs with the simulator as robot, whose time waits for the executor, in a network namespace of its own. Skipped without node and the packages
of tests/conformance/node (npm ci).
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "system"))

import trials  # noqa: E402
from processes import BINARIES, ROOT, Programs, exemplar, wait_for  # noqa: E402

NODE = HERE / "node"
ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = ROOT / "deploy" / "config" / "rail_press.yaml"
PROTOS = sorted((ROOT / "proto" / "exemplar" / "v1").glob("*.proto"))
SERVICES = {f"exemplar.v1.{name}" for proto in PROTOS for name in re.findall(r"(?m)^service (\w+)", proto.read_text(encoding="utf-8"))}
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06), (0.66, -0.22, 0.06)]


@unittest.skipUnless(shutil.which("node") and (NODE / "node_modules" / "grpc-js-reflection-client").exists(), "node or its packages are not installed (npm ci --prefix tests/conformance/node)")
class ServicesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-services-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.programs = Programs(cls.folder, "96")
        cls.addClassCleanup(cls.programs.end)
        cls.files = trials.write_set(cls.folder / "trials", BUTTONS)
        cls.learning = cls.server("exemplar-learning", "--data-dir", cls.folder / "skills", "--robot", ROBOT, bus=False)
        cls.recorder = cls.server("exemplar-recorder", "--data-dir", cls.folder / "recordings")
        cls.programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", SCENE, "--cameras", "off", "--in-step-with", "executor", "--pace", "3")
        cls.executor = cls.server("exemplar-executor", "--robot", ROBOT, "--scene", SCENE, "--learning", cls.learning, "--clock", "network", "--guard-touch-n", "0")
        wait_for(lambda: exemplar("--server", cls.executor, "robot", "status").get("joint_names"), "the robot's joint state")

    @classmethod
    def server(cls, program, *words, bus=True):
        port = cls.folder / f"port-{len(cls.programs.running)}"
        process = cls.programs.start(program, "--listen", "127.0.0.1:0", "--port-file", port, *words, bus=bus)
        wait_for(lambda: process.poll() is not None or (port.exists() and port.read_text().strip()), f"the port of {program}")
        assert process.poll() is None, cls.programs.logs()
        return "127.0.0.1:" + port.read_text().strip()

    def run_node(self, address, **shown):
        command = [str(word) for word in ("node", NODE / "call_services.mjs", address, *self.files)]
        return subprocess.run(command, capture_output=True, text=True, timeout=200, check=False, env=os.environ | {name: str(value) for name, value in shown.items()})

    def call(self, address, **shown):
        """What each method answered. `shown` goes into the environment."""
        done = self.run_node(address, **shown)
        self.assertEqual(done.returncode, 0, done.stderr + self.programs.logs())
        answers = json.loads(done.stdout)
        self.assertEqual(answers["grpc.health.v1.Health/Check"], 0)
        return answers

    def test_1_the_learning_service_answers_every_method(self):
        answers = self.call(self.learning)
        self.assertLessEqual({"exemplar.v1.TrialService", "exemplar.v1.SkillService"}, {name.split("/")[0] for name in answers})

    def test_2_the_recorder_answers_every_method(self):
        self.assertIn("exemplar.v1.RecorderService/MarkEvent", self.call(self.recorder))

    def test_3_the_executor_answers_every_method(self):
        # It asks the learning service for the skill that is executed.
        exemplar("--server", self.learning, "trial", "submit", "--skill", "reflected", *self.files)
        exemplar("--server", self.learning, "skill", "learn", "reflected")
        answers = self.call(self.executor)
        self.assertEqual(answers["exemplar.v1.ExecutorService/Execute"], 0)

    @unittest.skipUnless((BINARIES / "exemplar-gateway").exists(), "there is no gateway")
    def test_4_the_gateway_answers_every_method_of_all(self):
        gateway = self.server("exemplar-gateway", "--learning", self.learning, "--executor", self.executor, "--recorder", self.recorder)
        answers = self.call(gateway)
        self.assertEqual({name.split("/")[0] for name in answers if name.startswith("exemplar")}, SERVICES)

    def security(self, command, *words):
        done = subprocess.run([str(word) for word in (BINARIES / "exemplar", "security", command, self.station, *words)], capture_output=True, text=True, check=True)
        return done.stdout.strip()

    @unittest.skipUnless((BINARIES / "exemplar-gateway").exists(), "there is no gateway")
    def test_5_the_gateway_answers_every_method_over_tls_to_whom_it_knows(self):
        self.station = self.folder / "station"
        self.security("init", "--station", "test")
        self.security("issue", "gateway", "--role", "gateway")
        self.security("issue", "anna", "--role", "person", "--call", "administer", "--call", "execute")
        token = self.security("token", "ben", "--role", "administer")
        own, anna = self.station / "members" / "gateway", self.station / "members" / "anna"
        secured = ["--tls-cert", own / "cert.pem", "--tls-key", own / "key.pem", "--access", self.station / "access.yaml"]
        backends = ["--learning", self.learning, "--executor", self.executor, "--recorder", self.recorder]
        ca = {"EXEMPLAR_TLS_CA": anna / "ca.pem"}

        by_token = self.server("exemplar-gateway", *backends, *secured)
        answers = self.call(by_token, **ca, EXEMPLAR_TOKEN=token)
        self.assertEqual({name.split("/")[0] for name in answers if name.startswith("exemplar")}, SERVICES)
        for shown in ({}, ca, ca | {"EXEMPLAR_TOKEN": "exm_guess"}):
            self.assertNotEqual(self.run_node(by_token, **shown).returncode, 0)

        by_certificate = self.server("exemplar-gateway", *backends, *secured, "--tls-client-ca", anna / "ca.pem")
        certificate = {"EXEMPLAR_TLS_CERT": anna / "cert.pem", "EXEMPLAR_TLS_KEY": anna / "key.pem"}
        answers = self.call(by_certificate, **ca, **certificate)
        self.assertEqual({name.split("/")[0] for name in answers if name.startswith("exemplar")}, SERVICES)
        self.assertNotEqual(self.run_node(by_certificate, **ca).returncode, 0)


if __name__ == "__main__":
    unittest.main()
