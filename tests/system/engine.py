"""A Docker engine of a test's own: its networks, mounts and processes lie in namespaces that end with it.

So nothing that its containers send leaves them, and whatever happens, nothing of them stays. Only building images uses
the machine's network, for Debian's packages.
"""

import contextlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

from processes import BINARIES, ROOT, wait_for

# Images and the bare Debian below them, kept between tests.
CACHE = pathlib.Path(os.environ.get("EXEMPLAR_DOCKER", ROOT / "build" / "docker"))
SERVERS = {"learning": "127.0.0.1:50051", "recorder": "127.0.0.1:50052", "executor": "127.0.0.1:50053"}
MEMBERS = ["recorder", "learning", "executor", "simulator", "capture-vision", "capture-tactile", "gateway"]
# Where the person shows the robot a button, and where it is afterwards.
PLACES = ["0.46,-0.12", "0.40,-0.28", "0.52,-0.22", "0.36,-0.18"]
NEW_PLACE = "0.45,-0.20"
COMPOSE = ROOT / "deploy" / "compose.yaml"
NEEDED = ("dockerd", "containerd", "docker-compose", "debootstrap", "tini", "nsenter", "unshare", "iptables")


class Unavailable(Exception):
    """Why no engine can run here."""


def check():
    """Raises Unavailable where an engine cannot run."""
    missing = [name for name in NEEDED if not shutil.which(name, path="/usr/sbin:/usr/bin:/sbin:/bin")]
    if missing:
        raise Unavailable(f"not installed: {', '.join(missing)} (Debian: docker.io docker-compose debootstrap tini iptables)")
    if os.geteuid() != 0:
        raise Unavailable("needs root")


def tell(text):
    print(text, file=sys.stderr, flush=True)


def build_images():
    """The images of this build's programs, into CACHE."""
    begin = time.monotonic()
    with Engine(CACHE, alone=False) as builder:
        run(ROOT / "deploy" / "docker" / "build", "--prebuilt", BINARIES.parent, env=builder.environment, timeout=1800)
    tell(f"images: {time.monotonic() - begin:.0f} s")


class Engine:
    """dockerd with its files under `folder`; `alone`: in network, mount and process namespaces of its own."""

    def __init__(self, folder, alone):
        self.folder, self.alone = pathlib.Path(folder), alone
        self.folder.mkdir(parents=True, exist_ok=True)
        self.socket = self.folder / "docker.sock"
        self.environment = {**os.environ, "DOCKER_HOST": f"unix://{self.socket}", "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"}

    def __enter__(self):
        command = ["dockerd", "--data-root", self.folder / "data", "--exec-root", self.folder / "exec", "--pidfile", self.folder / "pid"]
        command += ["--host", f"unix://{self.socket}", "--bridge=none", "--iptables=false", "--ip6tables=false", "--cgroup-parent=/exemplar-test"]
        if self.alone:
            # A process namespace ends with its first process, and everything in it.
            isolated = ["unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", "tini", "-g", "--"]
            command = [*isolated, *command]
        for stale in ("pid", "docker.sock"):
            (self.folder / stale).unlink(missing_ok=True)
        # Containers of a run that was cut off would start again with the engine, on whatever network it has.
        for stale in ("exec", "data/containers", "data/network"):
            shutil.rmtree(self.folder / stale, ignore_errors=True)
        with open(self.folder / "dockerd.log", "w", encoding="utf-8") as log:
            self.process = subprocess.Popen([str(word) for word in command], stdout=log, stderr=log, env=self.environment)
        deadline = time.monotonic() + 60
        while subprocess.run(["docker", "version"], env=self.environment, capture_output=True, check=False).returncode != 0:
            if self.process.poll() is not None or time.monotonic() > deadline:
                tail = (self.folder / "dockerd.log").read_text(encoding="utf-8").splitlines()[-5:]
                self.__exit__()
                raise Unavailable("dockerd does not run here: " + " / ".join(tail))
            time.sleep(0.2)
        if self.alone:
            self.inside("ip", "link", "set", "lo", "up")
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            listed = subprocess.run(["docker", "ps", "-aq"], env=self.environment, capture_output=True, text=True, check=False).stdout.split()
            if listed:
                subprocess.run(["docker", "rm", "-f", "-v", *listed], env=self.environment, capture_output=True, check=False)
            # unshare hands no signal on: its child does the work.
            target = self.first() if self.alone else self.process.pid
            if target:
                subprocess.run(["kill", "-TERM", str(target)], check=False)
            try:
                self.process.wait(40)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        for group in pathlib.Path("/sys/fs/cgroup").glob("*/exemplar-test"):
            for inner in [*sorted(group.glob("*/"), reverse=True), group]:
                try:
                    inner.rmdir()
                except OSError:
                    pass

    def first(self):
        """The process that holds the namespaces, or None while there is none."""
        children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text(encoding="ascii").split()
        return children[0] if children else None

    def inside(self, *words, **more):
        """Runs a command in the engine's namespaces; its output."""
        return run("nsenter", "-t", self.first(), "-n", "-m", "-p", *words, **more)

    def docker(self, *words):
        return run("docker", *words, env=self.environment)


