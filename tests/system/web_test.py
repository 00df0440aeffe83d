"""The web page in a real browser before a real station: what a person sees, drags and clicks, and what happens when something is gone.

Runs in a network namespace of its own (made by run_isolated). Skipped without Chromium, or where the page was not built
(npm ci and node build.mjs in clients/web; deploy/build does it).
"""

import json
import math
import os
import pathlib
import shutil
import signal
import socket
import ssl
import subprocess
import tempfile
import time
import unittest

import trials
from processes import BINARIES, Programs, exemplar, wait_for

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PAGE = pathlib.Path(os.environ.get("EXEMPLAR_WEB", ROOT / "build" / "web"))
ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = "obstacles:\n  - {name: table, shape: box, size: [0.8, 1.2, 0.04], position: [0.75, 0, -0.02]}\n"
SCENE += "buttons:\n  - {name: target, position: [0.55, -0.15, 0.05], height: 0.05, radius: 0.02}\n"
# A person's posture that holds the robot at its home (deploy/models/arm7/suit.yaml).
SUIT = {
    "right shoulder in/out": 0.2, "right elbow in/out": 1.63, "right upper-arm rotation": 0.12, "right shoulder forward/backward": 0.13,
    "right forearm rotation": 1.25, "right wrist in/out": 1.12,
}  # fmt: skip
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06)]


