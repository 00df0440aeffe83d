"""Every program as its operator meets it: usage, configuration, metrics, garbage from the network, and the end.

Runs in a network namespace of its own (made by run_isolated).
"""

import os
import pathlib
import random
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.request

import trials

ROOT = pathlib.Path(__file__).resolve().parents[2]
BINARIES = pathlib.Path(os.environ.get("EXEMPLAR_BIN", ROOT / "build" / "release" / "bin"))
ROBOT = ROOT / "deploy" / "models" / "arm7"
RAIL = ROOT / "deploy" / "config" / "rail_press.yaml"
TABLE = ROOT / "deploy" / "config" / "press_table.yaml"
PROGRAMS = ["capture-suit", "capture-tactile", "capture-vision", "executor", "gateway", "learning", "recorder", "simulator"]
WITH_DDS = [name for name in PROGRAMS if name != "learning"]
SERVERS = ["executor", "gateway", "learning", "recorder"]
# What runs under systemd or Docker is killed when it takes longer; on a machine that does nothing else it takes less than 2 s.
ENDS_WITHIN_S = 10
LOG_LINE = re.compile(r"^\d{4}-\d\d-\d\dT\S+Z (debug|info|warning|error) [a-z-]+: .+$")


def run(name, *arguments, timeout=60):
    command = [BINARIES / f"exemplar-{name}", *arguments]
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=timeout, check=False)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_for(condition, limit=60):
    deadline = time.monotonic() + limit
    while time.monotonic() < deadline:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    return None


class Program:
    """A program that runs, with its metrics and, where it serves, its port."""

    def __init__(self, folder, name, *arguments):
        self.name = name
        self.metrics_port = free_port()
        self.log = folder / f"{name}-{self.metrics_port}.log"
        self.port_file = folder / f"{name}-{self.metrics_port}.port"
        words = [BINARIES / f"exemplar-{name}", "--metrics", f"127.0.0.1:{self.metrics_port}", *arguments]
        if name in SERVERS:
            words += ["--port-file", self.port_file]
        with open(self.log, "w", encoding="utf-8") as stream:
            self.process = subprocess.Popen([str(word) for word in words], stderr=stream)

    def port(self):
        return int(wait_for(lambda: self.port_file.exists() and self.port_file.read_text()))

    def metrics(self):
        """Name with labels -> value; waits until they are served."""

        def fetch():
            if self.process.poll() is not None:
                raise AssertionError(self.lines())
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{self.metrics_port}/metrics", timeout=60) as answer:
                    return answer.read().decode()
            except OSError:
                return None

        text = wait_for(fetch)
        assert text, f"{self.name} serves no metrics: {self.lines()}"
        rows = (line.rpartition(" ") for line in text.splitlines() if not line.startswith("#"))
        return {name: float(value) for name, _, value in rows}

    def lines(self):
        return self.log.read_text(encoding="utf-8").splitlines()

    def end(self, how=signal.SIGTERM):
        """Exit code and seconds it took."""
        begin = time.monotonic()
        self.process.send_signal(how)
        code = self.process.wait(timeout=60)
        return code, time.monotonic() - begin


class UsageTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-usage-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def test_help_and_version_succeed_and_say_what_for(self):
        for name in PROGRAMS:
            with self.subTest(name):
                done = run(name, "--help")
                self.assertEqual(done.returncode, 0)
                self.assertIn(f"exemplar-{name} ", done.stdout)
                for flag in ("--config", "--metrics", "--log-format", "--version"):
                    self.assertIn(flag, done.stdout)
                self.assertRegex(run(name, "--version").stdout, rf"^exemplar-{name} \d+\.\d+\.\d+\n$")

    def test_wrong_usage_is_exit_code_two_and_names_the_word(self):
        for name in PROGRAMS:
            with self.subTest(name):
                done = run(name, "--metrisc", "127.0.0.1:0")
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn("--metrics", done.stderr)
        for name in WITH_DDS:
            done = run(name, "--domain", "233")
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn("233", done.stderr)

    def test_a_slip_in_the_configuration_is_named_with_its_line(self):
        config = self.folder / "slip.yaml"
        config.write_text("log-format: json\nlog-levl: info\n")
        for name in PROGRAMS:
            with self.subTest(name):
                done = run(name, "--config", config)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn("slip.yaml: line 2", done.stderr)
                self.assertIn("did you mean log-level", done.stderr)

    def test_the_options_of_containers_and_packages_are_known(self):
        files = [*(ROOT / "deploy" / "docker" / "etc").glob("*.yaml"), *(ROOT / "deploy" / "systemd" / "etc").glob("*.yaml")]
        self.assertGreater(len(files), 10)
        for file in files:
            with self.subTest(str(file)):
                done = run(file.stem, "--config", file, "--check")
                # Nobody runs there: that is found out once the options are understood.
                self.assertEqual(done.returncode, 5, done.stderr)

    def test_what_is_missing_is_named(self):
        absent = self.folder / "absent"
        port = ["--listen", "127.0.0.1:0"]
        cases = [
            (["recorder", "--data-dir", "/proc/exemplar"], 4, "/proc/exemplar"),
            (["learning", "--data-dir", "/proc/exemplar"], 4, "/proc/exemplar"),
            (["learning", "--data-dir", self.folder, "--robot", absent], 3, "absent"),
            (["recorder", "--data-dir", self.folder / "a", *port, "--port-file", absent / "port"], 4, "absent/port"),
            (["simulator", "--robot", absent, "--scene", RAIL], 3, "absent"),
            (["simulator", "--robot", ROBOT, "--scene", absent], 3, "absent"),
            (["capture-vision", "--scene", absent], 3, "absent"),
            (["capture-suit", "--replay", absent], 3, "absent"),
            (["capture-suit"], 2, "--replay"),
            (["capture-suit", "--person"], 2, "--robot"),
            (["executor", "--robot", absent, "--scene", RAIL, "--learning", "127.0.0.1:1"], 3, "absent"),
            (["executor", "--robot", ROBOT, "--scene", RAIL, "--learning", "nowhere"], 4, "nowhere"),
            (["gateway", "--learning", "nowhere"], 4, "nowhere"),
            (["gateway", "--http", "nowhere"], 4, "nowhere"),
            (["recorder", "--config", absent, "--data-dir", self.folder], 2, "absent"),
        ]
        for words, code, named in cases:
            with self.subTest(" ".join(str(word) for word in words)):
                done = run(*words)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn(named, done.stderr)

    def test_a_port_in_use_is_refused(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            address = f"127.0.0.1:{taken.getsockname()[1]}"
            for option in ("--listen", "--metrics"):
                done = run("learning", "--data-dir", self.folder / "data", option, address)
                self.assertEqual(done.returncode, 5, done.stderr)
                self.assertIn(address, done.stderr)


class RunningTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-running-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.programs = {}
        cls.addClassCleanup(cls.kill)
        station = ["--station", "operators", "--domain", "93"]
        cls.station = station
        learning = cls.start("learning", "--data-dir", cls.folder / "learning")
        # The others' options come from files, as an operator would keep them.
        configs = {
            "recorder": {"data-dir": cls.folder / "recordings"},
            "executor": {"robot": ROBOT, "scene": RAIL, "learning": f"127.0.0.1:{learning.port()}"},
            "gateway": {"learning": f"127.0.0.1:{learning.port()}", "http": "127.0.0.1:0"},
            "simulator": {"robot": ROBOT, "scene": RAIL, "cameras": "off"},
            "capture-tactile": {"from-robot": "true", "rate-hz": 60},
            "capture-vision": {"scene": TABLE},
        }
        for name, options in configs.items():
            file = cls.folder / f"{name}.yaml"
            file.write_text("".join(f"{key}: {value}\n" for key, value in options.items()))
            cls.start(name, "--config", file, *station)
        cls.files = trials.write_set(cls.folder / "trials", [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06)])

    @classmethod
    def start(cls, name, *arguments):
        program = Program(cls.folder, name, *arguments)
        cls.programs[name] = program
        return program

    @classmethod
    def kill(cls):
        for program in cls.programs.values():
            if program.process.poll() is None:
                program.process.kill()
            program.process.wait()

    def test_1_every_program_serves_its_figures(self):
        suit = self.start("capture-suit", "--replay", *self.files, "--rate", "0.2", *self.station)
        wanted = {
            "learning": "exemplar_learning_calls_total",
            "recorder": "exemplar_recorder_recording",
            "gateway": "exemplar_gateway_samples_total",
            "executor": 'exemplar_executor_state{state="idle"}',
            "simulator": 'exemplar_simulator_sent_total{topic="ircp/joint_state",source="robot"}',
            "capture-tactile": 'exemplar_capture_tactile_sent_total{topic="ircp/tactile",source="tactile"}',
            "capture-vision": "exemplar_capture_vision_pictures_total",
            "capture-suit": "exemplar_capture_suit_trials_total",
        }
        for name, metric in wanted.items():
            with self.subTest(name):
                program = self.programs[name]
                if name == "learning":
                    self.assertIn("exemplar_learning_skill_version", self.help_of(program))
                else:
                    self.assertIn(metric, program.metrics())
        tactile = self.programs["capture-tactile"]
        sent = wanted["capture-tactile"]
        self.assertTrue(wait_for(lambda: tactile.metrics()[sent] > 30))
        self.assertTrue(wait_for(lambda: self.programs["executor"].metrics().get("exemplar_executor_joint_state_age_seconds", 9) < 1))
        for name, program in self.programs.items():
            for metric, value in program.metrics().items():
                if "_lost_total" in metric:
                    self.assertEqual(value, 0, f"{name}: {metric}")
        code, seconds = suit.end()
        self.assertEqual(code, 130, suit.lines())
        self.assertLess(seconds, ENDS_WITHIN_S)

    def help_of(self, program):
        program.metrics()
        with urllib.request.urlopen(f"http://127.0.0.1:{program.metrics_port}/metrics", timeout=60) as answer:
            return answer.read().decode()

    def test_2_garbage_on_ports_ends_nothing(self):
        rng = random.Random(7)
        for name, program in self.programs.items():
            if name == "capture-suit":
                continue
            ports = [program.metrics_port] + ([program.port()] if name in SERVERS else [])
            for port in ports:
                for length in (1, 100, 10_000, 1_000_000):
                    with socket.create_connection(("127.0.0.1", port), timeout=30) as link:
                        try:
                            link.sendall(rng.randbytes(length))
                        except OSError:
                            pass  # it may hang up on us
            self.assertIsNone(program.process.poll(), program.lines())
            program.metrics()

    def test_3_a_second_executor_and_recorder_are_said(self):
        for name in ("executor", "recorder"):
            with self.subTest(name):
                first = self.programs[name]
                extra = ["--data-dir", self.folder / "second"] if name == "recorder" else []
                second = Program(self.folder, name, "--config", self.folder / f"{name}.yaml", *extra, *self.station)
                said = f"another {name} runs in this station"
                try:
                    for program in (first, second):
                        self.assertTrue(wait_for(lambda: any(said in line for line in program.lines())), program.lines())
                finally:
                    second.end()

    def test_4_a_capture_that_is_interrupted_stops_its_recording(self):
        suit = Program(self.folder, "capture-suit", "--replay", self.files[0], "--rate", "0.2", "--record", "--name", "cut", *self.station)
        recorder = self.programs["recorder"]
        self.assertTrue(wait_for(lambda: recorder.metrics()["exemplar_recorder_recording"] == 1), suit.lines())
        code, seconds = suit.end(signal.SIGINT)
        self.assertEqual(code, 130, suit.lines())
        self.assertLess(seconds, ENDS_WITHIN_S)
        self.assertTrue(wait_for(lambda: recorder.metrics()["exemplar_recorder_recording"] == 0))
        self.assertEqual(self.magic(self.folder / "recordings" / "cut.mcap"), b"\x89MCAP0\r\n")

    def test_5_a_recording_that_cannot_be_made_is_an_error(self):
        arguments = ["--replay", self.files[0], "--rate", "20", "--record", *self.station]
        self.assertEqual(run("capture-suit", *arguments, "--name", "twice").returncode, 0)
        again = run("capture-suit", *arguments, "--name", "twice")
        self.assertEqual(again.returncode, 4, again.stderr)
        self.assertIn("twice", again.stderr)
        for name in ("../outside", "/tmp/outside", "a/b", "..", ""):
            with self.subTest(name):
                refused = run("capture-suit", *arguments, "--name", name)
                if name:
                    self.assertNotEqual(refused.returncode, 0, refused.stderr)
        self.assertFalse((self.folder / "outside.mcap").exists())
        lonely = run("capture-suit", "--replay", self.files[0], "--record", "--station", "elsewhere", "--domain", "93", timeout=90)
        self.assertEqual(lonely.returncode, 5, lonely.stderr)
        self.assertIn("recorder", lonely.stderr)

    def test_6_all_end_soon_and_leave_whole_files(self):
        suit = Program(self.folder, "capture-suit", "--replay", self.files[0], "--rate", "0.2", "--record", "--name", "last", *self.station)
        recorder = self.programs["recorder"]
        self.assertTrue(wait_for(lambda: recorder.metrics()["exemplar_recorder_recording"] == 1), suit.lines())
        for name, program in self.programs.items():
            if name == "capture-suit":
                continue
            with self.subTest(name):
                code, seconds = program.end()
                self.assertEqual(code, 0, program.lines())
                self.assertLess(seconds, ENDS_WITHIN_S)
                for line in program.lines():
                    self.assertRegex(line, LOG_LINE)
        self.assertEqual(self.magic(self.folder / "recordings" / "last.mcap"), b"\x89MCAP0\r\n")
        # Its recorder is gone: it says so.
        code = suit.process.wait(timeout=60)
        self.assertEqual(code, 5, suit.lines())
        self.assertTrue(any("recorder" in line for line in suit.lines()), suit.lines())

    @staticmethod
    def magic(file):
        """The last bytes of a whole MCAP file are its magic."""
        assert wait_for(file.exists), file
        return file.read_bytes()[-8:]


