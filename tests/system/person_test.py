"""The demo with its simulated person: suit, touch and stereo vision in, a clicked button out."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BINARIES = pathlib.Path(os.environ.get("EXEMPLAR_BIN", ROOT / "build" / "release" / "bin"))


class PersonTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-person-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        command = [sys.executable, ROOT / "deploy" / "lib" / "demo.py", "--headless", "--bin", BINARIES, "--keep", cls.folder / "demo", "--domain", "92"]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=500)
        cls.stderr = done.stderr
        assert done.stdout, done.stderr
        cls.figures = json.loads(done.stdout.splitlines()[-1])

    def test_the_button_clicks_where_no_trial_was(self):
        self.assertTrue(self.figures["passed"], self.stderr)
        self.assertEqual(self.figures["trials"], 7)
        self.assertEqual(self.figures["clicks"], 1)
        self.assertLess(self.figures["contact_error_mm"], 12.7)

    def test_every_device_was_recorded(self):
        for topic in ("ircp/suit", "ircp/tactile", "ircp/objects", "ircp/camera", "ircp/joint_state", "ircp/joint_command"):
            self.assertGreater(self.figures["topics"][topic]["received"], 0, topic)
        for topic in ("ircp/suit", "ircp/tactile", "ircp/objects", "ircp/joint_command"):
            self.assertEqual(self.figures["topics"][topic]["lost"], 0, topic)

    def test_every_program_ended_cleanly(self):
        self.assertNotIn("did not end cleanly", self.stderr)

    def test_the_result_is_drawn(self):
        self.assertIn("<svg", (self.folder / "demo" / "result.svg").read_text()[:200])


if __name__ == "__main__":
    unittest.main()
