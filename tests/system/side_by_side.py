"""Runs the tests of a file side by side: each in a process, a network and a /dev/shm of its own.

For tests that mostly wait. The file ends with `side_by_side.main(__file__)`.
"""

import concurrent.futures
import ctypes
import os
import pathlib
import subprocess
import sys
import time
import unittest

AT_ONCE = 4
LIMIT_S = 400
HERE = pathlib.Path(__file__).resolve().parent


def main(file):
    """All tests of `file`, or of the classes that are named, each by itself; tests that are named (Class.test) run here."""
    if any("." in word or word.startswith("-") for word in sys.argv[1:]):
        own_shared_memory()
        unittest.main()
    names = [name.removeprefix("__main__.") for name in ids(unittest.defaultTestLoader.loadTestsFromModule(sys.modules["__main__"]))]
    if sys.argv[1:]:
        names = [name for name in names if name.split(".")[0] in sys.argv[1:]]
        assert names, f"no test of {sys.argv[1:]} in {file}"
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        failed = [name for name, passed in pool.map(lambda name: run(file, name), names) if not passed]
    print(f"{len(names)} tests, {len(failed)} failed{': ' if failed else ''}{', '.join(failed)}", flush=True)
    sys.exit(1 if failed else 0)


def ids(tests):
    for test in tests:
        yield from ids(test) if isinstance(test, unittest.TestSuite) else [test.id()]


def run(file, name):
    """A test's name, and whether it passed; what it said is printed at once when it is over."""
    environment = {key: value for key, value in os.environ.items() if key != "EXEMPLAR_ISOLATED"}
    command = [str(HERE / "run_isolated"), sys.executable, "-B", str(file), name]
    began = time.monotonic()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment, timeout=LIMIT_S, check=False)
    verdict = "failed" if done.returncode != 0 else "skipped" if "OK (skipped=" in done.stdout else "ok"
    said = "" if verdict == "ok" else "\n" + done.stdout
    print(f"{name} ... {verdict} ({time.monotonic() - began:.1f} s){said}", flush=True)
    return name, done.returncode == 0


def own_shared_memory():
    """DDS finds its neighbours of the same machine there, whatever network they are in."""
    libc = ctypes.CDLL(None, use_errno=True)
    clone_newns, ms_rec, ms_private = 0x20000, 0x4000, 1 << 18
    if libc.unshare(clone_newns) != 0 or libc.mount(b"none", b"/", None, ms_rec | ms_private, None) != 0:
        raise OSError(ctypes.get_errno(), "unshare")
    if libc.mount(b"none", b"/dev/shm", b"tmpfs", 0, None) != 0:
        raise OSError(ctypes.get_errno(), "mount")
