"""The simulated robot by the executor, and the recorder, over DDS."""

import asyncio
import pathlib
import time
from collections.abc import Iterator

import numpy as np
import pytest

import exemplar
from conftest import BUTTON, Station

TARGET = {"target": BUTTON}


@pytest.fixture(scope="module")
def station_client(station: Station, press: exemplar.Skill) -> Iterator[exemplar.Client]:
    """Each service at its own address."""
    learning, executor, recorder = station.learning(), station.executor(), station.recorder()
    with exemplar.Client(learning=learning, executor=executor, recorder=recorder) as client:
        yield client


def until(condition: object, limit_s: float = 60.0) -> None:
    deadline = time.monotonic() + limit_s
    assert callable(condition)
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def at_rest(client: exemplar.Client) -> bool:
    """Whether the robot has come to rest: until then, no other motion is planned."""
    try:
        return client.robot.plan("press", TARGET).duration_s > 0
    except (exemplar.FailedPreconditionError, exemplar.UnavailableError):  # the latter after a while of slowing down
        return False


def test_the_robot_says_where_it_is(station_client: exemplar.Client) -> None:
    status = station_client.robot.status()
    assert status.speed == 1.0
    assert len(status.joint_names) == len(status.joints) == 7
    assert status.tool is not None
    assert status.tool.quaternion is not None
    assert status.state_age_s < 5


def test_what_is_out_of_reach_is_refused(station_client: exemplar.Client) -> None:
    with pytest.raises(exemplar.FailedPreconditionError) as refused:
        station_client.robot.plan("press", {"target": [3.0, 0.0, 0.06]})
    assert refused.value.code == "failed_precondition"
    with pytest.raises(exemplar.FailedPreconditionError):
        station_client.robot.execute("press", {"target": [3.0, 0.0, 0.06]}).result()
    with pytest.raises(exemplar.NotFoundError):
        station_client.robot.plan("nothing", TARGET)
    with pytest.raises(exemplar.InvalidArgumentError) as speed:
        station_client.robot.plan("press", TARGET, speed=2.0)
    assert speed.value.field == "execution.speed"


def test_an_execution_is_recorded_and_reported(station_client: exemplar.Client) -> None:
    robot, recorder = station_client.robot, station_client.recorder
    started = recorder.start("pressed", metadata={"who": "test"}, expected_topics=["ircp/joint_state"])
    assert started.state == "recording"
    with pytest.raises(exemplar.FailedPreconditionError):
        recorder.start("again")

    plan = robot.plan("press", TARGET)
    assert plan.duration_s > 0
    assert plan.clearance_m > 0
    execution = station_client.skill("press").execute(BUTTON)
    feedback = list(execution)
    result = execution.result()
    assert result.done, result.detail
    assert "executing" in {now.state for now in feedback}
    times = [now.time_s for now in feedback]
    assert times == sorted(times)
    assert result.contact_error_m is not None
    assert result.contact_error_m < 0.0127
    assert result.tool.shape == (len(result.tool_time_s), 7)
    assert np.linalg.norm(result.tool[:, :3] - BUTTON, axis=1).min() < 0.03
    np.testing.assert_allclose(result.objects["target"].position, BUTTON)
    assert execution.result() is result

    assert recorder.mark_event("pressed").state == "recording"
    assert recorder.pause().state == "paused"
    assert recorder.resume().state == "recording"
    stopped = recorder.stop()
    assert pathlib.Path(stopped.file).read_bytes()[-8:] == b"\x89MCAP0\r\n"
    assert stopped.pauses == 1
    topics = {topic.topic: topic for topic in stopped.topics}
    assert topics["ircp/joint_state"].received > 0
    assert topics["ircp/joint_command"].received > 0
    assert recorder.status().file == stopped.file


def test_a_motion_pauses_goes_on_and_is_cancelled(station_client: exemplar.Client) -> None:
    robot = station_client.robot
    robot.set_speed(0.3)  # not over before it is paused
    states = []
    execution = robot.execute("press", TARGET)
    for now in execution:
        if now.state not in states:
            states.append(now.state)
            if now.state == "executing":
                robot.pause()
            elif now.state == "paused":
                robot.resume()
        elif now.state == "executing" and "paused" in states:
            robot.cancel()
    result = execution.result()
    assert "paused" in states
    assert not result.done
    assert result.detail
    until(lambda: at_rest(station_client))
    robot.set_speed(1.0)


def test_cancelling_the_call_holds_the_robot(station_client: exemplar.Client) -> None:
    with station_client.robot.execute("press", TARGET) as execution:
        next(now for now in execution if now.state == "executing")
    with pytest.raises(exemplar.CancelledError):
        execution.result()
    until(lambda: at_rest(station_client))


def test_after_a_stop_motions_wait_for_a_reset(station: Station, station_client: exemplar.Client) -> None:
    async def body() -> None:
        async with exemplar.AsyncClient(station.learning(), executor=station.executor()) as client:
            execution = client.robot.execute("press", TARGET)
            async for now in execution:
                if now.state == "executing":
                    await client.robot.stop()
            assert not (await execution.result()).done
            with pytest.raises(exemplar.FailedPreconditionError):
                await client.robot.execute("press", TARGET).result()
            await client.robot.reset()
            await asyncio.to_thread(until, lambda: at_rest(station_client))

            # Whoever waits for a motion and is cancelled takes the motion with him.
            moving = client.robot.execute("press", TARGET)
            async for now in moving:
                if now.state == "executing":
                    break
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(moving.result(), 0.05)

    asyncio.run(body())
    until(lambda: at_rest(station_client))
