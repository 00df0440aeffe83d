"""The command line as a person or a script meets it: help, errors, exit codes, formats.

Runs the real `exemplar` against a real `exemplar-learning` on trials made here.
"""

import csv
import io
import json
import math
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import time
import unittest
import xml.etree.ElementTree

BINARIES = pathlib.Path(os.environ["EXEMPLAR_BIN"])
DONE, OTHER, USAGE, NOT_FOUND, REFUSED, UNAVAILABLE, INTERRUPTED = 0, 1, 2, 3, 4, 5, 130
COMMANDS = {
    "trial": ["submit", "list", "show", "segments", "export", "delete"],
    "skill": ["learn", "list", "show", "versions", "suggest", "rollback", "delete", "query", "evaluate", "execute", "export"],
    "robot": ["status", "pause", "resume", "cancel", "stop", "reset", "speed"],
    "record": ["start", "stop", "pause", "resume", "status", "info", "recover"],
}
PLACES = [(0.50, -0.20), (0.60, 0.00), (0.45, 0.10), (0.62, -0.22), (0.52, -0.05)]
POSE = ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]


def smooth(s):
    s = min(max(s, 0.0), 1.0)
    return s * s * s * (10 - 15 * s + 6 * s * s)


def write_trial(path, seed, place):
    """Reach over a button, press it, go back; 100 Hz, seeded timing and start."""
    rng = random.Random(seed)
    rest, reach, press, hold = rng.uniform(0.2, 0.4), rng.uniform(0.9, 1.3), rng.uniform(0.5, 0.7), rng.uniform(0.3, 0.5)
    start = [0.30 + rng.gauss(0, 0.01), rng.gauss(0, 0.01), 0.30]
    above, button = [*place, 0.15], [*place, 0.05]
    columns = ["time_s", *(f"ee_{name}" for name in POSE), "tactile_finger_n", *(f"object_button_{name}" for name in POSE)]
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        for i in range(int(100 * (2 * rest + reach + 2 * press + hold))):
            t = i / 100
            over = smooth((t - rest) / reach)
            down = smooth((t - rest - reach) / press) - smooth((t - rest - reach - press - hold) / press)
            tool = [s + (a - s) * over + (b - a) * down for s, a, b in zip(start, above, button)]
            touch = smooth((t - rest - reach - press) / 0.15) - smooth((t - rest - reach - press - hold + 0.15) / 0.15)
            writer.writerow([t, *tool, 1, 0, 0, 0, 5 * touch, *button, 0, 0, 0, 1])


def run(*words, server=None, env=None):
    command = [str(BINARIES / "exemplar"), *map(str, words)]
    environment = {k: v for k, v in os.environ.items() if k != "EXEMPLAR_SERVER"} | (env or {})
    if server:
        environment["EXEMPLAR_SERVER"] = server
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, env=environment)


class Learning:
    """exemplar-learning on a port of its own choice."""

    def __init__(self, folder, *words, data="data"):
        self.port_file = folder / f"port-{data}"
        self.port_file.unlink(missing_ok=True)
        self.log = open(folder / "learning.log", "ab")
        command = [BINARIES / "exemplar-learning", "--listen", "127.0.0.1:0", "--port-file", self.port_file, "--data-dir", folder / data, *words]
        self.process = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stderr=self.log)
        deadline = time.monotonic() + 60
        while not self.port_file.exists():
            assert self.process.poll() is None and time.monotonic() < deadline, "exemplar-learning does not listen"
            time.sleep(0.01)
        self.address = "127.0.0.1:" + self.port_file.read_text().strip()

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        code = self.process.wait(20)
        self.log.close()
        return code


