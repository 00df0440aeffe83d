"""Makes trial files like those of a person who moves a robot arm by hand to press a button.

Straight-ish minimum-jerk reaches with pauses, seeded; nothing in here is shared with the learner.
"""

import csv
import math
import random

RATE_HZ = 100
COLUMNS = ["time_s", "ee_x_m", "ee_y_m", "ee_z_m", "ee_qx", "ee_qy", "ee_qz", "ee_qw"] + [
    f"object_target_{name}" for name in ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")
]


def minimum_jerk(s):
    return s * s * s * (10 + s * (-15 + 6 * s))


def press(seed, button):
    """Samples (time, tool position) of one press: start, reach above, press, release, retract a little."""
    rng = random.Random(seed)
    noise = lambda scale: [rng.gauss(0, scale) for _ in range(3)]
    start = [0.45, -0.12, 0.32]
    above = [button[0], button[1], button[2] + 0.10]
    contact = list(button)
    waypoints = [[a + n for a, n in zip(start, noise(0.01))], [a + n for a, n in zip(above, noise(0.006))], contact, contact, above]
    durations = [rng.uniform(1.2, 1.9), rng.uniform(0.9, 1.5), rng.uniform(0.3, 0.6), rng.uniform(0.8, 1.2)]
    pause = rng.uniform(0.1, 0.3)
    samples, begin = [], 0.0
    for origin, goal, duration in zip(waypoints, waypoints[1:], durations):
        count = int(duration * RATE_HZ)
        for i in range(count):
            s = minimum_jerk(i / count)
            bow = 0.02 * math.sin(math.pi * s) if goal is waypoints[1] else 0.0
            samples.append((begin + i / RATE_HZ, [o + s * (g - o) for o, g in zip(origin, goal)], bow))
        begin += count / RATE_HZ
        if goal is waypoints[1]:
            samples += [(begin + i / RATE_HZ, goal, 0.0) for i in range(int(pause * RATE_HZ))]
            begin += int(pause * RATE_HZ) / RATE_HZ
    return [(t, [p[0], p[1] + bow, p[2] + bow]) for t, p, bow in samples]


def write(path, seed, button):
    """Writes one trial. The tool points down; the button's frame is turned by `seed` tenths of a radian."""
    turn = 0.1 * seed
    orientation = [0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2)]
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(COLUMNS)
        for time_s, position in press(seed, button):
            values = [time_s, *position, 1.0, 0.0, 0.0, 0.0, *button, *orientation]
            writer.writerow([f"{value:.9g}" for value in values])


def write_set(folder, buttons):
    """One trial a button; returns the files in order."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for number, button in enumerate(buttons, start=1):
        files.append(folder / f"trial{number:02}.csv")
        write(files[-1], number, button)
    return files
