#!/usr/bin/env python3
"""The recorder under load, beside a bare raw reader that throws samples away: a 42-joint suit and 50 touch
sensors at 1 kHz, two cameras of 640 x 480 at 30 Hz, 200 small topics at 100 Hz. Both get the same load in turn,
several times, in one run. Prints a JSON list of rows as tests/bench/run collects them.
Run it under tests/system/run_isolated."""

import argparse
import json
import os
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile
import time

DOMAIN = 91


def cpu_s(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Bench:
    def __init__(self, bin_folder, folder, seconds):
        self.bin, self.folder, self.seconds = bin_folder, folder, seconds
        self.bus = ["--domain", str(DOMAIN), "--station", "bench"]

    def start(self, program, *words, **streams):
        return subprocess.Popen([str(self.bin / program), *map(str, words)], **streams)

    def exemplar(self, *words):
        done = subprocess.run([str(self.bin / "exemplar"), *map(str, words), "--format", "json"], check=True,
                              stdout=subprocess.PIPE, text=True)
        return json.loads(done.stdout)

    def publish(self, reader):
        """What was sent, and the CPU seconds that the reader needed for it."""
        before = cpu_s(reader)
        publisher = self.start("bench_recording", "--part", "publish", "--seconds", self.seconds, *self.bus,
                               stdout=subprocess.PIPE, text=True)
        said, _ = publisher.communicate()
        if publisher.returncode != 0:
            raise RuntimeError("the publisher failed")
        return json.loads(said), cpu_s(reader) - before

    def drained(self):
        ready = self.folder / "ready"
        ready.unlink(missing_ok=True)
        reader = self.start("bench_recording", "--part", "drain", "--ready-file", ready, *self.bus,
                            stdout=subprocess.PIPE, text=True)
        wait_for(ready.exists, "the bare reader")
        said, cpu = self.publish(reader)
        reader.send_signal(signal.SIGTERM)
        received, _ = reader.communicate()
        return said, cpu, json.loads(received)

    def recorded(self, name):
        port = self.folder / "port"
        port.unlink(missing_ok=True)
        recorder = self.start("exemplar-recorder", "--data-dir", self.folder, "--port-file", port, "--log-level",
                              "error", "--pre-buffer-s", 0, *self.bus)
        wait_for(lambda: port.exists() and port.read_text().strip(), "the recorder")
        server = ["--server", "127.0.0.1:" + port.read_text().strip().rsplit(":", 1)[-1]]
        self.exemplar("record", "start", "--name", name, *server)
        said, cpu = self.publish(recorder)
        status = self.exemplar("record", "stop", *server)
        info = self.exemplar("record", "info", self.folder / f"{name}.mcap")
        recorder.send_signal(signal.SIGTERM)
        recorder.wait()
        (self.folder / f"{name}.mcap").unlink()
        return said, cpu, status, info


def wait_for(condition, what, limit_s=20):
    deadline = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > deadline:
            raise RuntimeError(f"waited in vain for {what}")
        time.sleep(0.02)


def counted(info):
    """Messages of a recording by topic, the small ones together."""
    counts = {}
    for topic in info["topics"]:
        name = "small" if topic["topic"].startswith("ircp/bench/") else topic["topic"]
        counts[name] = counts.get(name, 0) + topic["messages"]
    return counts


def load(bench, rounds):
    bare_us, recorder_us, missing, lost, sent_total = [], [], 0, 0, 0
    for number in range(rounds):
        said, cpu, received = bench.drained()
        bare_us.append(1e6 * cpu / received["received"])
        print(f"bare reader: {cpu:.2f} CPU s of {said['seconds']:.1f} s, {received}, publisher at most "
              f"{said['latest_ms']:.1f} ms late", file=sys.stderr)
        said, cpu, status, info = bench.recorded(f"load-{number}")
        counts = counted(info)
        recorder_us.append(1e6 * cpu / sum(counts.values()))
        sent = {topic: count for topic, count in said["sent"].items() if topic != "refused"}
        absent = {topic: count - counts.get(topic, 0) for topic, count in sent.items()}
        of_round = sum(loss["lost_in_gaps"] + loss["lost_at_end"] + loss["dropped_by_recorder"] for loss in info["losses"])
        print(f"recorder: {cpu:.2f} CPU s of {said['seconds']:.1f} s, sent {sent}, absent {absent}, said lost {of_round}, "
              f"{info['bytes'] / 1e6:.1f} MB, publisher at most {said['latest_ms']:.1f} ms late, refused "
              f"{said['sent']['refused']}", file=sys.stderr)
        missing += sum(absent.values()) + said["sent"]["refused"]
        lost += of_round
        sent_total += sum(sent.values())
    recorder, bare = statistics.median(recorder_us), statistics.median(bare_us)
    return [
        {"name": "recorder_cpu", "value": recorder, "unit": "us/sample", "peer": "raw reader that throws samples away",
         "peer_value": bare, "ratio": recorder / bare},
        {"name": "recorder_missing", "value": missing, "unit": "samples", "peer": "sent by the load's writers",
         "peer_value": sent_total, "ratio": missing / sent_total},
        {"name": "recorder_said_lost", "value": lost, "unit": "samples", "peer": "found missing in the files",
         "peer_value": missing, "ratio": lost / missing if missing else float(lost == 0)},
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, required=True, metavar="DIR", help="where the programs are")
    parser.add_argument("--seconds", type=float, default=10, help="of load, for each reader and round")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", choices=["codec", "load"])
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory(prefix="exemplar-bench-recording-") as name:
        folder = pathlib.Path(name)
        if arguments.only != "load":
            codec = [arguments.bin / "bench_recording", "--part", "codec", "--folder", folder]
            rows += json.loads(subprocess.run([str(word) for word in codec], check=True, stdout=subprocess.PIPE).stdout)
        if arguments.only != "codec":
            rows += load(Bench(arguments.bin, folder, arguments.seconds), arguments.rounds)
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
