"""Starts programs of the build in a folder of their own, and ends them."""

import json
import os
import pathlib
import signal
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BINARIES = pathlib.Path(os.environ.get("EXEMPLAR_BIN", ROOT / "build" / "release" / "bin"))


class Programs:
    """All of one station. `prefix` goes before each command (a namespace to run in)."""

    def __init__(self, folder, domain):
        self.folder, self.domain, self.running = folder, domain, []

    def start(self, program, *words, prefix=(), bus=True):
        command = [*prefix, BINARIES / program, *words]
        if bus:
            command += ["--domain", self.domain, "--station", "test"]
        log = open(self.folder / f"{program}-{len(self.running)}.log", "w", encoding="utf-8")
        process = subprocess.Popen([str(word) for word in command], stderr=log, stdout=log)
        log.close()
        self.running.append(process)
        return process

    def recorder(self, *words, prefix=()):
        """A recorder and the address that it listens on."""
        port_file = self.folder / f"port-{len(self.running)}"
        process = self.start("exemplar-recorder", "--listen", "127.0.0.1:0", "--port-file", port_file, "--data-dir", self.folder / "data", *words, prefix=prefix)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), "the recorder's port")
        return process, "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]

    def end(self):
        for process in self.running:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
        for process in self.running:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def logs(self):
        return "\n".join(f"{path.name}: {path.read_text()}" for path in sorted(self.folder.glob("*.log")))


def exemplar(*words, prefix=()):
    """Runs the command line; its answer in JSON."""
    command = [*prefix, BINARIES / "exemplar", *words, "--format", "json"]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=120)
    if done.returncode != 0:
        raise AssertionError(f"{words}: exit {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def wait_for(condition, what, limit_s=60):
    deadline = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"waited in vain for {what}")
        time.sleep(0.02)
