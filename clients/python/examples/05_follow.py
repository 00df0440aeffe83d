"""Presses a button that moves: the robot meets it where it will be.

Usage: python 05_follow.py press target [--executor HOST:PORT] [--watch 1]
"""

import argparse
import sys
import time

import numpy as np

import exemplar


def seen(client: exemplar.Client, name: str) -> exemplar.SeenObject:
    """The object as the executor hears of it on ircp/objects."""
    for one in client.robot.status().objects:
        if one.name == name:
            return one
    sys.exit(f"{name} is not seen")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("skill")
    parser.add_argument("target", help="name of the object that moves")
    parser.add_argument("--executor", help="HOST:PORT (default: EXEMPLAR_SERVER)")
    parser.add_argument("--watch", type=float, default=1.0, help="seconds to watch it first")
    arguments = parser.parse_args()

    with exemplar.Client(executor=arguments.executor) as client:
        before, began = seen(client, arguments.target).pose.position, time.monotonic()
        time.sleep(arguments.watch)
        way = seen(client, arguments.target).pose.position - before
        speed = np.linalg.norm(way) / (time.monotonic() - began)
        print(f"{arguments.target} moves at {1000 * speed:.0f} mm/s")

        try:
            with client.robot.execute(arguments.skill, follow=True) as execution:
                for feedback in execution:
                    print(f"{feedback.state:10} {feedback.time_s:5.1f} of {feedback.duration_s:.1f} s")
                result = execution.result()
        except exemplar.FailedPreconditionError as refused:
            sys.exit(f"refused: {refused}")
    print(f"{result.state} {result.detail}".strip())
    sys.exit(0 if result.done else 1)


if __name__ == "__main__":
    main()
