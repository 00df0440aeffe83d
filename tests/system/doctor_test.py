"""`exemplar doctor` and `exemplar watch` on real programs: each kind of mismatch is made for real, and the verdict read.

Each test runs in a network namespace of its own, several at once.
"""

import json
import os
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import tempfile
import unittest

import side_by_side
from processes import BINARIES, ROOT, Programs, exemplar, wait_for

ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = "obstacles: []\nbuttons: []\n"
FAKETIME = pathlib.Path("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1")
DRIVER, EXECUTOR = "exemplar-reference-driver", "exemplar-executor"
HERE = ["--domain", 61, "--station", "test"]


def run(*words, env=None):
    command = [str(word) for word in (BINARIES / "exemplar", *words)]
    environment = {k: v for k, v in os.environ.items() if not k.startswith("EXEMPLAR_SERVER")} | (env or {})
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment, check=False)


def doctor(*words):
    """Exit code and report. It looks around for a while, in which a busy machine may keep it from running."""
    seconds = () if "--seconds" in words else ("--seconds", 4)
    done = run("doctor", *words, *seconds, "--format", "json")
    assert done.returncode in (0, 1) and done.stdout, f"exit {done.returncode}: {done.stdout}{done.stderr}"
    return done.returncode, json.loads(done.stdout)


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-doctor-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.programs = Programs(self.folder, "61")
        self.addCleanup(self.programs.end)
        self.scene = self.folder / "scene.yaml"
        self.scene.write_text(SCENE, encoding="utf-8")

    def driver(self, *words, domain="61", station="test"):
        log = self.folder / f"{DRIVER}-{len(self.programs.running)}.log"
        self.programs.start(DRIVER, "--robot", ROBOT, "--domain", domain, "--station", station, *words, bus=False)
        wait_for(lambda: " driver: running" in log.read_text(), "the driver")

    def executor(self, *words):
        """Its address."""
        port = self.folder / "executor.port"
        # Nobody is asked for skills here.
        self.programs.start(EXECUTOR, "--robot", ROBOT, "--scene", self.scene, "--learning", "127.0.0.1:1", "--listen", "127.0.0.1:0", "--port-file", port, *words)
        wait_for(lambda: port.exists() and port.read_text().strip(), "the executor's port")
        return "127.0.0.1:" + port.read_text().strip()

    def assert_problem(self, report, cause, *said):
        code, found = report
        problems = [finding for finding in found["findings"] if finding["severity"] == "problem"]
        self.assertTrue(problems, f"{found}\n{self.programs.logs()}")
        match = [finding for finding in problems if finding["cause"] == cause]
        self.assertTrue(match, problems)
        for word in said:
            self.assertIn(word, match[0]["what"])
        self.assertTrue(match[0]["remedy"])
        self.assertEqual(code, 1)
        return match[0]


