"""Client, examples and tests are typed throughout."""

import importlib.util
import pathlib
import subprocess
import sys

import pytest

from conftest import ROOT


@pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not installed")
def test_mypy_finds_nothing_in_its_strict_mode(tmp_path: pathlib.Path) -> None:
    command = [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT / "clients" / "python", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