class WordsTest(unittest.TestCase):
    """Without any server."""

    def commands(self, *path):
        """Every command that does something, with its --help."""
        text = run(*path, "--help").stdout
        names = re.findall(r"(?m)^  ([a-z_-]+) +\S", text.partition("Subcommands:")[2].partition("Examples:")[0])
        for name in names:
            yield from self.commands(*path, name)
        if not names:
            yield " ".join(path), text

    def test_every_command_has_examples_and_json_for_scripts(self):
        files = {"trial export", "skill export", "completion"}  # what they print is a file
        commands = dict(self.commands())
        self.assertGreater(len(commands), 40)
        self.assertLessEqual({f"{group} {name}" for group, names in COMMANDS.items() for name in names}, set(commands))
        for name, text in commands.items():
            self.assertIn(f"Usage: exemplar {name}", text)
            self.assertIn(f"Examples:\n  exemplar {name}", text)
            self.assertEqual(re.search(r"--format \S*json", text) is None, name in files, name)

    def test_help_is_a_word_as_well(self):
        self.assertEqual(run("help", "skill", "learn").stdout, run("skill", "learn", "--help").stdout)
        self.assertEqual(run("help").stdout, run("--help").stdout)

    def test_the_overview_says_a_whole_sentence_of_each_command(self):
        for line in run("--help").stdout.partition("Subcommands:")[2].partition("Examples:")[0].splitlines():
            self.assertNotRegex(line, r"(,| or| the| and)$")

    def test_version_is_one_line(self):
        self.assertRegex(run("--version").stdout, r"^exemplar \d+\.\d+\.\d+\n$")

    def test_bad_usage_is_said_on_stderr_with_code_2(self):
        for words, said in [
            ([], "which command?"),
            (["help", "skil"], 'did you mean "skill"?'),
            (["skill", "lern", "--help"], 'did you mean "learn"?'),
            (["skil", "list"], 'did you mean "skill"?'),
            (["skill", "lern", "press"], 'did you mean "learn"?'),
            (["skill", "learn"], "NAME is required"),
            (["skill", "learn", "press", "--optoin", "a=b"], 'did you mean "--option"?'),
            (["skill", "learn", "press", "--option", "method"], "must be name=value"),
            (["skill", "learn", "press", "--option", "a=1", "--option", "a=2"], "given twice"),
            (["skill", "list", "--format", "xml"], '"xml" is not one of text, json'),
            (["skill", "query", "press", "--object", "0.1,0.2,0.3"], "must be NAME=x,y,z"),
            (["skill", "query", "press", "--object", "b=0.1,0.2"], "2 numbers"),
            (["skill", "query", "press", "--object", "b=0.1,zwei,0.3"], '"zwei" is not a number'),
            (["skill", "query", "press", "--object", "b=nan,0,0"], '"nan" is not a number'),
            (["skill", "query", "press", "--object", "b=0,0,0,0,0,0,0"], "the quaternion is zero"),
            (["skill", "query", "press", "--object", "b=1,2,3", "--object", "b=1,2,3"], '"b" is given twice'),
            (["skill", "query", "press", "--start", "-0.1,0.2"], "--start -0.1,0.2: 2 numbers"),
            (["skill", "query", "press", "--joint-start", "a=1,2"], "--joint-start"),
            (["skill", "execute", "press", "--speed", "1.5"], "--speed is 1.5"),
            (["skill", "rollback", "press"], "--version is required"),
            (["robot", "speed", "-1"], 'FACTOR is "-1"'),
            (["trial", "submit", "a.csv"], "--skill is required"),
            (["--timeout", "-3", "skill", "list"], "--timeout is -3"),
            (["--server", "nowhere", "skill", "list"], 'server address "nowhere" is not HOST:PORT'),
        ]:
            with self.subTest(words=words):
                done = run(*words)
                self.assertEqual((done.returncode, done.stdout), (USAGE, ""), done.stderr)
                self.assertIn(said, done.stderr)

    def test_nobody_answering_is_code_5_with_the_address(self):
        for words in (["skill", "list"], ["robot", "status"], ["record", "stop"], ["skill", "learn", "press"]):
            done = run("--server", "127.0.0.1:1", *words)
            self.assertEqual((done.returncode, done.stdout), (UNAVAILABLE, ""))
            self.assertIn("no answer from 127.0.0.1:1: nobody listens there", done.stderr)
            self.assertIn("exemplar doctor --server", done.stderr)

    def test_ctrl_c_is_code_130_and_says_how_things_stand(self):
        backup = pathlib.Path(tempfile.gettempdir()) / f"exemplar-cli-{os.getpid()}.tar"
        for words, standing in [
            (["skill", "learn", "press"], "nothing was changed"),
            (["skill", "execute", "press", "--wait"], "the robot slows down and holds"),
            (["robot", "teleop", "on"], "teleoperation has ended, the robot holds"),
            (["backup", backup], f"there is no {backup}"),
            (["person", "erase", "user03", "--yes"], "nothing was erased"),
        ]:
            with self.subTest(words=words), socket.create_server(("127.0.0.1", 0)) as silent:
                command = [BINARIES / "exemplar", "--server", f"127.0.0.1:{silent.getsockname()[1]}", *words]
                process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
                connection, _ = silent.accept()
                process.send_signal(signal.SIGINT)
                out, err = process.communicate(timeout=60)
                connection.close()
                self.assertEqual((process.returncode, out), (INTERRUPTED, ""), err)
                self.assertTrue(err.endswith(f"exemplar: interrupted; {standing}\n"), err)
        self.assertFalse(backup.exists())

    def test_a_file_that_is_not_there_is_code_3(self):
        for words in (["trial", "submit", "--skill", "a", "none.csv"], ["trial", "segments", "none.csv"], ["skill", "evaluate", "a", "none.csv"], ["record", "info", "none.mcap"]):
            done = run(*words, server="127.0.0.1:1")
            self.assertEqual(done.returncode, NOT_FOUND, done.stderr)
            self.assertIn("none.", done.stderr)