class Station:
    """The containers of deploy/compose.yaml, under an engine."""

    def __init__(self, engine, overrides, environment, profiles=("demo",)):
        self.engine, self.profiles = engine, [word for name in profiles for word in ("--profile", name)]
        self.files = [word for file in (COMPOSE, *overrides) for word in ("-f", file)]
        self.environment = {**engine.environment, "COMPOSE_PROJECT_NAME": "exemplar", **environment}

    def compose(self, *words, timeout=180, **environment):
        command = ["docker-compose", *self.files, *self.profiles, *words]
        return run(*command, env={**self.environment, **environment}, timeout=timeout)

    def inspect(self, service, all_of_it=False):
        name = f"exemplar_{service}_1"
        found = json.loads(self.engine.docker("inspect", name))[0]
        return found if all_of_it else found["State"]

    def healthy(self, *services):
        def well(state):
            return state["Running"] and not state["Paused"] and state.get("Health", {}).get("Status") == "healthy"

        return all(well(self.inspect(service)) for service in services)

    def up(self, services, **environment):
        self.compose("up", "-d", *services, **environment)
        wait_for(lambda: self.healthy(*services), "healthy containers", 90)

    def place(self, where=NEW_PLACE, **environment):
        """Moves the button."""
        self.compose("run", "--rm", "capture-suit", "--places", where, "--place-only", **environment)

    def teach(self, learn):
        """Brings it up, has a person teach it and submits the recordings; then `learn()`; then the robot follows commands."""
        begin = time.monotonic()
        self.compose("down", "--volumes", "--timeout", "5")
        self.up(MEMBERS, EXEMPLAR_FOLLOW="suit")
        tell(f"up and healthy: {time.monotonic() - begin:.0f} s")
        self.compose("run", "--rm", "capture-suit", "--places", ";".join(PLACES), "--record", "--name", "trial", timeout=240)
        files = [f"/trials/trial-{number:03}.mcap" for number in range(1, len(PLACES) + 1)]
        # With the image of the command line and by the gateway, as on a machine that has nothing else.
        submitted = json.loads(self.compose("run", "--rm", "exemplar", "trial", "submit", "--skill", "press", *files, "--format", "json"))
        assert len(submitted) == len(PLACES), submitted
        learn()
        self.up(MEMBERS)
        self.place()
        tell(f"taught by {len(PLACES)} trials: {time.monotonic() - begin:.0f} s")

    def show_logs(self, *services):
        for service in services:
            with contextlib.suppress(AssertionError):
                tell(self.logs(service))

    def signal(self, service, name):
        """Straight to the program, past the engine: to it the container just died."""
        self.engine.inside("kill", f"-{name}", self.inspect(service)["Pid"])

    def within(self, service, *words):
        """Runs a command of this machine in the network of a container."""
        return self.engine.inside("nsenter", "-t", self.inspect(service)["Pid"], "-n", *words)

    def logs(self, service):
        return self.compose("logs", "--no-color", "--tail", "40", service)


def run(*words, timeout=120, **more):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=timeout, check=False, **more)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(str(word) for word in words)}: exit {done.returncode}: {(done.stderr or done.stdout).strip()[-1500:]}")
    return done.stdout
