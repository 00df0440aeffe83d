"""Shows what a recording holds, and sends it again through the gateway, which was told --publish.

Usage: python 07_replay.py trial-001.mcap [--topic ircp/suit] [--rate 2] [--server HOST:PORT]
"""

import argparse
from collections import Counter

import exemplar


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("file", help="MCAP")
    parser.add_argument("--server", help="HOST:PORT of the gateway (default: EXEMPLAR_SERVER)")
    parser.add_argument("--topic", action="append", default=[], help="only these, * for any text")
    parser.add_argument("--rate", type=float, default=1.0, help="so many times faster")
    arguments = parser.parse_args()

    counts = Counter(sample.topic for sample in exemplar.read_recording(arguments.file))
    for topic, messages in sorted(counts.items()):
        print(f"{topic:28} {messages:6} messages")

    with exemplar.Client(arguments.server) as client:
        done = exemplar.replay(client, arguments.file, arguments.topic, rate=arguments.rate)
    print(f"{done.sent} sent, at most {1000 * done.late_s:.1f} ms late")


if __name__ == "__main__":
    main()
