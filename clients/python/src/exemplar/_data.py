"""What operators do with the data of a service, as calls; and the file that a backup is (docs/operators_data.md)."""

from __future__ import annotations

import hashlib
import io
import json
import os
import tarfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, Literal, TypeAlias

from . import _read
from ._calls import Long, Unary
from ._errors import AlreadyExistsError, DataLossError, InvalidArgumentError, NotFoundError
from ._values import Backup, BackupService, DataReport, PersonInfo, Progress
from ._wire import Message, Method, method

RestoreMode: TypeAlias = Literal["empty_only", "merge", "replace"]
"""Where something is there already: refuse, add what is not there, take it out first."""

BackupFile: TypeAlias = str | os.PathLike[str]

_MODES = {"empty_only": "MODE_EMPTY_ONLY", "merge": "MODE_MERGE", "replace": "MODE_REPLACE"}
_MANIFEST = "manifest.json"
_FORMAT = "exemplar-backup"
_CHUNK = 256 << 10


def _unary(service: str, name: str, read: Any, **fields: Any) -> Unary[Any]:
    found = method(f"{service}/{name}")
    return Unary(found, found.request(**fields), read, True)


def list_persons(service: str) -> Unary[tuple[PersonInfo, ...]]:
    return _unary(service, "ListPersons", lambda m: tuple(_read.person_info(x) for x in m.persons))


def erase_person(service: str, person: str, dry_run: bool) -> Long[Progress, DataReport]:
    found = method(f"{service}/ErasePerson")
    request = found.request(person=person, dry_run=dry_run)
    return Long(found, request, "progress", _read.progress, "report", _read.data_report)


def apply_retention(
    service: str, dry_run: bool, keep_days: float | None, keep_versions_days: float | None, needed_too: bool
) -> Unary[DataReport]:
    days = {"keep_days": keep_days, "keep_versions_days": keep_versions_days}
    given = {name: value for name, value in days.items() if value is not None}
    return _unary(
        service,
        "ApplyRetention",
        lambda m: _read.data_report(m.report),
        dry_run=dry_run,
        needed_too=needed_too,
        **given,
    )


@dataclass(frozen=True)
class Copy:
    """One request, a backup's parts, which go into a file."""

    method: Method
    request: Message
    writer: BackupWriter

    def take(self, message: Message) -> None:
        """The next message of the answer."""
        self.writer.take(message)


def backup(service: str, writer: BackupWriter) -> Copy:
    found = method(f"{service}/Backup")
    return Copy(found, found.request(), writer)


@dataclass(frozen=True)
class Restoration:
    """A backup's parts, one answer."""

    method: Method
    file: Path
    service: BackupService
    mode: RestoreMode
    erased: Sequence[dict[str, Any]]

    def requests(self) -> Iterator[Message]:
        """In the order in which they are sent."""
        plan = {
            "service": self.service.service,
            "schema": self.service.schema,
            "parts": self.service.parts,
            "bytes": self.service.bytes,
            "counts": dict(self.service.counts),
            "notices": list(self.service.notices),
        }
        header: dict[str, Any] = {"plan": plan, "mode": _MODES[self.mode]}
        request = self.method.request(header=header)
        for person in self.erased:
            erased = request.header.erased.add(salt=person["salt"].encode(), hash=person["hash"].encode())
            erased.erased.FromNanoseconds(person["erased_ns"])
        yield request
        prefix = self.service.service + "/"
        with tarfile.open(self.file, "r:") as archive:
            for entry in archive:
                if not entry.name.startswith(prefix):
                    continue
                yield self.method.request(begin={"name": entry.name.removeprefix(prefix), "bytes": entry.size})
                stream = archive.extractfile(entry)
                while stream is not None and (data := stream.read(_CHUNK)):
                    yield self.method.request(chunk={"data": data})
        yield self.method.request(commit=True)

    def read(self, message: Message) -> DataReport:
        return _read.data_report(message.report)


