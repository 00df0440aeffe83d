"""Lets the robot follow a person's suit, shows what it does and why it holds, and ends it.

Usage: python 06_teleoperate.py [--executor HOST:PORT] [--touch target] [--follow-for 10]

Whoever wears the suit holds the dead-man: `exemplar-capture-suit --dead-man`. This program presses nothing.
"""

import argparse
import sys

import exemplar


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--executor", help="HOST:PORT (default: EXEMPLAR_SERVER)")
    parser.add_argument("--touch", nargs="*", default=[], metavar="OBJECT", help="what the robot may touch")
    parser.add_argument("--follow-for", type=float, default=10.0, help="seconds that the robot follows, then it ends")
    arguments = parser.parse_args()

    # Leaving the block before the end, with an exception or Ctrl-C, holds the robot and ends the mode.
    with (
        exemplar.Client(executor=arguments.executor) as client,
        client.robot.teleoperate(touch=arguments.touch) as teleoperation,
    ):
        phase, began_s = "", None
        for feedback in teleoperation:
            if feedback.phase != phase:
                phase = feedback.phase
                print(f"{feedback.time_s:6.1f} s  {phase}  {feedback.detail}".rstrip())
            if phase == "following" and began_s is None:
                began_s = feedback.time_s
            if began_s is not None and feedback.time_s - began_s >= arguments.follow_for:
                client.robot.end_teleoperation()
                began_s = float("inf")
        result = teleoperation.result()
    print(f"{result.state} {result.detail}".strip())
    print(f"followed for {result.following_s:.1f} s, {result.commands_sent} commands, held {result.holds} times")
    sys.exit(0 if result.done else 1)


if __name__ == "__main__":
    main()
