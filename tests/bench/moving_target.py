"""The button on a moving cart, pressed: how many of so many presses click, by the cart's speed.

Real programs (learning, executor, simulator), a fresh simulator and executor a press, the simulated time in step with
the executor. A skill is learned from a person's presses of a button that stands; then the button runs to and fro on a
rail, at a random place, in a random direction across the table, tracked at 60 Hz with half a millimetre of noise, and
`skill execute --follow` presses it once the cart was there and back. A press counts when the button clicks in the simulator.

    tests/system/run_isolated python3 tests/bench/moving_target.py --bin build/release/bin --pace 0 --presses 25

Prints a line a press that went wrong, a table, and as last line one JSON object with the figures. Ends with 1 when
fewer than 99 of 100 presses clicked.
"""

import argparse
import json
import math
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "lib"))
sys.path.insert(0, str(ROOT / "tests" / "bench"))
from processes import Failure, System, wait_until  # noqa: E402
from workspace import REGIONS, SKILL, TRIALS, Place, scene_for, write_trial  # noqa: E402

SPEEDS_M_S = (0.0, 0.05, 0.1, 0.15, 0.2)
RAIL_M = 0.4
# Where the middle of the rail is (m, base frame), and how far its direction is turned from the table's y.
MIDDLE = ((0.45, 0.6), (-0.12, 0.02), (0.04, 0.08))
LARGEST_TURN_RAD = 0.3
METRICS_PORT = 9464  # in a network of our own


def simulated_s():
    with urllib.request.urlopen(f"http://127.0.0.1:{METRICS_PORT}/metrics", timeout=10) as answer:
        rows = (line.rpartition(" ") for line in answer.read().decode().splitlines() if not line.startswith("#"))
        return {name: float(value) for name, _, value in rows}["exemplar_simulator_time_seconds"]


class Cart:
    """A button that stands upright on its rail."""

    def __init__(self, rng):
        middle = [rng.uniform(*span) for span in MIDDLE]
        turn = rng.uniform(-LARGEST_TURN_RAD, LARGEST_TURN_RAD)
        self.direction = [math.sin(turn), math.cos(turn), 0.0]
        if rng.random() < 0.5:
            self.direction = [-part for part in self.direction]
        self.place = Place(REGIONS["arm7"], rng)
        self.place.position = [m - RAIL_M / 2 * d for m, d in zip(middle, self.direction)]
        self.place.rotation = (0.0, 0.0, 0.0, 1.0)

    def scene(self, speed_m_s):
        words = ", ".join(f"{part:.9g}" for part in self.direction)
        return scene_for(self.place) + f"    rail: {{direction: [{words}], length: {RAIL_M}, speed: {speed_m_s}}}\n"


def said(done):
    """What matters of an execution that went through."""
    return {name: done.get(name) for name in ("state", "detail", "contact_error_m", "touch_max_n", "clearance_m")}


