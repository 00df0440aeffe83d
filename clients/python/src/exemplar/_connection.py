"""What a connection needs, whether it blocks or not: addresses, limits, names of calls, the outcome of long calls."""

from __future__ import annotations

import itertools
import os
import secrets
from collections import deque
from pathlib import Path
from typing import Generic, TypeVar

import grpc

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
from ._values import Motion, TopicBatch, TopicInfo, TopicSample
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


class Credentials:
    """Whom a client believes, and how it proves who it is. What is not given comes from the environment:
    EXEMPLAR_TLS_CA, EXEMPLAR_TLS_CERT, EXEMPLAR_TLS_KEY, EXEMPLAR_TOKEN.
    """

    def __init__(self, tls_ca: str | None, tls_cert: str | None, tls_key: str | None, token: str | None) -> None:
        ca = tls_ca or os.environ.get("EXEMPLAR_TLS_CA", "")
        certificate = tls_cert or os.environ.get("EXEMPLAR_TLS_CERT", "")
        key = tls_key or os.environ.get("EXEMPLAR_TLS_KEY", "")
        given = token or os.environ.get("EXEMPLAR_TOKEN") or ""
        if bool(certificate) != bool(key):
            raise InvalidArgumentError("tls_cert and tls_key must be given together", "tls_cert")
        if certificate and not ca:
            raise InvalidArgumentError("tls_cert needs tls_ca, the CA of the server", "tls_ca")
        self.token = _bytes(given[1:], "token").decode().strip() if given.startswith("@") else given
        self.channel = (
            grpc.ssl_channel_credentials(
                _bytes(ca, "tls_ca"),
                _bytes(key, "tls_key") if key else None,
                _bytes(certificate, "tls_cert") if certificate else None,
            )
            if ca
            else None
        )

    def check(self, address: str) -> None:
        """The token must not cross a network in plain text."""
        host = address.rpartition(":")[0].strip("[]")
        local = host in ("localhost", "::1") or host.startswith("127.")
        if self.token and self.channel is None and not local:
            raise FailedPreconditionError(
                f"the token would cross the network to {host} in plain text; give tls_ca", "tls_ca"
            )


def _bytes(path: str, field: str) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise InvalidArgumentError(f"{field}: {path} cannot be read: {error.strerror}", field) from None


class Settings:
    """Where the services are, who calls, and how long a call may take. Thread-safe."""

    def __init__(
        self,
        server: str | None,
        learning: str | None,
        executor: str | None,
        recorder: str | None,
        timeout: float | None,
        credentials: Credentials,
    ) -> None:
        one = checked_address(server or os.environ.get("EXEMPLAR_SERVER") or DEFAULT_SERVER, "server")
        of_learning = checked_address(learning or one, "learning")
        of_recorder = checked_address(recorder or one, "recorder")
        self._addresses = {
            "TrialService": of_learning,
            "SkillService": of_learning,
            "LearningDataService": of_learning,
            "ExecutorService": checked_address(executor or one, "executor"),
            "RecorderService": of_recorder,
            "RecorderDataService": of_recorder,
            "TopicService": one,
        }
        self.credentials = credentials
        for address in self._addresses.values():
            credentials.check(address)
        self.timeout = timeout
        _calls.limit_s(timeout, None, long=False)
        self._request_id = f"request-{secrets.token_hex(8)}"
        self._numbers = itertools.count(1)

    def address(self, of: Method) -> str:
        """Who serves a method."""
        return self._addresses[of.service]

    def metadata(self) -> tuple[tuple[str, str], ...]:
        """Names a call in the services' logs, and the caller."""
        named = (("x-request-id", f"{self._request_id}-{next(self._numbers)}"),)
        token = self.credentials.token
        return (*named, ("authorization", f"Bearer {token}")) if token else named


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


class Arrivals:
    """What has come of a subscription and was not taken yet. Not thread-safe."""

    def __init__(self) -> None:
        self._waiting: deque[TopicSample] = deque()
        self.missed = 0
        self.topics: dict[str, TopicInfo] = {}

    def add(self, batch: TopicBatch) -> None:
        """Keeps it."""
        self._waiting.extend(batch.samples)
        self.topics.update((info.topic, info) for info in batch.topics)
        self.missed = batch.missed

    def take(self) -> TopicSample | None:
        """The oldest."""
        return self._waiting.popleft() if self._waiting else None


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
