"""Records a station's topics for some seconds, marks an event, and says what was received and lost.

Usage: python 02_record.py [--recorder HOST:PORT] [--seconds 5] [--expect ircp/joint_state]
"""

import argparse
import time

import exemplar


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--recorder", help="HOST:PORT (default: EXEMPLAR_SERVER)")
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--name", default="", help="of the file (default: made from the time)")
    parser.add_argument("--expect", nargs="*", default=[], metavar="TOPIC", help="wait until these have a writer")
    arguments = parser.parse_args()

    with exemplar.Client(recorder=arguments.recorder) as client:
        recorder = client.recorder
        recorder.start(arguments.name, metadata={"operator": "example"}, expected_topics=arguments.expect)
        time.sleep(arguments.seconds / 2)
        recorder.mark_event("half time")
        time.sleep(arguments.seconds / 2)
        status = recorder.stop()

    print(f"{status.file}: {status.messages} messages, {status.bytes / 1e6:.1f} MB in {status.duration_s:.1f} s")
    for topic in status.topics:
        print(f"  {topic.topic:24} {topic.rate_hz:6.1f} Hz  received {topic.received}, lost {topic.lost}")


if __name__ == "__main__":
    main()
