"""A button that moves and is pressed."""

import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

import exemplar
import processes
from conftest import ROOT, MovingStation

EXAMPLES = ROOT / "clients" / "python" / "examples"


@pytest.fixture(scope="module")
def robot(moving: MovingStation, press: exemplar.Skill) -> Iterator[exemplar.Client]:
    with exemplar.Client(moving.learning(), executor=moving.executor()) as client:
        processes.wait_for(lambda: client.robot.status().objects, "the button to be seen")
        yield client


def run(name: str, *words: object) -> str:
    command = [sys.executable, EXAMPLES / name, *words]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_target_that_moves_is_met_where_it_will_be(robot: exemplar.Client, moving: MovingStation) -> None:
    with pytest.raises(exemplar.InvalidArgumentError) as both:
        robot.robot.execute("press", {"target": [0.5, 0.0, 0.05]}, follow=True)
    assert both.value.field == "objects"
    plan = robot.robot.plan("press", follow=True)
    assert plan.duration_s > 0
    seen = {tuple(robot.robot.status().objects[0].pose.position)}
    result = robot.skill("press").execute(follow=True).result()
    seen.add(tuple(robot.robot.status().objects[0].pose.position))
    assert result.done, result.detail
    assert len(seen) == 2
    # Met within half an inch while it went on.
    assert result.contact_error_m is not None
    assert result.contact_error_m < 0.0127
    # Along its rail, y, it was wherever the time took it that planning took.
    across = (result.tool[:, :3] - result.objects["target"].position)[:, [0, 2]]
    assert np.linalg.norm(across, axis=1).min() < 0.03


def test_the_example_follows(robot: exemplar.Client, moving: MovingStation) -> None:
    told = run("05_follow.py", "press", "target", "--executor", moving.executor())
    assert "moves at" in told
    assert "done" in told
