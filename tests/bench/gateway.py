#!/usr/bin/env python3
"""The gateway under load, beside a bare reader that relays over TCP: 200 topics with 10,000 samples a second in, ten
clients of 1,000 a second each out. Both get the same load in turn, several times, in one run; then the gateway alone
has a client more that takes nothing. Prints a JSON list of rows as tests/bench/run collects them.
Run it under tests/system/run_isolated."""

import argparse
import json
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile
import time

DOMAIN = 92
CLIENTS = 10
WARM_UP_S = 1.5


def wait_for(condition, what, limit_s=20):
    deadline = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > deadline:
            raise RuntimeError(f"waited in vain for {what}")
        time.sleep(0.02)


def memory_mb(process):
    for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    raise RuntimeError("no VmRSS")


class Bench:
    def __init__(self, bin_folder, folder, seconds, rate_hz):
        self.bin, self.folder, self.seconds, self.rate_hz = bin_folder, folder, seconds, rate_hz
        self.bus = ["--domain", str(DOMAIN), "--station", "bench"]

    def start(self, program, *words, **streams):
        return subprocess.Popen([str(self.bin / program), *map(str, words)], **streams)

    def part(self, name, *words, **streams):
        return self.start("bench_gateway", "--part", name, *words, **streams)

    def serve(self, program, *words):
        """A process that listens, and its port."""
        port = self.folder / "port"
        port.unlink(missing_ok=True)
        file = "--file" if program == "bench_gateway" else "--port-file"
        process = self.start(program, *words, file, port, *self.bus)
        wait_for(lambda: port.exists() and port.read_text().strip(), program)
        return process, port.read_text().strip()

    def gateway(self):
        return self.serve("exemplar-gateway", "--log-level", "error")

    def waits_us(self, kind, server):
        """What all clients waited for their samples while the writer wrote."""
        writer = self.part("publish", "--seconds", self.seconds + WARM_UP_S + 3, "--rate-hz", self.rate_hz, *self.bus,
                           stdout=subprocess.PIPE, text=True)
        time.sleep(2)  # discovery
        clients = []
        for index in range(CLIENTS):
            clients.append(self.part(kind, "--server", server, "--index", index, "--seconds", self.seconds, "--warm-up",
                                     WARM_UP_S, "--file", self.folder / f"waits-{index}"))
        said, _ = writer.communicate()
        for client in clients:
            client.wait(20)
            if client.returncode != 0:
                raise RuntimeError(f"a client of {kind} failed")
        waits = [float(line) for index in range(CLIENTS)
                 for line in (self.folder / f"waits-{index}").read_text().splitlines()]
        said = json.loads(said)
        print(f"{kind}: {len(waits)} of about {round(self.seconds * self.rate_hz)} samples, p50 {percentile(waits, 50):.0f} us, "
              f"p99 {percentile(waits, 99):.0f} us, writer at most {said['latest_ms']:.1f} ms late, refused "
              f"{said['refused']}", file=sys.stderr)
        return waits

    def relayed(self):
        relay, port = self.serve("bench_gateway", "--part", "relay")
        try:
            return self.waits_us("tcp", port)
        finally:
            end(relay)

    def gatewayed(self, stalled=False):
        gateway, port = self.gateway()
        address = f"127.0.0.1:{port}"
        client = self.part("stalled", "--server", address) if stalled else None
        try:
            waits = self.waits_us("grpc", address)
            return waits, memory_mb(gateway)
        finally:
            if client is not None:
                end(client)
            end(gateway)


def end(process):
    process.send_signal(signal.SIGTERM)
    process.wait()


def percentile(values, percent):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * percent / 100))] if ordered else float("nan")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, required=True, metavar="DIR", help="where the programs are")
    parser.add_argument("--seconds", type=float, default=5, help="that are counted, of each reader and round")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--rate-hz", type=float, default=10000, help="of all topics together")
    arguments = parser.parse_args()
    figures = {"relay": {50: [], 99: []}, "gateway": {50: [], 99: []}}
    counts = {"relay": 0, "gateway": 0}
    memory = []
    with tempfile.TemporaryDirectory(prefix="exemplar-bench-gateway-") as name:
        bench = Bench(arguments.bin, pathlib.Path(name), arguments.seconds, arguments.rate_hz)
        for _ in range(arguments.rounds):
            relayed = bench.relayed()
            gatewayed, used = bench.gatewayed()
            memory.append(used)
            for who, waits in (("relay", relayed), ("gateway", gatewayed)):
                counts[who] += len(waits)
                for percent, all_rounds in figures[who].items():
                    all_rounds.append(percentile(waits, percent))
        _, stalled = bench.gatewayed(stalled=True)
    rows = []
    for percent in (50, 99):
        value, peer = (statistics.median(figures[who][percent]) for who in ("gateway", "relay"))
        rows.append({"name": f"gateway_p{percent}", "value": value, "unit": "us", "peer": "bare reader that relays over TCP",
                     "peer_value": peer, "ratio": value / peer})
    rows.append({"name": "gateway_delivered", "value": counts["gateway"], "unit": "samples", "peer": "by the bare relay",
                 "peer_value": counts["relay"], "ratio": counts["gateway"] / counts["relay"]})
    rows.append({"name": "gateway_memory_with_a_stalled_client", "value": stalled, "unit": "MB", "peer": "without one",
                 "peer_value": statistics.median(memory), "ratio": stalled / statistics.median(memory)})
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
