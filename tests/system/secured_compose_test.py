"""The main job over secured containers: deploy/compose.secured.yaml, with the station's files by deploy/docker/secure.

Members meet by multicast on one bridge, and by static peers over two; strangers' containers beside them read and write nothing; calls
need a certificate or a token; who is revoked while it runs is heard no more after a time that is printed. Exit code 77: no engine runs here.
"""

import contextlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import engine
from engine import CACHE, MEMBERS, ROOT, SERVERS, Engine, Station, run, tell
from processes import BINARIES, wait_for

OVERRIDES = [ROOT / "deploy" / "compose.secured.yaml", pathlib.Path(__file__).resolve().parent / "secured_compose_test.yaml"]
NAME = "secured"
FAR_MEMBERS = [name for name in MEMBERS if name != "simulator"] + ["far-robot"]
FAR = {"EXEMPLAR_DDS": "--peer 10.95.3.14"}
STATE_RATE_HZ = 125
LIMIT_S = 150

STATUS = """
import ssl, sys, urllib.error, urllib.request
request = urllib.request.Request(sys.argv[2], headers={"Authorization": "Bearer " + sys.argv[3]} if len(sys.argv) > 3 else {})
try:
    print(urllib.request.urlopen(request, context=ssl.create_default_context(cafile=sys.argv[1])).status)
except urllib.error.HTTPError as error:
    print(error.code)
"""


class SecuredComposeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-secured-compose-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.folder.chmod(0o755)
        cls.files = cls.folder / "station"
        run(ROOT / "deploy" / "docker" / "secure", cls.files, NAME, env={**os.environ, "EXEMPLAR": str(BINARIES / "exemplar")})
        cls.security("issue", cls.files, "anna", "--role", "person", "--call", "administer")
        cls.watcher = cls.security("token", cls.files, "watcher", "--role", "observe").strip()
        cls.operator = (cls.files / "tokens" / "operator").read_text(encoding="ascii").strip()
        engine.build_images()
        stack = contextlib.ExitStack()
        cls.addClassCleanup(stack.close)
        cls.engine = stack.enter_context(Engine(CACHE, alone=True))
        cls.engine.inside("sysctl", "-qw", "net.ipv4.ip_forward=1")
        variables = {"EXEMPLAR_STATION": NAME, "EXEMPLAR_STATION_FILES": str(cls.files)}
        cls.station = Station(cls.engine, OVERRIDES, variables, profiles=("demo", "far"))
        try:
            cls.station.teach(lambda: cls.cli("learning", "skill", "learn", "press"))
        except BaseException:
            cls.show_logs()
            raise

    @classmethod
    def show_logs(cls):
        cls.station.show_logs(*MEMBERS, "far-robot")

    @classmethod
    def security(cls, *words):
        return run(BINARIES / "exemplar", "security", *words)

    @classmethod
    def cli(cls, service, *words):
        member = cls.files / "members" / "anna"
        proof = ["--tls-ca", member / "ca.pem", "--tls-cert", member / "cert.pem", "--tls-key", member / "key.pem"]
        return json.loads(cls.engine.inside(BINARIES / "exemplar", "--server", SERVERS[service], "--timeout", "60", *proof, *words, "--format", "json"))

    def topics(self):
        return {topic["topic"]: topic for topic in self.cli("recorder", "record", "status")["topics"]}

    def pressed(self, what, members, begin):
        """Once all are well, the robot presses the button where it is seen; a busy machine may stop it on the way."""
        trouble = "not tried"

        def attempt():
            nonlocal trouble
            try:
                if not self.station.healthy(*members):
                    return None
                status = self.cli("executor", "robot", "status")
                if status["state"] == "protective_stop":
                    self.cli("executor", "robot", "reset")
                    return None
                seen = [each for each in status["objects"] if each["name"] == "target" and each["age_s"] < 1]
                if status["state_age_s"] > 0.5 or not seen:
                    return None
                target = ",".join(f"{value:.6f}" for value in seen[0]["position"])
                well = time.monotonic() - begin
                return well, self.cli("executor", "skill", "execute", "press", "--object", f"target={target}", "--wait")
            except AssertionError as error:
                trouble = error
                return None

        deadline = time.monotonic() + LIMIT_S
        while not (found := attempt()):
            self.assertLess(time.monotonic(), deadline, f"{what}: {trouble}\n{self.station.logs('executor')}")
            time.sleep(0.2)
        well, done = found
        self.assertEqual(done["state"], "done", done["detail"])
        tell(f"{what}: works after {well:.1f} s, tracking within {done['tracking_error_rad']:.3f} rad")

    def tearDown(self):
        result = self._outcome.result
        if any(getattr(case, "test_case", case) is self for case, _ in [*result.failures, *result.errors]):
            self.show_logs()

    def setUp(self):
        self.station.compose("rm", "--stop", "--force", "far-robot")
        self.station.up(MEMBERS)

    def test_members_meet_by_multicast_on_one_bridge_and_the_robot_presses(self):
        self.pressed("secured, by multicast", MEMBERS, time.monotonic())

    def test_members_meet_by_static_peers_across_two_bridges(self):
        begin = time.monotonic()
        self.station.compose("stop", "simulator")
        self.station.up(FAR_MEMBERS, **FAR)
        self.station.place(**FAR)
        self.pressed("secured, by static peers across two bridges", FAR_MEMBERS, begin)

    def test_the_laboratorys_profile_is_secured_likewise(self):
        laboratory = [f"lab-{name}" for name in MEMBERS if name != "simulator"]
        self.station.compose("stop")
        try:
            self.station.up(laboratory)
            wait_for(lambda: self.topics().get("ircp/executor/status", {}).get("received"), "the recorder to hear the executor", 60)
            ca = self.files / "members" / "gateway" / "ca.pem"
            page = self.engine.inside(sys.executable, "-c", STATUS, ca, "https://localhost:8080/exemplar.v1.SkillService/List", self.operator)
            self.assertEqual(page.strip(), "200")
        finally:
            self.station.compose("rm", "--stop", "--force", *laboratory)

    def test_strangers_read_nothing_and_write_nothing(self):
        self.station.compose("--profile", "strangers", "up", "-d", "stranger-reader", "stranger-writer")
        try:
            wait_for(lambda: self.station.healthy("stranger-reader", "stranger-writer"), "healthy strangers", 90)

            def heard_by_the_stranger():
                words = ["--server", "10.95.1.66:50052", "record", "status", "--format", "json"]
                return {topic["topic"]: topic["received"] for topic in json.loads(self.engine.inside(BINARIES / "exemplar", *words))["topics"]}

            # The strangers are able to talk: to each other.
            wait_for(lambda: heard_by_the_stranger().get("ircp/joint_state"), "the strangers to meet", 60)
            before, seen_before, begin = self.topics()["ircp/joint_state"]["received"], heard_by_the_stranger()["ircp/joint_state"], time.monotonic()
            time.sleep(5)
            members, strangers = self.topics(), heard_by_the_stranger()
            elapsed = time.monotonic() - begin
            # One robot's states on either side, though both have one in the same station, domain and topic.
            for count in (members["ircp/joint_state"]["received"] - before, strangers["ircp/joint_state"] - seen_before):
                self.assertGreater(count, 0)
                self.assertLess(count, 1.4 * STATE_RATE_HZ * elapsed)
            self.assertGreater(members["ircp/objects"]["received"], 0)
            for topic in ("ircp/objects", "ircp/tactile", "ircp/camera", "ircp/executor/status"):
                self.assertFalse(strangers.get(topic), f"a stranger heard {topic}")
            tell(f"strangers hear {sorted(strangers)}, members {len(members)} topics")
        finally:
            self.station.compose("--profile", "strangers", "rm", "--stop", "--force", "stranger-reader", "stranger-writer")

    def test_calls_need_a_certificate_or_a_token_with_the_role(self):
        ca = self.files / "members" / "gateway" / "ca.pem"

        def refused(server, *words, **more):
            words = [BINARIES / "exemplar", "--server", server, "--timeout", "10", *words]
            command = ["nsenter", "-t", self.engine.first(), "-n", *words]
            done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=60, check=False, **more)
            self.assertNotEqual(done.returncode, 0, done.stdout)
            return done.stderr

        refused(SERVERS["recorder"], "record", "status")
        refused(SERVERS["recorder"], "--tls-ca", ca, "record", "status")  # the server asks for a certificate
        refused("127.0.0.1:50050", "--tls-ca", ca, "skill", "list")
        watcher = {"env": {**os.environ, "EXEMPLAR_TOKEN": self.watcher}}
        self.engine.inside(BINARIES / "exemplar", "--server", "127.0.0.1:50050", "--tls-ca", ca, "skill", "list", **watcher)
        self.assertIn("execute", refused("127.0.0.1:50050", "--tls-ca", ca, "skill", "execute", "press", "--object", "target=0.45,-0.2,0.04", **watcher))
        page = "https://localhost:8080/exemplar.v1.SkillService/List"
        https = lambda *token: self.engine.inside(sys.executable, "-c", STATUS, ca, page, *token).strip()
        self.assertEqual([https(), https("exm_" + "A" * 43 + "="), https(self.operator)], ["401", "401", "200"])

    def test_who_is_revoked_while_it_runs_is_heard_no_more(self):
        wait_for(lambda: self.topics().get("ircp/tactile", {}).get("received"), "touch to be recorded", 60)
        self.assertTrue(self.station.inspect("capture-tactile")["Running"])
        started = self.station.inspect("recorder")["StartedAt"]
        begin = time.monotonic()
        self.security("revoke", self.files, "capture-tactile")
        wait_for(lambda: self.station.inspect("recorder")["StartedAt"] != started, "the recorder to start again", 60)
        tell(f"revoked: the recorder had started again after {time.monotonic() - begin:.1f} s")
        rest = [name for name in MEMBERS if name != "capture-tactile"]
        wait_for(lambda: self.station.healthy(*rest), "the others to be well", 90)
        self.pressed("revoked one member", rest, begin)
        topics = self.topics()
        self.assertGreater(topics["ircp/joint_state"]["received"], 0)
        self.assertFalse(topics.get("ircp/tactile", {}).get("received"), "who was revoked is still heard")
        # It comes back with what the station gives it anew.
        self.security("issue", self.files, "capture-tactile", "--role", "capture")
        run("chown", "-R", "10001:10001", self.files / "members" / "capture-tactile")
        self.station.compose("rm", "--stop", "--force", "capture-tactile")
        self.station.up(MEMBERS)
        wait_for(lambda: self.topics().get("ircp/tactile", {}).get("received"), "touch to be recorded again", 60)


if __name__ == "__main__":
    try:
        engine.check()
    except engine.Unavailable as reason:
        print(f"skipped: {reason}", file=sys.stderr)
        sys.exit(77)
    unittest.main()
