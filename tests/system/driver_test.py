"""The reference driver in a robot's place: a skill is executed, and the joints hold when the executor is killed.

Runs in a network namespace of its own (made by run_isolated).
"""

import json
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
            "exemplar-executor", "--robot", ROBOT, "--scene", self.scene, "--learning", self.learning, "--guard-touch-n", "0",
            # A driver that a busy machine keeps from running for long is not what is tested here.
            "--state-patience-s", "5", "--command-patience-s", "5", "--path-tolerance", "3",
        )  # fmt: skip
        wait_for(lambda: exemplar("--server", address, "robot", "status").get("joint_names"), "the driver's joint state")
        return process, address

    def joints(self):
        return exemplar("--server", self.address, "robot", "status")["joints"]

    def stops(self):
        """How often commands stopped coming to the driver: once after each motion, and whenever the machine kept one of the two from running."""
        return (self.folder / "exemplar-reference-driver-0.log").read_text().count("commands stopped coming")

    def undisturbed(self, off_rad=3):
        """What a motion came to that the machine did not interrupt. One that it did may be stopped, and rightly; one whose programs
        were only slow to run was more than `off_rad` off the path by what was heard of it."""
        off = []
        words = ["--server", self.address, "skill", "execute", "press", "--object", OBJECT, "--speed", "0.5", "--wait", "--format", "json"]
        for _ in range(15):
            before = self.stops()
            done = subprocess.run([BINARIES / "exemplar", *words], capture_output=True, text=True, timeout=120)
            wait_for(lambda: self.stops() > before, "the end of the commands")
            if self.stops() == before + 1:
                self.assertEqual(done.returncode, 0, f"{done.stderr}{self.programs.logs()}")
                result = json.loads(done.stdout)
                off.append(result["tracking_error_rad"])
                if off[-1] < off_rad:
                    return result
            elif done.returncode != 0:
                exemplar("--server", self.address, "robot", "reset")
        self.fail(f"each of fifteen motions was interrupted by the machine, or as far off the path as this: {off} {self.programs.logs()}")

    def test_a_skill_is_executed_exactly(self):
        done = self.undisturbed(off_rad=0.05)
        self.assertEqual(done["state"], "done", self.programs.logs())
        self.assertLess(done["contact_error_m"], 0.003)

    def test_the_joints_hold_when_the_executor_is_killed_in_motion(self):
        home = self.joints()
        words = ["--server", self.address, "skill", "execute", "press", "--object", OBJECT, "--speed", "0.2", "--wait"]
        client = threading.Thread(target=subprocess.run, args=([BINARIES / "exemplar", *words],), kwargs={"capture_output": True})
        client.start()
        moved = lambda: max(abs(a - b) for a, b in zip(self.joints(), home)) > 0.05
        wait_for(moved, "the robot to move")
        self.executor.kill()
        self.executor.wait()
        client.join()
        wait_for(lambda: self.stops() > 0, "the driver to notice")
        self.executor, self.address = self.start_executor()
        # It brakes first, and a state that is told may be a little old.
        wait_for(lambda: self.joints() == self.joints(), "the driver to stand still")
        held = self.joints()
        self.assertGreater(max(abs(a - b) for a, b in zip(held, home)), 0.05)
        self.assertEqual(self.joints(), held)
        self.assertEqual(self.undisturbed()["state"], "done", self.programs.logs())


if __name__ == "__main__":
    unittest.main()
