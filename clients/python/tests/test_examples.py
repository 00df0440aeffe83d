"""The examples run as they stand."""

import pathlib
import subprocess
import sys

import exemplar
from conftest import BUTTON, ROOT, Station

EXAMPLES = ROOT / "clients" / "python" / "examples"


def run(name: str, *words: object) -> str:
    command = [sys.executable, EXAMPLES / name, *words]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_learn_and_query(station: Station, files: list[pathlib.Path]) -> None:
    told = run("01_learn_and_query.py", *files, "--server", station.learning(), "--skill", "example")
    assert "version 1, about target" in told
    assert "touches target" in told
    assert "elephant" in told


def test_record(station: Station) -> None:
    station.executor()
    told = run("02_record.py", "--recorder", station.recorder(), "--seconds", 0.5, "--expect", "ircp/joint_state")
    assert ".mcap" in told
    assert "ircp/joint_state" in told


def test_execute(station: Station, press: exemplar.Skill) -> None:
    where = "target=" + ",".join(str(value) for value in BUTTON)
    told = run("03_execute.py", "press", "--object", where, "--executor", station.executor())
    assert "executing" in told
    assert "contact met to" in told


def test_stream(station: Station, press: exemplar.Skill) -> None:
    told = run("async_stream.py", "press", "target", "--server", station.learning(), "--steps", 20)
    assert told.count("target at") == 20
    assert "version" in told
