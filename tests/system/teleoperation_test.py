"""Teleoperation by real processes: a person's suit and dead-man, the executor, the simulated robot, the recorder.

Runs in a network namespace of its own (made by run_isolated).
"""

import csv
import math
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import tempfile
import time
import unittest

import processes
import recorded
from processes import BINARIES, ROOT, exemplar, wait_for

DOMAIN = 97
LEONARDO = ROOT / "deploy" / "models" / "leonardo"
TABLE = ROOT / "deploy" / "config" / "press_table.yaml"
HOME = {
    "torso_rotation": 0, "hip_front_back": 0.02, "hip_side_side": -0.03, "right_shoulder_in_out": 0.2,
    "right_shoulder_forward_backward": 0.13, "right_upper_arm_rotation": 0.12, "right_elbow_in_out": 1.63,
    "right_forearm_rotation": 1.25, "right_wrist_in_out": 1.12,
}  # fmt: skip
SUIT_SCHEMA = """module exemplar { module ircp { module v1 {
@final struct Suit { @key string source; unsigned long long seq; long long stamp_ns; sequence<string> names; sequence<double> positions; };
}; }; };"""


class TeleoperationTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-teleop-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.programs = processes.Programs(self.folder, DOMAIN)
        self.addCleanup(self.programs.end)

    # ---- the station ----

    def start_robot(self, scene=TABLE, *executor_words):
        """Simulator and executor; the executor once it hears the robot. Patient ones: what a busy machine keeps from running for a while is
        not tested here, and who holds for that is right, but does not follow any more."""
        self.simulator = self.programs.start("exemplar-simulator", "--robot", LEONARDO, "--scene", TABLE, "--cameras", "off")
        port = self.folder / f"executor-{len(self.programs.running)}"
        self.executor = self.programs.start(
            "exemplar-executor", "--robot", LEONARDO, "--scene", scene, "--learning", "127.0.0.1:9", "--listen", "127.0.0.1:0",
            "--port-file", port, "--state-patience-s", "5", "--command-patience-s", "5", "--suit-patience-s", "2", "--dead-man-patience-s", "2",
            *executor_words)  # fmt: skip
        wait_for(lambda: port.exists() and port.read_text().strip(), "the executor's port")
        self.server = "127.0.0.1:" + port.read_text().strip()
        wait_for(lambda: exemplar("robot", "status", "--server", self.server)["joints"], "the robot's joints")

    def teleop_on(self, *words):
        """`teleop on` in the foreground; what it says goes to a file."""
        self.said = self.folder / f"teleop-{len(self.programs.running)}.log"
        command = [BINARIES / "exemplar", "robot", "teleop", "on", "--server", self.server, "--format", "json", *words]
        with open(self.said, "w", encoding="utf-8") as log:
            process = subprocess.Popen([str(word) for word in command], stdout=log, stderr=log)
        self.programs.running.append(process)
        self.wait_said("holding")
        return process

    def wait_said(self, words, times=1, limit_s=60):
        try:
            wait_for(lambda: self.said.read_text().count(words) >= times, f'"{words}"', limit_s)
        except AssertionError as missing:
            raise AssertionError(f"{missing}: {self.said.read_text()}\n{self.programs.logs()}") from None

    def status(self):
        return exemplar("robot", "status", "--server", self.server)

    def joints(self):
        status = self.status()
        return dict(zip(status["joint_names"], status["joints"])) if "joint_names" in status else status["joints"]

    def capture(self, file, *words):
        return self.programs.start("exemplar-capture-suit", "--replay", file, "--dead-man", *words)

    def trial(self, name, motion, seconds, rate_hz=60, joints=HOME):
        """A file of a suit's joints: `motion(t)` gives what differs from the robot's home."""
        path = self.folder / f"{name}.csv"
        with open(path, "w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream)
            writer.writerow(["time_s", *(f"{joint}_rad" for joint in joints)])
            for k in range(int(seconds * rate_hz)):
                here = {**joints, **motion(k / rate_hz)}
                writer.writerow([f"{k / rate_hz:.6f}", *(f"{here[joint]:.6f}" for joint in joints)])
        return path

    def wave(self, name="wave", seconds=4, amplitude=0.25):
        ease = lambda t: 0.5 - 0.5 * math.cos(2 * math.pi * t / 2)
        return self.trial(name, lambda t: {"right_shoulder_in_out": HOME["right_shoulder_in_out"] + amplitude * ease(t)}, seconds)

    def change(self):
        """The largest change of a joint over a while in which a suit that moves goes far."""
        seen = []
        for _ in range(6):
            seen.append(self.joints())
            time.sleep(0.2)
        return max(max(joints[name] for joints in seen) - min(joints[name] for joints in seen) for name in seen[0])

    def comes_to_rest(self):
        """Whoever stops needs half a second for it, and as long as the machine is busy."""
        wait_for(lambda: self.change() < 0.01, f"the robot to stand still: {self.said.read_text()}")

    # ---- tests ----

    def test_a_person_drives_the_robot_and_both_are_recorded(self):
        self.start_robot()
        _, recorder = self.programs.recorder()
        on = self.teleop_on("--touch", "target")
        person = self.programs.start(
            "exemplar-capture-suit", "--person", "--robot", LEONARDO, "--scene", TABLE, "--places", "0.46,-0.12", "--dead-man", "--record",
            "--name", "driven")  # fmt: skip
        self.assertEqual(person.wait(90), 0, self.programs.logs())
        self.assertIn("following", self.said.read_text())
        exemplar("robot", "teleop", "off", "--server", self.server)
        self.assertEqual(on.wait(60), 0, self.said.read_text())
        file = self.folder / "data" / "driven.mcap"
        messages = recorded.messages(file)
        for topic, least in (("ircp/suit", 120), ("ircp/joint_command", 200), ("ircp/joint_state", 200), ("ircp/safety", 20)):
            self.assertGreater(len(messages.get(topic, [])), least, topic)
        topics = {entry["topic"]: entry for entry in exemplar("record", "status", "--server", recorder)["topics"]}
        self.assertEqual(topics["ircp/suit"]["lost"], 0)
        self.assertEqual(topics["ircp/joint_command"]["lost"], 0)
        # The simulated button was pressed by the robot, not by the suit.
        self.assertIn("button clicked", self.programs.logs())
        # And what was recorded is a trial: the learner takes it.
        port = self.folder / "learning"
        self.programs.start("exemplar-learning", "--data-dir", self.folder / "learn", "--port-file", port, bus=False)
        wait_for(lambda: port.exists() and port.read_text().strip(), "the learning service's port")
        learning = "127.0.0.1:" + port.read_text().strip()
        taken = exemplar("trial", "submit", "--skill", "press", file, "--server", learning)
        self.assertTrue(taken)
        listed = exemplar("trial", "list", "--server", learning)
        self.assertTrue(any("joints" in stream for trial in listed for stream in trial["streams"]), listed)

    def test_the_robot_holds_when_the_dead_man_is_released_or_the_suit_falls_silent(self):
        self.start_robot()
        self.teleop_on()
        file = self.wave(seconds=3)
        capture = self.capture(file)
        self.wait_said("following")
        self.assertEqual(capture.wait(60), 0, self.programs.logs())
        self.wait_said("holding: the dead-man was released")
        self.comes_to_rest()
        # The whole capture program stops: neither suit nor dead-man is heard any more.
        capture = self.capture(self.wave(name="long", seconds=30))
        self.wait_said("following: ", times=2)
        capture.send_signal(signal.SIGSTOP)
        self.wait_said("holding: nothing")
        self.comes_to_rest()
        # What comes now is old, or at least nobody pressed anew.
        capture.send_signal(signal.SIGCONT)
        time.sleep(0.5)
        self.assertIn("teleoperating", self.status()["state"])
        self.assertLess(self.change(), 0.01)

    def test_the_robot_holds_when_the_suit_says_what_cannot_be_meant(self):
        self.start_robot()
        on = self.teleop_on()
        jump = lambda t: {"right_elbow_in_out": HOME["right_elbow_in_out"] - (0.9 if t > 1 else 0)}
        self.capture(self.trial("jump", jump, 3))
        self.wait_said("holding: the suit jumps by 0.90 rad at joint \"right_elbow_in_out\"")
        self.comes_to_rest()
        self.assertLess(abs(self.joints()["right_elbow_in_out"] - HOME["right_elbow_in_out"]), 0.05)
        self.programs.running[-1].wait(90)

        strangers = {f"left_finger_{k}": 0.1 * k for k in range(5)}
        self.capture(self.trial("strangers", lambda t: {}, 1, joints=strangers))
        self.wait_said("holding: the suit has no joint that drives one of the robot's")
        self.programs.running[-1].terminate()
        self.programs.running[-1].wait(60)

        far = dict(HOME, right_elbow_in_out=HOME["right_elbow_in_out"] - 1.4)
        self.capture(self.trial("far", lambda t: {}, 1, joints=far))
        self.wait_said("holding: the operator's posture is 1.")
        self.programs.running[-1].terminate()
        self.programs.running[-1].wait(60)

        # Numbers that are none never come as far as the robot: they are refused where they arrive.
        suit = self.capture(self.wave(name="before_nan", seconds=30))
        self.wait_said("following: ", times=2)
        suit.send_signal(signal.SIGSTOP)
        self.wait_said("holding: nothing")
        suit.kill()
        nan = self.folder / "nan.mcap"
        nan.write_bytes(suit_recording(20))
        exemplar("record", "recover", nan)
        exemplar("record", "replay", self.folder / "nan.recovered.mcap", "--domain", DOMAIN, "--station", "test")
        self.assertIsNone(self.executor.poll(), self.programs.logs())
        wait_for(lambda: "not a finite number" in self.programs.logs(), f"the refusal: {self.programs.logs()}")
        self.comes_to_rest()
        exemplar("robot", "teleop", "off", "--server", self.server)
        self.assertEqual(on.wait(60), 0)

    def test_the_robot_stops_before_an_obstacle_and_comes_back(self):
        # Only the executor knows of the wall: if the robot came as far, nothing else would stop it.
        wall = self.folder / "wall.yaml"
        tool = self.tool_at_home()
        text = TABLE.read_text()
        entry = f"  - {{name: wall, shape: box, size: [0.4, 0.02, 0.4], position: [{tool[0]:.3f}, {tool[1] - 0.13:.3f}, {tool[2]:.3f}], quaternion: [0, 0, 0, 1]}}\n"
        wall.write_text(re.sub(r"^obstacles:\n", "obstacles:\n" + entry, text, count=1, flags=re.M))
        self.start_robot(wall)
        on = self.teleop_on()
        ease = lambda t: 0.5 - 0.5 * math.cos(2 * math.pi * min(t, 6) / 6)
        sway = lambda t: {"torso_rotation": -0.6 * ease(t)}
        capture = self.capture(self.trial("sway", sway, 10))
        self.wait_said("blocked: ")
        self.assertIn('"wall"', self.said.read_text())
        self.assertEqual(capture.wait(90), 0, self.programs.logs())
        exemplar("robot", "teleop", "off", "--server", self.server)
        self.assertEqual(on.wait(60), 0, self.said.read_text())
        self.comes_to_rest()
        self.assertLess(abs(self.joints()["torso_rotation"]), 0.1)
        result = self.result()
        self.assertGreaterEqual(result["blocks"], 1)
        self.assertGreater(result["clearance_m"], 0)

    def test_sigterm_holds_the_robot_and_ends_the_mode(self):
        self.start_robot()
        on = self.teleop_on()
        self.capture(self.wave(seconds=30))
        self.wait_said("following")
        self.executor.send_signal(signal.SIGTERM)
        self.assertEqual(self.executor.wait(10), 0, self.programs.logs())  # before it would be killed
        self.assertEqual(on.wait(60), 4, self.said.read_text())
        self.assertIn("shutting down", self.said.read_text())

    def test_the_end_of_the_command_line_ends_the_mode(self):
        self.start_robot()
        on = self.teleop_on()
        self.capture(self.wave(seconds=30))
        self.wait_said("following")
        on.kill()
        wait_for(lambda: self.status()["state"] == "aborted", "the end of the mode")
        self.comes_to_rest()

    def tool_at_home(self):
        self.start_robot()
        position = self.status()["tool"]["position"]
        for program in (self.executor, self.simulator):
            program.terminate()
            program.wait(60)
        return position

    def result(self):
        import json

        text = self.said.read_text()
        return json.loads(text[text.index("\n{") :])


def suit_recording(count):
    """An MCAP file with a suit whose first joint is not a number."""
    words = lambda text: struct.pack("<I", len(text.encode())) + text.encode()
    record = lambda op, body: bytes([op]) + struct.pack("<Q", len(body)) + body

    def cdr_string(text, at):
        data = text.encode() + b"\0"
        out = struct.pack("<I", len(data)) + data
        return out + b"\0" * (-(at + len(out)) % 4)

    magic = b"\x89MCAP0\r\n"
    out = magic + record(1, words("") + words("test"))
    out += record(3, struct.pack("<H", 1) + words("exemplar::ircp::v1::Suit") + words("omgidl") + words(SUIT_SCHEMA))
    out += record(4, struct.pack("<HH", 1, 1) + words("ircp/suit") + words("cdr") + struct.pack("<I", 0))
    names = list(HOME)
    for k in range(count):
        body = cdr_string("suit", 0)
        body += b"\0" * (-len(body) % 8) + struct.pack("<Qq", k + 1, 1_700_000_000_000_000_000 + k * 16_000_000)
        body += struct.pack("<I", len(names))
        for name in names:
            body += cdr_string(name, len(body))
        body += struct.pack("<I", len(names))
        body += b"\0" * (-len(body) % 8) + struct.pack(f"<{len(names)}d", math.nan, *list(HOME.values())[1:])
        time_ns = 1_700_000_000_000_000_000 + k * 16_000_000
        out += record(5, struct.pack("<HIQQ", 1, k + 1, time_ns, time_ns) + b"\0\1\0\0" + body)
    out += record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + magic
    return out


if __name__ == "__main__":
    unittest.main()
