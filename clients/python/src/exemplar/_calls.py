"""Every call of the services as a value: what it sends and how its answer is read. Nothing in here does I/O.

`Client` and `AsyncClient` carry out the same calls; what is the same for both stands in this file.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Literal, TypeAlias, TypeVar

import numpy as np

from . import _read
from ._errors import InvalidArgumentError
from ._pose import Objects, Pose, PoseLike, as_pose
from ._trial import Trial
from ._values import (
    Evaluation,
    ExecutionResult,
    Feedback,
    Motion,
    Plan,
    Progress,
    RecorderStatus,
    RobotStatus,
    Segmentation,
    SkillInfo,
    SkillReport,
    SkillVersion,
    Submission,
    Suggestions,
    TeleoperationFeedback,
    TeleoperationResult,
    TopicBatch,
    TopicInfo,
    TrialInfo,
)
from ._wire import Message, Method, message_class, method

T = TypeVar("T")
P = TypeVar("P")

TrialFile: TypeAlias = str | os.PathLike[str] | Trial
"""The path of a CSV or MCAP file, or a trial as arrays."""

JointStart: TypeAlias = Mapping[str, float] | Sequence[float] | np.ndarray[Any, Any]
"""Joint positions (rad or m) by name, or in the skill's joint order."""

Options: TypeAlias = Mapping[str, object]
"""Options of learning by name, as `exemplar skill learn --option` takes them."""

Sample: TypeAlias = Mapping[str, object] | bytes
"""A topic's sample to publish: its members, or its bytes with their 4-byte encapsulation header."""

Content: TypeAlias = Literal["value", "cdr", "both"]
"""What samples of a subscription carry."""

_CONTENTS = {"value": "CONTENT_JSON", "cdr": "CONTENT_RAW", "both": "CONTENT_RAW_AND_JSON"}

_CHUNK = 256 << 10


@dataclass(frozen=True)
class Unary(Generic[T]):
    """One request, one answer. `long`: no timeout unless one is given."""

    method: Method
    request: Message
    read: Callable[[Message], T]
    long: bool = False


@dataclass(frozen=True)
class Upload(Generic[T]):
    """A header and a file's bytes, one answer."""

    method: Method
    header: dict[str, Any]
    file: bytes
    read: Callable[[Message], T]

    def requests(self) -> Iterator[Message]:
        """In the order in which they are sent."""
        yield self.method.request(header=self.header)
        for begin in range(0, len(self.file), _CHUNK):
            yield self.method.request(chunk={"data": self.file[begin : begin + _CHUNK]})


@dataclass(frozen=True)
class Download:
    """One request, a file's bytes."""

    method: Method
    request: Message


@dataclass(frozen=True)
class Stream(Generic[P]):
    """One request, any number of messages."""

    method: Method
    request: Message
    read: Callable[[Message], P]


@dataclass(frozen=True)
class Long(Generic[P, T]):
    """One request, any number of messages with `progress`, one with `result`."""

    method: Method
    request: Message
    progress: str
    read_progress: Callable[[Message], P]
    result: str
    read_result: Callable[[Message], T]


def _unary(name: str, read: Callable[[Message], T], long: bool = False, /, **fields: Any) -> Unary[T]:
    found = method(name)
    return Unary(found, found.request(**fields), read, long)


def _nothing(_: Message) -> None:
    return None


# ---- requests ----


def skill(name: str, version: int) -> dict[str, Any]:
    """A SkillVersion; 0: the current one."""
    return {"name": name, "version": version}


def pose(value: PoseLike, field: str) -> Message:
    """A Pose."""
    given: Pose = as_pose(value, field)
    message = message_class("Pose")(position=dict(zip("xyz", given.position.tolist(), strict=True)))
    if given.quaternion is not None:
        x, y, z, w = given.quaternion.tolist()
        message.rotation.MergeFrom(message_class("Quaternion")(x=x, y=y, z=z, w=w))
    return message


def named_poses(objects: Objects) -> list[dict[str, Any]]:
    """NamedPoses."""
    if not isinstance(objects, Mapping):
        raise InvalidArgumentError(
            f"objects is a {type(objects).__name__}, must be a mapping of names to poses", "objects"
        )
    return [{"name": name, "pose": pose(value, f'objects["{name}"]')} for name, value in objects.items()]


def query(objects: Objects, start: PoseLike | None, joint_start: JointStart | None) -> Message:
    """A SkillQuery."""
    message = message_class("SkillQuery")(objects=named_poses(objects))
    if start is not None:
        message.start.MergeFrom(pose(start, "start"))
    if isinstance(joint_start, Mapping):
        message.joint_start_names.extend(joint_start.keys())
        message.joint_start.extend(float(value) for value in joint_start.values())
    elif joint_start is not None:
        message.joint_start.extend(float(value) for value in joint_start)
    return message


