"""The main job over containers of their own on two bridged networks, while everything that can happen to them happens.

Brings up deploy/compose.yaml under a Docker engine of its own (engine.py), has a simulated person teach the robot, and then kills,
pauses, cuts, loses, fills and shifts. After each: what was acknowledged is there, what was lost is counted, the robot held or went on
safely, and the station works again by itself within a time that is printed. Exit code 77: no engine runs here.
"""

import contextlib
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import engine
from engine import CACHE, MEMBERS, SERVERS, Engine, Station, run, tell
from processes import BINARIES, wait_for

OVERRIDE = pathlib.Path(__file__).resolve().parent / "compose_test.yaml"
FAKETIME = pathlib.Path("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1")
DISK = CACHE / "disk"
DISK_MB = 160
LIMIT_S = 150  # for anything to work again; what it took is printed
STARTS = 5  # of a motion that a busy machine stops
LOSSY = {"ircp/camera"}  # best effort by design

FETCH = "import urllib.request as u; print(u.urlopen('http://127.0.0.1:9464/metrics').read().decode())"


class ComposeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-compose-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        engine.build_images()
        shutil.copy(FAKETIME, cls.folder)
        cls.clock = cls.folder / "now"
        cls.clock.write_text("+0s\n")
        cls.folder.chmod(0o755)
        stack = contextlib.ExitStack()
        cls.addClassCleanup(stack.close)
        cls.engine = stack.enter_context(Engine(CACHE, alone=True))
        cls.engine.inside("sh", "-c", f"mkdir -p {DISK} && mount -t tmpfs -o size={DISK_MB}m,uid=10001,gid=10001,mode=0750 none {DISK}")
        variables = {"EXEMPLAR_TEST_DISK": str(DISK), "EXEMPLAR_TEST_FAKETIME": str(cls.folder), "EXEMPLAR_STATION": "compose"}
        cls.station = Station(cls.engine, [OVERRIDE], variables)
        try:
            cls.station.teach(lambda: cls.cli("learning", "skill", "learn", "press"))
        except BaseException:
            cls.station.show_logs(*MEMBERS)
            raise

    # ---- what the tests are made of ----

    @classmethod
    def cli(cls, service, *words, timeout=90):
        return json.loads(cls.engine.inside(BINARIES / "exemplar", "--server", SERVERS[service], "--timeout", "60", *words, "--format", "json", timeout=timeout))

    def recorder(self, *words):
        return self.cli("recorder", "record", *words)

    def topics(self):
        return {topic["topic"]: topic for topic in self.recorder("status")["topics"]}

    def target(self):
        """Where the vision program sees the button, or None."""
        for seen in self.cli("executor", "robot", "status")["objects"]:
            if seen["name"] == "target" and seen["age_s"] < 1:
                return ",".join(f"{value:.6f}" for value in seen["position"])
        return None

    def start_execution(self):
        """`skill execute --wait` in the background, once the robot moves."""
        target = wait_for_value(self.target, "the button to be seen", LIMIT_S)
        command = ["nsenter", "-t", self.engine.first(), "-n", BINARIES / "exemplar", "--server", SERVERS["executor"], "--timeout", "60"]
        command += ["skill", "execute", "press", "--object", f"target={target}", "--wait", "--format", "json"]
        for _ in range(STARTS):
            process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            wait_for(lambda: process.poll() is not None or self.state() == "executing", "the robot to move", 30)
            time.sleep(0.5)
            if process.poll() is None and self.state() == "executing":
                return process
            _, error = process.communicate()
            if self.state() != "protective_stop":
                raise AssertionError(f"the execution ended with {process.returncode}: {error}")
            self.cli("executor", "robot", "reset")
        raise AssertionError(f"the robot did not get far in {STARTS} attempts: {error}")

    def state(self):
        return self.cli("executor", "robot", "status")["state"]

    def execute(self):
        target = wait_for_value(self.target, "the button to be seen", LIMIT_S)
        return self.cli("executor", "skill", "execute", "press", "--object", f"target={target}", "--wait")

    def works_again(self, what, begin):
        """The whole station: healthy, and it presses the button. What stopped the robot is reset, as an operator would; on a machine
        that is busy with other things it may stop again because the robot's state comes late."""
        trouble = stops = 0

        def pressed():
            nonlocal trouble, stops
            try:
                if not self.station.healthy(*MEMBERS):
                    return None
                status = self.cli("executor", "robot", "status")
                if status["state"] == "protective_stop":
                    self.cli("executor", "robot", "reset")
                    return None
                if status["state_age_s"] > 0.5 or not self.target():
                    return None
                well = time.monotonic() - begin
                return well, self.execute()
            except AssertionError as error:
                trouble = error
                stops += "protective_stop" in str(error)
                return None

        deadline = time.monotonic() + LIMIT_S
        while not (found := pressed()):
            self.assertLess(time.monotonic(), deadline, f"{what}: does not work again: {trouble}\n{self.station.logs('executor')}")
            time.sleep(0.1)
        well, done = found
        self.assertEqual(done["state"], "done", done["detail"])
        late = f" (after {stops} stops on the way)" if stops else ""
        tell(f"{what}: works again after {well:.1f} s{late}, pressed in {done['tool_time_s'][-1]:.1f} s, tracking within {done['tracking_error_rad']:.3f} rad")

    def holds(self):
        """Whether the simulated robot, asked itself, moves nowhere."""
        text = self.station.within("simulator", sys.executable, "-c", FETCH)
        return re.search(r'^exemplar_simulator_state\{state="holding"\} 1', text, re.MULTILINE) is not None

    def acknowledged(self):
        """What clients were told is kept: trials, versions, an answer, and the finished recordings' bytes."""
        query = self.cli("learning", "skill", "query", "press", "--object", "target=0.45,-0.20,0.03")
        finished = self.engine.inside("sh", "-c", f"cd {DISK} && sha256sum trial-*.mcap")
        return self.cli("learning", "trial", "list"), self.cli("learning", "skill", "versions", "press"), query, finished

    def lost(self, topics):
        return {name: figures["lost"] for name, figures in topics.items() if figures["lost"] and name not in LOSSY}

    def setUp(self):
        # A test before may have left some of it down.
        self.station.up(MEMBERS)
        self.before = self.acknowledged()

    def tearDown(self):
        result = self._outcome.result
        if any(getattr(case, "test_case", case) is self for case, _ in [*result.failures, *result.errors]):
            self.station.show_logs(*MEMBERS)
        with contextlib.suppress(AssertionError):
            self.recorder("stop")
        self.assertEqual(self.acknowledged(), self.before)

    # ---- what happens to it ----

    def test_each_service_killed_comes_back_by_itself(self):
        for service in ("learning", "capture-vision", "capture-tactile", "recorder", "simulator", "gateway"):
            with self.subTest(service):
                self.station.signal(service, "KILL")
                self.works_again(f"{service} killed", time.monotonic())
                self.assertEqual(self.acknowledged(), self.before)

    def test_the_robot_holds_when_its_executor_is_killed_in_motion(self):
        execution = self.start_execution()
        begin = time.monotonic()
        self.station.signal("executor", "KILL")
        wait_for(self.holds, "the robot to hold", 10)
        tell(f"executor killed in motion: the robot was seen to hold after {time.monotonic() - begin:.2f} s")
        self.assertNotEqual(execution.wait(30), 0)
        execution.communicate()
        self.works_again("executor killed in motion", begin)

    def test_a_recording_survives_its_recorders_death(self):
        self.recorder("start", "--name", "cut-short")
        before = self.topics()["ircp/joint_state"]["received"]
        time.sleep(5)
        received = self.topics()["ircp/joint_state"]["received"] - before
        begin = time.monotonic()
        self.station.signal("recorder", "KILL")
        self.works_again("recorder killed while it recorded", begin)
        whole = self.folder / "whole.mcap"
        self.engine.inside(BINARIES / "exemplar", "record", "recover", DISK / "cut-short.mcap", "--output", whole)
        info = json.loads(run(BINARIES / "exemplar", "record", "info", whole, "--format", "json"))
        kept = sum(topic["messages"] for topic in info["topics"] if topic["topic"] == "ircp/joint_state")
        tell(f"recorder killed: {kept} joint states kept of {received} that it had received a moment before")
        # What is missing had a bounded time to reach the disk.
        self.assertGreater(kept, received / 2)

    def test_the_robot_holds_while_its_executor_is_paused(self):
        execution = self.start_execution()
        begin = time.monotonic()
        self.station.compose("pause", "executor")
        wait_for(self.holds, "the robot to hold", 10)
        time.sleep(3)
        self.assertTrue(self.holds())
        self.station.compose("unpause", "executor")
        out, error = execution.communicate(timeout=60)
        tell(f"executor paused for 3 s in motion: exit {execution.returncode}, {(error or out).strip()[:160]}")
        self.works_again("executor paused", begin)

    def test_a_network_cut_for_10_s_holds_the_robot_and_loses_nothing_uncounted(self):
        self.recorder("start", "--name", "cut-off")
        time.sleep(1)
        execution = self.start_execution()
        begin = time.monotonic()
        self.engine.inside("ip", "link", "set", "field", "down")
        time.sleep(1.5)
        self.assertTrue(self.holds())
        time.sleep(8.5)
        self.engine.inside("ip", "link", "set", "field", "up")
        execution.communicate(timeout=60)
        self.assertNotEqual(execution.returncode, 0)
        self.works_again("the devices' network cut for 10 s", begin)
        wait_for(lambda: self.topics()["ircp/joint_state"]["sent"] - self.topics()["ircp/joint_state"]["received"] < 500, "what was held back", 30)
        topics = self.topics()
        self.recorder("stop")
        state = topics["ircp/joint_state"]
        tell(f"network cut: joint states sent {state['sent']}, received {state['received']}, lost {state['lost']}; lost of others {self.lost(topics)}")
        self.assertEqual(self.lost(topics), {})

    def test_a_tenth_of_the_packets_lost_loses_no_sample(self):
        self.recorder("start", "--name", "lossy")
        hurt = ("recorder", "executor", "simulator")
        rule = ["INPUT", "-p", "udp", "-m", "statistic", "--mode", "random", "--probability", "0.1", "-j", "DROP"]
        for service in hurt:
            self.station.within(service, "iptables", "-A", *rule)
        try:
            self.works_again("a tenth of the packets lost", time.monotonic())
            rows = [self.station.within(service, "iptables", "-L", "INPUT", "-v", "-x", "-n") for service in hurt]
        finally:
            for service in hurt:
                self.station.within(service, "iptables", "-D", *rule)
        dropped = [int(line.split()[0]) for row in rows for line in row.splitlines() if "DROP" in line and "statistic" in line]
        time.sleep(2)
        topics = self.topics()
        self.recorder("stop")
        tell(f"packets dropped at {', '.join(hurt)}: {dropped}; samples lost: {self.lost(topics)}; pictures lost: {topics['ircp/camera']['lost']}")
        self.assertGreater(min(dropped), 20)
        self.assertEqual(self.lost(topics), {})

    def test_a_full_disk_costs_only_what_did_not_fit_and_says_so(self):
        filler = DISK / "filler"
        self.recorder("start", "--name", "squeezed")
        time.sleep(1)
        try:
            self.engine.inside("sh", "-c", f"cat /dev/zero > {filler} 2>/dev/null; true")
            time.sleep(4)
            begin = time.monotonic()
            full = self.recorder("status")
            tell(f"disk full: recorder is {full['state']} ({full['detail']}), {full['disk_free_bytes']} bytes free, left out {full['left_out']}, lost {full['lost']}")
            self.works_again("with the recorder's disk full", begin)  # nothing else depends on it
        finally:
            self.engine.inside("rm", filler)
        begin = time.monotonic()
        with contextlib.suppress(AssertionError):  # where it gave the recording up by itself
            self.recorder("stop")
        self.recorder("start", "--name", "roomy")
        time.sleep(1)
        stopped = self.recorder("stop")
        info = json.loads(self.engine.inside(BINARIES / "exemplar", "record", "info", DISK / "roomy.mcap", "--format", "json"))
        self.assertGreater(sum(topic["messages"] for topic in info["topics"]), 50, stopped)
        tell(f"disk free again: a new recording is whole after {time.monotonic() - begin:.1f} s")
        squeezed = DISK / "squeezed.mcap"
        whole = self.folder / "squeezed.mcap"
        self.engine.inside("sh", "-c", f"{BINARIES}/exemplar record info {squeezed} >/dev/null || {BINARIES}/exemplar record recover {squeezed} --output {whole}")

    def test_a_clock_that_jumps_by_2_s_moves_nothing_and_is_noticed(self):
        def jumps():
            text = self.station.within("recorder", sys.executable, "-c", FETCH)
            return float(re.search(r"^exemplar_recorder_clock_jumps_total (\S+)", text, re.MULTILINE)[1])

        before = jumps()
        execution = self.start_execution()
        begin = time.monotonic()
        try:
            self.clock.write_text("+2s\n")
            out, error = execution.communicate(timeout=60)
            tell(f"simulator's clock 2 s ahead in motion: exit {execution.returncode}, {(error or out).strip()[:160]}")
            self.works_again("simulator's clock 2 s ahead", begin)
            wait_for(lambda: jumps() > before, "the recorder to notice the jump", 30)
            tell(f"the jump was counted after {time.monotonic() - begin:.1f} s")
        finally:
            self.clock.write_text("+0s\n")
        self.works_again("simulator's clock back again", time.monotonic())

    def test_down_and_up_lose_nothing_and_every_program_ends_by_itself(self):
        begin = time.monotonic()
        self.station.compose("stop")
        stopped = time.monotonic() - begin
        codes = {service: self.station.inspect(service)["ExitCode"] for service in MEMBERS}
        tell(f"SIGTERM to all: {stopped:.1f} s, exit codes {codes}")
        self.assertEqual(set(codes.values()), {0}, codes)
        self.station.compose("down")
        begin = time.monotonic()
        self.station.up(MEMBERS)
        self.station.place()
        self.works_again("down and up", begin)
        self.assertEqual(self.acknowledged(), self.before)

    def test_a_discovery_server_stands_in_for_multicast_and_may_die(self):
        server = {"EXEMPLAR_DDS": "--discovery-server discovery:11811"}
        try:
            begin = time.monotonic()
            self.station.compose("--profile", "discovery", "up", "-d", "discovery")
            wait_for(lambda: self.station.healthy("discovery"), "the discovery server", 30)
            self.station.up(MEMBERS, **server)
            # Nobody meets by multicast any more.
            for service in MEMBERS:
                self.station.within(service, "iptables", "-A", "OUTPUT", "-d", "224.0.0.0/4", "-j", "DROP")
            self.station.place(**server)
            self.works_again("with a discovery server", begin)
            self.station.signal("discovery", "KILL")
            self.works_again("discovery server killed", time.monotonic())
            begin = time.monotonic()
            self.station.signal("simulator", "KILL")
            self.works_again("simulator killed beside the new discovery server", begin)
        finally:
            self.station.compose("--profile", "discovery", "rm", "--stop", "--force", "discovery")
            self.station.compose("up", "-d", *MEMBERS)
            self.station.place()
        self.works_again("with multicast again", time.monotonic())

    def test_prometheus_hears_every_program(self):
        query = "import urllib.request as u; print(u.urlopen('http://127.0.0.1:9090/api/v1/query?query=up').read().decode())"
        try:
            self.station.compose("--profile", "observe", "up", "-d", "prometheus")

            def up():
                try:
                    found = json.loads(self.station.within("prometheus", sys.executable, "-c", query))["data"]["result"]
                except AssertionError:
                    return False
                return {one["metric"]["program"] for one in found if one["value"][1] == "1"} == set(MEMBERS)

            wait_for(up, "Prometheus to hear all", LIMIT_S)
        finally:
            self.station.compose("--profile", "observe", "rm", "--stop", "--force", "prometheus")

    def test_the_gateways_image_has_the_page_where_it_was_built(self):
        if not (engine.ROOT / "build" / "web" / "index.html").exists():
            self.skipTest("build/web is not built (deploy/build)")
        page = self.engine.inside(sys.executable, "-c", FETCH.replace("9464/metrics", "8080/"))
        self.assertIn('src="/app.js"', page)

    def test_containers_are_nobody_and_write_nowhere_else(self):
        for service in MEMBERS:
            made = self.station.inspect(service, all_of_it=True)
            self.assertEqual(made["Config"]["User"], "exemplar", service)
            self.assertTrue(made["HostConfig"]["ReadonlyRootfs"], service)
            self.assertEqual(made["HostConfig"]["CapDrop"], ["ALL"], service)
            self.assertIn("org.opencontainers.image.version", made["Config"]["Labels"])


def wait_for_value(ask, what, limit_s):
    found = []
    wait_for(lambda: found.append(ask()) or found[-1], what, limit_s)
    return found[-1]


if __name__ == "__main__":
    try:
        engine.check()
        if not FAKETIME.exists():
            raise engine.Unavailable("not installed: faketime")
    except engine.Unavailable as reason:
        print(f"skipped: {reason}", file=sys.stderr)
        sys.exit(77)
    unittest.main()