def restore(service: str, file: BackupFile, mode: RestoreMode, erased_in: BackupFile | None) -> Restoration:
    if mode not in _MODES:
        raise InvalidArgumentError(f'mode is "{mode}", must be one of {", ".join(_MODES)}', "mode")
    name = _NAMES[service]
    known = verify(file)
    for held in known.services:
        if held.service == name:
            erased = erased_persons(erased_in) if erased_in is not None else ()
            return Restoration(method(f"{service}/Restore"), Path(file), held, mode, erased)
    raise NotFoundError(f"{file} holds nothing of {name}", "file")


LEARNING = "LearningDataService"
RECORDER = "RecorderDataService"
_NAMES = {LEARNING: "learning", RECORDER: "recorder"}


@dataclass
class _Part:
    name: str
    size: int
    left: int
    sha256: Any = field(default_factory=hashlib.sha256)


class BackupWriter:
    """One backup file; as a context manager it gets its name at the end, and goes where an error comes first."""

    def __init__(self, file: BackupFile) -> None:
        self._file = Path(file)
        if self._file.exists():
            raise AlreadyExistsError(f"{self._file} is there already", "file")
        self._part_file = self._file.with_name(self._file.name + ".part")
        self._made = datetime.now(UTC)
        self._plans: list[dict[str, Any]] = []
        self._parts: list[dict[str, Any]] = []
        self._open: _Part | None = None
        self._stream: IO[bytes] | None = None

    def __enter__(self) -> BackupWriter:
        descriptor = os.open(self._part_file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        self._stream = os.fdopen(descriptor, "wb")
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        assert self._stream is not None
        try:
            if kind is None:
                self._finish()
        finally:
            self._stream.close()
            self._part_file.unlink(missing_ok=True)

    def take(self, message: Message) -> None:
        """A message of a service's backup."""
        if message.HasField("plan"):
            self._end_part()
            plan = message.plan
            names = ("service", "schema", "parts", "bytes")
            self._plans.append(
                {name: getattr(plan, name) for name in names}
                | {"counts": dict(plan.counts), "notices": list(plan.notices)}
            )
        elif message.HasField("begin"):
            self._end_part()
            self._begin(f"{self._plans[-1]['service']}/{message.begin.name}", message.begin.bytes)
        elif self._open is not None:
            self._write(message.chunk.data)

    def value(self) -> Backup:
        """What the file holds."""
        return _backup({"made_ns": _nanoseconds(self._made), "program": _version(), "services": self._plans})

    def _begin(self, name: str, size: int) -> None:
        assert self._stream is not None
        entry = tarfile.TarInfo(name)
        entry.size, entry.mode, entry.mtime = size, 0o644, int(self._made.timestamp())
        # Only the header: the bytes come piece by piece.
        self._stream.write(entry.tobuf(tarfile.PAX_FORMAT))
        self._open = _Part(name, size, size)

    def _write(self, data: bytes) -> None:
        assert self._open is not None
        assert self._stream is not None
        self._stream.write(data)
        self._open.sha256.update(data)
        self._open.left -= len(data)

    def _end_part(self) -> None:
        if self._open is None or self._stream is None:
            return
        part, self._open = self._open, None
        if part.left != 0:
            raise DataLossError(f"{part.name} is not as long as announced")
        self._stream.write(b"\0" * (-part.size % tarfile.BLOCKSIZE))
        self._parts.append({"name": part.name, "bytes": part.size, "sha256": part.sha256.hexdigest()})

    def _finish(self) -> None:
        assert self._stream is not None
        self._end_part()
        expected = sum(plan["parts"] for plan in self._plans)
        if expected != len(self._parts):
            raise DataLossError(f"{len(self._parts)} parts came of {expected}")
        manifest = {
            "format": _FORMAT,
            "format_version": 1,
            "made": self._made.isoformat().replace("+00:00", "Z"),
            "made_ns": _nanoseconds(self._made),
            "program": _version(),
            "services": self._plans,
            "parts": self._parts,
        }
        text = json.dumps(manifest, indent=1).encode() + b"\n"
        self._begin(_MANIFEST, len(text))
        self._write(text)
        self._end_part()
        self._stream.write(b"\0" * 2 * tarfile.BLOCKSIZE)
        self._stream.flush()
        os.fsync(self._stream.fileno())
        self._part_file.rename(self._file)


def verify(file: BackupFile) -> Backup:
    """Reads all of a backup and compares it with its manifest. Raises DataLossError where it is cut or damaged."""
    manifest, found = _read_all(file)
    parts = manifest["parts"]
    for part in parts:
        there = found.pop(part["name"], None)
        if there is None:
            raise DataLossError(f"{file}: the part {part['name']} is missing", "file")
        size, digest, offset = there
        if (size, digest) != (part["bytes"], part["sha256"]):
            raise DataLossError(f"{file}: {part['name']} is damaged, within bytes {offset} to {offset + size}", "file")
    if found:
        raise DataLossError(f"{file}: {next(iter(found))} is not in the manifest", "file")
    return _backup(manifest)


def erased_persons(file: BackupFile) -> tuple[dict[str, Any], ...]:
    """Who stands in a backup as erased."""
    verify(file)
    erased: list[dict[str, Any]] = []
    with tarfile.open(file, "r:") as archive:
        for entry in archive:
            if entry.name == "learning/store.json":
                erased += json.load(_opened(archive, entry))["erased_persons"]
            elif entry.name == "recorder/erased.json":
                erased += json.load(_opened(archive, entry))
    return tuple(erased)


def _read_all(file: BackupFile) -> tuple[dict[str, Any], dict[str, tuple[int, str, int]]]:
    found: dict[str, tuple[int, str, int]] = {}
    manifest: dict[str, Any] | None = None
    length = Path(file).stat().st_size
    try:
        with tarfile.open(file, "r:") as archive:
            end = 0
            for entry in archive:
                if entry.offset_data + entry.size > length:
                    raise DataLossError(f"{file}: byte {length}: the file ends here, within {entry.name}", "file")
                stream = _opened(archive, entry)
                if entry.name == _MANIFEST:
                    manifest = json.load(stream)
                else:
                    digest = hashlib.sha256()
                    while data := stream.read(_CHUNK):
                        digest.update(data)
                    found[entry.name] = (entry.size, digest.hexdigest(), entry.offset_data)
                end = entry.offset_data + entry.size
    except (tarfile.TarError, EOFError, ValueError) as error:
        raise DataLossError(f"{file}: {error}", "file") from None
    if manifest is None or manifest.get("format") != _FORMAT:
        raise DataLossError(f"{file}: it has no manifest.json of ours: it is no whole backup", "file")
    if length < end + -end % tarfile.BLOCKSIZE + 2 * tarfile.BLOCKSIZE:
        raise DataLossError(f"{file}: byte {length}: its end mark is missing", "file")
    return manifest, found


def _opened(archive: tarfile.TarFile, entry: tarfile.TarInfo) -> IO[bytes]:
    return archive.extractfile(entry) or io.BytesIO()


def _nanoseconds(at: datetime) -> int:
    return round(at.timestamp() * 1e6) * 1000


def _version() -> str:
    from importlib import metadata

    try:
        return metadata.version("exemplar")
    except metadata.PackageNotFoundError:
        return ""


def _backup(manifest: dict[str, Any]) -> Backup:
    services: Iterable[dict[str, Any]] = manifest["services"]
    return Backup(
        made=datetime.fromtimestamp(manifest["made_ns"] * 1e-9, UTC),
        program=manifest["program"],
        services=tuple(
            BackupService(
                service=plan["service"],
                schema=plan["schema"],
                parts=plan["parts"],
                bytes=plan["bytes"],
                counts=dict(plan["counts"]),
                notices=tuple(plan["notices"]),
            )
            for plan in services
        ),
    )
