"""A skill of several episodes with a hand: a block is taken here and laid down there, at places no trial had.

A simulated person with a hand shows it by suit and glove, the recorder keeps it, the learner makes one skill of it, and
the executor carries it out on the simulated arm. Runs in a network namespace of its own (made by run_isolated).
"""

import math
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "lib"))
from processes import System, wait_until  # noqa: E402

BINARIES = pathlib.Path(os.environ.get("EXEMPLAR_BIN", ROOT / "build" / "release" / "bin"))
MODEL = ROOT / "deploy" / "models" / "arm7_hand"
SCENE = ROOT / "deploy" / "config" / "carry_table.yaml"
# Block and tray of each trial: x, y in m.
TRIALS = [
    ((0.44, -0.22), (0.44, 0.14)),
    ((0.54, -0.12), (0.48, 0.26)),
    ((0.48, -0.28), (0.54, 0.18)),
    ((0.42, -0.10), (0.42, 0.24)),
    ((0.52, -0.22), (0.46, 0.12)),
    ((0.46, -0.16), (0.52, 0.24)),
]
NEW_BLOCK, NEW_TRAY = (0.49, -0.19), (0.47, 0.19)
BLOCK_HALF_M, TRAY_TOP_M = 0.025, 0.001
TRACKING = ("--cameras", "off", "--track-hz", 20, "--noise-object", 0.0005, "--pace", 0)


def words(places):
    return ";".join(",".join(f"{number:g}" for number in place) for place in places)


class CarryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-carry-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        system = System(BINARIES, cls.folder, 95, "carry")
        try:
            cls.run_through(system)
        finally:
            cls.unclean = system.stop()

    @classmethod
    def run_through(cls, system):
        learning = system.start("learning", "--data-dir", cls.folder / "learning", "--robot", MODEL, server=True, bus=False).address()
        # The simulated time waits for whoever acts in it: how busy the machine is does not matter.
        simulator = system.start("simulator", "--robot", MODEL, "--scene", SCENE, "--follow", "suit", *TRACKING, "--in-step-with", "capture_suit", "recorder")
        system.start("recorder", "--data-dir", cls.folder / "recordings", "--clock", "network", server=True).address()
        person = system.start(
            "capture-suit", "--person", "--robot", MODEL, "--scene", SCENE, "--object", "block", "--carry-to", "tray", "--tempo", 1.4,
            "--places", words(block for block, _ in TRIALS), "--to-places", words(tray for _, tray in TRIALS), "--record", "--name", "carry",
            "--clock", "network",
        )
        person.wait(150)
        simulator.stop()
        files = sorted((cls.folder / "recordings").glob("carry-*.mcap"))
        cls.recorded = len(files)
        system.cli(learning, "trial", "submit", "--skill", "carry", *files)
        cls.report = system.cli(learning, "skill", "learn", "carry")

        scene = cls.folder / "scene.yaml"
        text = SCENE.read_text().replace("[0.48, -0.16, 0.02]", f"[{NEW_BLOCK[0]}, {NEW_BLOCK[1]}, 0.02]")
        scene.write_text(text.replace("[0.48, 0.2, -0.002]", f"[{NEW_TRAY[0]}, {NEW_TRAY[1]}, -0.002]"))
        system.start("simulator", "--robot", MODEL, "--scene", scene, *TRACKING, "--in-step-with", "executor")
        executor = system.start("executor", "--robot", MODEL, "--scene", scene, "--learning", learning, "--clock", "network", server=True).address()
        wait_until("both objects to be seen", lambda: len(system.cli(executor, "robot", "status").get("objects", [])) == 2, 60)
        cls.result = system.cli(executor, "skill", "execute", "carry", "--wait")
        cls.status = system.cli(executor, "robot", "status")

    def position_of(self, name):
        return next(thing for thing in self.status["objects"] if thing["name"] == name)["position"]

    def test_every_trial_was_recorded_and_has_several_episodes(self):
        self.assertEqual(self.recorded, len(TRIALS))
        self.assertEqual([contact["object"] for contact in self.report["contacts"]], ["block", "tray"])
        self.assertGreaterEqual(len(self.report["markers_s"]), 4)

    def test_the_block_stands_on_the_tray(self):
        self.assertEqual(self.result["state"], "done", self.result)
        block = self.position_of("block")
        self.assertLess(math.dist(block[:2], NEW_TRAY), 0.03, block)
        self.assertAlmostEqual(block[2], TRAY_TOP_M + BLOCK_HALF_M, delta=0.004)

    def test_every_program_ended_cleanly(self):
        self.assertEqual(self.unclean, [])


if __name__ == "__main__":
    unittest.main()