class Browser:
    """One page; each call is one action of web_page.mjs."""

    def __init__(self):
        # It draws with the processor: the robot's programs come first, as they would on a machine with a graphics processor.
        self.process = subprocess.Popen(["nice", "-n", "19", "node", HERE / "web_page.mjs"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self, do, **words):
        self.process.stdin.write(json.dumps({"do": do, **words}) + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline() or '{"error": "the browser has ended"}')
        if "error" in answer:
            raise AssertionError(f"{do} {words}: {answer['error']}")
        return answer["answer"]

    def end(self):
        self.process.stdin.close()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()


class WebTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if not shutil.which("node") or not shutil.which("chromium"):
            raise unittest.SkipTest("no chromium or no node: apt install chromium nodejs npm")
        if not (ROOT / "clients" / "web" / "node_modules" / "playwright-core").exists():
            raise unittest.SkipTest("clients/web has no playwright-core: run npm ci there")
        if not (PAGE / "index.html").exists():
            raise unittest.SkipTest(f"no page in {PAGE}: run node build.mjs in clients/web")
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-web-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.programs = Programs(cls.folder, "91")
        cls.addClassCleanup(cls.programs.end)
        cls.scene = cls.folder / "scene.yaml"
        cls.scene.write_text(SCENE, encoding="utf-8")
        cls.programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", cls.scene, "--cameras", "off", "--track-hz", "20", "--log-format", "json")
        _, cls.recorder = cls.programs.recorder()
        _, cls.learning = cls.server("exemplar-learning", "--data-dir", cls.folder / "skills", "--robot", ROBOT, bus=False)
        cls.executor_program, cls.executor = cls.server(*cls.executor_words())
        cls.gateway, cls.address, cls.port = cls.start_gateway("127.0.0.1:0")
        cls.files = trials.write_set(cls.folder / "trials", BUTTONS)
        exemplar("--server", cls.address, "trial", "submit", "--skill", "press", *cls.files)
        exemplar("--server", cls.address, "skill", "learn", "press")
        wait_for(lambda: exemplar("--server", cls.address, "robot", "status").get("joint_names"), "the robot's joint state")
        cls.page = Browser()
        cls.addClassCleanup(cls.page.end)
        cls.page("go", url=f"http://127.0.0.1:{cls.port}/")
        cls.page("grows", name="answers", than=0)

    @classmethod
    def executor_words(cls):
        # The browser draws with the same processors: what a robot's computer would wait for is not what is tested here.
        patience = "--state-patience-s", "2", "--command-patience-s", "2", "--suit-patience-s", "0.5", "--dead-man-patience-s", "0.6"
        return "exemplar-executor", "--robot", ROBOT, "--scene", cls.scene, "--learning", cls.learning, "--log-format", "json", *patience

    @classmethod
    def server(cls, program, *words, bus=True, listen="127.0.0.1:0"):
        port_file = cls.folder / f"port-{len(cls.programs.running)}"
        process = cls.programs.start(program, "--listen", listen, "--port-file", port_file, *words, bus=bus)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), f"the port of {program}")
        return process, "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]

    @classmethod
    def start_gateway(cls, http, *words):
        port_file = cls.folder / f"http-port-{len(cls.programs.running)}"
        process, address = cls.server(
            "exemplar-gateway", "--learning", cls.learning, "--executor", cls.executor, "--recorder", cls.recorder, "--robot", ROBOT,
            "--scene", cls.scene, "--recordings", cls.folder / "data", "--web", PAGE, "--http", http, "--http-port-file", port_file, *words,
        )  # fmt: skip
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), "the HTTP port")
        return process, address, int(port_file.read_text())

    def tool(self):
        return [float(word) for word in self.page("data")["tool"].split(",")]

    def events(self, program, event):
        lines = [line for file in sorted(self.folder.glob(f"{program}-*.log")) for line in file.read_text().splitlines()]
        return sum(1 for line in lines if line.startswith("{") and line.endswith("}") and json.loads(line)["event"] == event)

    def clicks(self):
        return self.events("exemplar-simulator", "button clicked")

    def ready(self):
        """The robot free, at full speed, the object where it is seen."""
        if self.page("shown", of="#reset"):
            self.page("click", of="#reset")
        wait_for(lambda: self.page("text", of="#robot-state") in ("idle", "done"), "the robot to be free")
        self.page("slide", of="#speed", to=1)
        self.page("click", of="#as-seen")

    # ---- an open station ----

    def test_the_robot_and_its_skill_are_on_the_screen(self):
        page = self.page
        before = float(page("data").get("samples", 0))
        page("grows", name="samples", than=before + 30)
        status = exemplar("--server", self.address, "robot", "status")
        self.assertLess(math.dist(self.tool(), status["tool"]["position"]), 0.02)
        self.assertIn("frames", page("text", of="#report"))
        self.assertIn("joint_state", page("says", of="#topics", text="joint_state"))
        for service in ("gateway", "learning", "executor", "recorder"):
            self.assertIn(service, page("text", of="#services"))
        self.assertNotIn("does not answer", page("text", of="#services"))

    def test_an_object_that_is_dragged_changes_the_answer(self):
        page = self.page
        self.ready()
        before = page("data")
        place = page("values", of="#objects input")
        page("drag", object="target", right=40, down=-25)
        page("grows", name="answers", than=int(before["answers"]))
        wait_for(lambda: page("data")["answerContact"] != before["answerContact"], "another answer")
        moved = page("values", of="#objects input")
        shift = [b - a for a, b in zip(place, moved)]
        self.assertGreater(math.hypot(*shift[:2]), 0.02)
        self.assertLess(abs(shift[2]), 1e-6)
        contact = lambda data: [float(word) for word in data["answerContact"].split(",")]
        wait_for(lambda: math.dist(contact(page("data"))[:2], moved[:2]) < 0.02, "the answer to meet the object")
        self.assertGreater(float(page("data")["latencyMs"]), 0)
        page("click", of="#as-seen")

    def test_numbers_and_arrow_keys_move_the_object_too(self):
        page = self.page
        self.ready()
        page("fill", of="#objects input", text="0.6")
        wait_for(lambda: page("data")["answerContact"].startswith("0.6") or page("data")["answerContact"].startswith("0.59"), "the answer at x = 0.6")
        before = page("values", of="#objects input")
        page("click", of="#view-above")
        page("click", of="#view canvas")
        page("press", key="ArrowUp")
        after = page("values", of="#objects input")
        self.assertAlmostEqual(math.dist(before, after), 0.01, places=3)
        page("click", of="#view-home")

    def test_what_is_executed_presses_the_button(self):
        page = self.page
        self.ready()
        page("click", of="#plan")
        self.assertIn("Free of collisions", page("says", of="#verdict", text="at the nearest"))
        before = self.clicks()
        page("click", of="#execute")
        page("says", of="#robot-state", text="executing")
        said = page("says", of="#verdict", text="Done")
        self.assertIn("contact", said)
        wait_for(lambda: self.clicks() > before, "the simulated button to click")

    def test_what_is_seen_to_move_is_followed(self):
        page = self.page
        self.ready()
        page("click", of="#follow")
        self.assertIn("where it will be", page("says", of="#follow-said", text="Execute meets it"))
        self.assertFalse(page("enabled", of="#as-seen"))
        seen = page("values", of="#objects input")
        page("press", key="ArrowUp")  # nobody's to move now
        self.assertEqual(page("values", of="#objects input"), seen)
        before = int(page("data")["answers"])
        page("grows", name="answers", than=before + 1)  # it is asked anew as it is seen
        page("click", of="#plan")
        page("says", of="#verdict", text="Free of collisions")
        followed = self.events("exemplar-executor", "followed")
        page("click", of="#execute")
        wait_for(lambda: self.events("exemplar-executor", "followed") > followed, "the executor to have followed it", 60)
        page("click", of="#follow")
        page("hides", of="#follow-said")

    def test_a_person_in_a_suit_drives_the_robot(self):
        page = self.page
        self.ready()
        page("click", of="#teleop-box summary")
        self.assertIn("Dead-man: not heard", page("says", of="#teleop-heard", text="Suit: not heard"))
        page("click", of="#teleop-touch input")
        page("click", of="#teleop-on")
        page("says", of="#robot-state", text="teleoperating")
        self.assertIn("Closing this page ends it", page("says", of="#robot-detail", text="press the dead-man"))
        self.assertFalse(page("enabled", of="#execute"))
        stood = self.tool()
        wave = self.folder / "wave.csv"
        rows = [["time_s", *(f"{name}_rad" for name in SUIT)]]
        for k in range(300):
            here = {**SUIT, "right shoulder in/out": 0.2 + 0.15 * (1 - math.cos(2 * math.pi * k / 100))}
            rows.append([f"{k / 50:.3f}", *(f"{angle:.5f}" for angle in here.values())])
        wave.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")
        self.programs.start("exemplar-capture-suit", "--replay", wave, "--dead-man")
        page("says", of="#robot-detail", text="following")
        page("says", of="#teleop-figures", text="behind")
        wait_for(lambda: math.dist(self.tool(), stood) > 0.02, "the robot to move as the person does")
        page("click", of="#teleop-off")
        self.assertRegex(page("says", of="#teleop-said", text="Ended"), r"The robot followed for [0-9.]+ s of")
        wait_for(lambda: page("enabled", of="#teleop-on"), "the robot to be free")
        page("click", of="#teleop-on")
        page("says", of="#robot-state", text="teleoperating")
        page("press", key="Escape")
        page("says", of="#teleop-said", text="protective stop")
        page("click", of="#teleop-box summary")

    def test_what_cannot_be_reached_is_refused_with_its_reason(self):
        page = self.page
        self.ready()
        page("fill", of="#objects input", text="2.5")
        page("click", of="#plan")
        self.assertRegex(page("says", of="#verdict", text="Refused"), r"Refused: \S+")
        page("click", of="#as-seen")

    def test_a_motion_is_paused_resumed_and_stopped_at_once(self):
        page = self.page
        self.ready()
        page("slide", of="#speed", to=0.1)
        page("click", of="#execute")
        page("says", of="#robot-state", text="executing")
        start = self.tool()
        wait_for(lambda: math.dist(self.tool(), start) > 0.002, "the robot to move")
        page("click", of="#pause")
        page("says", of="#robot-state", text="paused")
        page("click", of="#resume")
        page("says", of="#robot-state", text="executing")
        page("press", key="Escape")
        page("says", of="#robot-state", text="stop")
        stood = self.tool()
        held = float(page("data")["samples"])
        page("grows", name="samples", than=held + 30)
        self.assertLess(math.dist(self.tool(), stood), 0.01)
        self.assertIn("stop", exemplar("--server", self.address, "robot", "status")["state"])
        self.assertTrue(page("shown", of="#reset"))
        page("click", of="#reset")
        page("says", of="#robot-state", text="idle")

    def test_a_recording_is_made_and_listed(self):
        page = self.page
        page("fill", of="#record-name", text="from-the-page")
        page("click", of="#record-start")
        page("says", of="#record-state", text="recording")
        page("click", of="#record-event")
        page("click", of="#record-stop")
        page("says", of="#record-line", text="Last: from-the-page.mcap")
        page("says", of="#recordings", text="from-the-page.mcap")
        self.assertTrue((self.folder / "data" / "from-the-page.mcap").exists())

    def test_trials_become_a_skill(self):
        page = self.page
        page("click", of="#learn-box summary")
        page("fill", of="#learn-name", text="second")
        page("files", of="#trial-files", files=[str(file) for file in self.files])
        page("says", of="#learn-said", text="3 trials stored")
        page("click", of="#learn")
        page("says", of="#learn-said", text="Version 1 learned from 3 trials")
        page("says", of="#skill", text="second")
        page("click", of="#learn-box summary")
        subprocess.run([BINARIES / "exemplar", "--server", self.address, "skill", "delete", "second"], check=True, timeout=30)
        wait_for(lambda: "second" not in page("text", of="#skill"), "the page to see it gone")

    def test_the_page_recovers_from_a_gateway_that_was_away(self):
        page = self.page
        self.gateway.send_signal(signal.SIGTERM)
        self.gateway.wait(20)
        page("says", of="#banner", text="gateway does not answer")
        page("says", of="#services", text="gateway does not answer")
        type(self).gateway, type(self).address, port = self.start_gateway(f"127.0.0.1:{self.port}")
        self.assertEqual(port, self.port)
        page("hides", of="#banner")
        seen = float(page("data")["samples"])
        page("grows", name="samples", than=seen + 30)
        self.assertNotIn("does not answer", page("text", of="#services"))

    def test_a_service_that_is_gone_is_named_until_it_is_back(self):
        page = self.page
        self.executor_program.send_signal(signal.SIGTERM)
        self.executor_program.wait(20)
        page("says", of="#services", text="executor does not answer")
        page("says", of="#robot-detail", text="The executor does not answer")
        type(self).executor_program, _ = self.server(*self.executor_words(), listen=self.executor)
        wait_for(lambda: "does not answer" not in page("text", of="#services"), "the executor to be back on the page", 40)
        page("says", of="#robot-state", text="idle")
        wait_for(lambda: exemplar("--server", self.address, "robot", "status").get("joint_names"), "the robot's joint state")

    def test_nothing_is_loaded_from_elsewhere_and_no_script_failed(self):
        told = self.page("problems")
        self.assertEqual(told, {"problems": [], "foreign": []})

    # ---- a phone, and a station that has nothing yet ----

    def test_a_narrow_window_holds_everything_and_the_stop_at_all_times(self):
        page = self.page
        page("size", width=360, height=700)
        self.addCleanup(page, "size", width=1100, height=720)
        self.assertLessEqual(page("overhang"), 0)
        self.assertTrue(page("inWindow", of="#stop"))
        page("toEnd")
        self.assertTrue(page("inWindow", of="#stop"))

    def test_a_gateway_with_nothing_behind_it_says_what_is_missing(self):
        port_file = self.folder / "bare-http-port"
        process, _ = self.server("exemplar-gateway", "--web", PAGE, "--http", "127.0.0.1:0", "--http-port-file", port_file)
        self.addCleanup(process.wait, 20)
        self.addCleanup(process.send_signal, signal.SIGTERM)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), "the HTTP port")
        page = Browser()
        self.addCleanup(page.end)
        page("go", url=f"http://127.0.0.1:{port_file.read_text().strip()}/")
        for place, option in (("#skill-line", "--learning"), ("#robot-detail", "--executor"), ("#record-line", "--recorder"), ("#view-said", "--robot")):
            page("says", of=place, text=option)
        for button in ("#plan", "#execute", "#as-seen", "#follow"):
            self.assertFalse(page("enabled", of=button), button)
        for hidden in ("#record-form", "#record-event", "#learn-box", "#teleop-box"):
            self.assertFalse(page("shown", of=hidden), hidden)
        page("press", key="Escape")
        page("says", of="#verdict", text="STOP did not reach the executor")
        self.assertEqual(page("problems"), {"problems": [], "foreign": []})

    # ---- a secured one ----

    def test_a_secured_page_wants_a_login_and_its_own_token(self):
        self.ready()
        station = self.folder / "station"
        security = lambda *words: subprocess.run([BINARIES / "exemplar", "security", *words], check=True, capture_output=True, text=True, cwd=self.folder).stdout
        security("init", station, "--station", "test")
        security("issue", station, "gateway", "--role", "gateway", "--host", "127.0.0.1")
        token = next(word for word in security("token", station, "ben", "--role", "record").split() if word.startswith("exm_"))
        member = station / "members" / "gateway"
        process, _, port = self.start_gateway(
            "127.0.0.1:0", "--tls-cert", member / "cert.pem", "--tls-key", member / "key.pem", "--access", station / "access.yaml",
        )  # fmt: skip
        self.addCleanup(process.wait, 20)
        self.addCleanup(process.send_signal, signal.SIGTERM)
        self.assert_paths_are_refused(port)
        page = Browser()
        self.addCleanup(page.end)
        page("go", url=f"https://localhost:{port}/")
        self.assertTrue(page("url").endswith("/login"))
        page("fill", of="#token", text=token)
        page("press", key="Enter")
        self.assertEqual(page("says", of="#who", text="ben"), "ben")
        page("grows", name="answers", than=0)
        page("grows", name="samples", than=10)
        self.assertEqual(page("fetch", path="/exemplar.v1.RecorderService/Start", headers={}), 403)
        page("click", of="#execute")
        self.assertIn("ben may not", page("says", of="#verdict", text="may not"))
        page("click", of="#log-out")
        wait_for(lambda: page("url").endswith("/login"), "the login page")
        self.assertEqual(page("problems"), {"problems": [], "foreign": []})

    def assert_paths_are_refused(self, port):
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        for path in ("/robot/files/../robot.yaml", "/robot/files/%2e%2e/robot.yaml", "/..%2f..%2fetc/passwd", "/robot/files/%2fetc%2fpasswd", "/app.js%00.html"):
            with context.wrap_socket(socket.create_connection(("127.0.0.1", port), timeout=10)) as connection:
                connection.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
                status = int(connection.recv(4096).split()[1])
            self.assertIn(status, (400, 401, 404), path)


if __name__ == "__main__":
    unittest.main(verbosity=2)
