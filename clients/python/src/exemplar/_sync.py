"""Carries calls out and waits for them."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Generic, TypeVar

import grpc

from . import _calls, _data
from ._connection import CHANNEL_OPTIONS, Arrivals, Outcome, QueryStream, Settings, closed
from ._errors import from_rpc
from ._pose import Objects, PoseLike
from ._values import DataReport, Motion, TopicBatch, TopicInfo, TopicSample
from ._wire import Message, Method

T = TypeVar("T")
P = TypeVar("P")


class Operation(Generic[P, T]):
    """A call that takes long: iterate over it for what is known on the way, then ask for its result.

    for progress in (learning := client.skills.learn("press")):
        print(progress.step)
    report = learning.result()

    It runs from the moment it is made. It is cancelled by cancel() (from any thread), at the end of a `with` block, and
    when nobody holds it any more.
    """

    def __init__(self, call: _calls.Long[P, T], stream: Any, address: str) -> None:
        self._outcome = Outcome(call)
        self._stream = stream
        self._address = address

    def __iter__(self) -> Iterator[P]:
        return self

    def __next__(self) -> P:
        if self._outcome.ended:
            raise StopIteration
        try:
            for message in self._stream:
                progress = self._outcome.take(message)
                if progress is not None:
                    return progress
        except grpc.RpcError as error:
            self._outcome.finish(from_rpc(error, self._address))
        else:
            self._outcome.finish()
        raise StopIteration

    def result(self) -> T:
        """Waits for the end. Raises what the service refused or what broke the call."""
        for _ in self:
            pass
        return self._outcome.value()

    def cancel(self) -> None:
        """Ends the call; iterating over it and its result raise CancelledError."""
        self._stream.cancel()

    def __enter__(self) -> Operation[P, T]:
        return self

    def __exit__(self, *_: object) -> None:
        if not self._outcome.ended:
            self.cancel()


class MotionStream:
    """One skill, asked again and again as its objects move: a question costs less than a call. Thread-safe."""

    def __init__(self, questions: QueryStream, link: Link, timeout: float | None) -> None:
        self._questions = questions
        self._address = link.settings.address(questions.method)
        self._requests: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._lock = threading.Lock()
        open_stream = link.channel(questions.method).stream_stream(questions.method.path, **questions.method.codec())
        self._answers = open_stream(
            iter(self._requests.get, None),
            timeout=_calls.limit_s(None, timeout, long=True),
            metadata=link.settings.metadata(),
        )

    def query(
        self,
        objects: Objects,
        *,
        start: PoseLike | None = None,
        joint_start: _calls.JointStart | None = None,
    ) -> Motion:
        """As `client.skills.query`. An error of the question leaves the stream open; one of the connection ends it."""
        with self._lock:
            self._requests.put(self._questions.request(objects, start, joint_start))
            with _errors_of(self._address):
                for answer in self._answers:
                    if self._questions.answers(answer):
                        return self._questions.read(answer)
        raise self._questions.ended(self._address)

    def close(self) -> None:
        """Ends the stream."""
        self._requests.put(None)
        self._answers.cancel()

    def __enter__(self) -> MotionStream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Subscription:
    """Samples as they come: iterate over it. Ends with close(), at the end of a `with` block, and with the client."""

    def __init__(self, call: _calls.Stream[TopicBatch], stream: Any, address: str) -> None:
        self._arrivals = Arrivals()
        self._read = call.read
        self._stream = stream
        self._address = address
        self._closed = False

    @property
    def missed(self) -> int:
        """Samples that the gateway dropped because this client was slow."""
        return self._arrivals.missed

    @property
    def topics(self) -> dict[str, TopicInfo]:
        """Of which samples came, by name."""
        return self._arrivals.topics

    def __iter__(self) -> Iterator[TopicSample]:
        return self

    def __next__(self) -> TopicSample:
        try:
            while (sample := self._arrivals.take()) is None:
                self._arrivals.add(self._read(next(self._stream)))
        except grpc.RpcError as error:
            if self._closed:
                raise StopIteration from None
            raise from_rpc(error, self._address) from None
        return sample

    def close(self) -> None:
        """Ends it, from any thread."""
        self._closed = True
        self._stream.cancel()

    def __enter__(self) -> Subscription:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Link:
    """Channels to the services, one an address, opened when first used. Thread-safe."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._channels: dict[str, grpc.Channel] = {}
        self._closed = False
        self._lock = threading.Lock()

    def channel(self, method: Method) -> Any:
        """The channel to who serves a method."""
        address = self.settings.address(method)
        with self._lock:
            if self._closed:
                raise closed()
            if address not in self._channels:
                credentials = self.settings.credentials.channel
                self._channels[address] = (
                    grpc.secure_channel(address, credentials, options=CHANNEL_OPTIONS)
                    if credentials
                    else grpc.insecure_channel(address, options=CHANNEL_OPTIONS)
                )
            return self._channels[address]

    def close(self) -> None:
        """Ends all calls."""
        with self._lock:
            self._closed = True
            for channel in self._channels.values():
                channel.close()
            self._channels.clear()

    def unary(self, call: _calls.Unary[T], timeout: float | None = None) -> T:
        """Answers."""
        invoke = self.channel(call.method).unary_unary(call.method.path, **call.method.codec())
        return call.read(self._wait(call.method, invoke, call.request, timeout, call.long))

    def upload(self, call: _calls.Upload[T], timeout: float | None = None) -> T:
        """Answers once the file is sent."""
        invoke = self.channel(call.method).stream_unary(call.method.path, **call.method.codec())
        return call.read(self._wait(call.method, invoke, call.requests(), timeout, False))

    def download(self, call: _calls.Download, timeout: float | None = None) -> bytes:
        """The file's bytes."""
        stream = self._open(call.method, call.request, _calls.limit_s(self.settings.timeout, timeout, False))
        with _errors_of(self.settings.address(call.method)):
            return b"".join(part.chunk.data for part in stream)

    def long(self, call: _calls.Long[P, T], timeout: float | None = None) -> Operation[P, T]:
        """Begins."""
        stream = self._open(call.method, call.request, _calls.limit_s(None, timeout, True))
        return Operation(call, stream, self.settings.address(call.method))

    def copy(self, call: _data.Copy, timeout: float | None = None) -> None:
        """Into the backup's file."""
        stream = self._open(call.method, call.request, _calls.limit_s(None, timeout, True))
        with _errors_of(self.settings.address(call.method)):
            for message in stream:
                call.take(message)

    def restore(self, call: _data.Restoration, timeout: float | None = None) -> DataReport:
        """Answers once all is sent and taken over."""
        invoke = self.channel(call.method).stream_unary(call.method.path, **call.method.codec())
        return call.read(self._wait(call.method, invoke, call.requests(), timeout, True))

    def subscribe(self, call: _calls.Stream[TopicBatch], timeout: float | None = None) -> Subscription:
        """Begins."""
        stream = self._open(call.method, call.request, _calls.limit_s(None, timeout, True))
        return Subscription(call, stream, self.settings.address(call.method))

    def _open(self, method: Method, request: Message, limit_s: float | None) -> Any:
        invoke = self.channel(method).unary_stream(method.path, **method.codec())
        return invoke(request, timeout=limit_s, metadata=self.settings.metadata())

    def _wait(self, method: Method, invoke: Any, request: Any, timeout: float | None, long: bool) -> Message:
        limit_s = _calls.limit_s(self.settings.timeout, timeout, long)
        with _errors_of(self.settings.address(method)):
            return invoke(request, timeout=limit_s, metadata=self.settings.metadata())


@contextmanager
def _errors_of(address: str) -> Iterator[None]:
    """Turns what gRPC raises into our exceptions."""
    try:
        yield
    except grpc.RpcError as error:
        raise from_rpc(error, address) from None