class Bench:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.model = ROOT / "deploy" / "models" / "arm7"

    def run(self):
        rng = random.Random(f"{self.options.seed} trials")
        services = System(self.options.bin, self.folder, self.options.domain, "moving")
        try:
            learning = services.start("learning", "--data-dir", self.folder / "learning", "--robot", self.model, server=True, bus=False)
            self.learning = learning.address()
            files = []
            for number in range(TRIALS):
                files.append(self.folder / f"trial-{number}.csv")
                write_trial(files[-1], Place(REGIONS["arm7"], rng), self.home(), rng)
            services.cli(self.learning, "trial", "submit", "--skill", SKILL, *files)
            services.cli(self.learning, "skill", "learn", SKILL)
            for speed in self.options.speeds:
                yield speed, [self.press(speed, number) for number in range(self.options.presses)]
        finally:
            services.stop()

    def home(self):
        """The tool's pose at the robot's home posture."""
        judge = [str(self.options.bin / "workspace_judge"), "--robot", str(self.model)]
        return json.loads(subprocess.run(judge, check=True, capture_output=True, text=True).stdout)

    def press(self, speed, number):
        rng = random.Random(f"{self.options.seed} cart {number}")
        cart = Cart(rng)
        folder = self.folder / f"press-{speed}-{number:03}"
        system = System(self.options.bin, folder, self.options.domain, f"press{number}")
        scene = folder / "scene.yaml"
        scene.write_text(cart.scene(speed), encoding="utf-8")
        try:
            simulator = system.start(
                "simulator", "--robot", self.model, "--scene", scene, "--cameras", "off", "--log-format", "json",
                "--track-hz", 60, "--noise-object", self.options.noise_m, "--seed", number + 1,
                "--pace", self.options.pace, "--in-step-with", "executor", "--metrics", f"127.0.0.1:{METRICS_PORT}",
            )
            executor = system.start(
                "executor", "--robot", self.model, "--scene", scene, "--learning", self.learning, "--clock", "network",
                "--guard-touch-n", self.options.guard_touch_n, "--log-level", "debug", server=True,
            )
            address = executor.address()
            wait_until("the robot's joint state", lambda: system.cli(address, "robot", "status").get("joint_names"), 20)
            there_and_back_s = 2 * RAIL_M / speed if speed > 0 else 0
            begin_s = there_and_back_s + 1 + rng.uniform(0, self.options.watch_s)
            wait_until("the cart to be there and back", lambda: simulated_s() >= begin_s, 60)
            done, detail = {}, ""
            try:
                done = system.cli(address, "skill", "execute", SKILL, "--follow", "--wait")
            except Failure as failure:
                detail = str(failure).splitlines()[-1]
            clicks = sum('"button clicked"' in line for line in simulator.log.read_text().splitlines())
            if clicks == 1 and done.get("state") == "done":
                return {"outcome": "clicked", **done}
            outcome = "clicked, then stopped" if clicks == 1 else f"clicked {clicks} times" if clicks > 1 else "no click" if done.get("state") == "done" else "stopped"
            print(f"{speed} m/s {number}: {outcome}: {detail or said(done)}", file=sys.stderr, flush=True)
            return {"outcome": outcome, **done}
        finally:
            system.stop()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "release" / "bin")
    parser.add_argument("--speeds", type=lambda text: [float(word) for word in text.split(",")], default=list(SPEEDS_M_S), help="m/s, separated by commas")
    parser.add_argument("--presses", type=int, default=25, help="a speed")
    parser.add_argument("--noise-m", type=float, default=0.0005, help="standard deviation of the tracker, an axis")
    parser.add_argument("--watch-s", type=float, default=3, help="the cart runs there and back, one second more, and up to so many before")
    parser.add_argument("--guard-touch-n", type=float, default=8, help="as the executor's; 0: presses end by position")
    parser.add_argument("--pace", type=float, default=1, help="simulated seconds a second; 0: as many as can be")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--domain", type=int, default=94)
    parser.add_argument("--keep", type=pathlib.Path, help="where scenes and logs go (default: nowhere)")
    options = parser.parse_args()
    figures = {}
    with tempfile.TemporaryDirectory(prefix="exemplar-moving-") as folder:
        for speed, presses in Bench(options, options.keep or pathlib.Path(folder)).run():
            outcomes = [press["outcome"] for press in presses]
            figures[f"{speed:g}"] = {outcome: outcomes.count(outcome) for outcome in sorted(set(outcomes))}
            for name, unit, factor in (("contact_error", "m", 1000), ("touch_max", "n", 1), ("clearance", "m", 1000)):
                values = [factor * press[f"{name}_{unit}"] for press in presses if press.get(f"{name}_{unit}") is not None]
                if values:
                    worst = min if name == "clearance" else max
                    unit = "mm" if unit == "m" else unit
                    figures[f"{speed:g}"][f"{name}_{unit}"] = {"median": round(statistics.median(values), 2), "worst": round(worst(values), 2)}
            print(f"{speed:g} m/s: {figures[f'{speed:g}']}", flush=True)
    passed = sum(counts.get("clicked", 0) for counts in figures.values()) >= 0.99 * options.presses * len(figures)
    print(json.dumps({"presses": options.presses, "seed": options.seed, "speeds_m_s": figures, "passed": passed}))
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
