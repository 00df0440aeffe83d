"""Real services for the tests: EXEMPLAR_BIN holds the programs of the build."""

import pathlib
import socket
import subprocess
import sys
from collections.abc import Iterator
from typing import Any, TypedDict

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
        self.scene = SCENE
        # The simulated time waits for the executor: how busy the machine is does not matter.
        self.simulator_words = ["--in-step-with", "executor"]
        self.executor_words = ["--clock", "network"]
        self._addresses: dict[str, str] = {}

    def learning(self) -> str:
        return self._server("learning", "--data-dir", self.programs.folder / "learning", bus=False)

    def recorder(self) -> str:
        return self._server("recorder", "--data-dir", self.programs.folder / "recordings")

    def executor(self) -> str:
        if "executor" not in self._addresses:
            shared = ["--robot", ROBOT, "--scene", self.scene]
            self.programs.start("exemplar-simulator", *shared, "--cameras", "off", *self.simulator_words)
            address = self._server("executor", *shared, "--learning", self.learning(), *self.executor_words)
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


class Shown(TypedDict, total=False):
    """What a client shows, and whom it believes."""

    tls_ca: str
    tls_cert: str
    tls_key: str
    token: str


def security(command: str, folder: pathlib.Path, *words: object) -> str:
    """Runs `exemplar security`."""
    line = [processes.BINARIES / "exemplar", "security", command, folder, *words]
    return subprocess.run([str(word) for word in line], capture_output=True, text=True, check=True).stdout


class SecuredStation:
    """A learning service that wants certificates of its callers, and a gateway before it that takes tokens."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.files = folder / "station"
        self.programs: Any = processes.Programs(folder, DOMAIN + 1)
        security("init", self.files, "--station", "test")
        for name, *words in (
            ("learning", "--role", "learning"),
            ("gateway", "--role", "gateway"),
            ("anna", "--role", "person", "--call", "teach"),
            ("otto", "--role", "person", "--call", "observe"),
        ):
            security("issue", self.files, name, *words)
        self.token = security("token", self.files, "ben", "--role", "observe").strip()
        access = ["--access", self.files / "access.yaml"]
        own_ca = ["--tls-client-ca", self.ca]
        self.learning = self._start("learning", "--data-dir", folder / "learning", *access, *own_ca, bus=False)
        self.gateway = self._start("gateway", "--learning", self.learning, "--tls-ca", self.ca, *access)

    @property
    def ca(self) -> str:
        return str(self.files / "members" / "anna" / "ca.pem")

    def certificate(self, name: str) -> Shown:
        """What a client shows that has a certificate."""
        member = self.files / "members" / name
        return {"tls_ca": self.ca, "tls_cert": str(member / "cert.pem"), "tls_key": str(member / "key.pem")}

    def _start(self, name: str, *words: object, bus: bool = True) -> str:
        member = self.files / "members" / name
        port = self.programs.folder / f"{name}.port"
        tls = ["--tls-cert", member / "cert.pem", "--tls-key", member / "key.pem"]
        listen = ["--listen", "127.0.0.1:0", "--port-file", port]
        process = self.programs.start(f"exemplar-{name}", *words, *tls, *listen, bus=bus)
        processes.wait_for(lambda: process.poll() is not None or port.exists(), f"the port of {name}")
        assert process.poll() is None, self.programs.logs()
        return f"127.0.0.1:{port.read_text().strip()}"


class MovingStation(Station):
    """One whose button runs along a rail, and is tracked."""

    def __init__(self, folder: pathlib.Path, learning: str) -> None:
        super().__init__(folder)
        self.programs = processes.Programs(folder, DOMAIN + 2)
        self._addresses["learning"] = learning
        self.scene = folder / "scene.yaml"
        text = SCENE.read_text().partition("cameras:")[0]
        rail = "    rail: {direction: [0, 1, 0], length: 0.4, speed: 0.01}\n"
        self.scene.write_text(text + rail)
        self.simulator_words += ["--track-hz", "60"]


class TeleoperatedStation(Station):
    """One whose robot follows a suit, which knows no simulated time."""

    def __init__(self, folder: pathlib.Path, learning: str) -> None:
        super().__init__(folder)
        self.programs = processes.Programs(folder, DOMAIN + 2)
        self._addresses["learning"] = learning
        self.simulator_words = []
        # A busy machine is no fault of the robot's.
        self.executor_words = ["--state-patience-s", "5", "--command-patience-s", "5"]
        self.executor_words += ["--suit-patience-s", "2", "--dead-man-patience-s", "2"]


@pytest.fixture(scope="module")
def teleoperated(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Iterator[TeleoperatedStation]:
    running = TeleoperatedStation(tmp_path_factory.mktemp("teleoperated"), station.learning())
    yield running
    running.programs.end()


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Iterator[MovingStation]:
    running = MovingStation(tmp_path_factory.mktemp("moving"), station.learning())
    yield running
    running.programs.end()


@pytest.fixture(scope="session")
def secured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SecuredStation]:
    running = SecuredStation(tmp_path_factory.mktemp("secured"))
    yield running
    running.programs.end()


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