class RecordingFileTest(unittest.TestCase):
    """`record info` and `record recover` on files, without a server."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-cli-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def cut_recording(self, messages):
        """A recording whose recorder was killed within the last message's record."""
        text = lambda word: struct.pack("<I", len(word)) + word.encode()
        record = lambda opcode, data: struct.pack("<BQ", opcode, len(data)) + data
        out = b"\x89MCAP0\r\n" + record(1, text("") + text("a test"))
        out += record(3, struct.pack("<H", 1) + text("Number") + text("omgidl") + text("struct Number { long n; };"))
        out += record(4, struct.pack("<HH", 1, 1) + text("ircp/number") + text("cdr") + struct.pack("<I", 0))
        for i in range(messages + 1):
            now = 1_700_000_000_000_000_000 + i * 10_000_000
            out += record(5, struct.pack("<HIQQ", 1, i, now, now) + struct.pack("<II", 0x100, i))
        file = self.folder / "cut.mcap"
        file.write_bytes(out[:-5])
        return file

    def test_a_cut_recording_is_recovered_and_then_shown(self):
        file = self.cut_recording(5)
        before = file.read_bytes()
        refused = run("record", "info", file)
        self.assertEqual(refused.returncode, REFUSED)
        self.assertIn("record recover", refused.stderr)
        recovered = run("record", "recover", file, "--format", "json")
        self.assertEqual(recovered.returncode, DONE, recovered.stderr)
        report = json.loads(recovered.stdout)
        self.assertEqual((report["messages"], report["was_whole"]), (5, False))
        self.assertEqual(report["output"], str(self.folder / "cut.recovered.mcap"))
        self.assertEqual(file.read_bytes(), before)
        info = json.loads(run("record", "info", report["output"], "--format", "json").stdout)
        self.assertEqual(info["messages"], 5)
        self.assertEqual(info["topics"], [{"topic": "ircp/number", "type": "Number", "encoding": "cdr", "messages": 5}])
        self.assertAlmostEqual(info["duration_s"], 0.04)
        self.assertIn("ircp/number", run("record", "info", report["output"]).stdout)

    def test_what_is_there_is_not_overwritten(self):
        file = self.cut_recording(1)
        self.assertEqual(run("record", "recover", file).returncode, DONE)
        self.assertEqual(run("record", "recover", file).returncode, REFUSED)

    def test_a_file_that_is_no_recording_is_refused(self):
        file = self.folder / "notes.mcap"
        file.write_text("these are notes")
        for action in ("info", "recover"):
            done = run("record", action, file)
            self.assertEqual(done.returncode, REFUSED)
            self.assertIn("notes.mcap", done.stderr)
        self.assertEqual(sorted(self.folder.iterdir()), [file])


