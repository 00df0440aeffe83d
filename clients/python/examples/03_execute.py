"""Carries a skill out on the robot of the station: plans, moves, and says how it went.

Usage: python 03_execute.py press --object target=0.55,-0.15,0.05 [--executor HOST:PORT] [--speed 0.5]
"""

import argparse
import sys

import exemplar


def named_pose(word: str) -> tuple[str, list[float]]:
    name, _, numbers = word.partition("=")
    return name, [float(number) for number in numbers.split(",")]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("skill")
    parser.add_argument("--object", action="append", type=named_pose, default=[], metavar="NAME=x,y,z[,qx,qy,qz,qw]")
    parser.add_argument("--executor", help="HOST:PORT (default: EXEMPLAR_SERVER)")
    parser.add_argument("--speed", type=float, default=1.0)
    arguments = parser.parse_args()
    # Without --object, the objects are taken where the cameras see them now.
    objects = dict(arguments.object) or None

    with exemplar.Client(executor=arguments.executor) as client:
        try:
            plan = client.robot.plan(arguments.skill, objects, speed=arguments.speed)
        except exemplar.FailedPreconditionError as refused:
            sys.exit(f"refused: {refused}")
        print(f"{plan.duration_s:.1f} s, clearance {1000 * plan.clearance_m:.0f} mm ({plan.clearance_between})")

        # Leaving the block before the end, with an exception or Ctrl-C, slows the robot down and holds it.
        with client.robot.execute(arguments.skill, objects, speed=arguments.speed) as execution:
            for feedback in execution:
                print(f"{feedback.state:10} {feedback.time_s:5.1f} of {feedback.duration_s:.1f} s")
            result = execution.result()

    print(f"{result.state} {result.detail}".strip())
    if result.contact_error_m is not None:
        print(f"contact met to {1000 * result.contact_error_m:.1f} mm, {result.touch_max_n:.1f} N")
    sys.exit(0 if result.done else 1)


if __name__ == "__main__":
    main()
