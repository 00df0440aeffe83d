"""The Python client: installed by pip from this checkout, then its own tests against the programs of the build.

With Debian's packages (deploy/packages-test.txt) nothing is fetched. Where they are missing, and with --from-pypi, pip fetches
everything as it does for a user; where it cannot, the test is skipped (exit code 77).
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
CLIENT = HERE.parents[1] / "clients" / "python"
SKIPPED = 77
NEEDED = "import google.protobuf, grpc, hatchling, numpy, pip, pytest, sys; assert sys.version_info >= (3, 11)"


def main():
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    with tempfile.TemporaryDirectory(prefix="exemplar-python-") as folder:
        python = pathlib.Path(folder) / "venv" / "bin" / "python"
        base = None if "--from-pypi" in sys.argv else python_with_packages()
        if base:
            print(f"with the packages of {base}", flush=True)
            run(base, "-m", "venv", "--system-site-packages", "--without-pip", python.parents[1])
            pip(base, python, "--no-index", "--no-build-isolation", CLIENT).check_returncode()
        else:
            print("with packages from PyPI", flush=True)
            run(sys.executable, "-m", "venv", python.parents[1])
            if pip(python, python, "pytest", "mypy", "types-grpcio").returncode != 0:
                print("SKIPPED: PyPI cannot be reached, and Debian's packages are not installed", flush=True)
                return SKIPPED
            pip(python, python, f"{CLIENT}[recordings]").check_returncode()
        return run(HERE / "run_isolated", python, "-m", "pytest", "-q", "-p", "no:cacheprovider", CLIENT / "tests", check=False)


def python_with_packages():
    """A Python that has what is needed to build, run and test the client."""
    if not shutil.which("protoc"):
        return None
    for python in (sys.executable, "/usr/bin/python3"):
        if pathlib.Path(python).exists() and subprocess.run([python, "-c", NEEDED], capture_output=True, check=False).returncode == 0:
            return python
    return None


def pip(runner, python, *words):
    """Installs for `python`, by the pip of `runner`."""
    command = [runner, "-m", "pip", "--python", python, "install", "--quiet", "--disable-pip-version-check", "--retries", "1", *words]
    return subprocess.run([str(word) for word in command], check=False)


def run(*words, check=True):
    return subprocess.run([str(word) for word in words], check=check).returncode


if __name__ == "__main__":
    sys.exit(main())
