"""Starts Exemplar's programs, talks to them by the command line, and ends them cleanly."""

import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import time


class Failure(Exception):
    """Something went wrong that a person can read about."""


class Process:
    """A program of Exemplar in the background; its log goes to a file."""

    def __init__(self, binary, arguments, log, needs_port=False, port=0):
        self.name = binary.name
        self.log = log
        self.port_file = log.with_suffix(".port") if needs_port else None
        if self.port_file:
            self.port_file.unlink(missing_ok=True)
            arguments = [*arguments, "--listen", f"127.0.0.1:{port}", "--port-file", str(self.port_file)]
        self._stderr = open(log, "ab")
        self._process = subprocess.Popen(
            [str(binary), *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=self._stderr, stderr=self._stderr
        )

    def address(self, timeout_s=60):
        """HOST:PORT of its gRPC server, once it listens."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            self.check_alive()
            if self.port_file.exists() and self.port_file.read_text().strip():
                return f"127.0.0.1:{self.port_file.read_text().strip()}"
            time.sleep(0.02)
        raise Failure(f"{self.name} did not listen within {timeout_s} s:\n{self.tail()}")

    def tail(self, lines=15):
        return "\n".join(self.log.read_text(errors="replace").splitlines()[-lines:])

    def check_alive(self):
        if self._process.poll() is not None:
            raise Failure(f"{self.name} ended with {self._process.returncode}:\n{self.tail()}")

    def alive(self):
        return self._process.poll() is None

    def wait(self, timeout_s):
        try:
            code = self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            self.stop()
            raise Failure(f"{self.name} did not end within {timeout_s:.0f} s:\n{self.tail()}") from None
        if code != 0:
            raise Failure(f"{self.name} ended with {code}:\n{self.tail()}")

    def stop(self, grace_s=10):
        """SIGTERM, then SIGKILL; returns whether it ended by itself with success."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
            try:
                self._process.wait(grace_s)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
                return False
        self._stderr.close()
        return self._process.returncode == 0


class Secured:
    """A station's certificates and permissions, made by `exemplar security`, and what each program is told of them."""

    ROLES = {"simulator": "robot", "capture-suit": "capture", "capture-vision": "capture", "capture-tactile": "capture"}
    SERVERS = ("recorder", "learning", "executor", "gateway")
    CLIENTS = ("executor", "gateway")

    def __init__(self, exemplar, folder, station):
        self.exemplar, self.folder = exemplar, folder
        self._run("init", folder, "--station", station)
        self._run("issue", folder, "operator", "--role", "person", "--call", "administer")

    def _run(self, *words):
        done = subprocess.run([str(word) for word in (self.exemplar, "security", *words)], capture_output=True, text=True, timeout=60)
        if done.returncode != 0:
            raise Failure(f"exemplar security {words[0]}: {done.stderr.strip()}")

    def member(self, name):
        return self.folder / "members" / name

    def options(self, program, bus):
        """The options of `program`, whose certificate is made when it is first asked for."""
        member = self.member(program)
        if not member.exists():
            self._run("issue", self.folder, program, "--role", self.ROLES.get(program, program))
        words = ["--security", member] if bus else []
        if program in self.SERVERS:
            words += ["--tls-cert", member / "cert.pem", "--tls-key", member / "key.pem", "--tls-client-ca", member / "ca.pem"]
            words += ["--access", self.folder / "access.yaml"]
        if program in self.CLIENTS:
            words += ["--tls-ca", member / "ca.pem"]
        return words

    def cli_options(self):
        member = self.member("operator")
        return ["--tls-ca", member / "ca.pem", "--tls-cert", member / "cert.pem", "--tls-key", member / "key.pem"]


class System:
    """All processes of one run, in one station and domain, with their files under `folder`."""

    def __init__(self, binaries, folder, domain, station, secured=False):
        self.binaries = pathlib.Path(binaries)
        self.folder = pathlib.Path(folder)
        self.logs = self.folder / "logs"
        self.logs.mkdir(parents=True, exist_ok=True)
        self.bus = ["--domain", str(domain), "--station", station]
        self.secured = Secured(self.binaries / "exemplar", self.folder / "security", station) if secured else None
        self.processes = []

    def start(self, program, *arguments, server=False, port=0, bus=True):
        if self.secured:
            arguments = (*self.secured.options(program, bus), *arguments)
        if bus:
            arguments = (*self.bus, *arguments)
        process = Process(self.binaries / f"exemplar-{program}", arguments, self.logs / f"{program}.log", server, port)
        self.processes.append(process)
        return process

    def cli(self, server, *arguments, timeout_s=300, as_json=True, stderr=None):
        """Runs the command line; returns its JSON output (or text)."""
        command = [str(self.binaries / "exemplar"), "--server", server, "--timeout", str(timeout_s)]
        command += [str(word) for word in self.secured.cli_options()] if self.secured else []
        command += [*map(str, arguments), *(["--format", "json"] if as_json else [])]
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=stderr or subprocess.PIPE, text=True, timeout=timeout_s + 30
        )
        if done.returncode != 0:
            raise Failure(f"exemplar {' '.join(map(str, arguments))}: exit code {done.returncode}: {(done.stderr or '').strip()}")
        if not as_json:
            return done.stdout
        try:
            return json.loads(done.stdout)
        except json.JSONDecodeError as error:
            raise Failure(f"exemplar {' '.join(map(str, arguments))} printed no JSON ({error}): {done.stdout[:200]}") from None

    def stop(self):
        """Ends all processes, last started first; names those that did not end well."""
        unclean = []
        for process in reversed(self.processes):
            if not process.stop():
                unclean.append(process.name)
        self.processes.clear()
        return unclean


def free_port():
    """A port that nobody listens on now, for a program that others must know before it runs."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def is_free(port):
    """Whether a program could listen on this port of loopback now."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True


def wait_until(what, condition, timeout_s, interval_s=0.1):
    """Polls `condition` until it returns something true, and returns that."""
    deadline = time.monotonic() + timeout_s
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise Failure(f"waited {timeout_s:.0f} s for {what}, in vain")
        time.sleep(interval_s)


class Narrator:
    """What a person reads on stderr while it runs."""

    def __init__(self):
        self.colour = sys.stderr.isatty() and not os.environ.get("NO_COLOR")
        self.started = time.monotonic()

    def _print(self, mark, text):
        print(f"{mark} {text}", file=sys.stderr, flush=True)

    def step(self, text):
        mark = f"[{time.monotonic() - self.started:5.1f} s]"
        self._print(f"\033[1;36m{mark}\033[0m" if self.colour else mark, text)

    def detail(self, text):
        for line in text.splitlines():
            self._print(" " * 9, line)
