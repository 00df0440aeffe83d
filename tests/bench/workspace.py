"""Success over the workspace: buttons at random places, turned and tilted at random, pressed by three robots.

Real programs (learning, executor, simulator), a fresh simulator and executor a press. A skill is learned from a
person's presses at other places; a press counts when the button clicks in the simulator. Each refusal goes to
workspace_judge, which tells by brute force whether the motion asked for can be reached at all.

    tests/system/run_isolated python3 tests/bench/workspace.py --bin build/release/bin --presses 10

Prints a line a press that went wrong, a table, and as last line one JSON object with the figures. Ends with 1 when
fewer than 99 of 100 presses that can be reached clicked, or a refusal was none.
"""

import argparse
import csv
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "lib"))
from processes import Failure, System, wait_until  # noqa: E402

SKILL = "press"
TRIALS = 9
RATE_HZ = 100
LARGEST_TILT_RAD = 0.15
PRESSED_M = 0.004  # by the person: the button's whole travel
# Where buttons stand (m, base frame): x, y, z from and to. Around what each robot's hand can do before it.
REGIONS = {
    "arm7": ((0.40, 0.68), (-0.35, 0.25), (0.03, 0.12)),
    "ur5e_like": ((0.36, 0.66), (-0.30, 0.20), (0.03, 0.12)),
    "leonardo": ((0.34, 0.55), (-0.36, -0.04), (0.03, 0.08)),
}
NEAR_M = 0.03  # of the contact: there the finger may touch the button


# ---- rotations, as quaternions x, y, z, w


