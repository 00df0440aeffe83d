"""The main job: trials in over DDS, a skill learned, a motion executed by the simulated robot.

Called by deploy/demo, which builds first and explains the options.
"""

import argparse
import json
import math
import os
import pathlib
import shutil
import sys

import picture
from processes import Failure, Narrator, System, free_port, is_free, wait_until

ROOT = pathlib.Path(__file__).resolve().parents[2]
SKILL = "press"
# Where the simulated person presses the button: seven places on the table, and the eighth for the robot alone.
PERSON_PLACES = [(0.46, -0.12), (0.40, -0.28), (0.52, -0.22), (0.36, -0.18), (0.48, -0.34), (0.42, -0.05), (0.54, -0.10)]
NEW_PLACE = (0.45, -0.20)
PAGE_PORT = 8080  # or another, where that is taken
# The last figures that count as a success.
MAX_CONTACT_ERROR_MM = 12.7  # the paper's half inch: how well its vision located an object
MAX_TRACKING_ERROR_RAD = 0.1
# The robot's time waits for the executor: a busy machine makes the demo slower, and stops no motion.
IN_STEP = ("--in-step-with", "executor")


def parse(arguments):
    parser = argparse.ArgumentParser(prog="deploy/demo", add_help=False)
    parser.add_argument("--trials", nargs="+", type=pathlib.Path)
    parser.add_argument("--rate", type=float)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, default=ROOT / "build" / "demo")
    parser.add_argument("--headless", action="store_true")
    parser.add_argument("--secured", action="store_true")
    parser.add_argument("--domain", type=int, default=77)
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "release" / "bin")
    options = parser.parse_args(arguments)
    options.headless = options.headless or not sys.stdin.isatty()
    if options.rate is not None and not options.rate > 0:
        parser.error(f"--rate: {options.rate} is not a positive number")
    return options


def trial_files(paths):
    """The files that --trials names, folders expanded."""
    files = []
    for path in paths:
        if path.is_dir():
            inside = sorted(p for p in path.iterdir() if p.suffix.lower() == ".csv")
            if not inside:
                raise Failure(f"--trials: no .csv file in {path}")
            files += inside
        elif path.is_file():
            files.append(path)
        else:
            raise Failure(f"--trials: there is no {path}")
    if len(files) < 2:
        raise Failure(f"--trials: {len(files)} file is too few: one is left out, and at least one is needed to learn from")
    return [file.resolve() for file in files]


def last_time_s(file):
    """The last time stamp of a trial file; 0 where none can be read (the capture program will say why)."""
    with open(file, "rb") as stream:
        stream.seek(0, os.SEEK_END)
        stream.seek(max(0, stream.tell() - 4096))
        lines = stream.read().decode(errors="replace").splitlines()
    for line in reversed(lines):
        try:
            return float(line.split(",")[0])
        except ValueError:
            continue
    return 0.0


