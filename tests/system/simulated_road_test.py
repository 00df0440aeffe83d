"""The whole road in simulated time, twice: a person shows presses, the recorder records, the learner learns, the robot presses.

Person, touch, recorder, executor and simulator run in step, as fast as the machine can. Every sample of every trial and of
the execution is compared with the other run's: stamps, times of reception and sensor noise included. Prints how much
faster than real time it went. Runs in a network namespace of its own (made by run_isolated).
"""

import pathlib
import shutil
import tempfile
import unittest

import recorded
from processes import exemplar, wait_for
from station import ROOT, SimulatedStation

ROBOT = ROOT / "deploy" / "models" / "leonardo"
SCENE = ROOT / "deploy" / "config" / "press_table.yaml"
PLACES = [(0.46, -0.12), (0.40, -0.28), (0.52, -0.22), (0.42, -0.05)]
NEW_PLACE = (0.45, -0.20)
TARGET = "target=0.45,-0.20,0.04,0,0,0,1"
TRIALS = [f"trial-{number:03}" for number in range(1, len(PLACES) + 1)]
MEASURED = ["ircp/joint_state", "ircp/objects", "ircp/tactile"]


def station(folder, domain):
    return SimulatedStation(folder, domain, ROBOT, SCENE, ["recorder", "capture_tactile"], seed=3)


def begin(run):
    run.start_recorder()
    run.programs.start("exemplar-capture-tactile", "--from-robot", "--clock", "network")
    run.start_learning()


def shown(folder):
    """The robot stands for the person's body, as in the demo; then another one executes."""
    run = station(folder, "96")
    try:
        simulator = run.simulator("suit", 1700000000, "capture_suit")
        begin(run)
        run.recorder_knows(*MEASURED)
        with run.timed():
            run.person(PLACES, "--record", "--clock", "network")
        simulator.terminate()
        assert simulator.wait(10) == 0, run.programs.logs()
        run.learn("press", [run.recording(trial) for trial in TRIALS])

        before = run.clicks()
        run.simulator("command", 1700001000, "executor")
        run.person([NEW_PLACE], "--place-only")
        run.start_executor()
        done = run.press("press", TARGET)
        assert done["state"] == "done" and run.clicks() == before + 1, (done, run.programs.logs())
    finally:
        run.end()
    return run


def driven(folder):
    """The person drives the robot, which presses; the same robot then executes what was learned from that."""
    run = station(folder, "97")
    try:
        run.simulator("command", 1700000000, "executor", "capture_suit@0.5")
        begin(run)
        run.start_executor()
        wait_for(lambda: run.time_s() > 0.49, f"the time to come to where the person is waited for: {run.programs.logs()}")
        run.recorder_knows(*MEASURED)
        exemplar("robot", "teleop", "on", "--touch", "target", "--detach", "--server", run.executor)
        run.commands_are_heard()
        with run.timed():
            run.person(PLACES, "--dead-man", "--record", "--clock", "network")
            exemplar("robot", "teleop", "off", "--server", run.executor)
        assert run.clicks() == len(PLACES), run.programs.logs()
        run.learn("press", [run.recording(trial) for trial in TRIALS])

        run.person([NEW_PLACE], "--place-only")
        done = run.press("press", TARGET)
        assert done["state"] == "done" and run.clicks() == len(PLACES) + 1, (done, run.programs.logs())
    finally:
        run.end()
    return run


class SimulatedRoadTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-simulated-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def assert_same(self, runs, name, topics, least):
        ours, theirs = (recorded.stamped(run.recording(name)) for run in runs)
        for topic in topics:
            with self.subTest(f"{name} {topic}"):
                self.assertGreater(len(ours[topic]), least)
                alone = sorted(set(map(str, ours[topic])) ^ set(map(str, theirs[topic])))
                self.assertEqual(len(ours[topic]), len(theirs[topic]), f"only in one of them: {alone[:3]} to {alone[-3:]}")
                differing = [pair for pair in zip(ours[topic], theirs[topic]) if pair[0] != pair[1]]
                self.assertEqual(differing[:1], [], f"{len(differing)} of {len(ours[topic])} messages")
                print(f"{name} {topic}: {len(ours[topic])} messages, equal to the last bit")

    def test_what_a_person_shows_is_the_same_in_every_run_and_so_is_what_the_robot_does(self):
        runs = [shown(self.folder / name) for name in ("first", "second")]
        for trial in TRIALS:
            self.assert_same(runs, trial, ["ircp/suit", *MEASURED], 50)
        self.assert_same(runs, "execution", ["ircp/joint_command", *MEASURED], 50)

    def test_a_teleoperated_robot_does_the_same_in_every_run_and_teaches_what_it_does(self):
        runs = [driven(self.folder / name) for name in ("first", "second")]
        for trial in TRIALS:
            self.assert_same(runs, trial, ["ircp/suit", "ircp/joint_command", *MEASURED], 50)


if __name__ == "__main__":
    unittest.main()