def execution(
    name: str, objects: Objects | None, speed: float, start: PoseLike | None, follow: bool, version: int
) -> Message:
    """A SkillExecution."""
    if follow and objects:
        raise InvalidArgumentError("follow takes the target where it is seen: leave objects away", "objects")
    message = message_class("SkillExecution")(
        skill=skill(name, version), objects=named_poses(objects or {}), speed=speed, follow=follow
    )
    if start is not None:
        message.start.MergeFrom(pose(start, "start"))
    return message


def options_text(options: Options | None) -> dict[str, str]:
    """Options as the services take them."""
    given = options or {}
    return {k: str(v).lower() if isinstance(v, bool) else str(v) for k, v in given.items()}


def trial_bytes(trial: TrialFile) -> tuple[str, bytes]:
    """Name and content of a trial file."""
    if isinstance(trial, Trial):
        return trial.source or "trial.csv", trial.to_csv().encode()
    path = Path(trial)
    return path.name, path.read_bytes()


def limit_s(client: float | None, call: float | None, long: bool) -> float | None:
    """The timeout of a call: its own, else the client's where it is not a long one. None: none."""
    limit = call if call is not None else None if long else client
    if limit is None or limit == math.inf:
        return None
    if not limit > 0:
        raise InvalidArgumentError(f"timeout is {limit} s, must be over 0", "timeout")
    return float(limit)


# ---- TrialService ----


def submit(name: str, trial: TrialFile, person: str) -> Upload[Submission]:
    source, data = trial_bytes(trial)
    header = {"skill": name, "name": source, "person": person}
    return Upload(method("TrialService/Submit"), header, data, _read.submission)


def list_trials(name: str, person: str) -> Unary[tuple[TrialInfo, ...]]:
    return _unary(
        "TrialService/List", lambda m: tuple(_read.trial_info(x) for x in m.trials), skill=name, person=person
    )


def get_trial(trial_id: str) -> Unary[TrialInfo]:
    return _unary("TrialService/Get", lambda m: _read.trial_info(m.trial), id=trial_id)


def load_trial(trial_id: str) -> Unary[Trial]:
    return _unary("TrialService/Load", lambda m: _read.trial(m.trial), id=trial_id)


def segments(trial_id: str, options: Options | None) -> Upload[Segmentation]:
    header = {"id": trial_id, "options": options_text(options)}
    return Upload(method("TrialService/Segments"), header, b"", _read.segmentation)


def segments_of(trial: TrialFile, options: Options | None) -> Upload[Segmentation]:
    source, data = trial_bytes(trial)
    header = {"name": source, "options": options_text(options)}
    return Upload(method("TrialService/Segments"), header, data, _read.segmentation)


def export_trial(trial_id: str) -> Download:
    found = method("TrialService/Export")
    return Download(found, found.request(id=trial_id))


def delete_trial(trial_id: str) -> Unary[None]:
    return _unary("TrialService/Delete", _nothing, id=trial_id)


def set_person(trial_id: str, person: str) -> Unary[None]:
    return _unary("TrialService/SetPerson", _nothing, id=trial_id, person=person)


# ---- SkillService ----


def learn(name: str, options: Options | None) -> Long[Progress, SkillReport]:
    found = method("SkillService/Learn")
    request = found.request(name=name, options=options_text(options))
    return Long(found, request, "progress", _read.progress, "report", _read.skill_report)


def get_skill(name: str, version: int) -> Unary[SkillReport]:
    return _unary("SkillService/Get", lambda m: _read.skill_report(m.report), skill=skill(name, version))


def list_skills() -> Unary[tuple[SkillInfo, ...]]:
    return _unary("SkillService/List", lambda m: tuple(_read.skill_info(x) for x in m.skills))


def versions(name: str) -> Unary[tuple[SkillVersion, ...]]:
    return _unary(
        "SkillService/Versions",
        lambda m: tuple(_read.skill_version(x) for x in m.versions),
        name=name,
    )


def rollback(name: str, version: int) -> Unary[None]:
    return _unary("SkillService/Rollback", _nothing, name=name, version=version)


def query_skill(
    name: str,
    objects: Objects,
    start: PoseLike | None,
    joint_start: JointStart | None,
    version: int,
) -> Unary[Motion]:
    return _unary(
        "SkillService/Query",
        lambda m: _read.motion(m.motion),
        skill=skill(name, version),
        query=query(objects, start, joint_start),
    )


