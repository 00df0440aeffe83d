"""A real recorder: killed at random moments, told of events, split, its files labelled."""

import fcntl
import os
import pathlib
import pty
import random
import select
import shutil
import subprocess
import tempfile
import termios
import time
import unittest

import processes
import recorded
import trials
from processes import exemplar, wait_for

TOPIC = "ircp/end_effector"
# Much more than the flush interval.
FLUSHED_AFTER_S = 0.5


class RecorderTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-recorder-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.programs = processes.Programs(self.folder, 93)
        self.addCleanup(self.programs.end)
        self.trial = trials.write_set(self.folder / "trials", [(0.55, -0.20, 0.06)])[0]
        with open(self.trial, encoding="utf-8") as stream:
            self.samples = sum(1 for _ in stream) - 1

    def replay(self, *words):
        return self.programs.start("exemplar-capture-suit", "--replay", self.trial, *words)

    def status(self, server):
        return exemplar("record", "status", "--server", server)

    def received(self, server):
        """Of the topic, as soon as they came."""
        return next((topic["received"] for topic in self.status(server)["topics"] if topic["topic"] == TOPIC), 0)

    def test_a_container_that_shares_no_memory_is_heard_where_its_own_is_tiny(self):
        # On the host's network it looks like any other program of the machine, but /dev/shm is its own.
        own = ("unshare", "--mount", "sh", "-c", 'mount -t tmpfs -o size=8m none /dev/shm && exec "$@"', "sh")
        _, server = self.programs.recorder("--expect", TOPIC, prefix=own)
        self.assertEqual(self.replay("--record", "--name", "t", "--rate", "2").wait(60), 0, self.programs.logs())
        topics = {topic["topic"]: topic for topic in exemplar("record", "status", "--server", server)["topics"]}
        self.assertEqual((topics[TOPIC]["received"], topics[TOPIC]["lost"]), (self.samples, 0))

    def test_a_killed_recorder_loses_no_more_than_the_flush_interval(self):
        rng = random.Random(4)
        for number in range(3):
            recorder, server = self.programs.recorder()
            name = f"killed-{number}"
            exemplar("record", "start", "--name", name, "--server", server)
            capture = self.replay("--rate", "0.5")
            wait_for(lambda: self.received(server) > 20, "samples")
            received = self.received(server)
            time.sleep(FLUSHED_AFTER_S + rng.uniform(0, 0.7))
            # Where the machine kept the writing thread from running, that it ran.
            wait_for(lambda: self.status(server)["messages"] >= received, "the samples to be written")
            recorder.kill()
            recorder.wait()
            capture.kill()
            capture.wait()
            file = self.folder / "data" / f"{name}.mcap"
            report = exemplar("record", "recover", file, "--output", self.folder / f"{name}.whole.mcap")
            self.assertFalse(report["was_whole"])
            self.assertEqual(report["damaged_chunks"], 0)
            numbers = [number for number, *_ in recorded.messages(self.folder / f"{name}.whole.mcap")[TOPIC]]
            self.assertGreaterEqual(len(numbers), received, self.programs.logs())
            self.assertEqual(numbers, list(range(1, 1 + len(numbers))), "none is missing before the end")

    def test_a_full_disk_stops_the_recording_with_what_is_written_intact(self):
        data = self.folder / "data"
        data.mkdir()
        small_disk = ("unshare", "--mount", "sh", "-c", 'mount -t tmpfs -o size=48k tmpfs "$0" && exec "$@"', data)
        recorder, server = self.programs.recorder(prefix=small_disk)
        exemplar("record", "start", "--name", "full", "--server", server)
        capture = self.replay("--rate", "4")
        wait_for(lambda: self.status(server)["state"] == "stopped", "the disk to be full")
        capture.wait(60)
        self.assertIn("stopped by a failure", self.status(server)["detail"])
        self.assertIn("No space left on device", self.status(server)["detail"])
        file = pathlib.Path(f"/proc/{recorder.pid}/root{data}/full.mcap")
        report = exemplar("record", "recover", file, "--output", self.folder / "whole.mcap")
        self.assertGreater(report["messages"], 0)
        self.assertEqual(report["damaged_chunks"], 0)
        self.assertEqual(report["bytes_left_out"], 0)
        self.assertIsNone(recorder.poll())

    def test_an_event_keeps_what_came_before_it_and_labels_come_later(self):
        _, server = self.programs.recorder("--pre-buffer-s", "60")
        self.assertEqual(self.replay("--rate", "4").wait(60), 0, self.programs.logs())
        wait_for(lambda: self.received(server) == self.samples, f"all samples: {self.programs.logs()}")
        marked = exemplar("record", "event", "--note", "stuck", "--name", "event", "--server", server)
        self.assertEqual(marked["state"], "recording")
        stopped = exemplar("record", "stop", "--server", server)
        self.assertGreater(stopped["disk_free_bytes"], 0)
        file = self.folder / "data" / "event.mcap"
        before = file.read_bytes()
        exemplar("record", "label", file, "success=no", "phase=press")
        labels = exemplar("record", "label", file, "success=yes", "phase=")["labels"]
        self.assertEqual(labels, {"success": "yes"})
        info = exemplar("record", "info", file)
        self.assertEqual({topic["topic"]: topic["messages"] for topic in info["topics"]}[TOPIC], self.samples)
        self.assertEqual(info["metadata"]["exemplar.labels"], {"success": "yes"})
        self.assertEqual(info["metadata"]["exemplar.event"]["note"], "stuck")
        self.assertEqual(file.read_bytes()[: len(before) // 2], before[: len(before) // 2])
        submitted = self.submit(file)
        self.assertIn("label success: yes", submitted["notices"])
        self.assertNotIn("label phase: press", submitted["notices"])

    def submit(self, file):
        """The trial that the learning service makes of a recording, as it shows it."""
        port_file = self.folder / "learning-port"
        words = ("--listen", "127.0.0.1:0", "--port-file", port_file, "--data-dir", self.folder / "learned")
        self.programs.start("exemplar-learning", *words, bus=False)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), "the learning service's port")
        server = ("--server", "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1])
        exemplar("trial", "submit", "--skill", "press", file, *server)
        (trial,) = exemplar("trial", "list", *server)
        return trial

    def test_a_replay_is_recorded_as_the_original_was(self):
        _, server = self.programs.recorder()
        exemplar("record", "start", "--name", "original", "--server", server)
        self.replay("--rate", "2").wait(30)
        exemplar("record", "stop", "--server", server)
        original = self.folder / "data" / "original.mcap"
        exemplar("record", "start", "--name", "again", "--server", server)
        played = exemplar("record", "replay", original, "--rate", "4", "--wait", "60", "--domain", "93", "--station", "test")
        exemplar("record", "stop", "--server", server)
        self.assertEqual(played["refused"], 0)
        left_out = {topic["topic"] for topic in played["topics"] if topic["left_out"]}
        self.assertEqual(left_out, {name for name in left_out if name.endswith(("/status", "/command", "/clock"))})
        before, after = recorded.messages(original), recorded.messages(self.folder / "data" / "again.mcap")
        self.assertEqual(len(before[TOPIC]), self.samples)
        for topic, sent in before.items():
            if topic not in left_out:
                self.assertEqual([said[1:] for said in after[topic]], [said[1:] for said in sent], topic)
        losses = exemplar("record", "info", self.folder / "data" / "again.mcap")["losses"]
        self.assertEqual(sum(loss["lost_in_gaps"] + loss["lost_at_end"] for loss in losses), 0)

    def test_keys_step_through_a_replay_on_a_terminal(self):
        _, server = self.programs.recorder()
        exemplar("record", "start", "--name", "steps", "--server", server)
        self.assertEqual(self.replay("--rate", "4").wait(60), 0, self.programs.logs())
        exemplar("record", "stop", "--server", server)
        for end, code in ((b"q", 0), (b"\x03", 130)):  # Ctrl-C
            with self.subTest(end=end):
                self.assert_steps_on_a_terminal(end, code)

    def assert_steps_on_a_terminal(self, end, code):
        ours, theirs = pty.openpty()
        self.addCleanup(os.close, ours)
        before = termios.tcgetattr(ours)
        command = [processes.BINARIES / "exemplar", "record", "replay", self.folder / "data" / "steps.mcap", "--paused",
                   "--wait", "0", "--topic", TOPIC, "--domain", "93", "--station", "test"]
        player = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
                                  preexec_fn=lambda: fcntl.ioctl(theirs, termios.TIOCSCTTY, 0))
        os.close(theirs)
        self.addCleanup(player.kill)
        shown = ""

        def shows(text):
            nonlocal shown
            while text not in shown:
                self.assertTrue(select.select([ours], [], [], 60)[0], f"{text!r} is not in {shown!r}")
                shown += os.read(ours, 4096).decode()
            shown = shown[shown.index(text) + len(text):]

        shows("space: pause")
        shows("paused")
        for number in range(1, 4):
            os.write(ours, b"s")
            shows(f" {number} sent")
        os.write(ours, end)
        shows("3 messages sent")
        self.assertEqual(player.wait(60), code)
        self.assertEqual(termios.tcgetattr(ours), before)

    def test_a_split_recording_has_every_sample_once(self):
        _, server = self.programs.recorder()
        exemplar("record", "start", "--name", "split", "--split-s", "0.5", "--server", server)
        self.assertEqual(self.replay("--rate", "2").wait(60), 0, self.programs.logs())
        stopped = exemplar("record", "stop", "--server", server)
        files = sorted((self.folder / "data").glob("split_*.mcap"))
        self.assertEqual(len(files), stopped["part"])
        self.assertGreater(len(files), 2)
        infos = [exemplar("record", "info", file) for file in files]
        self.assertEqual(sum(info["messages"] for info in infos), stopped["messages"])
        numbers = [number for file in files for number, *_ in recorded.messages(file).get(TOPIC, [])]
        self.assertEqual(numbers, list(range(1, self.samples + 1)))
        for before, info in zip(files, infos[1:]):
            self.assertEqual(info["metadata"]["exemplar.recording"]["previous_file"], before.name)


if __name__ == "__main__":
    unittest.main()
