"""The Debian packages on a Debian that has nothing else: installed by apt, the units' commands started, a query answered.

The packages are made of the build folder; they are installed in a container (engine.py), with the machine's network for Debian's own
packages, and run in one that has no network but loopback. Exit code 77: no engine runs here.
"""

import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import unittest

import engine
import trials
from engine import ROOT, Engine, run
from processes import BINARIES, wait_for

CACHE = pathlib.Path(os.environ.get("EXEMPLAR_DOCKER", ROOT / "build" / "docker"))
UNITS = ["recorder", "learning", "executor", "capture-tactile", "capture-vision", "simulator", "gateway"]
IMAGE = "exemplar/installed-packages:test"
NAME = "exemplar-packages"


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-packages-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.folder.chmod(0o777)
        for old in (BINARIES.parent / "packages").glob("*.deb"):
            old.unlink()
        cls.packages = [pathlib.Path(line) for line in run(ROOT / "deploy" / "package", BINARIES.parent, timeout=1800).split()]
        for package in cls.packages:
            shutil.copy(package, cls.folder)
        trials.write_set(cls.folder / "trials", [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06)])

    def test_the_packages_hold_what_belongs_into_each(self):
        names = {}
        for package in self.packages:
            fields = run("dpkg-deb", "--field", package, "Package", "Depends", "Version")
            name = re.search(r"^Package: (.+)$", fields, re.MULTILINE)[1]
            names[name] = (fields, run("dpkg-deb", "--contents", package))
        self.assertEqual(set(names), {"exemplar-services", "exemplar-clients", "libexemplar-dev"})
        fields, files = names["exemplar-services"]
        for unit in UNITS:
            self.assertIn(f"/usr/bin/exemplar-{unit}\n", files)
            self.assertIn(f"/usr/lib/systemd/system/exemplar-{unit}.service\n", files)
            self.assertIn(f"/etc/exemplar/{unit}.yaml\n", files)
        self.assertIn("libfastrtps2.9", fields)
        self.assertIn("./usr/bin/exemplar\n", names["exemplar-clients"][1])
        self.assertRegex(names["libexemplar-dev"][1], r"/usr/include/exemplar/\S+\.hpp")
        self.assertIn(".proto\n", names["libexemplar-dev"][1])

    def test_systemd_takes_the_units(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("systemd is not installed")
        root = self.folder / "root"
        for package in self.packages:
            run("dpkg-deb", "--extract", package, root)
        units = sorted((root / "usr/lib/systemd/system").glob("*.service"))
        self.assertEqual(len(units), len(UNITS))
        done = subprocess.run(["systemd-analyze", "verify", f"--root={root}", "--man=no", *(unit.name for unit in units)], capture_output=True, text=True, check=False)
        # A bare tree has no targets to order against and no user; nothing may be said of our units' own lines.
        complaints = [line for line in done.stderr.splitlines() if re.search(r"exemplar-\S+\.service:\d+:|Unknown|not executable", line)]
        self.assertEqual(complaints, [])

    def test_installed_services_start_as_their_units_say_and_answer_a_query(self):
        with Engine(CACHE, alone=False) as docker:
            run(ROOT / "deploy" / "docker" / "base-image", "--folder", CACHE, env=docker.environment, timeout=600)
            subprocess.run(["docker", "rm", "-f", NAME], env=docker.environment, capture_output=True, check=False)
            install = "apt-get update -q && DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends /packages/exemplar-*.deb"
            base = ["docker", "run", "--name", NAME, "--volume", f"{self.folder}:/packages"]
            begin = time.monotonic()
            run(*base, "--network", "host", "debian:bookworm-slim", "sh", "-c", install, env=docker.environment, timeout=900)
            print(f"installed by apt: {time.monotonic() - begin:.0f} s", file=sys.stderr)
            docker.docker("commit", NAME, IMAGE)
            docker.docker("rm", NAME)
        with Engine(CACHE, alone=True) as docker:
            run(*base, "--detach", "--network", "none", IMAGE, "sleep", "infinity", env=docker.environment)
            try:
                self.start_all(docker)
            finally:
                docker.docker("rm", "-f", NAME)
                docker.docker("image", "rm", "-f", IMAGE)

    def start_all(self, docker):
        running = {}
        for unit in UNITS:
            running[unit] = self.start(docker, unit)
        for unit, (process, heard, _) in running.items():
            heard.settimeout(30)
            messages = {heard.recv(64).decode() for _ in range(2)}
            self.assertEqual(messages, {"READY=1", "WATCHDOG=1"}, unit)
            self.assertIsNone(process.poll(), unit)
            self.inside(docker, f"exemplar-{unit}", "--check", "--config", f"/etc/exemplar/{unit}.yaml")
        files = sorted(f"/packages/trials/{file.name}" for file in (self.folder / "trials").glob("*.csv"))
        cli = ("exemplar", "--server", "127.0.0.1:50051")
        self.inside(docker, *cli, "trial", "submit", "--skill", "press", *files)
        self.inside(docker, *cli, "skill", "learn", "press")
        answer = json.loads(self.inside(docker, *cli, "skill", "query", "press", "--object", "target=0.57,-0.15,0.06", "--format", "json"))
        self.assertGreater(len(answer["time_s"]), 100)
        wait_for(lambda: json.loads(self.inside(docker, "exemplar", "--server", "127.0.0.1:50053", "robot", "status", "--format", "json"))["joint_names"], "the robot's state")
        for unit, (process, heard, number) in running.items():
            self.inside(docker, "sh", "-c", f"kill -TERM {number()}")
            out, _ = process.communicate(timeout=20)
            self.assertEqual(process.returncode, 0, f"{unit}: {out}")
            heard.close()

    def start(self, docker, unit):
        """The unit's command, as systemd would start it: its process, what it tells systemd, its number inside."""
        text = docker.docker("exec", NAME, "cat", f"/usr/lib/systemd/system/exemplar-{unit}.service")
        value = lambda key: re.search(rf"^{key}=(.+)$", text, re.MULTILINE)[1]
        heard = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        heard.bind(str(self.folder / f"{unit}.notify"))
        (self.folder / f"{unit}.notify").chmod(0o777)
        docker.docker("exec", NAME, "install", "-d", "-o", value("User"), "-g", value("Group"), f"/var/lib/{value('StateDirectory')}")
        command = ["docker", "exec", "--user", value("User"), "--workdir", value("WorkingDirectory")]
        command += ["--env", f"NOTIFY_SOCKET=/packages/{unit}.notify", "--env", f"WATCHDOG_USEC={int(value('WatchdogSec')) * 1_000_000}"]
        command += [NAME, "sh", "-c", f"echo $$ > /packages/{unit}.pid; exec {value('ExecStart')}"]
        process = subprocess.Popen(command, env=docker.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        return process, heard, lambda: (self.folder / f"{unit}.pid").read_text(encoding="ascii").strip()

    def inside(self, docker, *words):
        return docker.docker("exec", NAME, *words)


if __name__ == "__main__":
    try:
        engine.check()
    except engine.Unavailable as reason:
        print(f"skipped: {reason}", file=sys.stderr)
        sys.exit(77)
    unittest.main()