class Demo:
    def __init__(self, options):
        self.options = options
        self.say = Narrator()
        shutil.rmtree(options.keep, ignore_errors=True)
        self.system = System(options.bin, options.keep, options.domain, "demo", options.secured)
        self.recordings = options.keep / "recordings"
        self.page = None

    # ---- what both forms share ----

    def start_services(self, robot):
        self.robot = ROOT / "deploy" / "models" / robot
        recorder = self.system.start("recorder", "--data-dir", self.recordings, server=True)
        learning = self.system.start(
            "learning", "--data-dir", self.options.keep / "learning", "--robot", self.robot, server=True, bus=False
        )
        self.recorder = recorder.address()
        self.learning = self.skills = learning.address()

    def start_gateway(self, scene):
        """From here on everything is asked at one address. Before this, captures begin once somebody reads what they
        send, and that has to be the recorder and the robot."""
        self.executor_port = free_port()
        gateway = self.system.start(
            "gateway", "--learning", self.learning, "--recorder", self.recorder, "--executor", f"127.0.0.1:{self.executor_port}",
            *self.page_options(scene), server=True,
        )  # fmt: skip
        self.recorder = self.skills = self.executor = gateway.address()
        if self.page:
            self.say.step(f"the web page: {self.page}")

    def page_options(self, scene):
        """For a person at a terminal: the gateway's web page. In a secured station it would want a login."""
        if self.options.headless or self.options.secured:
            return []
        port = PAGE_PORT if is_free(PAGE_PORT) else free_port()
        self.page = f"http://localhost:{port}/"
        return ["--http", f"127.0.0.1:{port}", "--robot", self.robot, "--scene", scene, "--recordings", self.recordings]

    def wait_for_person(self):
        if self.page:
            self.say.step(f"try it yourself: {self.page} (Enter ends the demo)")
            sys.stdin.readline()

    def submit_and_learn(self):
        files = sorted(self.recordings.glob("trial-*.mcap"))
        self.say.step(f"submitting {len(files)} recordings over gRPC")
        submitted = self.system.cli(self.skills, "trial", "submit", "--skill", SKILL, *files)
        for trial in submitted:
            for notice in trial.get("notices", []):
                self.say.detail(f"{trial.get('source', trial.get('id'))}: {notice}")
        self.say.step("learning")
        self.system.cli(self.skills, "skill", "learn", SKILL)
        self.say.detail(self.system.cli(self.skills, "skill", "show", SKILL, "--format", "text", as_json=False))
        return len(submitted)

    def skill(self):
        return json.loads(self.system.cli(self.skills, "skill", "export", SKILL, as_json=False))

    def start_robot(self, scene, *simulator_options):
        self.simulator = self.system.start("simulator", "--robot", self.robot, "--scene", scene, *simulator_options)

    def start_executor(self, scene):
        self.start_gateway(scene)
        executor = self.system.start(
            "executor", "--robot", self.robot, "--scene", scene, "--learning", self.learning, "--clock", "network",
            server=True, port=self.executor_port,
        )  # fmt: skip
        executor.address()
        wait_until("the robot's joint state", self.robot_is_seen, 60)

    def robot_is_seen(self):
        try:
            return self.robot_status().get("joint_names")
        except Failure:
            return None  # the gateway has not noticed yet that the executor is there

    def robot_status(self):
        return self.system.cli(self.executor, "robot", "status")

    def record(self, action, *arguments):
        return self.system.cli(self.recorder, "record", action, *arguments)

    def execute(self, *arguments):
        self.say.step("planning and executing")
        # Once the recorder hears both, so that it has them whole.
        self.record("start", "--name", "execution", "--topic", "ircp/joint_command", "--topic", "ircp/joint_state", "--wait", 60)
        try:
            result = self.system.cli(self.executor, "skill", "execute", SKILL, *arguments, "--wait")
        finally:
            self.record("stop")
        return result

    def topics(self):
        """Samples sent, received and lost on every topic, from the writers' counts and the recorder's."""
        status = self.record("status")
        return {
            topic["topic"]: {"sent": topic["sent"], "received": topic["received"], "lost": topic["lost"]}
            for topic in sorted(status["topics"], key=lambda t: t["topic"])
        }

    def report(self, figures):
        self.say.step("result")
        table = [f"{'topic':28} {'sent':>8} {'received':>9} {'lost':>5}"]
        for name, count in figures["topics"].items():
            table.append(f"{name:28} {count['sent']:8} {count['received']:9} {count['lost']:5}")
        self.say.detail("\n".join(table))

        def line(label, value, unit, digits=2):
            self.say.detail(f"{label:44} {'-' if value is None else f'{value:.{digits}f} {unit}'}")

        line("answer against the left-out trial, Fréchet", figures["frechet_cm"], "cm")
        line("answer against the left-out trial, at its end", figures["end_error_cm"], "cm")
        line("robot at contact, error", figures["contact_error_mm"], "mm")
        line("smallest clearance", figures["clearance_mm"], "mm")
        line("largest tracking error", figures["tracking_error_rad"], "rad", 4)
        for name, value in figures.items():
            if name == "clicks":
                self.say.detail(f"{'button clicks':44} {value}")
        self.say.detail(f"picture: {self.options.keep / 'result.svg'}")
        self.say.detail("passed" if figures["passed"] else "FAILED: " + "; ".join(figures["failures"]))
        print(json.dumps(figures), flush=True)

    def figures(self, trials, evaluation, execution, extra_failures=(), **more):
        deviation = evaluation["deviation"] if evaluation else {}

        def scaled(value, factor):
            return None if value is None or not math.isfinite(value) else value * factor

        topics = self.topics()
        contact_mm = scaled(execution.get("contact_error_m"), 1e3)
        failures = list(extra_failures)
        if execution["state"] != "done":
            failures.append(f"the execution ended as {execution['state']}: {execution.get('detail')}")
        if contact_mm is None or contact_mm > MAX_CONTACT_ERROR_MM:
            failures.append(f"contact error {contact_mm} mm is above {MAX_CONTACT_ERROR_MM} mm")
        if execution["tracking_error_rad"] > MAX_TRACKING_ERROR_RAD:
            failures.append(f"tracking error {execution['tracking_error_rad']} rad is above {MAX_TRACKING_ERROR_RAD} rad")
        lost = {name: count["lost"] for name, count in topics.items() if count["lost"] and name != "ircp/camera"}
        if lost:
            failures.append(f"samples were lost: {lost}")
        return {
            "trials": trials,
            "frechet_cm": scaled(deviation.get("frechet_m"), 100),
            "end_error_cm": scaled(deviation.get("end_error_m"), 100),
            "contact_error_mm": contact_mm,
            "clearance_mm": scaled(execution.get("clearance_m"), 1e3),
            "tracking_error_rad": execution["tracking_error_rad"],
            "topics": topics,
            **more,
            "passed": not failures,
            "failures": failures,
        }

    # ---- trials from files ----

    def from_files(self):
        files = trial_files(self.options.trials)
        learn, left_out = files[:-1], files[-1]
        total_s = sum(last_time_s(file) for file in learn)
        rate = self.options.rate or max(1.0, total_s / 30)
        self.say.step(f"{len(learn)} trials to learn from, {left_out.name} is left out; replay at {rate:.1f} times real time")
        self.start_services("arm7")
        # The first half is told to the recorder by the command line over gRPC, the rest by the capture
        # program over DDS: both are the system's own ways.
        half = (len(learn) + 1) // 2
        for number, file in enumerate(learn[:half], start=1):
            self.say.step(f"recording {file.name} (trial {number} of {len(learn)}; start and stop over gRPC)")
            self.record("start", "--name", f"trial-{number:03}", "--meta", f"source={file.name}")
            self.system.start("capture-suit", "--replay", file, "--rate", rate).wait(total_s / rate + 60)
            self.record("stop")
        for number, file in enumerate(learn[half:], start=half + 1):
            self.say.step(f"recording {file.name} (trial {number} of {len(learn)}; start and stop over DDS)")
            capture = self.system.start(
                "capture-suit", "--replay", file, "--rate", rate, "--record", "--name", f"trial-{number:03}"
            )
            capture.wait(total_s / rate + 60)
        trials = self.submit_and_learn()

        self.say.step(f"querying at the object pose and start of {left_out.name}")
        evaluation = self.system.cli(self.skills, "skill", "evaluate", SKILL, left_out)
        deviation = evaluation["deviation"]
        self.say.detail(
            f"the person's motion is {100 * deviation['frechet_m']:.2f} cm away (Fréchet), its end {100 * deviation['end_error_m']:.2f} cm"
        )
        answer = evaluation["answer"]
        scene = self.options.keep / "scene.yaml"
        scene.write_text(scene_for(answer))
        self.start_robot(scene, "--cameras", "off", *IN_STEP)
        self.start_executor(scene)
        query = evaluation["query"]
        objects = [part for pose in query["objects"] for part in ("--object", pose["name"] + "=" + numbers(pose))]
        execution = self.execute(*objects, "--start", numbers(query["start"]))
        picture.draw(self.options.keep / "result.svg", left_out.name, answer, execution, left_out, self.skill())
        self.report(self.figures(trials, evaluation, execution))

    # ---- the simulated person ----

    def from_person(self):
        self.start_services("leonardo")
        scene = ROOT / "deploy" / "config" / "press_table.yaml"
        self.start_robot(scene, "--follow", "suit")
        self.system.start("capture-vision", "--scene", scene)
        self.system.start("capture-tactile", "--from-robot")
        places = place_words(PERSON_PLACES)
        self.say.step(f"a simulated person presses the button at {len(PERSON_PLACES)} places, the robot following the suit")
        person = self.system.start(
            "capture-suit", "--person", "--robot", self.robot, "--scene", scene, "--places", places,
            "--seed", self.options.seed, "--record", "--name", "trial",
        )  # fmt: skip
        person.wait(240)
        self.say.detail("\n".join(line for line in person.log.read_text().splitlines() if "trial" in line))
        trials = self.submit_and_learn()

        self.say.step("the button is moved to a place that no trial had")
        self.simulator.stop()
        self.system.processes.remove(self.simulator)
        self.start_robot(scene, "--follow", "command", "--log-format", "json", *IN_STEP)
        mover = self.system.start(
            "capture-suit", "--person", "--robot", self.robot, "--scene", scene, "--places", place_words([NEW_PLACE]), "--place-only"
        )
        mover.wait(60)
        self.start_executor(scene)
        seen = wait_until("the vision program to see the button", self.seen_target, 60)
        self.say.detail("seen at " + numbers(seen))
        answer = self.system.cli(self.skills, "skill", "query", SKILL, "--object", "target=" + numbers(seen))
        execution = self.execute("--object", "target=" + numbers(seen))
        clicks = wait_until("the simulator's count of clicks", self.clicks, 20)
        picture.draw(self.options.keep / "result.svg", "a place no trial had", answer, execution, None, self.skill())
        missed = [] if clicks > 0 else ["the button did not click"]
        self.report(self.figures(trials, None, execution, missed, clicks=clicks))

    def seen_target(self):
        for seen in self.robot_status().get("objects", []):
            near = math.dist(seen["position"][:2], NEW_PLACE) < 0.05
            if seen["name"] == "target" and seen["age_s"] < 1 and near:
                return seen
        return None


    def clicks(self):
        """How often the simulated button clicked, from the simulator's log."""
        lines = (json.loads(line) for line in self.simulator.log.read_text().splitlines() if line.startswith("{"))
        return sum(1 for line in lines if line["event"] == "button clicked")


