"""Capture and recorders on two machines: network namespaces joined by a bridge that loses packets and is cut.

Needs the right to make namespaces and bridges, and iptables with its statistic match; skips where it has not.
"""

import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import processes
import side_by_side
import trials
from processes import exemplar, wait_for

TOPIC = "ircp/end_effector"
DOMAIN = 94
STRANGERS = pathlib.Path(__file__).resolve().parent / "strangers"
IDL = processes.ROOT / "idl"
FAKETIME = pathlib.Path("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1")
DISCOVERY_SERVER = "/usr/bin/fast-discovery-server"
METRICS = "127.0.0.1:9464"
# A participant of Cyclone DDS is forgotten after 10 s without a sign of life by default; a cut on a busy machine may take longer.
PATIENT = "<CycloneDDS><Domain><Discovery><LeaseDuration>60s</LeaseDuration></Discovery></Domain></CycloneDDS>"
KEPT = 3000  # samples of the topic that a writer keeps (docs/topics.md)


class Machine:
    """A network namespace with one interface on the bridge."""

    def __init__(self, name, address):
        self.name = name
        self.holder = subprocess.Popen(["unshare", "--net", "sleep", "600"])
        own = os.readlink("/proc/self/ns/net")
        wait_for(lambda: os.readlink(f"/proc/{self.holder.pid}/ns/net") != own, "the namespace")
        run("ip", "link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", self.holder.pid)
        run("ip", "link", "set", name, "master", "bridge0", "up")
        self.run("ip", "link", "set", "lo", "up")
        self.run("ip", "address", "add", f"{address}/24", "dev", "eth0")
        self.run("ip", "link", "set", "eth0", "up")
        self.run("ip", "route", "add", "224.0.0.0/4", "dev", "eth0")

    @property
    def prefix(self):
        return ("nsenter", "-t", str(self.holder.pid), "-n")

    def run(self, *words):
        return run(*self.prefix, *words)

    def lose(self, share):
        """Drops this share of what comes in from the bridge."""
        self.run("iptables", "-A", "INPUT", "-i", "eth0", "-m", "statistic", "--mode", "random", "--probability", share, "-j", "DROP")

    def dropped(self):
        for line in self.run("iptables", "-L", "INPUT", "-v", "-x").splitlines():
            if "DROP" in line and "statistic" in line:
                return int(line.split()[0])
        return 0

    def end(self):
        self.holder.kill()
        self.holder.wait()
        subprocess.run(["ip", "link", "delete", self.name], check=False, capture_output=True)


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=60)
    if done.returncode != 0:
        raise OSError(f"{' '.join(str(word) for word in words)}: {done.stderr.strip()}")
    return done.stdout


def missing_after(number, counts):
    """Of what a reader of another middleware counted."""
    return sum(max(0, last - max(first, number + 1) + 1) for first, last in counts["gaps"])


