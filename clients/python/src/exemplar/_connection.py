"""What a connection needs, whether it blocks or not: addresses, limits, names of calls, the outcome of long calls."""

from __future__ import annotations

import itertools
import os
import secrets
from typing import Generic, TypeVar

from . import _calls, _read
from ._errors import (
    ExemplarError,
    FailedPreconditionError,
    InternalError,
    InvalidArgumentError,
    UnavailableError,
    from_detail,
)
from ._pose import Objects, PoseLike
from ._values import Motion
from ._wire import Message, Method, method

T = TypeVar("T")
P = TypeVar("P")

DEFAULT_SERVER = "127.0.0.1:50051"

CHANNEL_OPTIONS: list[tuple[str, int]] = [
    # A proxy set for the browser must not come between a robot and its services.
    ("grpc.enable_http_proxy", 0),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.max_reconnect_backoff_ms", 1_000),
    ("grpc.keepalive_time_ms", 20_000),
    ("grpc.keepalive_timeout_ms", 10_000),
    ("grpc.max_receive_message_length", -1),
]


class Settings:
    """Where the services are, and how long a call may take. Thread-safe."""

    def __init__(
        self,
        server: str | None,
        learning: str | None,
        executor: str | None,
        recorder: str | None,
        timeout: float | None,
    ) -> None:
        one = checked_address(server or os.environ.get("EXEMPLAR_SERVER") or DEFAULT_SERVER, "server")
        of_learning = checked_address(learning or one, "learning")
        self._addresses = {
            "TrialService": of_learning,
            "SkillService": of_learning,
            "ExecutorService": checked_address(executor or one, "executor"),
            "RecorderService": checked_address(recorder or one, "recorder"),
        }
        self.timeout = timeout
        _calls.limit_s(timeout, None, long=False)
        self._request_id = f"request-{secrets.token_hex(8)}"
        self._numbers = itertools.count(1)

    def address(self, of: Method) -> str:
        """Who serves a method."""
        return self._addresses[of.service]

    def metadata(self) -> tuple[tuple[str, str], ...]:
        """Names a call in the services' logs."""
        return (("x-request-id", f"{self._request_id}-{next(self._numbers)}"),)


def checked_address(address: str, name: str) -> str:
    """HOST:PORT."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
        raise InvalidArgumentError(f'{name} address "{address}" is not HOST:PORT', name)
    return address


def closed() -> ExemplarError:
    """What is raised by a client that was closed."""
    return FailedPreconditionError("the client is closed")


class Outcome(Generic[P, T]):
    """What has come of a long call so far."""

    def __init__(self, call: _calls.Long[P, T]) -> None:
        self._call = call
        self._result: T | None = None
        self._error: ExemplarError | None = None

    @property
    def ended(self) -> bool:
        """Whether there is a result or an error."""
        return self._result is not None or self._error is not None

    def take(self, message: Message) -> P | None:
        """The progress that a message holds; None for the result, which is kept."""
        if message.HasField(self._call.result):
            self._result = self._call.read_result(getattr(message, self._call.result))
            return None
        return self._call.read_progress(getattr(message, self._call.progress))

    def finish(self, error: ExemplarError | None = None) -> None:
        """The call has ended; how does not matter any more once the result is there. Raises what ended it instead."""
        if self._result is None:
            self._error = error or InternalError("the service ended the call without a result")
            raise self._error from None

    def value(self) -> T:
        """The result; raises what ended the call instead."""
        if self._error is not None:
            raise self._error
        assert self._result is not None
        return self._result


class QueryStream:
    """One skill's questions and answers over one stream. Not thread-safe."""

    def __init__(self, name: str, version: int) -> None:
        self.method = method("SkillService/QueryStream")
        self._skill = _calls.skill(name, version)
        self._tag = 0

    def request(self, objects: Objects, start: PoseLike | None, joint_start: _calls.JointStart | None) -> Message:
        """The next question."""
        query = _calls.query(objects, start, joint_start)
        self._tag += 1
        return self.method.request(skill=self._skill, query=query, tag=self._tag)

    def answers(self, message: Message) -> bool:
        """Whether a message answers the last question; one that was given up may come before it."""
        return bool(message.tag == self._tag)

    @staticmethod
    def read(message: Message) -> Motion:
        """The motion; an answer that is an error is raised, and the stream goes on."""
        if message.WhichOneof("answer") == "error":
            raise from_detail(message.error)
        return _read.motion(message.motion)

    @staticmethod
    def ended(address: str) -> ExemplarError:
        """What is raised when there is no answer any more."""
        return UnavailableError(f"{address} ended the stream")
