"""A station in simulated time: all its programs in step, as fast as the machine can."""

import contextlib
import pathlib
import time
import urllib.request

from processes import Programs, exemplar, wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]


def metric(address, name):
    """The value of one of a program's metrics that has no labels, once it is served."""
    lines = []

    def served():
        try:
            with urllib.request.urlopen(f"http://{address}/metrics", timeout=30) as answer:
                lines[:] = answer.read().decode().splitlines()
        except OSError:
            return False
        return True

    wait_for(served, f"the metrics at {address}")
    return float(next(line.split()[1] for line in lines if line.startswith(name + " ")))


class SimulatedStation:
    """`in_step`: what every simulator waits for. Simulated seconds add up in `simulated_s`, real ones in `running_s`."""

    STANDS_AFTER_S = 0.6
    EXECUTOR_METRICS = "127.0.0.1:19773"

    def __init__(self, folder, domain, robot, scene, in_step, seed, metrics="127.0.0.1:19772"):
        folder.mkdir()
        self.folder, self.robot, self.scene, self.in_step, self.seed, self.metrics = folder, robot, scene, in_step, seed, metrics
        self.programs = Programs(folder, domain)
        self.simulated_s = self.running_s = 0
        self.began = time.monotonic()

    def simulator(self, follow, epoch_s, *in_step, noise=("--noise-position", "1e-4", "--noise-touch", "0.02", "--noise-object", "1e-4")):
        return self.programs.start(
            "exemplar-simulator", "--robot", self.robot, "--scene", self.scene, "--cameras", "off", "--follow", follow, "--pace", "0",
            "--in-step-with", *in_step, *self.in_step, "--stand-after-s", self.STANDS_AFTER_S, "--epoch-s", epoch_s, "--track-hz", "25",
            "--seed", self.seed, "--metrics", self.metrics, *noise,
        )  # fmt: skip

    def server(self, program, *words, bus=True):
        """A program with a gRPC server, and its address."""
        port_file = self.folder / f"port-{len(self.programs.running)}"
        self.programs.start(program, "--listen", "127.0.0.1:0", "--port-file", port_file, *words, bus=bus)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), f"the port of {program}: {self.programs.logs()}")
        return "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]

    def start_recorder(self):
        self.recorder = self.server("exemplar-recorder", "--data-dir", self.folder / "data", "--clock", "network")

    def start_learning(self):
        self.learning = self.server("exemplar-learning", "--data-dir", self.folder / "skills", "--robot", self.robot, bus=False)

    def start_executor(self):
        words = ["--robot", self.robot, "--scene", self.scene, "--learning", self.learning, "--clock", "network", "--metrics", self.EXECUTOR_METRICS]
        self.executor = self.server("exemplar-executor", *words)

    def person(self, places, *words):
        """A person who presses the button at these places, in the foreground."""
        places = ";".join(",".join(map(str, place)) for place in places)
        person = self.programs.start(
            "exemplar-capture-suit", "--person", "--robot", self.robot, "--scene", self.scene, "--places", places, "--seed", self.seed, *words
        )
        assert person.wait(400) == 0, self.programs.logs()

    def recorder_knows(self, *topics):
        def known():
            status = exemplar("record", "status", "--server", self.recorder)
            return {topic["topic"] for topic in status["topics"]} >= set(topics)

        wait_for(known, f"the recorder to find {topics}: {self.programs.logs()}")

    def commands_are_heard(self):
        """By the robot and the recorder, as the executor sees it: what it sends before, nobody has."""
        heard = lambda: metric(self.EXECUTOR_METRICS, "exemplar_executor_command_readers") >= 2
        wait_for(heard, f"robot and recorder to hear the commands: {self.programs.logs()}")

    def time_s(self):
        return metric(self.metrics, "exemplar_simulator_time_seconds")

    def wait_until_time_stands(self):
        stands = lambda: metric(self.metrics, "exemplar_simulator_time_stands") == 1
        wait_for(stands, f"the simulated time to stand still: {self.programs.logs()}", 60)

    @contextlib.contextmanager
    def timed(self):
        """Counts the time of what stands within, until simulated time stands."""
        before, begin = self.time_s(), time.monotonic()
        yield
        self.wait_until_time_stands()
        self.simulated_s += self.time_s() - before
        self.running_s += time.monotonic() - begin

    def learn(self, skill, trials):
        exemplar("--server", self.learning, "trial", "submit", "--skill", skill, *trials)
        exemplar("--server", self.learning, "skill", "learn", skill)

    def press(self, skill, target):
        """The robot carries the skill out, recorded; the answer."""
        self.wait_until_time_stands()
        self.commands_are_heard()
        exemplar("record", "start", "--name", "execution", "--topic", "ircp/joint_command", "--wait", "60", "--server", self.recorder)
        with self.timed():
            done = exemplar("--server", self.executor, "skill", "execute", skill, "--object", target, "--wait")
        exemplar("record", "stop", "--server", self.recorder)
        return done

    def recording(self, name):
        return self.folder / "data" / f"{name}.mcap"

    def clicks(self):
        return self.programs.logs().count("button clicked")

    def end(self):
        self.programs.end()
        seconds = time.monotonic() - self.began
        print(
            f"{self.folder.name}: {self.simulated_s:.1f} simulated seconds in {self.running_s:.1f} s, {self.simulated_s / max(self.running_s, 1e-3):.1f} times "
            f"real time, planning and what is started meanwhile included; {seconds:.1f} s with all else"
        )
