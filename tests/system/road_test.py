"""The whole road, from capture to an executed skill, by real processes on generated trials.

Runs in a network namespace of its own (made by run_isolated). Checks the demo's last line, and that the recordings
open in an independent MCAP reader with the very values that were captured.
"""

import csv
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import trials

ROOT = pathlib.Path(__file__).resolve().parents[2]
BINARIES = pathlib.Path(os.environ.get("EXEMPLAR_BIN", ROOT / "build" / "release" / "bin"))
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06), (0.66, -0.22, 0.06), (0.52, -0.02, 0.06), (0.58, -0.14, 0.06)]
NODE = ROOT / "tests" / "conformance" / "node"


class RoadTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-road-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.files = trials.write_set(cls.folder / "trials", BUTTONS)
        command = [sys.executable, ROOT / "deploy" / "lib" / "demo.py", "--headless", "--bin", BINARIES]
        command += ["--rate", "3", "--keep", cls.folder / "demo", "--domain", "91", "--trials", *cls.files]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=500)
        cls.stderr = done.stderr
        assert done.stdout, done.stderr
        cls.figures = json.loads(done.stdout.splitlines()[-1])

    def test_the_demo_passes_with_all_figures(self):
        self.assertTrue(self.figures["passed"], self.stderr)
        for name in ("trials", "frechet_cm", "end_error_cm", "contact_error_mm", "clearance_mm", "tracking_error_rad", "topics"):
            self.assertIn(name, self.figures)
        self.assertEqual(self.figures["trials"], len(BUTTONS) - 1)

    def test_the_answer_is_near_what_was_left_out(self):
        self.assertLess(self.figures["frechet_cm"], 8)
        self.assertLess(self.figures["end_error_cm"], 4)
        self.assertLess(self.figures["contact_error_mm"], 12.7)

    def test_nothing_was_lost_and_everything_counted(self):
        topics = self.figures["topics"]
        samples = 0
        for file in self.files[:-1]:
            with open(file, encoding="utf-8") as stream:
                samples += sum(1 for _ in stream) - 1
        self.assertEqual(topics["ircp/end_effector"], {"sent": samples, "received": samples, "lost": 0}, self.stderr)
        for name in ("ircp/objects", "ircp/joint_command", "ircp/joint_state"):
            self.assertGreater(topics[name]["received"], 0, name)
            self.assertEqual(topics[name]["lost"], 0, name)

    def test_recordings_open_in_an_independent_reader(self):
        if not (NODE / "node_modules").exists():
            self.skipTest("tests/conformance/node has no node_modules: run npm ci there")
        for number, file in enumerate(self.files[:-1], start=1):
            recording = self.folder / "demo" / "recordings" / f"trial-{number:03}.mcap"
            done = subprocess.run(["node", NODE / "read_recording.mjs", recording], capture_output=True, text=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            topic = json.loads(done.stdout)["topics"]["ircp/end_effector"]
            with open(file, newline="", encoding="utf-8") as stream:
                rows = list(csv.DictReader(stream))
            self.assertEqual(topic["count"], len(rows))
            for message, row in ((topic["first"], rows[0]), (topic["last"], rows[-1])):
                position = flatten(message)
                for column in ("ee_x_m", "ee_y_m", "ee_z_m"):
                    self.assertTrue(any(math.isclose(value, float(row[column]), rel_tol=1e-12) for value in position), (column, message))


def flatten(value):
    """All numbers in a decoded message."""
    if isinstance(value, dict):
        return [number for part in value.values() for number in flatten(part)]
    if isinstance(value, list):
        return [number for part in value for number in flatten(part)]
    return [value] if isinstance(value, (int, float)) and not isinstance(value, bool) else []


if __name__ == "__main__":
    unittest.main()