class NetworkCase(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-network-"))
        self.addCleanup(shutil.rmtree, self.folder)
        try:
            run("ip", "link", "add", "bridge0", "type", "bridge", "mcast_snooping", "0")
            self.addCleanup(run, "ip", "link", "delete", "bridge0")
            run("ip", "link", "set", "bridge0", "up")
            self.machines = []
            for number in (1, 2):
                machine = Machine(f"machine{number}", f"10.93.0.{number}")
                self.machines.append(machine)
                self.addCleanup(machine.end)
            self.machines[0].run("iptables", "-L", "-n")
        except (OSError, FileNotFoundError) as error:
            self.skipTest(f"no bridged namespaces here: {error}")
        self.capture_machine, self.recorder_machine = self.machines
        self.programs = processes.Programs(self.folder, DOMAIN)
        self.addCleanup(self.programs.end)
        self.trial = trials.write_set(self.folder / "trials", [(0.55, -0.20, 0.06)])[0]
        with open(self.trial, encoding="utf-8") as stream:
            self.samples = sum(1 for _ in stream) - 1

    def start_recorder(self, *words):
        """It is ready once the topic is written."""
        return self.programs.recorder("--expect", TOPIC, *words, prefix=self.recorder_machine.prefix)

    def recording(self, name):
        """A recorder that records, whatever comes, and from its first sample on."""
        recorder, server = self.programs.recorder(prefix=self.recorder_machine.prefix)
        self.at_recorder("record", "start", "--name", name, "--server", server)
        return recorder, server

    def start_capture(self, trial, rate, *words):
        return self.programs.start("exemplar-capture-suit", "--replay", trial, "--rate", rate, "--metrics", METRICS, *words, prefix=self.capture_machine.prefix)

    def captured(self, figure):
        """A figure of the topic as the capture program itself tells it, also while its network is cut."""
        page = run(*self.capture_machine.prefix, sys.executable, "-c", f"import urllib.request as u; print(u.urlopen('http://{METRICS}/metrics').read().decode())")
        lines = [line for line in page.splitlines() if line.startswith(figure + "{") and f'topic="{TOPIC}"' in line]
        return float(lines[0].rsplit(" ", 1)[1]) if lines else None

    def at_recorder(self, *words):
        return exemplar(*words, prefix=self.recorder_machine.prefix)

    def cut(self):
        run("ip", "link", "set", self.capture_machine.name, "down")

    def restore(self):
        run("ip", "link", "set", self.capture_machine.name, "up")

    def long_trial(self, rows, slow=0, slower=1):
        """A trial file of so many rows: the first one's, over and over; the first `slow` of them take `slower` times their time."""
        with open(self.trial, encoding="utf-8", newline="") as stream:
            header, *first = list(csv.reader(stream))
        path = self.folder / "long.csv"
        with open(path, "w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(header)
            for number in range(rows):
                time_s = (number + (slower - 1) * min(number, slow)) / trials.RATE_HZ
                writer.writerow([f"{time_s:.9g}", *first[number % len(first)][1:]])
        return path

    def build_cyclone_reader(self):
        """The program of a reader of another middleware."""
        if not shutil.which("idlc") or not pathlib.Path("/usr/include/dds/dds.h").exists():
            self.skipTest("cyclonedds-dev and cyclonedds-tools are not installed")
        for name in ("common", "end_effector"):
            subprocess.run(["idlc", "-l", "c", "-I", IDL, IDL / f"{name}.idl"], cwd=self.folder, check=True)
        program = self.folder / "reader"
        sources = [STRANGERS / "reader.c", self.folder / "end_effector.c", self.folder / "common.c"]
        subprocess.run(["gcc", "-I", self.folder, *sources, "-lddsc", "-o", program], check=True)
        return program

    def cyclone_reader(self, program, last, quiet_s=10, settings=""):
        """It runs on the recorder's machine, counts for itself, and has begun to read what is being sent."""
        command = [*self.recorder_machine.prefix, program, DOMAIN, "test", last, quiet_s]
        reader = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True, env=os.environ | {"CYCLONEDDS_URI": settings})
        self.programs.running.append(reader)
        self.assertEqual(reader.stdout.readline(), "first\n", self.programs.logs())
        return reader

    def known_to_the_writer(self):
        """The last number of the topic that went without a wait for the second reader: it joins in mid-stream and hears what is sent to
        many at once, and the writer repeats for it only what came after it, too, had heard of the reader."""
        wait_for(lambda: self.captured("exemplar_capture_suit_readers") == 2, "both readers")
        return self.captured("exemplar_capture_suit_sent_total")

    def counts_of(self, reader):
        self.assertEqual(reader.wait(60), 0)
        with reader.stdout as stream:
            return json.load(stream)

    def record(self, during, rate="1", words=()):
        """Records one replay while `during` is done to the network; the file's end-effector messages."""
        _, server = self.start_recorder(*words)
        # The capture starts and stops the recorder itself, so that the first sample is in the file.
        capture = self.start_capture(self.trial, rate, "--record", "--name", "t", *words)
        during(server)
        self.assertEqual(capture.wait(60), 0, self.programs.logs())
        figures = self.topic(server)
        info = exemplar("record", "info", self.folder / "data" / "t.mcap")
        return figures, {topic["topic"]: topic["messages"] for topic in info["topics"]}[TOPIC]

    def topic(self, server):
        status = self.at_recorder("record", "status", "--server", server)
        unheard_of = {"topic": TOPIC, "received": 0, "lost": 0, "sent": 0}
        return next((topic for topic in status["topics"] if topic["topic"] == TOPIC), unheard_of)

    def check_whole(self, figures, recorded):
        self.assertEqual(figures["received"], self.samples, self.programs.logs())
        self.assertEqual(figures["lost"], 0)
        self.assertEqual(recorded, self.samples)


class NetworkTest(NetworkCase):
    def test_nothing_is_lost_at_20_percent_packet_loss_as_another_middleware_finds_too(self):
        for machine in self.machines:
            machine.lose(0.2)
        program = self.build_cyclone_reader()
        joined = {}

        def another_reads(_server):
            joined["reader"] = self.cyclone_reader(program, self.samples)
            joined["known"] = self.known_to_the_writer()

        # Slow enough that the other middleware finds the writer too: the announcements are lost as well.
        figures, recorded = self.record(another_reads, rate="0.3")
        self.check_whole(figures, recorded)
        self.assertGreater(self.recorder_machine.dropped(), 20)
        counts = self.counts_of(joined["reader"])
        self.assertEqual(counts["last"], self.samples)
        self.assertEqual(missing_after(joined["known"], counts), 0, f"{counts} {joined} {self.programs.logs()}")

    def test_a_cut_across_the_trials_end_loses_only_what_the_history_does_not_keep(self):
        program = self.build_cyclone_reader()
        # 6 s in which the other reader joins and the cut begins, with few packets on their way, and 1.7 s in which more is sent
        # than is kept.
        slow, rows, rate = 500, 500 + 4000, 24
        _, server = self.recording("t")
        capture = self.start_capture(self.long_trial(rows, slow, slower=30), rate)
        reader = self.cyclone_reader(program, rows, quiet_s=15, settings=PATIENT)
        known = self.known_to_the_writer()
        self.cut()
        wait_for(lambda: self.captured("exemplar_capture_suit_sent_total") == rows, "the end of the trial")
        self.assertIsNone(capture.poll())  # waits for those who have not all of it
        self.restore()
        self.assertEqual(capture.wait(60), 0, self.programs.logs())
        wait_for(lambda: self.topic(server)["sent"] >= rows, "the last number")
        figures = self.topic(server)
        self.at_recorder("record", "stop", "--server", server)
        before = figures["received"] - KEPT
        self.assertGreater(before, 0, self.programs.logs())
        self.assertEqual(figures["lost"], rows - KEPT - before)
        self.assertGreater(figures["lost"], 0)
        counts = self.counts_of(reader)
        self.assertEqual(counts["last"], rows)
        missing = missing_after(known, counts)
        self.assertLess(abs(missing - figures["lost"]), 2, f"{counts} {figures} {self.programs.logs()}")  # the cut may fall between the two's packets

    def test_two_recorders_with_wrong_clocks_make_one_trial_on_one_time_base(self):
        if not FAKETIME.exists():
            self.skipTest("faketime is not installed")
        wrong = ("env", f"LD_PRELOAD={FAKETIME}", "DONT_FAKE_MONOTONIC=1", "FAKETIME=+7.5s x1.0002")
        recorders = [
            self.programs.recorder("--expect", TOPIC, prefix=self.capture_machine.prefix),
            self.programs.recorder("--expect", TOPIC, prefix=(*self.recorder_machine.prefix, *wrong)),
        ]
        capture = self.start_capture(self.trial, "0.5")
        for number, (machine, (_, server)) in enumerate(zip(self.machines, recorders)):
            exemplar("record", "start", "--name", f"t{number}", "--topic", TOPIC, "--wait", "30", "--server", server, prefix=machine.prefix)
        self.assertEqual(capture.wait(60), 0, self.programs.logs())
        for machine, (_, server) in zip(self.machines, recorders):
            exemplar("record", "stop", "--server", server, prefix=machine.prefix)
        files = [self.folder / "data" / f"t{number}.mcap" for number in (0, 1)]
        clocks = {clock["program"]: clock for clock in exemplar("record", "info", files[1])["clocks"]}
        suit = clocks["capture_suit"]
        self.assertLess(abs(suit["offset_s"] + 7.5), suit["uncertainty_s"] + 0.01)  # and what the wrong clock has gained
        self.assertEqual(suit["jumps"], 0)
        joined = exemplar("record", "join", *files, "-o", self.folder / "joined.mcap")
        first, second = joined["files"]
        self.assertEqual(first["offset_s"], 0)
        self.assertLess(abs(second["offset_s"] - 7.5), second["uncertainty_s"] + 0.01)
        self.assertGreater(second["repeated"], 0)
        infos = [exemplar("record", "info", file) for file in (*files, self.folder / "joined.mcap")]
        of_topic = [sum(topic["messages"] for topic in info["topics"] if topic["topic"] == TOPIC) for info in infos]
        self.assertGreaterEqual(of_topic[2], max(of_topic[:2]))
        self.assertLessEqual(of_topic[2], self.samples)
        self.assertEqual([loss["lost_in_gaps"] + loss["lost_at_end"] for loss in infos[2]["losses"] if loss["topic"] == TOPIC], [0])
        # On one base the two recorders' files take not 7.5 s longer than each alone, but as much as one began and ended before the other.
        self.assertLess(infos[2]["duration_s"], max(info["duration_s"] for info in infos[:2]) + 5)

    def test_programs_find_each_other_by_a_discovery_server_without_multicast(self):
        if not os.path.exists(DISCOVERY_SERVER):
            self.skipTest("fastdds-tools is not installed")
        for machine in self.machines:
            machine.run("iptables", "-A", "OUTPUT", "-d", "224.0.0.0/4", "-j", "DROP")
        command = [*self.recorder_machine.prefix, DISCOVERY_SERVER, "-i", "0", "-l", "10.93.0.2", "-p", "11811"]
        server = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL)
        self.programs.running.append(server)
        figures, recorded = self.record(lambda server: None, rate="4", words=("--discovery-server", "10.93.0.2:11811"))
        self.check_whole(figures, recorded)