class InMotionTest(unittest.TestCase):
    """What ends while the simulated robot moves, by real processes."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-motion-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.programs = []
        cls.addClassCleanup(cls.kill)
        cls.station = ["--station", "motion", "--domain", "93"]
        cls.scene = ["--robot", ROBOT, "--scene", RAIL]
        cls.learning = cls.start("learning", "--data-dir", cls.folder / "learning")
        cls.simulator = cls.start("simulator", *cls.scene, "--cameras", "off", *cls.station)
        files = trials.write_set(cls.folder / "trials", [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06)])
        for words in (["trial", "submit", "--skill", "press", *files], ["skill", "learn", "press"]):
            done = cls.ask(cls.learning, *words)
            assert done.returncode == 0, done.stderr

    @classmethod
    def start(cls, name, *arguments):
        program = Program(cls.folder, name, *arguments)
        cls.programs.append(program)
        return program

    @classmethod
    def kill(cls):
        for program in cls.programs:
            if program.process.poll() is None:
                program.process.kill()
            program.process.wait()

    @staticmethod
    def ask(program, *words):
        command = [BINARIES / "exemplar", "--server", f"127.0.0.1:{program.port()}", *words]
        return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=60, check=False)

    def moving_executor(self, speed=0.2):
        """An executor in the middle of a motion, which goes on for long when it is slow."""
        # A simulator that a busy machine keeps from running for long is not what is tested here.
        patient = ["--state-patience-s", "5", "--command-patience-s", "5", "--path-tolerance", "3"]
        executor = self.start("executor", *self.scene, "--learning", f"127.0.0.1:{self.learning.port()}", *patient, *self.station)
        seen = "exemplar_executor_joint_state_age_seconds"
        self.assertTrue(wait_for(lambda: executor.metrics().get(seen, 9) < 0.2), executor.lines())
        done = self.ask(executor, "skill", "execute", "press", "--object", "target=0.55,-0.15,0.05", "--speed", str(speed))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(wait_for(lambda: executor.metrics()['exemplar_executor_state{state="executing"}'] == 1), executor.lines())
        cycles = executor.metrics()["exemplar_executor_cycles_total"]
        self.assertTrue(wait_for(lambda: executor.metrics()["exemplar_executor_cycles_total"] > cycles + 40))
        return executor

    def stale(self):
        return self.simulator.metrics()["exemplar_simulator_stale_total"]

    def test_sigterm_in_motion_holds_and_then_exits(self):
        executor = self.moving_executor()
        code, seconds = executor.end()
        self.assertEqual(code, 0, executor.lines())
        self.assertLess(seconds, ENDS_WITHIN_S)
        lines = executor.lines()
        stop = next(n for n, line in enumerate(lines) if "protective_stop" in line and "shutting down" in line)
        self.assertLess(stop, next(n for n, line in enumerate(lines) if "stopped" in line and n > stop), lines)

    def test_a_motion_outlives_its_learning_service(self):
        executor = self.moving_executor(speed=0.5)
        self.learning.end(signal.SIGKILL)
        type(self).learning = self.start("learning", "--data-dir", self.folder / "learning")
        done = 'exemplar_executor_executions_total{end="done"}'
        self.assertTrue(wait_for(lambda: executor.metrics().get(done) == 1), executor.lines())
        refused = self.ask(executor, "skill", "execute", "press", "--object", "target=0.55,-0.15,0.05", "--wait")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("no answer", refused.stderr)
        self.assertEqual(executor.end()[0], 0)

    def test_nobody_who_joins_can_hold_up_what_the_robot_says_or_is_told(self):
        # Fast DDS opens a newcomer's port of shared memory by a check that may sleep .33 s: those two have none.
        executor = self.moving_executor()
        for program in (executor, self.simulator):
            maps = pathlib.Path(f"/proc/{program.process.pid}/maps").read_text()
            self.assertIn("libfastrtps", maps)
            self.assertNotIn("fastrtps_port", maps)
        self.assertEqual(executor.end()[0], 0)

    def test_the_robot_holds_by_itself_when_its_executor_is_killed(self):
        executor = self.moving_executor()
        before = self.stale()
        executor.end(signal.SIGKILL)
        self.assertTrue(wait_for(lambda: self.stale() > before))
        self.assertIsNone(self.simulator.process.poll())
        # And another one takes it from where it stands.
        self.assertEqual(self.moving_executor().end()[0], 0)


if __name__ == "__main__":
    unittest.main()
