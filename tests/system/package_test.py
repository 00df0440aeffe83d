"""The Debian packages on a Debian that has nothing else: installed by apt, the units' commands started, a query answered.

The packages are made of the build folder; they are installed in a container (engine.py), with the machine's network for Debian's own
packages, and run in one that has no network but loopback. Exit code 77: no engine runs here.
"""

import json
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
from engine import CACHE, ROOT, Engine, run
from processes import BINARIES, wait_for

UNITS = ["recorder", "learning", "executor", "capture-tactile", "capture-vision", "simulator", "gateway"]
IMAGE = "exemplar/installed-packages:test"
NAME = "exemplar-packages"
SYSTEMD = "exemplar-systemd"
# systemd as the first process of a container: the little of cgroups that it may have there, it must be able to write.
BOOT = "mount -o remount,rw /sys/fs/cgroup; for each in /sys/fs/cgroup/*; do mount -o remount,rw $each; done 2>/dev/null; exec /lib/systemd/systemd"


class PackageTest(unittest.TestCase):
    installed = False

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

    @classmethod
    def install(cls):
        """Makes the image of a Debian on which the packages are installed, once."""
        if cls.installed:
            return
        with Engine(CACHE, alone=False) as docker:
            run(ROOT / "deploy" / "docker" / "base-image", "--folder", CACHE, env=docker.environment, timeout=600)
            for old in (("rm", "-f", NAME), ("image", "rm", "-f", IMAGE)):
                subprocess.run(["docker", *old], env=docker.environment, capture_output=True, check=False)
            packages = "systemd /packages/exemplar-*.deb"
            script = f"apt-get update -q && DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends {packages}"
            begin = time.monotonic()
            words = ["docker", "run", "--name", NAME, "--volume", f"{cls.folder}:/packages", "--network", "host"]
            run(*words, "debian:bookworm-slim", "sh", "-c", script, env=docker.environment, timeout=900)
            print(f"installed by apt: {time.monotonic() - begin:.0f} s", file=sys.stderr)
            docker.docker("commit", NAME, IMAGE)
            docker.docker("rm", NAME)
        cls.installed = True

    def test_installed_services_start_as_their_units_say_and_answer_a_query(self):
        self.install()
        with Engine(CACHE, alone=True) as docker:
            words = ["docker", "run", "--name", NAME, "--volume", f"{self.folder}:/packages", "--detach", "--network", "none"]
            run(*words, IMAGE, "sleep", "infinity", env=docker.environment)
            try:
                self.start_all(docker)
            finally:
                docker.docker("rm", "-f", NAME)

    def test_systemd_starts_the_units_and_starts_again_who_dies_or_hangs(self):
        self.install()
        with Engine(CACHE, alone=True) as docker:
            words = ["docker", "run", "--name", SYSTEMD, "--detach", "--network", "none", "--cgroupns", "private", "--cap-add", "SYS_ADMIN"]
            words += [f"--security-opt={option}=unconfined" for option in ("seccomp", "apparmor", "systempaths")]
            words += ["--tmpfs", "/run", "--tmpfs", "/run/lock", "--tmpfs", "/tmp:exec", "--env", "container=docker", IMAGE, "sh", "-c", BOOT]
            try:
                run(*words, env=docker.environment)
                wait_for(lambda: self.says(docker, "is-system-running") in ("running", "degraded"), "systemd to be up", 60)
            except AssertionError as reason:
                self.skipTest(f"systemd does not run in a container here: {reason}")
            try:
                self.supervise(docker)
            finally:
                docker.docker("rm", "-f", SYSTEMD)

    def supervise(self, docker):
        names = [f"exemplar-{unit}" for unit in UNITS]
        for name in names:
            started = subprocess.run(["docker", "exec", SYSTEMD, "systemctl", "start", name], env=docker.environment, capture_output=True, text=True, check=False)
            self.assertEqual(self.says(docker, "is-active", name), "active", started.stderr + self.says(docker, "status", "--no-pager", "--lines=20", name))
        for name, signal in (("exemplar-recorder", "KILL"), ("exemplar-learning", "STOP")):
            first = self.says(docker, "show", "--property=MainPID", "--value", name)
            begin = time.monotonic()
            docker.docker("exec", SYSTEMD, "systemctl", "kill", "--kill-whom=main", f"--signal=SIG{signal}", name)
            well = lambda: self.says(docker, "is-active", name) == "active" and self.says(docker, "show", "--property=MainPID", "--value", name) != first
            wait_for(well, f"systemd to start {name} again", 90)
            print(f"SIG{signal} to {name}: runs again after {time.monotonic() - begin:.1f} s", file=sys.stderr)
            self.assertEqual(self.says(docker, "show", "--property=NRestarts", "--value", name), "1")
        begin = time.monotonic()
        docker.docker("exec", SYSTEMD, "systemctl", "stop", *names)
        results = {name: self.says(docker, "show", "--property=Result", "--value", name) for name in names}
        print(f"stopped in {time.monotonic() - begin:.1f} s", file=sys.stderr)
        self.assertEqual(set(results.values()), {"success"}, results)

    @staticmethod
    def says(docker, *words):
        done = subprocess.run(["docker", "exec", SYSTEMD, "systemctl", *words], env=docker.environment, capture_output=True, text=True, check=False)
        return (done.stdout or done.stderr).strip()

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
