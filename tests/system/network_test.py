"""Capture and recorder on two machines: network namespaces joined by a bridge that loses packets and is cut.

Needs the right to make namespaces and bridges, and iptables with its statistic match; skips where it has not.
"""

import os
import pathlib
import shutil
import subprocess
import tempfile
import time
import unittest

import processes
import trials
from processes import exemplar, wait_for

TOPIC = "ircp/end_effector"


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
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=30)
    if done.returncode != 0:
        raise OSError(f"{' '.join(str(word) for word in words)}: {done.stderr.strip()}")
    return done.stdout


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
        self.programs = processes.Programs(self.folder, 94)
        self.addCleanup(self.programs.end)
        self.trial = trials.write_set(self.folder / "trials", [(0.55, -0.20, 0.06)])[0]
        with open(self.trial, encoding="utf-8") as stream:
            self.samples = sum(1 for _ in stream) - 1

    def start_recorder(self):
        return self.programs.recorder("--expect", TOPIC, prefix=self.recorder_machine.prefix)

    def at_recorder(self, *words):
        return exemplar(*words, prefix=self.recorder_machine.prefix)

    def record(self, during, rate="1"):
        """Records one replay while `during` is done to the network; the file's end-effector messages."""
        _, server = self.start_recorder()
        capture = self.programs.start("exemplar-capture-suit", "--replay", self.trial, "--rate", rate, prefix=self.capture_machine.prefix)
        self.at_recorder("record", "start", "--name", "t", "--topic", TOPIC, "--wait", "30", "--server", server)
        during(server)
        self.assertEqual(capture.wait(60), 0, self.programs.logs())
        wait_for(lambda: self.topic(server)["received"] + self.topic(server)["lost"] >= self.samples, "the last sample", 30)
        figures = self.topic(server)
        self.at_recorder("record", "stop", "--server", server)
        info = exemplar("record", "info", self.folder / "data" / "t.mcap")
        return figures, {topic["topic"]: topic["messages"] for topic in info["topics"]}[TOPIC]

    def topic(self, server):
        status = self.at_recorder("record", "status", "--server", server)
        return next(topic for topic in status["topics"] if topic["topic"] == TOPIC)

    def check_whole(self, figures, recorded):
        self.assertEqual(figures["received"], self.samples, self.programs.logs())
        self.assertEqual(figures["lost"], 0)
        self.assertGreater(recorded, 0)
        self.assertLessEqual(recorded, self.samples)


class NetworkTest(NetworkCase):
    def test_nothing_is_lost_at_20_percent_packet_loss(self):
        for machine in self.machines:
            machine.lose(0.2)
        figures, recorded = self.record(lambda server: None)
        self.check_whole(figures, recorded)
        self.assertGreater(self.recorder_machine.dropped(), 20)


class SlowNetworkTest(NetworkCase):
    def test_nothing_is_lost_at_5_percent_packet_loss(self):
        for machine in self.machines:
            machine.lose(0.05)
        figures, recorded = self.record(lambda server: None)
        self.check_whole(figures, recorded)

    def test_nothing_is_lost_when_the_link_is_cut_for_10_s(self):
        def cut(server):
            run("ip", "link", "set", self.capture_machine.name, "down")
            time.sleep(1)
            before = self.topic(server)["received"]
            time.sleep(9)
            self.assertEqual(self.topic(server)["received"], before)
            run("ip", "link", "set", self.capture_machine.name, "up")

        figures, recorded = self.record(cut, rate="0.3")  # so that the link is back before the trial ends
        self.check_whole(figures, recorded)

    def test_a_publisher_killed_and_started_again_is_counted_as_two(self):
        _, server = self.start_recorder()
        words = ("exemplar-capture-suit", "--replay", self.trial, "--rate", "1")
        first = self.programs.start(*words, prefix=self.capture_machine.prefix)
        self.at_recorder("record", "start", "--name", "t", "--topic", TOPIC, "--wait", "30", "--server", server)
        wait_for(lambda: self.topic(server)["received"] > 100, "samples")
        first.kill()
        first.wait()
        before = self.topic(server)["received"]
        self.assertLess(before, self.samples)
        self.assertEqual(self.programs.start(*words, prefix=self.capture_machine.prefix).wait(60), 0)
        figures = self.topic(server)
        self.at_recorder("record", "stop", "--server", server)
        self.assertEqual(figures["lost"], 0, self.programs.logs())
        self.assertEqual(figures["received"], before + self.samples)
        info = exemplar("record", "info", self.folder / "data" / "t.mcap")
        of_writers = [topic["messages"] for topic in info["topics"] if topic["topic"] == TOPIC]
        self.assertEqual(len(of_writers), 2)
        self.assertEqual(of_writers[1], self.samples)


if __name__ == "__main__":
    unittest.main()