class ServiceTest(unittest.TestCase):
    """Against one learning service, from empty to deleted."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-cli-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.files = []
        for number, place in enumerate(PLACES):
            cls.files.append(cls.folder / f"press{number}.csv")
            write_trial(cls.files[-1], number, place)
        cls.left_out = cls.folder / "left-out.csv"
        write_trial(cls.left_out, 99, (0.55, -0.10))
        cls.learning = Learning(cls.folder)
        done = cls.exemplar("trial", "submit", "--skill", "press", *cls.files)
        assert done.returncode == DONE, done.stderr
        cls.ids = done.stdout.split()
        cls.learned = cls.exemplar("skill", "learn", "press")
        assert cls.learned.returncode == DONE, cls.learned.stderr

    @classmethod
    def tearDownClass(cls):
        code = cls.learning.end()
        assert code == 0, f"exemplar-learning ended with {code} on SIGTERM"

    @classmethod
    def exemplar(cls, *words):
        return run(*words, server=cls.learning.address)

    def json(self, *words):
        done = self.exemplar(*words, "--format", "json")
        self.assertEqual(done.returncode, DONE, done.stderr)
        return json.loads(done.stdout)

    def test_submit_prints_ids_and_knows_duplicates(self):
        self.assertEqual(len(set(self.ids)), len(PLACES))
        again = self.exemplar("trial", "submit", "--skill", "press", self.files[0])
        self.assertEqual(again.stdout, self.ids[0] + "\n")
        self.assertIn("was there already", again.stderr)
        self.assertEqual(len(self.json("trial", "list", "--skill", "press")), len(PLACES))
        self.assertTrue(self.json("trial", "submit", "--skill", "press", self.files[1])[0]["duplicate"])

    def test_a_bad_file_does_not_keep_the_others_from_being_stored(self):
        bad = self.folder / "bad.csv"
        bad.write_text("time_s,ee_x_m,ee_y_m,ee_z_m\n0,0,0,0\n0.1,zero,0,0\n0.2,0,0,0\n")
        done = self.exemplar("trial", "submit", "--skill", "mixed", bad, self.folder / "none.csv", self.files[0])
        self.assertEqual(done.returncode, REFUSED)
        self.assertIn("bad.csv:3: ee_x_m", done.stderr)
        self.assertIn("none.csv", done.stderr)
        self.assertEqual(len(done.stdout.split()), 1)
        self.assertEqual(len(self.json("trial", "list", "--skill", "mixed")), 1)

    def test_learning_tells_progress_and_ends_with_a_report(self):
        self.assertIn("storing the skill\n", self.learned.stderr)
        self.assertNotIn("\r", self.learned.stderr)
        for words in ("skill press, version", "press0.csv", "correlation", "before alignment", "contact", "METHOD", "FRECHET"):
            self.assertIn(words, self.learned.stdout)
        report = self.json("skill", "show", "press", "--version", 1)
        self.assertEqual([trial["id"] for trial in report["trials"]], self.ids)
        self.assertGreater(len(report["methods"]), 1)

    def test_figures_are_written_with_an_index(self):
        folder = self.folder / "new" / "figures"
        done = self.exemplar("skill", "show", "press", "--figures", folder)
        self.assertEqual(done.returncode, DONE, done.stderr)
        names = [f"figure-{number:02d}.svg" for number in range(4, 15)]
        self.assertEqual(sorted(path.name for path in folder.iterdir()), [*names, "index.html"])
        index = (folder / "index.html").read_text(encoding="utf-8")
        for name in names:
            root = xml.etree.ElementTree.parse(folder / name).getroot()
            self.assertEqual(root.tag, "{http://www.w3.org/2000/svg}svg")
            self.assertIn(str(folder / name), done.stdout)
            self.assertIn(f'src="{name}"', index)
        as_json = self.exemplar("skill", "show", "press", "--figures", folder, "--format", "json")
        self.assertEqual(json.loads(as_json.stdout)["skill"], "press")
        self.assertIn("index.html", as_json.stderr)
        taken = self.exemplar("skill", "show", "press", "--figures", self.files[0])
        self.assertEqual(taken.returncode, REFUSED)
        self.assertIn("press0.csv", taken.stderr)

    def test_a_query_in_csv_has_the_contracts_columns(self):
        done = self.exemplar("skill", "query", "press", "--object", "button=0.55,-0.1,0.05")
        self.assertEqual(done.returncode, DONE, done.stderr)
        rows = list(csv.DictReader(io.StringIO(done.stdout)))
        self.assertEqual(list(rows[0]), ["time_s", *(f"ee_{name}" for name in POSE), "objectivity", "sigma_m"])
        nearest = min(math.dist((0.55, -0.1, 0.05), [float(row[f"ee_{axis}_m"]) for axis in "xyz"]) for row in rows)
        self.assertLess(nearest, 0.02)
        self.assertIn("orientation", done.stderr)

    def test_a_query_in_json_holds_the_warnings_and_goes_to_a_file(self):
        file = self.folder / "answer.json"
        done = self.exemplar(
            "skill", "query", "press", "--object", "button=0.55,-0.1,0.05,0,0,0,2", "--start", "0.3,0,0.3", "--format", "json", "--output", file
        )  # fmt: skip
        self.assertEqual((done.returncode, done.stdout, done.stderr), (DONE, "", ""))
        answer = json.loads(file.read_text())
        self.assertEqual(answer["objects"][0]["quaternion"], [0, 0, 0, 1])
        self.assertIsInstance(answer["warnings"], list)
        self.assertLess(math.dist(answer["base_T_tool"][0]["position"], (0.3, 0, 0.3)), 0.02)
        self.assertEqual(len(answer["objectivity"]), len(answer["time_s"]))
        text = self.exemplar("skill", "query", "press", "--object", "button=0.55,-0.1,0.05", "--format", "text")
        self.assertIn("contact", text.stdout)

    def test_what_does_not_exist_is_code_3(self):
        for words, said in [
            (["skill", "show", "pres"], 'did you mean "press"?'),
            (["skill", "show", "press", "--version", "99"], "99"),
            (["skill", "query", "nothing", "--object", "a=1,2,3"], '"nothing"'),
            (["skill", "learn", "nothing"], '"nothing"'),
            (["skill", "delete", "nothing"], '"nothing"'),
            (["trial", "show", "trial-0"], "trial-0"),
            (["trial", "segments", "trial-0"], "trial-0"),
            (["trial", "delete", "trial-0"], "trial-0"),
        ]:
            with self.subTest(words=words):
                done = self.exemplar(*words)
                self.assertEqual((done.returncode, done.stdout), (NOT_FOUND, ""), done.stderr)
                self.assertIn(said, done.stderr)

    def test_what_cannot_be_is_code_4_with_the_value(self):
        for words, said in [
            (["skill", "learn", "press", "--option", "method=magic"], '"magic"'),
            (["skill", "learn", "press", "--option", "methd=paper"], 'did you mean "method"?'),
            (["trial", "submit", "--skill", "a/b", self.files[0]], '"a/b"'),
        ]:
            with self.subTest(words=words):
                done = self.exemplar(*words)
                self.assertEqual((done.returncode, done.stdout), (REFUSED, ""), done.stderr)
                self.assertIn(said, done.stderr)

    def test_an_unknown_object_is_named(self):
        done = self.exemplar("skill", "query", "press", "--object", "lever=0.5,0,0")
        self.assertIn(done.returncode, (NOT_FOUND, REFUSED))
        self.assertIn("lever", done.stderr)
        self.assertIn("button", done.stderr)

    def test_a_service_that_this_server_lacks_is_said(self):
        done = self.exemplar("robot", "status")
        self.assertEqual(done.returncode, REFUSED)
        self.assertIn(self.learning.address, done.stderr)

    def test_evaluation_prints_the_deviation(self):
        text = self.exemplar("skill", "evaluate", "press", self.left_out)
        self.assertRegex(text.stdout, r"Frechet distance +[\d.]+ cm\nend error +[\d.]+ cm\nend angle +[\d.]+ rad\n")
        evaluation = self.json("skill", "evaluate", "press", self.left_out)
        self.assertLess(evaluation["deviation"]["frechet_m"], 0.05)
        self.assertEqual(evaluation["query"]["objects"][0]["name"], "button")

    def test_segments_of_a_file_and_of_its_stored_trial_are_the_same(self):
        of_file = self.exemplar("trial", "segments", self.files[0])
        self.assertEqual(of_file.returncode, DONE, of_file.stderr)
        rows = list(csv.DictReader(io.StringIO(of_file.stdout)))
        self.assertEqual(list(rows[0])[:3], ["time_s", "cause", "score"])
        self.assertIn("touch onset", [row["cause"] for row in rows])
        self.assertEqual(self.exemplar("trial", "segments", self.ids[0]).stdout, of_file.stdout)
        self.assertEqual(len(self.json("trial", "segments", self.ids[0])["markers"]), len(rows))

    def test_an_exported_trial_is_the_trial(self):
        file = self.folder / "exported.csv"
        self.assertEqual(self.exemplar("trial", "export", self.ids[2], "--output", file).returncode, DONE)
        again = self.exemplar("trial", "submit", "--skill", "press", file)
        self.assertEqual(again.stdout.strip(), self.ids[2])

    def test_versions_roll_back_and_survive_a_kill(self):
        skill = ["--skill", "versions"]
        self.exemplar("trial", "submit", *skill, *self.files[:4])
        for option in ("method=paper", "method=frames"):
            done = self.exemplar("skill", "learn", "versions", "--option", option)
            self.assertEqual(done.returncode, DONE, done.stderr)
        self.assertEqual(self.exemplar("skill", "rollback", "versions", "--version", 1).returncode, DONE)
        query = ["skill", "query", "versions", "--object", "button=0.5,0,0.05,0,0,0,1"]
        answer = self.exemplar(*query).stdout
        acknowledged = self.exemplar("trial", "submit", *skill, self.files[4]).stdout.strip()
        self.learning.end(signal.SIGKILL)
        type(self).learning = Learning(self.folder)
        self.assertIn(acknowledged, [trial["id"] for trial in self.json("trial", "list", *skill)])
        versions = self.json("skill", "versions", "versions")
        self.assertEqual([(v["version"], v["current"], v["method"]) for v in versions], [(1, True, "paper"), (2, False, "frames")])
        self.assertEqual(self.exemplar(*query).stdout, answer)
        # Killed right after the acknowledgement of a learning.
        self.assertEqual(self.exemplar("skill", "learn", "versions").returncode, DONE)
        self.learning.end(signal.SIGKILL)
        type(self).learning = Learning(self.folder)
        versions = self.json("skill", "versions", "versions")
        self.assertEqual([(v["version"], v["current"]) for v in versions], [(1, False), (2, False), (3, True)])
        self.assertEqual(self.exemplar(*query).returncode, DONE)
        self.assertEqual(self.exemplar("skill", "delete", "versions").returncode, DONE)
        self.assertEqual(self.exemplar("skill", "versions", "versions").returncode, NOT_FOUND)
        # Numbers go on where the deleted skill's ended.
        self.assertEqual(self.exemplar("skill", "learn", "versions").returncode, DONE)
        self.assertEqual([v["version"] for v in self.json("skill", "versions", "versions")], [4])
        self.assertEqual(self.exemplar("skill", "delete", "versions").returncode, DONE)
        self.assertEqual(len(self.json("trial", "list", *skill)), 5)

    def test_suggest_says_where_to_demonstrate_next(self):
        found = self.json("skill", "suggest", "press", "--count", 2)
        self.assertIn(len(found["places"]), (1, 2))
        self.assertEqual(found["places"][0]["target"]["name"], "button")
        self.assertGreater(found["places"][0]["nearest_trial_m"], 0)
        text = self.exemplar("skill", "suggest", "press").stdout
        self.assertIn('demonstrate next with "button" at', text)
        self.assertIn("the nearest trial is", text)
        wrong = self.exemplar("skill", "suggest", "press", "--count", 99)
        self.assertEqual(wrong.returncode, REFUSED)
        self.assertIn("count is 99", wrong.stderr)
        self.assertEqual(self.exemplar("skill", "suggest", "nothing").returncode, NOT_FOUND)

    def test_segments_takes_the_options_of_segmentation(self):
        options = ["--option", "threshold=local", "--option", "cues=extrema,orientation"]
        found = self.json("trial", "segments", self.files[0], *options)
        self.assertEqual(len(found["c_along"]), len(found["msv"]))
        plain = self.json("trial", "segments", self.files[0])
        self.assertEqual(plain["c_along"], [])
        self.assertGreater(len(found["markers"]), len(plain["markers"]))
        self.assertTrue(all(marker["cause"] and marker["score"] > 0 for marker in found["markers"]))
        wrong = self.exemplar("trial", "segments", self.files[0], "--option", "cues=smell")
        self.assertEqual(wrong.returncode, REFUSED)
        self.assertIn("orientation, extrema", wrong.stderr)

    def test_tables_are_aligned(self):
        for words in (["trial", "list"], ["skill", "list"], ["skill", "versions", "press"]):
            lines = self.exemplar(*words).stdout.splitlines()
            self.assertGreater(len(lines), 1)
            starts = {match.start() for match in re.finditer(r"(?<=  )\S|^\S", lines[0])}
            self.assertEqual(lines[0], lines[0].upper())
            self.assertGreater(len(starts), 3)

    def test_a_second_service_on_the_same_data_is_refused(self):
        command = [BINARIES / "exemplar-learning", "--data-dir", self.folder / "data"]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=20)
        self.assertEqual(done.returncode, REFUSED)
        self.assertIn("in use", done.stderr)


class SecuredTest(unittest.TestCase):
    """A service that wants TLS and tokens: who is refused is told why, and what helps."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-cli-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.station = cls.folder / "station"
        cls.security("init", "--station", "test")
        issued = cls.security("issue", "learning", "--role", "learning", "--format", "json")
        cls.token = cls.security("token", "ben", "--role", "observe", "--format", "json")["token"]
        cls.ca = issued["tls_ca"]
        tls = ["--tls-cert", issued["tls_cert"], "--tls-key", issued["tls_key"], "--access", cls.station / "access.yaml"]
        cls.learning = Learning(cls.folder, *tls)

    @classmethod
    def tearDownClass(cls):
        cls.learning.end()

    @classmethod
    def security(cls, command, *words):
        done = run("security", command, cls.station, *words)
        assert done.returncode == DONE, done.stderr
        return json.loads(done.stdout) if "json" in words else done.stdout

    def exemplar(self, *words, token=None):
        secret = self.folder / "token"
        secret.write_text(token or "")
        return run("--tls-ca", self.ca, *(["--token", f"@{secret}"] if token else []), *words, server=self.learning.address)

    def test_who_shows_nothing_or_what_is_not_known_is_told_how_to_get_a_token(self):
        for token, said in ((None, "wants a token"), ("exm_guess", "not known")):
            done = self.exemplar("skill", "list", token=token)
            self.assertEqual((done.returncode, done.stdout), (REFUSED, ""))
            self.assertIn(said, done.stderr)
            self.assertIn("exemplar security token", done.stderr)

    def test_who_lacks_a_role_is_told_which(self):
        self.assertEqual(self.exemplar("skill", "list", token=self.token).returncode, DONE)
        for words in (["skill", "learn", "press"], ["skill", "delete", "press"], ["trial", "delete", "trial-0"]):
            done = self.exemplar(*words, token=self.token)
            self.assertEqual((done.returncode, done.stdout), (REFUSED, ""))
            self.assertRegex(done.stderr, r"ben may not call \S+: that takes the role \w+, and ben has observe")
            self.assertIn("exemplar security token FOLDER NAME --role ROLE", done.stderr)

    def test_plain_text_gets_no_answer_and_a_hint(self):
        done = run("skill", "list", server=self.learning.address)
        self.assertEqual(done.returncode, UNAVAILABLE)
        self.assertIn("--tls-ca", done.stderr)

    def test_members_are_listed_for_people_and_for_scripts(self):
        self.assertEqual([one["name"] for one in self.security("list", "--format", "json")], ["learning"])
        self.assertRegex(self.security("list"), r"(?m)^learning +learning +20")
        self.security("token", "carl", "--role", "observe")
        self.assertEqual(self.security("revoke", "carl", "--format", "json"), {"revoked": "carl"})


if __name__ == "__main__":
    unittest.main()
