"""Real services for the tests: EXEMPLAR_BIN holds the programs of the build."""

import pathlib
import socket
import sys
from collections.abc import Iterator
from typing import Any

import pytest

import exemplar

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests" / "system"))

import processes  # noqa: E402
import trials  # noqa: E402

ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = ROOT / "deploy" / "config" / "rail_press.yaml"
DOMAIN = 97
BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06), (0.66, -0.22, 0.06), (0.52, -0.02, 0.06)]
# Where the scene has its button, which no trial had.
BUTTON = (0.55, -0.15, 0.05)


class Station:
    """The programs of one station, each started when a test first asks for it."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.programs: Any = processes.Programs(folder, DOMAIN)
        self._addresses: dict[str, str] = {}

    def learning(self) -> str:
        return self._server("learning", "--data-dir", self.programs.folder / "learning", bus=False)

    def recorder(self) -> str:
        return self._server("recorder", "--data-dir", self.programs.folder / "recordings")

    def executor(self) -> str:
        if "executor" not in self._addresses:
            self.programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", SCENE, "--cameras", "off")
            address = self._server("executor", "--robot", ROBOT, "--scene", SCENE, "--learning", self.learning())
            with exemplar.Client(address) as client:
                processes.wait_for(lambda: len(client.robot.status().joints) > 0, "the robot's joint state")
        return self._addresses["executor"]

    def _server(self, name: str, *words: object, bus: bool = True) -> str:
        if name not in self._addresses:
            port = self.programs.folder / f"{name}.port"
            listen = ["--listen", "127.0.0.1:0", "--port-file", port]
            process = self.programs.start(f"exemplar-{name}", *words, *listen, bus=bus)
            processes.wait_for(lambda: process.poll() is not None or port.exists(), f"the port of {name}")
            assert process.poll() is None, self.programs.logs()
            self._addresses[name] = f"127.0.0.1:{port.read_text().strip()}"
        return self._addresses[name]


@pytest.fixture(scope="session")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    running = Station(tmp_path_factory.mktemp("station"))
    yield running
    running.programs.end()


@pytest.fixture
def silent() -> Iterator[str]:
    """The address of somebody who takes connections and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield f"127.0.0.1:{listener.getsockname()[1]}"


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[pathlib.Path]:
    written: list[pathlib.Path] = trials.write_set(tmp_path_factory.mktemp("trials"), BUTTONS)
    return written


@pytest.fixture(scope="session")
def client(station: Station) -> Iterator[exemplar.Client]:
    """Of the learning service alone."""
    with exemplar.Client(station.learning()) as connected:
        yield connected


@pytest.fixture(scope="session")
def press(client: exemplar.Client, files: list[pathlib.Path]) -> exemplar.Skill:
    """A skill that is learned."""
    skill = client.skill("press")
    skill.submit(*files)
    skill.learn().result()
    return skill
