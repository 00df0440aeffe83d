"""Teaches a skill from trial files and asks it for a motion.

Usage: python 01_learn_and_query.py trial1.csv trial2.csv trial3.csv [--server HOST:PORT]
"""

import argparse

import exemplar


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("trials", nargs="+", help="CSV or MCAP files of one task")
    parser.add_argument("--server", help="HOST:PORT (default: EXEMPLAR_SERVER)")
    parser.add_argument("--skill", default="press")
    arguments = parser.parse_args()

    with exemplar.Client(arguments.server) as client:
        skill = client.skill(arguments.skill)
        for submission in skill.submit(*arguments.trials):
            trial = submission.trial
            print(
                f"{trial.source}: {trial.samples} samples, {trial.duration_s:.1f} s"
                + " (was there)" * submission.duplicate
            )

        for progress in (learning := skill.learn()):
            print(f"{100 * progress.fraction:3.0f} %  {progress.step}")
        report = learning.result()
        print(f"version {report.version}, about {report.target}, by {report.method}")

        # A place between those of the trials: the target of the first, a little aside.
        target = report.trials[0].target
        assert target is not None
        motion = skill.query(target.position + [0.01, 0.01, 0.0])
        print(f"{len(motion)} frames, {motion.duration_s:.1f} s, ends at {motion.positions[-1].round(3)}")
        for contact in motion.contacts:
            time_s = motion.time_s[contact.first]
            sigma_mm = 1000 * motion.sigma_m[contact.first]
            print(f"touches {contact.object} at {time_s:.1f} s, expected error {sigma_mm:.1f} mm")

        try:
            skill.query({"elephant": [0.5, 0.0, 0.1]})
        except exemplar.ExemplarError as error:
            print(f"{error.code}: {error.message} ({error.field})")


if __name__ == "__main__":
    main()