class HealthyTest(Case):
    """One station whose programs hear each other."""

    def setUp(self):
        super().setUp()
        self.driver()
        self.address = self.executor()
        wait_for(lambda: exemplar("--server", self.address, "robot", "status").get("joint_names"), "the executor to hear the driver")

    def test_a_station_that_is_well_gets_no_problem(self):
        code, found = doctor(*HERE, "--service", self.address)
        problems = [finding for finding in found["findings"] if finding["severity"] == "problem"]
        self.assertEqual((code, problems), (0, []))
        self.assertEqual({one["name"] for one in found["participants"]}, {DRIVER, EXECUTOR})
        self.assertTrue(all(one["vendor"] == "Fast DDS" and one["properties"]["exemplar.version"] for one in found["participants"]))
        flows = {flow["topic"]: flow for flow in found["flows"]}
        self.assertEqual((flows["ircp/joint_state"]["from"], flows["ircp/joint_state"]["to"]), ([DRIVER], [EXECUTOR]))
        self.assertEqual(found["services"], [{"address": self.address, "reachable": True, "serving": True}])

    def test_names_limit_it_and_are_suggested(self):
        code, found = doctor("reference-driver", "executor", *HERE)
        self.assertEqual(code, 0, found)
        problem = self.assert_problem(doctor("exemplar-reference-drive", EXECUTOR, *HERE), "participant", "exemplar-reference-drive")
        self.assertIn(f'"{DRIVER}"', problem["remedy"])
        self.assert_problem(doctor(*HERE, "--service", "127.0.0.1:1"), "service", "127.0.0.1:1")

    def test_asked_in_a_place_where_nobody_is_it_says_where_they_are(self):
        self.assert_problem(doctor("--domain", 62, "--station", "test"), "domain", "domain 61, not in 62", EXECUTOR)
        self.assert_problem(doctor("--domain", 61, "--station", "tset"), "station", '"tset"', '"test"')

    def test_people_get_text_without_colours_in_a_pipe(self):
        text = run("doctor", *HERE, "--seconds", 4, "--all")
        self.assertEqual(text.returncode, 0)
        self.assertIn("no problem found", text.stdout)
        self.assertRegex(text.stdout, rf"(?m)^ircp/joint_state +{DRIVER} +{EXECUTOR}$")
        self.assertNotIn("\033", text.stdout + text.stderr)

    def test_topics_are_watched(self):
        table = run("watch", *HERE, "--count", 4, "--format", "json")
        self.assertEqual(table.returncode, 0, table.stderr)
        lines = [json.loads(line) for line in table.stdout.splitlines()]
        states = [line for line in lines if line["topic"] == "ircp/joint_state"]
        state = states[-1]
        self.assertEqual((state["writers"], state["lost"], state["has_schema"]), (1, 0, True))
        self.assertGreater(max(line["rate_hz"] for line in states), 20)
        self.assertIn("JointState", state["type"])
        plain = run("watch", *HERE, "--count", 4)  # not every writer need be known in the first second
        self.assertRegex(plain.stdout, r"(?m)^\S+Z ircp/joint_state [\d.]+ Hz, \d+ received, 0 lost, 1 writer, ")

    def test_samples_are_watched(self):
        samples = run("watch", "ircp/joint_state", *HERE, "--count", 3, "--format", "json")
        self.assertEqual(samples.returncode, 0, samples.stderr)
        shown = [json.loads(line) for line in samples.stdout.splitlines()]
        self.assertEqual(len(shown), 3)
        self.assertTrue(all(sample["topic"] == "ircp/joint_state" and "error" not in sample for sample in shown), shown)
        self.assertEqual(len(shown[0]["sample"]["positions"]), 7)
        self.assertGreater(shown[1]["sequence"], shown[0]["sequence"])

        wrong = run("watch", "ircp/joint_stat", *HERE)
        self.assertEqual(wrong.returncode, 3)
        self.assertIn('did you mean "ircp/joint_state"?', wrong.stderr)
        elsewhere = ["--domain", 61, "--station", "tset", "--wait", 0.5]
        nobody = run("watch", "ircp/joint_state", *elsewhere)
        self.assertEqual(nobody.returncode, 3)
        self.assertIn('nobody writes "ircp/joint_state" in station "tset" of domain 61', nobody.stderr)
        self.assertIn("exemplar doctor", nobody.stderr)
        empty = run("watch", *elsewhere, "--count", 1)
        self.assertEqual((empty.returncode, empty.stdout), (0, ""))
        self.assertIn('nobody writes any topic in station "tset" of domain 61', empty.stderr)

        # Without an end it goes on until it is interrupted, which is no failure.
        endless = subprocess.Popen([str(word) for word in (BINARIES / "exemplar", "watch", "ircp/joint_state", *HERE)], stdout=subprocess.PIPE, text=True)
        self.assertIn("ircp/joint_state", endless.stdout.readline())
        endless.send_signal(signal.SIGINT)
        endless.communicate(timeout=60)
        self.assertEqual(endless.returncode, 0)