def times(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def about(axis, angle):
    return tuple(math.sin(angle / 2) * part for part in axis) + (math.cos(angle / 2),)


def turned(q, v):
    return times(times(q, (*v, 0.0)), (-q[0], -q[1], -q[2], q[3]))[:3]


def widened(span, factor):
    middle, half = (span[0] + span[1]) / 2, (span[1] - span[0]) / 2
    return middle - factor * half, middle + factor * half


class Place:
    """A button, where it stands: `tilt` leans it over towards `lean`, `turn` turns it about its own normal."""

    def __init__(self, region, rng):
        self.position = [rng.uniform(*span) for span in region]
        lean, tilt = rng.uniform(-math.pi, math.pi), rng.uniform(0, LARGEST_TILT_RAD)
        self.tilted = about((-math.sin(lean), math.cos(lean), 0.0), tilt)
        self.rotation = times(self.tilted, about((0.0, 0.0, 1.0), rng.uniform(-math.pi, math.pi)))
        self.normal = turned(self.rotation, (0.0, 0.0, 1.0))

    def above(self, height_m):
        return [p + height_m * n for p, n in zip(self.position, self.normal)]

    def words(self):
        return ",".join(f"{value:.9g}" for value in (*self.position, *self.rotation))


# ---- the person's trials


def minimum_jerk(s):
    return s * s * s * (10 + s * (-15 + 6 * s))


def slerp(a, b, s):
    dot = sum(x * y for x, y in zip(a, b))
    b = b if dot >= 0 else tuple(-y for y in b)
    angle = math.acos(min(1.0, abs(dot)))
    if angle < 1e-9:
        return a
    return tuple((math.sin((1 - s) * angle) * x + math.sin(s * angle) * y) / math.sin(angle) for x, y in zip(a, b))


def write_trial(path, place, home, rng):
    """A press: from near home to above the button, along its normal into it, and back."""
    position, rotation = home[:3], tuple(home[3:])
    start = [p + rng.gauss(0, 0.01) for p in position]
    press = times(place.tilted, rotation)
    above, into = place.above(0.08), place.above(-PRESSED_M)
    legs = [
        (start, rotation, above, press, rng.uniform(1.4, 1.9)),
        (above, press, above, press, rng.uniform(0.1, 0.2)),
        (above, press, into, press, rng.uniform(0.9, 1.3)),
        (into, press, into, press, rng.uniform(0.3, 0.5)),
        (into, press, above, press, rng.uniform(0.8, 1.2)),
    ]
    columns = ["time_s"] + [f"ee_{name}" for name in ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")]
    columns += [f"object_target_{name}" for name in ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")]
    time_s = 0.0
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        for p, q, p_end, q_end, duration_s in legs:
            count = int(duration_s * RATE_HZ)
            for i in range(count):
                s = minimum_jerk(i / count)
                now = [a + s * (b - a) for a, b in zip(p, p_end)]
                values = [time_s + i / RATE_HZ, *now, *slerp(q, q_end, s), *place.position, *place.rotation]
                writer.writerow([f"{value:.9g}" for value in values])
            time_s += count / RATE_HZ


# ---- one robot


def scene_for(place):
    words = lambda values: "[" + ", ".join(f"{value:.9g}" for value in values) + "]"
    return f"""obstacles:
  - {{name: table, shape: box, size: [0.9, 1.5, 0.04], position: [0.66, -0.1, -0.025]}}
buttons:
  - name: target
    position: {words(place.position)}
    quaternion: {words(place.rotation)}
    height: 0.02
    radius: 0.02
    travel: 0.004
    click_force: 3
"""


class Robot:
    def __init__(self, options, name, folder):
        self.options, self.name, self.folder = options, name, folder
        self.guard = ["--guard-touch-n", options.guard_touch_n]
        self.model = ROOT / "deploy" / "models" / name
        self.judge = [str(options.bin / "workspace_judge"), "--robot", str(self.model)]
        self.home = json.loads(subprocess.run(self.judge, check=True, capture_output=True, text=True).stdout)

    def run(self):
        rng = random.Random(f"{self.options.seed} {self.name}")
        services = System(self.options.bin, self.folder, self.options.domain, "workspace")
        try:
            learning = services.start("learning", "--data-dir", self.folder / "learning", "--robot", self.model, server=True, bus=False)
            self.learning, self.services = learning.address(), services
            files = []
            for number in range(TRIALS):
                files.append(self.folder / f"trial-{number}.csv")
                write_trial(files[-1], Place(REGIONS[self.name], rng), self.home, rng)
            services.cli(self.learning, "trial", "submit", "--skill", SKILL, *files)
            services.cli(self.learning, "skill", "learn", SKILL)
            region = [widened(span, self.options.wide) for span in REGIONS[self.name][:2]] + [REGIONS[self.name][2]]
            return [self.press(number, Place(region, rng)) for number in range(self.options.presses)]
        finally:
            services.stop()

    def press(self, number, place):
        """"clicked", or what went wrong."""
        folder = self.folder / f"press-{number:03}"
        system = System(self.options.bin, folder, self.options.domain, f"press{number}")
        scene = folder / "scene.yaml"
        scene.write_text(scene_for(place), encoding="utf-8")
        try:
            pace = [] if self.options.pace == 1 else ["--pace", self.options.pace, "--in-step-with", "executor"]
            clock = [] if self.options.pace == 1 else ["--clock", "network"]
            simulator = system.start("simulator", "--robot", self.model, "--scene", scene, "--cameras", "off", "--log-format", "json", *pace)
            executor = system.start("executor", "--robot", self.model, "--scene", scene, "--learning", self.learning, *clock, *self.guard, server=True)
            address = executor.address()
            wait_until("the robot's joint state", lambda: system.cli(address, "robot", "status").get("joint_names"), 60)
            try:
                done = system.cli(address, "skill", "execute", SKILL, "--object", "target=" + place.words(), "--wait")
            except Failure as failure:
                if "the motion ended as" in str(failure):
                    return self.say(number, place, "stopped", str(failure).splitlines()[-1])
                return self.say(number, place, *self.judged(scene, place, str(failure)))
            clicks = sum('"button clicked"' in line for line in simulator.log.read_text().splitlines())
            if clicks > 0 and done["state"] == "done":
                return "clicked"
            outcome = "clicked, then stopped" if clicks > 0 else "no click" if done["state"] == "done" else "stopped"
            return self.say(number, place, outcome, f"{done['state']}: {done.get('detail')}, contact error {done.get('contact_error_m')} m")
        finally:
            system.stop()

    def judged(self, scene, place, refusal):
        """Whether what was refused is out of reach by brute force too."""
        start = ",".join(f"{value:.9g}" for value in self.home)
        answer = self.services.cli(self.learning, "skill", "query", SKILL, "--object", "target=" + place.words(), "--start", start)
        if not answer["contacts"]:
            return "false refusal", f"the answer touches nothing: {refusal}"
        contact = answer["contacts"][0]
        poses = answer["base_T_tool"]
        frames = sorted({*range(0, len(poses), max(1, len(poses) // 40)), len(poses) - 1, contact["first"], contact["last"]})
        lines = []
        for frame in frames:
            pose = poses[frame]
            touching = contact["first"] <= frame <= contact["last"]
            near = math.dist(pose["position"], contact["base_p_contact"]) < NEAR_M
            word = "touching" if touching else "near" if near else "free"
            lines.append(" ".join([word, *(f"{value:.9g}" for value in (*pose["position"], *pose["quaternion"]))]))
        command = [*self.judge, "--scene", str(scene)]
        verdicts = json.loads(subprocess.run(command, input="\n".join(lines), check=True, capture_output=True, text=True).stdout)
        for frame, verdict in zip(frames, verdicts):
            if verdict["clear"] == 0:
                why = "no posture reaches" if verdict["reached"] == 0 else f"all {verdict['reached']} postures collide at"
                return "true refusal", f"{why} frame {frame} of {len(poses)}: {refusal}"
        return "false refusal", refusal

    def say(self, number, place, outcome, detail):
        print(f"{self.name} {number} at {place.words()}: {outcome}: {detail}", file=sys.stderr, flush=True)
        return outcome


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "release" / "bin")
    parser.add_argument("--robots", default=",".join(REGIONS), help="some of them, separated by commas")
    parser.add_argument("--presses", type=int, default=100, help="a robot")
    parser.add_argument("--wide", type=float, default=1, help="so many times as wide and deep as where the person pressed")
    parser.add_argument("--guard-touch-n", type=float, default=8, help="as the executor's: presses end by touch; 0: by position alone")
    parser.add_argument("--pace", type=float, default=1, help="simulated seconds a second, in step; 1: by the machine's clock; 0: as many as can be")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--domain", type=int, default=93)
    parser.add_argument("--keep", type=pathlib.Path, help="where scenes and logs go (default: nowhere)")
    options = parser.parse_args()
    figures = {}
    with tempfile.TemporaryDirectory(prefix="exemplar-workspace-") as folder:
        for name in options.robots.split(","):
            outcomes = Robot(options, name, (options.keep or pathlib.Path(folder)) / name).run() if name in REGIONS else parser.error(f"--robots: there is no {name}")
            figures[name] = {outcome: outcomes.count(outcome) for outcome in sorted(set(outcomes))}
            print(f"{name:12} " + ", ".join(f"{count} {outcome}" for outcome, count in figures[name].items()), flush=True)
    passed = True
    for counts in figures.values():
        reachable = sum(counts.values()) - counts.get("true refusal", 0)
        passed &= counts.get("clicked", 0) >= 0.99 * reachable and "false refusal" not in counts
    print(json.dumps({"presses": options.presses, "seed": options.seed, "robots": figures, "passed": passed}))
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