def evaluate(name: str, trial: TrialFile, version: int) -> Upload[Evaluation]:
    source, data = trial_bytes(trial)
    header = {"skill": skill(name, version), "name": source}
    return Upload(method("SkillService/Evaluate"), header, data, _read.evaluation)


def suggest(name: str, count: int, version: int) -> Unary[Suggestions]:
    return _unary("SkillService/Suggest", _read.suggestions, skill=skill(name, version), count=count)


def delete_skill(name: str) -> Unary[None]:
    return _unary("SkillService/Delete", _nothing, name=name)


def export_skill(name: str, version: int) -> Download:
    found = method("SkillService/Export")
    return Download(found, found.request(skill=skill(name, version)))


# ---- ExecutorService ----


def plan(
    name: str, objects: Objects | None, speed: float, start: PoseLike | None, follow: bool, version: int
) -> Unary[Plan]:
    return _unary(
        "ExecutorService/Plan",
        lambda m: _read.plan(m.plan),
        True,
        execution=execution(name, objects, speed, start, follow, version),
    )


def execute(
    name: str,
    objects: Objects | None,
    speed: float,
    start: PoseLike | None,
    follow: bool,
    detached: bool,
    version: int,
) -> Long[Feedback, ExecutionResult]:
    found = method("ExecutorService/Execute")
    request = found.request(execution=execution(name, objects, speed, start, follow, version), detached=detached)
    return Long(found, request, "feedback", _read.feedback, "result", _read.execution_result)


def robot_status() -> Unary[RobotStatus]:
    return _unary("ExecutorService/GetStatus", _read.robot_status)


def robot(name: str) -> Unary[None]:
    """Pause, Resume, Cancel, Stop or Reset."""
    return _unary(f"ExecutorService/{name}", _nothing)


def set_speed(factor: float) -> Unary[None]:
    return _unary("ExecutorService/SetSpeed", _nothing, factor=factor)


def teleoperate(suit: str, touch: Sequence[str], detached: bool) -> Long[TeleoperationFeedback, TeleoperationResult]:
    found = method("ExecutorService/Teleoperate")
    request = found.request(suit=suit, touch=list(touch), detached=detached)
    return Long(found, request, "feedback", _read.teleoperation_feedback, "result", _read.teleoperation_result)


def end_teleoperation() -> Unary[None]:
    return _unary("ExecutorService/EndTeleoperation", _nothing)


# ---- RecorderService ----


def _status(m: Message) -> RecorderStatus:
    return _read.recorder_status(m.status)


def start_recording(
    name: str,
    metadata: Mapping[str, str] | None,
    expected_topics: Sequence[str],
    expect_timeout_s: float,
    split_bytes: int,
    split_s: float,
) -> Unary[RecorderStatus]:
    return _unary(
        "RecorderService/Start",
        _status,
        name=name,
        metadata=dict(metadata or {}),
        expected_topics=list(expected_topics),
        timeout_s=expect_timeout_s,
        split_bytes=split_bytes,
        split_s=split_s,
    )


def recorder(name: str) -> Unary[RecorderStatus]:
    """Stop, Pause, Resume or GetStatus."""
    return _unary(f"RecorderService/{name}", _status)


def mark_event(note: str, name: str, metadata: Mapping[str, str] | None) -> Unary[RecorderStatus]:
    return _unary("RecorderService/MarkEvent", _status, note=note, name=name, metadata=dict(metadata or {}))


# ---- TopicService ----


def _plain(value: Any) -> Any:
    """Numpy's arrays and numbers as JSON has them."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise InvalidArgumentError(f"a {type(value).__name__} cannot be published", "sample")


def list_topics(topics: Sequence[str]) -> Unary[tuple[TopicInfo, ...]]:
    return _unary("TopicService/List", lambda m: tuple(_read.topic_info(x) for x in m.topics), topics=list(topics))


def subscribe(
    topics: Sequence[str], max_rate_hz: float, queue: int, content: Content, last: bool
) -> Stream[TopicBatch]:
    if content not in _CONTENTS:
        raise InvalidArgumentError(f'content is "{content}", must be one of {", ".join(_CONTENTS)}', "content")
    found = method("TopicService/Subscribe")
    request = found.request(
        topics=list(topics), max_rate_hz=max_rate_hz, queue=queue, content=_CONTENTS[content], skip_last=not last
    )
    return Stream(found, request, _read.topic_batch)


def publish(topic: str, sample: Sample, type_name: str, schema: str) -> Unary[None]:
    found = method("TopicService/Publish")
    request = found.request(topic=topic, type=type_name, schema=schema)
    if isinstance(sample, bytes):
        request.cdr = sample
    else:
        request.json = json.dumps(sample, default=_plain)
    return Unary(found, request, _nothing)
