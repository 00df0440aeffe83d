"""Shows a station's topics and then the samples of one of them, through the gateway.

Usage: python 04_topics.py ircp/joint_state [--server HOST:PORT] [--samples 10] [--rate 5]
"""

import argparse

import exemplar


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("topic")
    parser.add_argument("--server", help="HOST:PORT of the gateway (default: EXEMPLAR_SERVER)")
    parser.add_argument("--samples", type=int, default=10)
    parser.add_argument("--rate", type=float, default=0.0, help="at most so many a second of each writer")
    arguments = parser.parse_args()

    with exemplar.Client(arguments.server) as client:
        for info in client.topics.list():
            print(f"{info.topic:28} {info.rate_hz:6.1f} Hz  lost {info.lost}  writers {info.writers}  {info.type}")
        with client.topics.subscribe(arguments.topic, max_rate_hz=arguments.rate) as samples:
            for _, sample in zip(range(arguments.samples), samples, strict=False):
                print(sample.topic, sample.sequence, sample.value if sample.value is not None else sample.error)
            print(f"{samples.missed} missed")


if __name__ == "__main__":
    main()
