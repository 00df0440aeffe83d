"""The whole road with DDS-Security, mutual TLS and roles, by real processes, and what a listener on the wire sees of it.

Runs in a network namespace of its own (made by run_isolated). Shared memory is closed to the programs, so that all that they
say crosses the wire, and a packet socket keeps every packet of loopback.
"""

import ctypes
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

import trials
from processes import wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
BINARIES = pathlib.Path(os.environ.get("EXEMPLAR_BIN", ROOT / "build" / "release" / "bin"))
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06), (0.66, -0.22, 0.06)]
TOPICS = [b"ircp/suit", b"ircp/end_effector", b"ircp/objects", b"ircp/joint_state", b"ircp/joint_command", b"ircp/recorder/status", b"ircp/clock"]
# Of the payload: the object's name, joints, and the types that writers announce.
PAYLOAD = [b"target\0", b"exemplar::ircp::v1", b"struct ", b"joint_1", b"executing"]
# Of gRPC in plain text: names of methods.
CALLS = [b"exemplar.v1."]
ETH_P_ALL = 3


def close_shared_memory():
    """Mounts a full /dev/shm, in a mount namespace of our own: the programs then use the network."""
    libc = ctypes.CDLL(None, use_errno=True)
    clone_newns, ms_rec, ms_private = 0x20000, 0x4000, 1 << 18
    if libc.unshare(clone_newns) != 0 or libc.mount(b"none", b"/", None, ms_rec | ms_private, None) != 0:
        raise OSError(ctypes.get_errno(), "unshare")
    if libc.mount(b"none", b"/dev/shm", b"tmpfs", 0, b"size=4096") != 0:
        raise OSError(ctypes.get_errno(), "mount")
    pathlib.Path("/dev/shm/full").write_bytes(bytes(4096))


class Wire:
    """Every packet of loopback from now on."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_ALL))
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 64 << 20)
        self.socket.bind(("lo", 0))
        self.socket.settimeout(0.2)
        self.packets, self.done = [], False
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def _run(self):
        while not self.done:
            try:
                self.packets.append(self.socket.recv(1 << 16))
            except TimeoutError:
                continue

    def stop(self):
        self.done = True
        self.thread.join()
        self.socket.close()
        return self.packets


def demo(folder, files, *options):
    command = [sys.executable, ROOT / "deploy" / "lib" / "demo.py", "--headless", "--bin", BINARIES, "--rate", "3", "--keep", folder]
    command += ["--domain", "92", *options, "--trials", *files]
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=500)


def seen(packets, words):
    """Which of `words` stand in a packet in the clear."""
    return {word for word in words if any(word in packet for packet in packets)}


class SecuredTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-secured-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.files = trials.write_set(cls.folder / "trials", BUTTONS)
        close_shared_memory()
        wire = Wire()
        cls.ran = demo(cls.folder / "demo", cls.files, "--secured")
        cls.packets = wire.stop()
        # Permissions cross in clear while two participants greet each other, as DDS-Security has it.
        cls.greetings = [packet for packet in cls.packets if b"<permissions>" in packet or b"multipart/signed" in packet]
        cls.others = [packet for packet in cls.packets if b"<permissions>" not in packet and b"multipart/signed" not in packet]

    def test_the_whole_road_passes(self):
        self.assertTrue(self.ran.stdout, self.ran.stderr)
        figures = json.loads(self.ran.stdout.splitlines()[-1])
        self.assertTrue(figures["passed"], self.ran.stderr)
        self.assertEqual(figures["topics"]["ircp/joint_command"]["lost"], 0)

    def test_the_wire_shows_no_payload_and_no_topic_outside_the_permissions(self):
        self.assertGreater(len(self.packets), 5000)
        self.assertTrue(self.greetings)
        self.assertEqual(seen(self.packets, PAYLOAD), set())
        self.assertEqual(seen(self.others, TOPICS), set())
        self.assertEqual(seen(self.packets, CALLS), set())

    def test_the_same_listener_sees_all_of_an_open_station(self):
        wire = Wire()
        folder = self.folder / "open"
        folder.mkdir()
        port = folder / "port"
        recorder = subprocess.Popen(
            [BINARIES / "exemplar-recorder", "--domain", "93", "--data-dir", folder, "--listen", "127.0.0.1:0", "--port-file", port],
            stderr=subprocess.DEVNULL,
        )
        wait_for(port.exists, "the recorder")
        capture = [BINARIES / "exemplar-capture-suit", "--domain", "93", "--replay", self.files[0], "--rate", "4", "--record"]
        done = subprocess.run(capture, capture_output=True, text=True, timeout=90)
        recorder.send_signal(signal.SIGTERM)
        recorder.wait(60)
        packets = wire.stop()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLessEqual({b"ircp/end_effector", b"ircp/objects", b"ircp/recorder/status"}, seen(packets, TOPICS))
        self.assertLessEqual({b"target\0", b"exemplar::ircp::v1", b"struct "}, seen(packets, PAYLOAD))

    def test_the_commands_of_the_page_work(self):
        page = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
        blocks = re.findall(r"^```sh\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
        commands = [line for block in blocks for line in block.splitlines() if line.startswith("exemplar ")]
        self.assertGreater(len(commands), 10)
        folder = self.folder / "page"
        folder.mkdir()
        for command in commands:
            done = subprocess.run([BINARIES / "exemplar", *shlex.split(command)[1:]], cwd=folder, capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 0, f"{command}: {done.stderr}")

    def test_the_pages_packet_filter_keeps_strangers_from_the_stations_ports(self):
        if not shutil.which("nft"):
            self.skipTest("nftables is not installed")
        page = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
        member, other, stranger = "10.0.7.11", "10.0.7.19", "10.0.7.66"
        for address in (member, other, stranger):
            subprocess.run(["ip", "address", "add", f"{address}/32", "dev", "lo"], check=True)

        def arrives(source, port):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as to, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as of:
                to.bind((member, port))
                to.settimeout(0.3)
                of.bind((source, 0))
                of.sendto(b"RTPS", (member, port))
                try:
                    return to.recv(16) == b"RTPS"
                except TimeoutError:
                    return False

        self.assertTrue(arrives(stranger, 7410))
        rules = re.findall(r"^nft .*", page, re.MULTILINE)
        self.assertEqual(len(rules), 3)
        for rule in rules:
            subprocess.run(shlex.split(rule), check=True)
        try:
            self.assertEqual([arrives(stranger, port) for port in (7400, 7410, 7649)], [False] * 3)
            self.assertTrue(arrives(other, 7410))
            # Others than the station may still answer what was asked of them.
            self.assertTrue(arrives(stranger, 40000))
        finally:
            subprocess.run(["nft", "delete", "table", "inet", "station"], check=True)

    def test_audit_lines_say_who_moved_the_robot(self):
        log = (self.folder / "demo" / "logs" / "executor.log").read_text()
        lines = [line for line in log.splitlines() if "audit" in line and "ExecutorService/Execute" in line]
        self.assertTrue(lines, log)
        self.assertIn("operator via gateway", lines[0])
        self.assertIn("press", lines[0])


if __name__ == "__main__":
    unittest.main(verbosity=2)