class SlowNetworkTest(NetworkCase):
    def test_nothing_is_lost_at_5_percent_packet_loss(self):
        for machine in self.machines:
            machine.lose(0.05)
        figures, recorded = self.record(lambda server: None)
        self.check_whole(figures, recorded)

    def test_nothing_is_lost_when_the_link_is_cut_for_10_s(self):
        def cut(server):
            wait_for(lambda: self.topic(server)["received"] > 0, "the first sample")  # both sides know each other
            self.cut()
            time.sleep(1)
            before = self.topic(server)["received"]
            time.sleep(9)
            self.assertEqual(self.topic(server)["received"], before)
            self.restore()

        figures, recorded = self.record(cut, rate="0.3")
        self.check_whole(figures, recorded)

    def test_a_publisher_killed_and_started_again_is_counted_as_two(self):
        _, server = self.recording("t")
        first = self.start_capture(self.trial, "0.3")
        wait_for(lambda: self.topic(server)["received"] > 100, "samples")
        first.kill()
        first.wait()
        self.assertEqual(self.start_capture(self.trial, "1").wait(60), 0)
        figures = self.topic(server)
        self.at_recorder("record", "stop", "--server", server)
        self.assertEqual(figures["lost"], 0, self.programs.logs())
        info = exemplar("record", "info", self.folder / "data" / "t.mcap")
        of_writers = [topic["messages"] for topic in info["topics"] if topic["topic"] == TOPIC]
        self.assertEqual(len(of_writers), 2)
        self.assertLess(of_writers[0], self.samples)
        self.assertEqual(of_writers[1], self.samples)
        self.assertEqual(figures["received"], sum(of_writers))

    def test_what_a_killed_publisher_had_announced_is_counted(self):
        program = self.build_cyclone_reader()
        _, server = self.start_recorder()
        capture = self.start_capture(self.long_trial(3000), "1", "--record", "--name", "t")
        reader = self.cyclone_reader(program, 3000, quiet_s=6)
        # Samples hold the number 1.0, which heartbeats and announcements do not: only these pass.
        one = "|000000000000f03f|"
        self.recorder_machine.run("iptables", "-A", "INPUT", "-i", "eth0", "-p", "udp", "-m", "string", "--algo", "bm", "--hex-string", one, "-j", "DROP")
        time.sleep(2.5)
        capture.kill()
        capture.wait()
        time.sleep(1)
        figures = self.topic(server)
        stopped = self.at_recorder("record", "stop", "--server", server)
        counts = self.counts_of(reader)
        info = exemplar("record", "info", self.folder / "data" / "t.mcap")
        losses = [loss for loss in info["losses"] if loss["topic"] == TOPIC]
        self.assertEqual([loss["received"] for loss in losses], [figures["received"]])
        self.assertLess(abs(counts["last"] - figures["received"]), 2, self.programs.logs())
        self.assertEqual(counts["gaps"], [])
        self.assertEqual(sum(loss["lost_in_gaps"] + loss["lost_at_end"] for loss in losses), figures["lost"])
        self.assertGreater(figures["lost"], 50, stopped)

    def test_a_recorder_killed_and_started_again_goes_on_where_it_finds_the_writer(self):
        recorder, server = self.start_recorder()
        capture = self.start_capture(self.trial, "0.3")
        self.at_recorder("record", "start", "--name", "first", "--topic", TOPIC, "--wait", "30", "--server", server)
        wait_for(lambda: self.topic(server)["received"] > 100, "samples")
        recorder.kill()
        recorder.wait()
        _, server = self.start_recorder()
        self.at_recorder("record", "start", "--name", "second", "--topic", TOPIC, "--wait", "30", "--server", server)
        # The dead one's reader counts as there until its lease ends: the capture waits for it.
        self.assertEqual(capture.wait(60), 0, self.programs.logs())
        figures = self.topic(server)
        self.at_recorder("record", "stop", "--server", server)
        self.assertEqual(figures["lost"], 0, self.programs.logs())
        whole = self.folder / "first.whole.mcap"
        exemplar("record", "recover", self.folder / "data" / "first.mcap", "--output", whole)
        infos = [exemplar("record", "info", file) for file in (whole, self.folder / "data" / "second.mcap")]
        parts = [sum(topic["messages"] for topic in info["topics"] if topic["topic"] == TOPIC) for info in infos]
        self.assertGreater(parts[0], 50)
        self.assertEqual([loss["received"] for loss in infos[1]["losses"] if loss["topic"] == TOPIC], [parts[1]])
        self.assertLessEqual(parts[1], figures["received"])
        self.assertLessEqual(sum(parts), self.samples)


if __name__ == "__main__":
    side_by_side.main(__file__)
