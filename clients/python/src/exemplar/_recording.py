"""Recordings (MCAP files): read message by message, and sent again through a gateway."""

from __future__ import annotations

import asyncio
import importlib
import os
import struct
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

from ._errors import DataLossError, InvalidArgumentError, UnimplementedError

if TYPE_CHECKING:
    from ._async_client import AsyncClient
    from ._client import Client

_MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15
# Not sent again unless chosen, as `exemplar record replay` has it.
_LEFT_OUT = ("ircp/*/command", "ircp/*/status", "ircp/safety", "ircp/clock")


@dataclass(frozen=True)
class RecordedSample:
    """One message of a recording. time_ns: when it was recorded, since the Unix epoch; cdr: its bytes."""

    topic: str
    type: str
    schema: str
    time_ns: int
    cdr: bytes


@dataclass(frozen=True)
class Replayed:
    """What was sent. late_s: the most that a sample was behind its time."""

    sent: int
    duration_s: float
    late_s: float


def read_recording(path: str | os.PathLike[str], topics: Sequence[str] = ()) -> Iterator[RecordedSample]:
    """The messages of an MCAP file in the order of the file; of `topics` only, in which * stands for any text.

    Chunks that are compressed need the package `zstandard` or `lz4` (pip install exemplar[recordings]). Raises
    DataLossError where the file is damaged or was cut: `exemplar record recover` makes it whole.
    """
    data = Path(path).read_bytes()
    if not data.startswith(_MAGIC):
        raise InvalidArgumentError(f"{path} is no MCAP file", "path")
    schemas: dict[int, tuple[str, str]] = {}
    channels: dict[int, tuple[str, str, str] | None] = {}
    try:
        yield from _messages(memoryview(data)[len(_MAGIC) :], schemas, channels, topics)
    except UnimplementedError:
        raise
    except Exception as error:  # of zstandard and lz4, which need not be there, as well
        raise DataLossError(f"{path} is damaged: {error}; `exemplar record recover` may mend it", "path") from None


def replay(client: Client, path: str | os.PathLike[str], topics: Sequence[str] = (), *, rate: float = 1.0) -> Replayed:
    """Sends a recording's samples again, with their intervals, on topics that the gateway may write (`--publish`).

    topics: of these only, in which * stands for any text; (): all but commands, states, the emergency stop and the
    clock. rate: so many times faster. Raises what `client.topics.publish` raises. For a machine that is itself on the
    station's network, `exemplar record replay` is the better tool: it needs no gateway.
    """
    pace = _Pace(rate)
    for sample in _chosen(path, topics):
        time.sleep(pace.wait_s(sample))
        client.topics.publish(sample.topic, sample.cdr, type=sample.type, schema=sample.schema)
    return pace.replayed()


async def replay_async(
    client: AsyncClient, path: str | os.PathLike[str], topics: Sequence[str] = (), *, rate: float = 1.0
) -> Replayed:
    """The same under asyncio."""
    pace = _Pace(rate)
    for sample in _chosen(path, topics):
        await asyncio.sleep(pace.wait_s(sample))
        await client.topics.publish(sample.topic, sample.cdr, type=sample.type, schema=sample.schema)
    return pace.replayed()


class _Pace:
    """When each sample is due, and how far behind it was."""

    def __init__(self, rate: float) -> None:
        if not rate > 0:
            raise InvalidArgumentError(f"rate is {rate}, must be over 0", "rate")
        self._rate = rate
        self._first_ns: int | None = None
        self._began_s = self._position_s = self._late_s = 0.0
        self._sent = 0

    def wait_s(self, sample: RecordedSample) -> float:
        """Until the next one is due."""
        if self._first_ns is None:
            self._first_ns, self._began_s = sample.time_ns, time.monotonic()
        self._position_s = (sample.time_ns - self._first_ns) * 1e-9
        behind_s = time.monotonic() - self._began_s - self._position_s / self._rate
        self._late_s = max(self._late_s, behind_s)
        self._sent += 1
        return max(0.0, -behind_s)

    def replayed(self) -> Replayed:
        return Replayed(self._sent, self._position_s, self._late_s)


def _chosen(path: str | os.PathLike[str], topics: Sequence[str]) -> Iterator[RecordedSample]:
    return (s for s in read_recording(path, topics) if topics or not _matches(s.topic, _LEFT_OUT))


def _matches(topic: str, patterns: Sequence[str]) -> bool:
    return any(fnmatchcase(topic, pattern) for pattern in patterns)


def _messages(
    data: memoryview,
    schemas: dict[int, tuple[str, str]],
    channels: dict[int, tuple[str, str, str] | None],
    topics: Sequence[str],
) -> Iterator[RecordedSample]:
    """Of a file's records or a chunk's."""
    at = 0
    while at < len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        record = data[at + 9 : at + 9 + length]
        if len(record) < length:
            raise IndexError("it ends within a record")
        at += 9 + length
        if opcode == _MESSAGE:
            channel = channels[struct.unpack_from("<H", record)[0]]
            if channel is not None:
                yield RecordedSample(*channel, struct.unpack_from("<Q", record, 6)[0], bytes(record[22:]))
        elif opcode == _CHUNK:
            yield from _messages(_unpacked(record), schemas, channels, topics)
        elif opcode == _SCHEMA:
            name, rest = _text(record, 2)
            _, rest = _text(record, rest)
            (size,) = struct.unpack_from("<I", record, rest)
            schemas[struct.unpack_from("<H", record)[0]] = (name, str(record[rest + 4 : rest + 4 + size], "utf-8"))
        elif opcode == _CHANNEL:
            number, schema = struct.unpack_from("<HH", record)
            topic, _ = _text(record, 4)
            wanted = not topics or _matches(topic, topics)
            channels[number] = (topic, *schemas.get(schema, ("", ""))) if wanted else None
        elif opcode == _DATA_END:
            return


def _text(record: memoryview, at: int) -> tuple[str, int]:
    """A string, and where what follows it begins."""
    (size,) = struct.unpack_from("<I", record, at)
    if len(record) < at + 4 + size:
        raise IndexError("it ends within a string")
    return str(record[at + 4 : at + 4 + size], "utf-8"), at + 4 + size


def _unpacked(chunk: memoryview) -> memoryview:
    """The records of a chunk."""
    _, _, size, _ = struct.unpack_from("<QQQI", chunk)
    compression, at = _text(chunk, 28)
    packed = chunk[at + 8 :]
    if not compression:
        return packed
    try:
        module = importlib.import_module({"zstd": "zstandard", "lz4": "lz4.frame"}[compression])
    except ImportError:
        raise UnimplementedError(f"chunks are compressed by {compression}: pip install exemplar[recordings]") from None
    if compression == "lz4":
        return memoryview(module.decompress(packed))
    return memoryview(module.ZstdDecompressor().decompress(packed, max_output_size=size))