def scene_for(answer):
    """A scene in which the object that the trials pressed stands where the answer meets it: one plate, wide enough
    for all contacts, on a table at the height of the robot's base. The files say nothing of the object's shape."""
    contacts = [contact["base_p_contact"] for contact in answer["contacts"]]
    if not contacts:
        raise Failure("the answer touches nothing: no contact was found in the trials")
    middle = [sum(point[axis] for point in contacts) / len(contacts) for axis in range(3)]
    top = min(point[2] for point in contacts)
    radius = 0.012 + max(math.dist(point[:2], middle[:2]) for point in contacts)
    target = next(pose for pose in answer["objects"] if pose["name"] == answer["contacts"][0]["object"])
    contact = into_frame(target, [middle[0], middle[1], top])
    normal = into_frame({**target, "position": [0, 0, 0]}, [0, 0, 1])
    words = lambda values: "[" + ", ".join(f"{value:.6f}" for value in values) + "]"
    return f"""obstacles:
  - {{name: table, shape: box, size: [1.2, 1.4, 0.04], position: [0.75, 0, -0.03], quaternion: [0, 0, 0, 1]}}
buttons:
  - name: {target["name"]}
    position: {words(target["position"])}
    quaternion: {words(target["quaternion"])}
    contact: {words(contact)}
    normal: {words(normal)}
    radius: {radius:.4f}
    height: {max(0.005, top - 0.008):.4f}
    travel: 0.004
    click_force: 3
"""


def into_frame(pose, point):
    """A point of the base frame, in the frame of `pose`."""
    x, y, z, w = pose["quaternion"]
    d = [p - o for p, o in zip(point, pose["position"])]
    # The rows of the transposed rotation matrix.
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)),
        (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)),
        (2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)),
    )
    return [sum(a * b for a, b in zip(row, d)) for row in rows]


def numbers(pose):
    values = list(pose["position"]) + (list(pose["quaternion"]) if pose.get("has_orientation", True) else [])
    return ",".join(f"{value:.9g}" for value in values)


def place_words(places):
    return ";".join(f"{x},{y}" for x, y in places)


def main():
    options = parse(sys.argv[1:])
    demo = Demo(options)
    try:
        if options.trials:
            demo.from_files()
        else:
            demo.from_person()
        demo.wait_for_person()
    except (Failure, KeyboardInterrupt) as failure:
        print(f"deploy/demo: {failure or 'interrupted'}\nlogs: {demo.system.logs}", file=sys.stderr)
        print(json.dumps({"passed": False, "failures": [str(failure) or "interrupted"]}))
        return 1
    finally:
        unclean = demo.system.stop()
        if unclean:
            print(f"deploy/demo: did not end cleanly: {', '.join(unclean)}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
