"""The asyncio client: the same calls, and what is its own."""

import asyncio
import inspect
import pathlib
import re
from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np
import pytest

import exemplar
from conftest import BUTTON, Station

NAMESPACES = ("trials", "skills", "robot", "recorder", "topics", "learning_data", "recorder_data")


def public(of: object) -> dict[str, Callable[..., Any]]:
    return {name: method for name, method in inspect.getmembers(of, callable) if not name.startswith("_")}


def signature(method: Callable[..., Any]) -> str:
    """Parameters, defaults and types, without what is asynchronous by nature."""
    return re.sub(r"\bAsync(\w+)", r"\1", str(inspect.signature(method)))


def test_both_clients_have_the_same_calls() -> None:
    sync, other = exemplar.Client("127.0.0.1:1"), exemplar.AsyncClient("127.0.0.1:1")
    pairs = [(getattr(sync, name), getattr(other, name)) for name in NAMESPACES]
    pairs += [(sync, other), (sync.skill("press"), other.skill("press"))]
    for one, two in pairs:
        mine, theirs = public(one), public(two)
        assert mine.keys() == theirs.keys()
        for name, method in mine.items():
            assert signature(method) == signature(theirs[name]), f"{type(one).__name__}.{name}"
            assert inspect.getdoc(method) == inspect.getdoc(theirs[name]), f"{type(one).__name__}.{name}"


def run(station: Station, body: Callable[[exemplar.AsyncClient], Coroutine[Any, Any, None]]) -> None:
    async def connected() -> None:
        async with exemplar.AsyncClient(station.learning()) as client:
            await body(client)

    asyncio.run(connected())


def test_learns_and_answers(station: Station, press: exemplar.Skill, files: list[pathlib.Path]) -> None:
    async def body(client: exemplar.AsyncClient) -> None:
        skill = client.skill("awaited")
        submissions = await skill.submit(*files[:3])
        assert [s.trial.id for s in submissions] == [t.id for t in await client.trials.list("awaited")]
        learning = skill.learn()
        fractions = [progress.fraction async for progress in learning]
        assert fractions == sorted(fractions)
        report = await learning.result()
        assert report.skill == "awaited"
        # Several calls at once over one connection.
        motions = await asyncio.gather(*(client.skill("press").query(BUTTON) for _ in range(4)))
        expected = press.query(BUTTON)
        for motion in motions:
            np.testing.assert_array_equal(motion.positions, expected.positions)
        assert (await client.trials.export(submissions[0].trial.id)).startswith(b"time_s")

    run(station, body)


def test_a_stream_goes_on_after_a_question_that_failed(station: Station, press: exemplar.Skill) -> None:
    async def body(client: exemplar.AsyncClient) -> None:
        async with client.skills.query_stream("press") as stream:
            places = [np.add(BUTTON, [0.01 * i, 0, 0]) for i in range(5)]
            motions = await asyncio.gather(*(stream.query({"target": place}) for place in places))
            for place, motion in zip(places, motions, strict=True):
                np.testing.assert_allclose(motion.objects["target"].position, place)
            with pytest.raises(exemplar.ExemplarError, match="elephant"):
                await stream.query({"elephant": BUTTON})
            await stream.query({"target": BUTTON})
        with pytest.raises(exemplar.ExemplarError):
            await stream.query({"target": BUTTON})

    run(station, body)


def test_cancelling_a_call_is_an_error_and_cancelling_a_task_is_asyncios(silent: str) -> None:
    async def body() -> None:
        async with exemplar.AsyncClient(silent) as client:
            learning = client.skills.learn("press")
            learning.cancel()
            for _ in range(2):
                with pytest.raises(exemplar.CancelledError):
                    await learning.result()

            for waiting in (client.skills.learn("press").result(), client.skills.list()):
                task = asyncio.create_task(waiting)
                await asyncio.sleep(0.02)
                task.cancel()
                with pytest.raises(asyncio.CancelledError):
                    await task

    asyncio.run(body())


def test_closing_the_client_ends_what_waits(silent: str) -> None:
    async def body() -> None:
        client = exemplar.AsyncClient(silent)
        waiting = [
            asyncio.create_task(client.skills.list()),
            asyncio.create_task(client.skills.learn("press").result()),
        ]
        async with client.skills.query_stream("press") as stream:
            waiting.append(asyncio.create_task(stream.query({"target": BUTTON})))
            await asyncio.sleep(0.05)
            await client.close()
            for outcome in await asyncio.gather(*waiting, return_exceptions=True):
                assert isinstance(outcome, exemplar.CancelledError), outcome
        with pytest.raises(exemplar.FailedPreconditionError, match="closed"):
            await client.skills.list()

    asyncio.run(body())


def test_errors_and_deadlines_are_those_of_the_other_client(
    station: Station, press: exemplar.Skill, silent: str
) -> None:
    async def body(client: exemplar.AsyncClient) -> None:
        with pytest.raises(exemplar.InvalidArgumentError) as invalid:
            await client.skills.query("press", {"": BUTTON})
        assert invalid.value.field == "query.objects[0].name"
        with pytest.raises(exemplar.NotFoundError):
            await client.skill("nothing").learn().result()
        async with exemplar.AsyncClient(silent, timeout=0.01) as waiting:
            with pytest.raises(exemplar.DeadlineExceededError):
                await waiting.skills.list()
            with pytest.raises(exemplar.DeadlineExceededError):
                await waiting.skills.learn("press", timeout=0.01).result()
            async with waiting.skills.query_stream("press", timeout=0.01) as stream:
                with pytest.raises(exemplar.DeadlineExceededError):
                    await stream.query({"target": BUTTON})

    run(station, body)
