"""The same run gives the same result: simulator, executor and learning service in step over DDS, twice.

What is commanded and what is measured is recorded in both runs and compared bit by bit, stamps and sensor noise
included. Prints how much faster than real time the whole system ran. Runs in a network namespace of its own (made by
run_isolated).
"""

import pathlib
import shutil
import tempfile
import time
import unittest

import recorded
import trials
from processes import Programs, exemplar, wait_for
from station import metric

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = ROOT / "deploy" / "config" / "rail_press.yaml"
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06)]
PLACE = "target=0.55,-0.15,0.05,0,0,0,1"
STANDS_AFTER_S = 0.6
METRICS = "127.0.0.1:19771"
COMPARED = ["ircp/joint_command", "ircp/joint_state", "ircp/objects"]


class Run:
    """A station of its own, in simulated time."""

    def __init__(self, folder, domain, *words):
        folder.mkdir()
        self.programs = Programs(folder, domain)
        learning = self.server("exemplar-learning", "--data-dir", folder / "skills", "--robot", ROBOT, bus=False)
        files = trials.write_set(folder / "trials", BUTTONS)
        exemplar("--server", learning, "trial", "submit", "--skill", "press", *files)
        exemplar("--server", learning, "skill", "learn", "press")
        self.programs.start(
            "exemplar-simulator", "--robot", ROBOT, "--scene", SCENE, "--cameras", "off", "--pace", "0", "--in-step-with",
            "executor", "--stand-after-s", STANDS_AFTER_S, "--epoch-s", "1700000000", "--track-hz", "25",
            "--noise-position", "1e-4", "--noise-touch", "0.02", "--noise-object", "1e-4", "--metrics", METRICS, *words,
        )  # fmt: skip
        _, self.recorder = self.programs.recorder()
        self.executor = self.server(
            "exemplar-executor", "--robot", ROBOT, "--scene", SCENE, "--learning", learning, "--clock", "network"
        )
        self.wait_until_time_stands()

    def server(self, program, *words, bus=True):
        port_file = self.programs.folder / f"port-{len(self.programs.running)}"
        self.programs.start(program, "--listen", "127.0.0.1:0", "--port-file", port_file, *words, bus=bus)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), f"the port of {program}")
        return "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]

    def time_s(self):
        return metric(METRICS, "exemplar_simulator_time_seconds")

    def wait_until_time_stands(self):
        """Nobody commands the robot, so time comes to a stand."""
        wait_for(lambda: metric(METRICS, "exemplar_simulator_time_stands") == 1, "the simulated time to stand still", 60)

    def press(self, place):
        """Presses once; simulated and real seconds that it took."""
        before, begin = self.time_s(), time.monotonic()
        done = exemplar("--server", self.executor, "skill", "execute", "press", "--object", place, "--wait")
        seconds = time.monotonic() - begin
        assert done["state"] == "done", (done, self.programs.logs())
        simulated = self.time_s() - before
        self.wait_until_time_stands()
        return simulated, seconds


class SameRunTest(unittest.TestCase):
    def run_once(self, name, *words):
        """Messages by topic, without the middleware's own times."""
        run = Run(self.folder / name, "94", *words)
        try:
            topics = [word for topic in COMPARED for word in ("--topic", topic)]
            exemplar("record", "start", "--name", "run", *topics, "--wait", "60", "--server", run.recorder)
            took = [run.press(PLACE), run.press(PLACE)]  # the second one from where the first ended
            exemplar("record", "stop", "--server", run.recorder)
        finally:
            run.programs.end()
        simulated, seconds = (sum(values) for values in zip(*took))
        print(f"{name}: {simulated:.2f} simulated seconds in {seconds:.2f} s, {simulated / seconds:.1f} times real time, planning and all")
        file = next(run.programs.folder.rglob("run.mcap"))
        return {topic: [(sequence, data) for sequence, _, data in rows] for topic, rows in recorded.messages(file).items()}

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-same-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def test_the_same_seed_gives_the_same_bits_and_another_one_does_not(self):
        first, second, other = self.run_once("first"), self.run_once("second"), self.run_once("other", "--seed", 2)
        # The recorder may have found the topics only after the first samples: the second half is compared, by number.
        for topic in COMPARED:
            with self.subTest(topic):
                count = min(len(first[topic]), len(second[topic])) // 2
                self.assertGreater(count, 100)
                ours, theirs = first[topic][-count:], second[topic][-count:]
                self.assertEqual([sequence for sequence, _ in ours], [sequence for sequence, _ in theirs])
                differing = [a[0] for a, b in zip(ours, theirs) if a != b]
                self.assertEqual(differing, [], f"of {count} messages")
                print(f"{topic}: {count} messages, equal to the last bit")
        self.assertNotEqual(first["ircp/joint_state"][-100:], other["ircp/joint_state"][-100:])


if __name__ == "__main__":
    unittest.main()
