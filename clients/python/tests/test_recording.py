"""Recordings are read, and sent again through the gateway."""

import asyncio
import contextlib
import importlib.util
import pathlib
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import pytest

import exemplar
import processes
from conftest import DOMAIN, ROOT, Station

needs_packages = pytest.mark.skipif(
    not importlib.util.find_spec("zstandard"), reason="the package zstandard is not installed"
)
SUIT = "ircp/suit"


def text(word: str) -> bytes:
    return struct.pack("<I", len(word)) + word.encode()


def record(opcode: int, data: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(data)) + data


def message(number: int, topic: int = 1) -> bytes:
    at = 1_700_000_000_000_000_000 + number * 10_000_000
    return record(5, struct.pack("<HIQQ", topic, number, at, at) + struct.pack("<II", 0x100, number))


def written(path: pathlib.Path, body: bytes) -> pathlib.Path:
    path.write_bytes(b"\x89MCAP0\r\n" + record(1, text("") + text("a test")) + body)
    return path


HEADER = record(3, struct.pack("<H", 1) + text("Number") + text("omgidl") + text("struct Number { long n; };"))
HEADER += record(4, struct.pack("<HH", 1, 1) + text("ircp/number") + text("cdr") + struct.pack("<I", 0))
HEADER += record(4, struct.pack("<HH", 2, 1) + text("ircp/other") + text("cdr") + struct.pack("<I", 0))


def chunk(records: bytes, compression: str, packed: bytes) -> bytes:
    return record(
        6, struct.pack("<QQQI", 0, 0, len(records), 0) + text(compression) + struct.pack("<Q", len(packed)) + packed
    )


def test_messages_come_in_the_files_order_with_their_schema(tmp_path: pathlib.Path) -> None:
    whole = written(tmp_path / "plain.mcap", HEADER + message(0) + message(1, topic=2) + message(2))
    samples = list(exemplar.read_recording(whole))
    assert [sample.topic for sample in samples] == ["ircp/number", "ircp/other", "ircp/number"]
    assert samples[0].type == "Number"
    assert samples[0].schema == "struct Number { long n; };"
    assert samples[2].time_ns - samples[0].time_ns == 20_000_000
    assert samples[2].cdr == struct.pack("<II", 0x100, 2)
    assert [sample.topic for sample in exemplar.read_recording(whole, ["*/other"])] == ["ircp/other"]
    body = HEADER + message(0) + message(1)
    assert len(list(exemplar.read_recording(written(tmp_path / "chunk.mcap", chunk(body, "", body))))) == 2


@needs_packages
def test_chunks_are_decompressed(tmp_path: pathlib.Path) -> None:
    import zstandard

    body = HEADER + message(0) + message(1)
    packed = zstandard.ZstdCompressor().compress(body)
    file = written(tmp_path / "zstd.mcap", chunk(body, "zstd", packed))
    assert len(list(exemplar.read_recording(file))) == 2
    broken = written(tmp_path / "broken.mcap", chunk(body, "zstd", packed[:9] + b"\0\0\0" + packed[12:]))
    with pytest.raises(exemplar.DataLossError):
        list(exemplar.read_recording(broken))


def test_what_is_damaged_or_no_recording_is_said(tmp_path: pathlib.Path) -> None:
    whole = written(tmp_path / "whole.mcap", HEADER + message(0) + message(1)).read_bytes()
    cut = tmp_path / "cut.mcap"
    for length in range(9, len(whole), 7):
        cut.write_bytes(whole[:length])
        with contextlib.suppress(exemplar.DataLossError):
            assert len(list(exemplar.read_recording(cut))) < 2
    cut.write_bytes(whole[:-3])
    with pytest.raises(exemplar.DataLossError, match=r"cut\.mcap is damaged"):
        list(exemplar.read_recording(cut))
    other = tmp_path / "notes.mcap"
    other.write_text("these are notes")
    with pytest.raises(exemplar.InvalidArgumentError, match="no MCAP file"):
        list(exemplar.read_recording(other))
    strange = written(tmp_path / "strange.mcap", chunk(HEADER, "brotli", HEADER))
    with pytest.raises(exemplar.DataLossError, match="brotli"):
        list(exemplar.read_recording(strange))
    with exemplar.Client("127.0.0.1:1") as client, pytest.raises(exemplar.InvalidArgumentError, match="rate"):
        exemplar.replay(client, strange, rate=0)


@pytest.fixture(scope="module")
def gateway(station: Station) -> str:
    station.recorder()
    return station._server("gateway", "--learning", station.learning(), "--publish", "ircp/suit")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Iterator[pathlib.Path]:
    """Half a second of somebody's suit, as the recorder of a station wrote it where nobody else reads a suit."""
    source = tmp_path_factory.mktemp("suit") / "suit.csv"
    rows = "".join(f"{k / 60},{0.01 * k}\n" for k in range(30))
    source.write_text("time_s,elbow_rad\n" + rows)
    programs: Any = processes.Programs(source.parent, DOMAIN - 1)
    try:
        _, recorder = programs.recorder()
        person = programs.start("exemplar-capture-suit", "--replay", source, "--record", "--name", "worn")
        assert person.wait(60) == 0, programs.logs()
        with exemplar.Client(recorder=recorder) as client:
            yield pathlib.Path(client.recorder.status().file)
    finally:
        programs.end()


@needs_packages
def test_what_was_recorded_arrives_again(gateway: str, recording: pathlib.Path) -> None:
    whole = [sample.cdr for sample in exemplar.read_recording(recording, [SUIT])]
    assert len(whole) > 20
    heard: list[bytes] = []
    with exemplar.Client(gateway) as client, client.topics.subscribe(SUIT, content="cdr", last=False) as samples:
        listening = threading.Thread(target=lambda: heard.extend(sample.cdr for sample in samples))
        listening.start()
        # Who begins to listen while they are sent may miss some of these, or all.
        while not heard:
            done = exemplar.replay(client, recording, [SUIT])
            assert done.sent == len(whole)
            assert done.duration_s > 0.3
        processes.wait_for(lambda: heard[-1:] == whole[-1:], "the first replay")
        before = len(heard)

        async def again() -> exemplar.Replayed:
            async with exemplar.AsyncClient(gateway) as other:
                return await exemplar.replay_async(other, recording, [SUIT], rate=4)

        assert asyncio.run(again()).sent == len(whole)
        arrived = lambda: len(heard) >= before + len(whole) and heard[-len(whole) :] == whole  # noqa: E731
        processes.wait_for(arrived, "the second replay")
        samples.close()
        listening.join(60)
    assert heard[-len(whole) :] == whole
    with exemplar.Client(gateway) as client, pytest.raises(exemplar.ExemplarError):
        exemplar.replay(client, recording, ["ircp/*/status"])


@needs_packages
def test_the_example_replays(gateway: str, recording: pathlib.Path) -> None:
    example = ROOT / "clients" / "python" / "examples" / "07_replay.py"
    command = [sys.executable, example, recording, "--topic", SUIT, "--rate", "4", "--server", gateway]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert f"{SUIT} " in done.stdout
    assert " sent, at most " in done.stdout
