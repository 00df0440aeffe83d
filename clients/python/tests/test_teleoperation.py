"""A robot that follows a person's suit."""

import asyncio
import csv
import math
import pathlib
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

import exemplar
import processes
from conftest import BUTTON, ROOT, TeleoperatedStation

EXAMPLE = ROOT / "clients" / "python" / "examples" / "06_teleoperate.py"
TARGET = {"target": BUTTON}


@pytest.fixture(scope="module")
def robot(teleoperated: TeleoperatedStation, press: exemplar.Skill) -> Iterator[exemplar.Client]:
    with exemplar.Client(teleoperated.learning(), executor=teleoperated.executor()) as client:
        yield client


@pytest.fixture(autouse=True)
def at_rest(robot: exemplar.Client) -> None:
    """Each test begins with a robot that has come to rest: until then, nothing else begins."""
    wait_for_rest(robot)


def wait_for_rest(client: exemplar.Client) -> None:
    def resting() -> bool:
        try:
            return client.robot.plan("press", TARGET).duration_s > 0
        except (exemplar.FailedPreconditionError, exemplar.UnavailableError):
            return False

    processes.wait_for(resting, "the robot to come to rest")


def wave(teleoperated: TeleoperatedStation, client: exemplar.Client, seconds: float) -> pathlib.Path:
    """A suit's file: from where the robot is, one joint to and fro."""
    status = client.robot.status()
    path: pathlib.Path = teleoperated.programs.folder / f"wave-{seconds}.csv"
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["time_s", *(f"{name}_rad" for name in status.joint_names)])
        for k in range(int(60 * seconds)):
            here = list(status.joints)
            here[0] += 0.1 * (1 - math.cos(2 * math.pi * k / 60 / seconds))
            writer.writerow([k / 60, *here])
    return path


def suit(teleoperated: TeleoperatedStation, file: pathlib.Path) -> Any:
    """Somebody who wears the suit and holds the dead-man."""
    return teleoperated.programs.start("exemplar-capture-suit", "--replay", file, "--dead-man")


def test_the_robot_follows_the_suit_and_says_how(robot: exemplar.Client, teleoperated: TeleoperatedStation) -> None:
    teleoperation = robot.robot.teleoperate()
    first = next(teleoperation)
    assert (first.state, first.phase) == ("teleoperating", "holding")
    with pytest.raises(exemplar.FailedPreconditionError, match="teleoperat"):
        robot.robot.execute("press", TARGET).result()
    wearer = suit(teleoperated, wave(teleoperated, robot, 2.0))
    phases, ended = set(), False
    for now in teleoperation:
        phases.add(now.phase)
        if "following" in phases and wearer.poll() is not None and not ended:
            robot.robot.end_teleoperation()
            ended = True
    result = teleoperation.result()
    assert "following" in phases
    assert result.done, result.detail
    assert result.suit_samples > 60
    assert result.commands_sent > 60
    assert result.following_s > 0.5
    assert result.clearance_m is not None
    assert result.clearance_m > 0


def test_asyncio_ends_the_mode_with_its_block(robot: exemplar.Client, teleoperated: TeleoperatedStation) -> None:
    async def body() -> None:
        async with exemplar.AsyncClient(executor=teleoperated.executor()) as client:
            async with client.robot.teleoperate(touch=["target"]) as teleoperation:
                assert (await anext(teleoperation)).state == "teleoperating"
            await asyncio.to_thread(wait_for_rest, robot)
            with pytest.raises(exemplar.ExemplarError, match="nothing"):
                await client.robot.teleoperate(touch=["nothing"]).result()
            assert (await client.robot.teleoperate(detached=True).result()).state == "teleoperating"
            assert (await client.robot.status()).state == "teleoperating"
            await client.robot.end_teleoperation()

    asyncio.run(body())


def test_the_example_teleoperates(robot: exemplar.Client, teleoperated: TeleoperatedStation) -> None:
    file = wave(teleoperated, robot, 3.0)
    command = [sys.executable, EXAMPLE, "--executor", teleoperated.executor(), "--follow-for", "0.5"]
    with subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True) as example:
        assert example.stdout is not None
        first = example.stdout.readline()
        suit(teleoperated, file)
        told = first + example.stdout.read()
    assert example.returncode == 0, told
    assert "holding" in first
    assert "following" in told
    assert "done" in told
