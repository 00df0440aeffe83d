"""A station's topics through the gateway: listed, subscribed to and published, with and without asyncio."""

import asyncio
import subprocess
import sys
from collections.abc import Iterator

import pytest

import exemplar
import processes
from conftest import ROOT, Station

STATE = "ircp/joint_state"


@pytest.fixture(scope="module")
def gateway(station: Station) -> Iterator[exemplar.Client]:
    """Beside a robot that tells its state."""
    if not (processes.BINARIES / "exemplar-gateway").exists():
        pytest.skip("there is no gateway")
    station.executor()
    address = station._server("gateway", "--learning", station.learning(), "--publish", "ircp/objects")
    with exemplar.Client(address) as client:
        processes.wait_for(lambda: client.topics.list(STATE), STATE)
        yield client


def test_topics_are_listed(gateway: exemplar.Client) -> None:
    (state,) = gateway.topics.list(STATE)
    assert state.type.endswith("JointState")
    assert "struct" in state.schema
    assert state.writers == 1
    assert gateway.topics.list("nothing/*") == ()
    assert STATE in {info.topic for info in gateway.topics.list("ircp/*")}


def test_samples_come_with_their_members_or_their_bytes(gateway: exemplar.Client) -> None:
    with gateway.topics.subscribe(STATE) as samples:
        first, second = next(samples), next(samples)
    assert first.value is not None
    assert len(first.value["positions"]) == 7
    assert second.sequence > first.sequence
    assert (first.topic, first.error, first.cdr) == (STATE, "", b"")
    assert samples.topics[STATE].type.endswith("JointState")
    assert samples.missed == 0
    assert list(samples) == []

    with gateway.topics.subscribe(STATE, content="cdr", max_rate_hz=10) as samples:
        raw = next(samples)
    assert raw.value is None
    assert raw.cdr[0] == 0
    with pytest.raises(exemplar.InvalidArgumentError) as refused:
        gateway.topics.subscribe(STATE, content="xml")  # type: ignore[arg-type]
    assert refused.value.field == "content"


def test_what_is_published_arrives_and_what_may_not_be_is_refused(gateway: exemplar.Client) -> None:
    sample = {"name": "cup", "position": [0.5, 0.1, 0.2]}
    with pytest.raises(exemplar.ExemplarError):
        gateway.topics.publish("ircp/joint_command", sample)
    with pytest.raises(exemplar.ExemplarError):
        gateway.topics.publish("ircp/objects", {"no_such_member": 1})


def test_asyncio_does_the_same(gateway: exemplar.Client, station: Station) -> None:
    async def body() -> None:
        async with exemplar.AsyncClient(station._addresses["gateway"]) as client:
            (state,) = await client.topics.list(STATE)
            assert state.writers == 1
            async with client.topics.subscribe(STATE) as samples:
                values = [await anext(samples) for _ in range(3)]
            assert [value.topic for value in values] == [STATE] * 3
            assert [sample async for sample in samples] == []
            with pytest.raises(exemplar.ExemplarError):
                await client.topics.publish("ircp/joint_command", {})

    asyncio.run(body())


def test_the_example_shows_topics_and_samples(gateway: exemplar.Client, station: Station) -> None:
    example = ROOT / "clients" / "python" / "examples" / "04_topics.py"
    command = [sys.executable, example, STATE, "--server", station._addresses["gateway"], "--samples", "3"]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("positions") == 3
    assert done.stdout.endswith("0 missed\n")


def test_the_learning_service_has_no_topics(client: exemplar.Client) -> None:
    with pytest.raises(exemplar.UnimplementedError):
        client.topics.list()
    with pytest.raises(exemplar.UnimplementedError):
        next(client.topics.subscribe(STATE))
