"""Carries calls out under asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from typing import Any, Generic, TypeVar

import grpc
import grpc.aio

from . import _calls, _data
from ._connection import CHANNEL_OPTIONS, Arrivals, Outcome, QueryStream, Settings, closed
from ._errors import CancelledError, ExemplarError, from_rpc
from ._pose import Objects, PoseLike
from ._values import DataReport, Motion, TopicBatch, TopicInfo, TopicSample
from ._wire import Message, Method

T = TypeVar("T")
P = TypeVar("P")


class AsyncOperation(Generic[P, T]):
    """A call that takes long: iterate over it for what is known on the way, then await its result.

    async for progress in (learning := client.skills.learn("press")):
        print(progress.step)
    report = await learning.result()

    It runs from the moment it is made. It is cancelled by cancel(), at the end of an `async with` block, and with the
    task that waits for it.
    """

    def __init__(self, call: _calls.Long[P, T], stream: Any, address: str) -> None:
        self._outcome = Outcome(call)
        self._stream = stream
        self._address = address

    def __aiter__(self) -> AsyncIterator[P]:
        return self

    async def __anext__(self) -> P:
        if self._outcome.ended:
            raise StopAsyncIteration
        try:
            with _errors_of(self._address):
                while (message := await self._stream.read()) is not grpc.aio.EOF:
                    progress = self._outcome.take(message)
                    if progress is not None:
                        return progress
        except ExemplarError as error:
            self._outcome.finish(error)
        else:
            self._outcome.finish()
        raise StopAsyncIteration

    async def result(self) -> T:
        """Waits for the end. Raises what the service refused or what broke the call."""
        async for _ in self:
            pass
        return self._outcome.value()

    def cancel(self) -> None:
        """Ends the call; iterating over it and its result raise CancelledError."""
        self._stream.cancel()

    async def __aenter__(self) -> AsyncOperation[P, T]:
        return self

    async def __aexit__(self, *_: object) -> None:
        if not self._outcome.ended:
            self.cancel()


class AsyncMotionStream:
    """One skill, asked again and again as its objects move: a question costs less than a call.

    Several tasks may ask; a task that is cancelled while it asks ends the stream.
    """

    def __init__(self, questions: QueryStream, link: AsyncLink, timeout: float | None) -> None:
        self._questions = questions
        self._address = link.settings.address(questions.method)
        self._lock = asyncio.Lock()
        open_stream = link.channel(questions.method).stream_stream(questions.method.path, **questions.method.codec())
        # A queue, as a write of gRPC's own outlives a stream that ends before it is connected.
        self._requests: asyncio.Queue[Message] = asyncio.Queue()
        self._stream = open_stream(
            self._sent(),
            timeout=_calls.limit_s(None, timeout, long=True),
            metadata=link.settings.metadata(),
        )

    async def query(
        self,
        objects: Objects,
        *,
        start: PoseLike | None = None,
        joint_start: _calls.JointStart | None = None,
    ) -> Motion:
        """As `client.skills.query`. An error of the question leaves the stream open; one of the connection ends it."""
        async with self._lock:
            request = self._questions.request(objects, start, joint_start)
            self._requests.put_nowait(request)
            with _errors_of(self._address):
                while (answer := await self._stream.read()) is not grpc.aio.EOF:
                    if self._questions.answers(answer):
                        return self._questions.read(answer)
        raise self._questions.ended(self._address)

    async def _sent(self) -> AsyncIterator[Message]:
        while True:
            yield await self._requests.get()

    async def close(self) -> None:
        """Ends the stream."""
        self._stream.cancel()

    async def __aenter__(self) -> AsyncMotionStream:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()


class AsyncSubscription:
    """Samples as they come: iterate over it. Ends with close(), at the end of an `async with` block, and with the
    client.
    """

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

    def __aiter__(self) -> AsyncIterator[TopicSample]:
        return self

    async def __anext__(self) -> TopicSample:
        try:
            with _errors_of(self._address):
                while (sample := self._arrivals.take()) is None:
                    message = await self._stream.read()
                    if message is grpc.aio.EOF:
                        raise StopAsyncIteration
                    self._arrivals.add(self._read(message))
        except ExemplarError:
            if self._closed:
                raise StopAsyncIteration from None
            raise
        return sample

    async def close(self) -> None:
        """Ends it."""
        self._closed = True
        self._stream.cancel()

    async def __aenter__(self) -> AsyncSubscription:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()


class AsyncLink:
    """Channels to the services, one an address, opened when first used. Belongs to one event loop."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._channels: dict[str, grpc.aio.Channel] = {}
        self._closed = False

    def channel(self, method: Method) -> Any:
        """The channel to who serves a method."""
        address = self.settings.address(method)
        if self._closed:
            raise closed()
        if address not in self._channels:
            credentials = self.settings.credentials.channel
            self._channels[address] = (
                grpc.aio.secure_channel(address, credentials, options=CHANNEL_OPTIONS)
                if credentials
                else grpc.aio.insecure_channel(address, options=CHANNEL_OPTIONS)
            )
        return self._channels[address]

    async def close(self) -> None:
        """Ends all calls."""
        self._closed = True
        channels, self._channels = self._channels, {}
        for channel in channels.values():
            await channel.close()

    async def unary(self, call: _calls.Unary[T], timeout: float | None = None) -> T:
        """Answers."""
        invoke = self.channel(call.method).unary_unary(call.method.path, **call.method.codec())
        return call.read(await self._wait(call.method, invoke, call.request, timeout, call.long))

    async def upload(self, call: _calls.Upload[T], timeout: float | None = None) -> T:
        """Answers once the file is sent."""
        invoke = self.channel(call.method).stream_unary(call.method.path, **call.method.codec())
        return call.read(await self._wait(call.method, invoke, call.requests(), timeout, False))

    async def download(self, call: _calls.Download, timeout: float | None = None) -> bytes:
        """The file's bytes."""
        stream = self._open(call.method, call.request, _calls.limit_s(self.settings.timeout, timeout, False))
        with _errors_of(self.settings.address(call.method)):
            return b"".join([part.chunk.data async for part in stream])

    def long(self, call: _calls.Long[P, T], timeout: float | None = None) -> AsyncOperation[P, T]:
        """Begins."""
        stream = self._open(call.method, call.request, _calls.limit_s(None, timeout, True))
        return AsyncOperation(call, stream, self.settings.address(call.method))

    async def copy(self, call: _data.Copy, timeout: float | None = None) -> None:
        """Into the backup's file."""
        stream = self._open(call.method, call.request, _calls.limit_s(None, timeout, True))
        with _errors_of(self.settings.address(call.method)):
            async for message in stream:
                call.take(message)

    async def restore(self, call: _data.Restoration, timeout: float | None = None) -> DataReport:
        """Answers once all is sent and taken over."""
        invoke = self.channel(call.method).stream_unary(call.method.path, **call.method.codec())
        return call.read(await self._wait(call.method, invoke, call.requests(), timeout, True))

    def subscribe(self, call: _calls.Stream[TopicBatch], timeout: float | None = None) -> AsyncSubscription:
        """Begins."""
        stream = self._open(call.method, call.request, _calls.limit_s(None, timeout, True))
        return AsyncSubscription(call, stream, self.settings.address(call.method))

    def _open(self, method: Method, request: Message, limit_s: float | None) -> Any:
        invoke = self.channel(method).unary_stream(method.path, **method.codec())
        return invoke(request, timeout=limit_s, metadata=self.settings.metadata())

    async def _wait(self, method: Method, invoke: Any, request: Any, timeout: float | None, long: bool) -> Message:
        limit_s = _calls.limit_s(self.settings.timeout, timeout, long)
        with _errors_of(self.settings.address(method)):
            return await invoke(request, timeout=limit_s, metadata=self.settings.metadata())


@contextmanager
def _errors_of(address: str) -> Iterator[None]:
    """Turns what gRPC raises into our exceptions."""
    try:
        yield
    except grpc.aio.AioRpcError as error:
        raise from_rpc(error, address) from None
    except asyncio.CancelledError:
        # gRPC raises the same for a call that was cancelled as asyncio does for the task that waits for it.
        task = asyncio.current_task()
        if task is None or task.cancelling() > 0:
            raise
        raise CancelledError(f"the call to {address} was cancelled") from None
