"""The reference driver in a robot's place: a skill is executed, and the joints hold when the executor is killed.

Runs in a network namespace of its own (made by run_isolated).
"""

import pathlib
import shutil
import subprocess
import tempfile
import threading
import unittest

import trials
from processes import BINARIES, Programs, exemplar, wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = "obstacles: []\nbuttons:\n  - {name: target, position: [0.55, -0.15, 0.05], height: 0.02, radius: 0.02}\n"
OBJECT = "target=0.55,-0.15,0.05,0,0,0,1"
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06)]


class DriverTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-driver-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.programs = Programs(self.folder, "95")
        self.addCleanup(self.programs.end)
        self.programs.start("exemplar-reference-driver", "--robot", ROBOT)
        _, self.learning = self.server("exemplar-learning", "--data-dir", self.folder / "skills", "--robot", ROBOT, bus=False)
        files = trials.write_set(self.folder / "trials", BUTTONS)
        exemplar("--server", self.learning, "trial", "submit", "--skill", "press", *files)
        exemplar("--server", self.learning, "skill", "learn", "press")
        self.scene = self.folder / "scene.yaml"
        self.scene.write_text(SCENE, encoding="utf-8")
        self.executor, self.address = self.start_executor()

    def server(self, program, *words, bus=True):
        port_file = self.folder / f"port-{len(self.programs.running)}"
        process = self.programs.start(program, "--listen", "127.0.0.1:0", "--port-file", port_file, *words, bus=bus)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), f"the port of {program}")
        return process, "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]

    def start_executor(self):
        process, address = self.server(
            "exemplar-executor", "--robot", ROBOT, "--scene", self.scene, "--learning", self.learning, "--guard-touch-n", "0"
        )
        wait_for(lambda: exemplar("--server", address, "robot", "status").get("joint_names"), "the driver's joint state")
        return process, address

    def joints(self):
        return exemplar("--server", self.address, "robot", "status")["joints"]

    def test_a_skill_is_executed_exactly(self):
        done = exemplar("--server", self.address, "skill", "execute", "press", "--object", OBJECT, "--wait")
        self.assertEqual(done["state"], "done", self.programs.logs())
        self.assertLess(done["tracking_error_rad"], 0.05)
        self.assertLess(done["contact_error_m"], 0.003)

    def test_the_joints_hold_when_the_executor_is_killed_in_motion(self):
        home = self.joints()
        words = ["--server", self.address, "skill", "execute", "press", "--object", OBJECT, "--wait"]
        client = threading.Thread(target=subprocess.run, args=([BINARIES / "exemplar", *words],), kwargs={"capture_output": True})
        client.start()
        moved = lambda: max(abs(a - b) for a, b in zip(self.joints(), home)) > 0.05
        wait_for(moved, "the robot to move")
        self.executor.kill()
        self.executor.wait()
        client.join()
        log = self.folder / "exemplar-reference-driver-0.log"
        wait_for(lambda: "commands stopped coming" in log.read_text(), "the driver to notice")
        self.executor, self.address = self.start_executor()
        held = self.joints()
        self.assertGreater(max(abs(a - b) for a, b in zip(held, home)), 0.05)
        self.assertEqual(self.joints(), held)
        done = exemplar("--server", self.address, "skill", "execute", "press", "--object", OBJECT, "--wait")
        self.assertEqual(done["state"], "done", self.programs.logs())


if __name__ == "__main__":
    unittest.main()