class MismatchTest(Case):
    def test_stations_that_differ_are_named(self):
        self.driver(station="hall")
        self.executor()
        self.assert_problem(doctor(*HERE), "station", 'station "hall"', 'station "test"', EXECUTOR, DRIVER)
        self.assert_problem(doctor(DRIVER, EXECUTOR, *HERE), "station", "stations do not mix")

    def test_domains_that_differ_are_named(self):
        self.driver(domain="63")
        self.executor()
        self.assert_problem(doctor(*HERE), "domain", "in domain 63", "in domain 61", DRIVER, EXECUTOR)

    def test_a_policy_that_does_not_match_is_named(self):
        self.driver("--best-effort", "ircp/joint_state")
        self.executor()
        problem = self.assert_problem(doctor(*HERE), "qos", DRIVER, EXECUTOR, "best effort", "ircp/joint_state")
        self.assertEqual((problem["policy"], problem["topic"]), ("reliability", "ircp/joint_state"))
        self.assertIn("--best-effort", problem["remedy"])

    def replay(self, type_name, schema, topic="ircp/joint_state"):
        """Writes a type on a topic: a recording that somebody made elsewhere, played for a minute."""
        text = lambda word: struct.pack("<I", len(word)) + word.encode()
        record = lambda opcode, data: struct.pack("<BQ", opcode, len(data)) + data
        out = b"\x89MCAP0\r\n" + record(1, text("") + text("a test"))
        out += record(3, struct.pack("<H", 1) + text(type_name) + text("omgidl") + text(schema))
        out += record(4, struct.pack("<HH", 1, 1) + text(topic) + text("cdr") + struct.pack("<I", 0))
        for i in range(7):
            now = 1_700_000_000_000_000_000 + i * 10_000_000_000
            out += record(5, struct.pack("<HIQQ", 1, i, now, now) + struct.pack("<II", 0x100, i))
        file = self.folder / "other.mcap"
        # Cut within its last record: `record recover` makes it whole.
        file.write_bytes(out[:-5])
        self.assertEqual(run("record", "recover", file).returncode, 0)
        self.programs.start("exemplar", "record", "replay", file.with_suffix(".recovered.mcap"), "--topic", topic, "--wait", "0.1")
        there = lambda: "exemplar-replay" in {one["name"] for one in doctor(*HERE, "--seconds", 1)[1]["participants"]}
        wait_for(there, f"the replay: {self.programs.logs()}")

    def test_types_that_differ_are_named(self):
        self.executor()
        self.replay("Other", "struct Other { long n; };")
        self.assert_problem(doctor(*HERE), "type", "writes the type Other", EXECUTOR, "JointState")

    def test_members_that_differ_are_named(self):
        self.executor()
        self.replay("exemplar::ircp::v1::JointState", "module exemplar { module ircp { module v1 { struct JointState { @key long n; }; }; }; };")
        self.assert_problem(doctor(*HERE), "type", EXECUTOR)

    def test_a_topic_that_is_nearly_the_one_is_named(self):
        self.executor()
        self.replay("exemplar::ircp::v1::JointState", "struct Other { long n; };", topic="ircp/joint_stat")
        problem = self.assert_problem(doctor(*HERE), "topic", "ircp/joint_state", '"ircp/joint_stat"')
        self.assertIn(EXECUTOR, problem["participants"])

    def members(self, station, **roles):
        """Their folders, for --security."""
        folder = self.folder / station
        self.assertEqual(run("security", "init", folder, "--station", "test").returncode, 0)
        for name, role in roles.items():
            self.assertEqual(run("security", "issue", folder, name, "--role", role).returncode, 0)
        return [folder / "members" / name for name in roles]

    def test_one_with_an_identity_beside_one_without_is_named(self):
        (robot,) = self.members("lab", robot="robot")
        self.driver("--security", robot)
        self.executor()
        self.assert_problem(doctor(*HERE, "--seconds", 6), "security", DRIVER, EXECUTOR, "identity")

    def test_identities_of_two_authorities_are_named(self):
        (robot,) = self.members("lab", robot="robot")
        executor, observer = self.members("hall", executor="executor", doctor="observer")
        self.driver("--security", robot)
        self.executor("--security", executor)
        _, found = doctor(*HERE, "--seconds", 8, "--security", observer)
        trust = {one["name"]: one["trust"] for one in found["participants"]}
        self.assertEqual(trust[EXECUTOR], "trusted", found)
        self.assertNotEqual(trust[DRIVER], "trusted", found)
        told = [finding for finding in found["findings"] if finding["cause"] == "security"]
        self.assertEqual([finding["participants"] for finding in told], [[DRIVER]], found)
        self.assertIn("authority", told[0]["what"])

    @unittest.skipUnless(FAKETIME.exists(), "faketime is not installed")
    def test_a_clock_that_is_wrong_is_named(self):
        prefix = ("env", f"LD_PRELOAD={FAKETIME}", "FAKETIME=+90", "FAKETIME_DONT_FAKE_MONOTONIC=1", "DONT_FAKE_MONOTONIC=1", "FAKETIME_NO_CACHE=1")
        self.programs.recorder(prefix=prefix)
        problem = self.assert_problem(doctor(*HERE, "--seconds", 6), "clock", "recorder", "ahead")
        offset = float(re.search(r"is ([\d.]+) s", problem["what"])[1])
        self.assertAlmostEqual(offset, 90, delta=1)

    def test_a_network_without_multicast_is_named(self):
        self.driver()
        self.executor()
        subprocess.run(["ip", "route", "del", "224.0.0.0/4", "dev", "lo"], check=True)
        subprocess.run(["ip", "link", "set", "lo", "multicast", "off"], check=True)
        try:
            _, found = doctor(*HERE)
        finally:
            subprocess.run(["ip", "link", "set", "lo", "multicast", "on"], check=True)
            subprocess.run(["ip", "route", "add", "224.0.0.0/4", "dev", "lo"], check=True)
        warnings = [finding for finding in found["findings"] if finding["cause"] == "transport"]
        self.assertTrue(warnings, found)
        self.assertIn("multicast", warnings[0]["what"])
        self.assertIn("--peer", warnings[0]["remedy"])

    @unittest.skipUnless(shutil.which("iptables"), "iptables is not installed")
    def test_a_firewall_in_the_way_is_named(self):
        self.driver()
        wait_for(lambda: doctor(*HERE)[1]["participants"], "the driver")
        rule = ["-p", "udp", "-d", "127.0.0.1", "--dport", "22650:22899", "-j", "REJECT"]
        if subprocess.run(["iptables", "-A", "OUTPUT", *rule], capture_output=True, check=False).returncode != 0:
            self.skipTest("no right to set up a firewall")
        try:
            report = doctor(*HERE)
        finally:
            subprocess.run(["iptables", "-D", "OUTPUT", *rule], check=True)
        self.assert_problem(report, "transport", DRIVER, "cannot be reached")


class AloneTest(Case):
    def test_a_network_with_nobody_is_said(self):
        self.assert_problem(doctor(*HERE), "domain", "nobody is in domain 61")

    def test_bad_words_are_refused(self):
        for words, said in [
            (["doctor", "--domain", "300"], "--domain is 300"),
            (["doctor", "--seconds", "0"], "--seconds is 0"),
            (["doctor", "--station", "a*"], 'station "a*"'),
            (["watch", "--domain", "1.5"], "--domain is 1.5"),
            (["watch", "--count", "0"], "--count is 0"),
            (["watch", "--interface", "none7"], '"none7"'),
        ]:
            with self.subTest(words=words):
                done = run(*words)
                self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
                self.assertIn(said, done.stderr)

    def test_nobody_at_the_gateways_address_is_code_5(self):
        done = run("--server", "127.0.0.1:1", "watch")
        self.assertEqual((done.returncode, done.stdout), (5, ""))


if __name__ == "__main__":
    side_by_side.main(__file__)
