"""Trials and skills against the learning service."""

import io
import json
import pathlib
import threading
from typing import Any

import numpy as np
import pytest

import exemplar
from conftest import BUTTON, BUTTONS


def test_a_trial_comes_back_as_it_was_submitted(client: exemplar.Client, files: list[pathlib.Path]) -> None:
    submission = client.trials.submit("back", files[0])
    assert not submission.duplicate
    assert client.trials.submit("back", str(files[0])).duplicate
    info = submission.trial
    assert client.trials.list("back") == (info,)
    assert client.trials.get(info.id) == info
    assert info.submitted is not None
    assert info.submitted.tzinfo is not None

    loaded, local = client.trials.load(info.id), exemplar.Trial.from_csv(files[0])
    assert loaded.duration_s == pytest.approx(info.duration_s)
    assert set(loaded.end_effectors) == set(local.end_effectors) == {""}
    assert set(loaded.objects) == set(local.objects) == {"target"}
    tool, expected = loaded.end_effectors[""], local.end_effectors[""]
    np.testing.assert_allclose(tool.time_s, expected.time_s, atol=1e-9)
    np.testing.assert_allclose(tool.positions, expected.positions, atol=1e-12)
    assert tool.quaternions is not None
    assert tool.quaternions.shape == (len(tool.time_s), 4)

    table: Any = np.genfromtxt(io.BytesIO(client.trials.export(info.id)), delimiter=",", names=True)
    np.testing.assert_allclose(table["ee_x_m"], expected.positions[:, 0], atol=1e-9)

    client.trials.delete(info.id)
    assert client.trials.list("back") == ()


def test_streams_made_of_arrays_keep_their_own_times(client: exemplar.Client) -> None:
    time_s = np.linspace(0, 2, 201)
    touch_s = np.arange(0, 2, 1 / 60)
    press = np.column_stack([0.4 + 0.1 * time_s, np.zeros(201), 0.2 - 0.1 * np.sin(time_s)])
    trial = exemplar.Trial(
        joints=exemplar.ScalarSeries(("shoulder", "lift"), time_s, np.column_stack([time_s, 0.1 * time_s])),
        prismatic_joints=("lift",),
        end_effectors={"": exemplar.PoseSeries(time_s, press, np.tile([1.0, 0, 0, 0], (201, 1)))},
        objects={"target": exemplar.PoseSeries([0.0, 1.0], [[0.5, 0, 0.1]] * 2)},
        tactile=exemplar.ScalarSeries(("finger",), touch_s, np.sin(touch_s)[:, None]),
        hands=exemplar.ScalarSeries(("",), [0.5], [[0.25]]),
        label=exemplar.ScalarSeries(("label",), [0.0, 1.5], [[1], [2]]),
        source="made.csv",
    )
    stored = client.trials.load(client.trials.submit("made", trial).trial.id)
    assert stored.source == "made.csv"
    assert stored.prismatic_joints == ("lift",)
    for name in ("joints", "tactile", "hands", "label"):
        mine, theirs = getattr(trial, name), getattr(stored, name)
        assert mine.names == theirs.names
        np.testing.assert_allclose(theirs.time_s, mine.time_s, atol=1e-9)
        np.testing.assert_array_equal(theirs.values, mine.values)
    np.testing.assert_allclose(stored.objects["target"].positions, trial.objects["target"].positions)
    assert stored.objects["target"].quaternions is None


def test_segments_are_the_same_of_a_file_and_of_the_stored_trial(
    client: exemplar.Client, press: exemplar.Skill, files: list[pathlib.Path]
) -> None:
    stored = client.trials.segments(client.trials.list("press")[0].id)
    of_file = client.trials.segments_of(files[0])
    assert stored.msv.shape == stored.time_s.shape
    assert [m.time_s for m in stored.markers] == [m.time_s for m in of_file.markers]
    assert {m.kind for m in stored.markers} == {"beginning", "ending"}
    with pytest.raises(exemplar.InvalidArgumentError):
        client.trials.segments_of(files[0], {"cutoff_hz": -1})


def test_learning_tells_its_progress_and_reports(client: exemplar.Client, press: exemplar.Skill) -> None:
    with press.learn({"method": "frames"}) as learning:
        fractions = [progress.fraction for progress in learning]
    report = learning.result()
    assert fractions == sorted(fractions)
    assert all(0 <= fraction <= 1 for fraction in fractions)
    assert report.method == "frames"
    assert report.target == "target"
    assert len(report.trials) == len(BUTTONS)
    assert report.trials[0].target is not None
    assert any(score.chosen for score in report.methods)
    assert press.report().version == report.version
    assert {skill.name: skill.version for skill in client.skills.list()}["press"] == report.version
    assert [version.current for version in client.skills.versions("press")][-1]

    client.skills.rollback("press", 1)
    assert client.skills.get("press").version == 1
    assert client.skills.get("press", version=report.version).method == "frames"


def test_a_query_answers_with_arrays_that_end_at_the_object(press: exemplar.Skill, client: exemplar.Client) -> None:
    motion = press.query(BUTTON)
    n, o = len(motion), len(motion.object_names)
    assert motion.positions.shape == (n, 3)
    assert motion.quaternions is not None
    assert motion.quaternions.shape == (n, 4)
    assert motion.joints.shape == (n, 0)
    assert motion.objectivity.shape == (n, o)
    assert motion.sigma_m.shape == (n,)
    assert np.all(np.diff(motion.time_s) > 0)
    nearest = np.linalg.norm(motion.positions - BUTTON, axis=1).min()
    assert nearest < 0.02
    assert motion.contacts[0].object == "target"
    np.testing.assert_allclose(motion.objects["target"].position, BUTTON)
    np.testing.assert_allclose(motion.position_at(motion.duration_s), motion.positions[-1])
    assert motion.warnings

    start = exemplar.Pose([0.45, -0.10, 0.30], [1, 0, 0, 0])
    moved = client.skills.query("press", {"target": [*BUTTON, 0, 0, 0, 1]}, start=start)
    assert np.linalg.norm(moved.positions[0] - start.position) < 0.02


def test_a_stream_goes_on_after_a_question_that_failed(press: exemplar.Skill) -> None:
    with press.query_stream() as stream:
        places = [np.add(BUTTON, [0.01 * i, 0, 0]) for i in range(5)]
        motions = [stream.query({"target": place}) for place in places]
        with pytest.raises(exemplar.ExemplarError, match="elephant"):
            stream.query({"elephant": places[0]})
        again = stream.query({"target": places[0]})
    for place, motion in zip(places, motions, strict=True):
        np.testing.assert_allclose(motion.objects["target"].position, place)
    np.testing.assert_array_equal(again.positions, motions[0].positions)
    with pytest.raises(exemplar.ExemplarError):
        stream.query({"target": places[0]})


def test_threads_share_one_stream(press: exemplar.Skill) -> None:
    places = [np.add(BUTTON, [0.005 * i, 0, 0]) for i in range(8)]
    got: dict[int, exemplar.Motion] = {}

    with press.query_stream() as stream:

        def ask(index: int) -> None:
            got[index] = stream.query({"target": places[index]})

        threads = [threading.Thread(target=ask, args=(i,)) for i in range(len(places))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    for index, place in enumerate(places):
        np.testing.assert_allclose(got[index].objects["target"].position, place)


def test_a_skill_is_evaluated_suggested_exported_and_deleted(
    client: exemplar.Client, files: list[pathlib.Path]
) -> None:
    skill = client.skill("short")
    skill.submit(*files[:-1])
    skill.learn().result()
    evaluation = client.skills.evaluate("short", files[-1])
    assert 0 < evaluation.frechet_m < 0.1
    np.testing.assert_allclose(evaluation.situation.objects["target"].position, BUTTONS[-1])
    assert len(evaluation.answer) > 0
    assert json.loads(client.skills.export("short"))
    suggestions = client.skills.suggest("short", 2)
    assert len(suggestions.places) == 2
    assert suggestions.places[0].object == "target"
    client.skills.delete("short")
    with pytest.raises(exemplar.NotFoundError):
        client.skills.get("short")


def test_errors_name_code_and_field(client: exemplar.Client, press: exemplar.Skill) -> None:
    with pytest.raises(exemplar.NotFoundError, match="nothing") as not_found:
        client.skills.get("nothing")
    assert not_found.value.code == "not_found"
    assert isinstance(not_found.value, LookupError)

    with pytest.raises(exemplar.InvalidArgumentError) as invalid:
        press.query({"": BUTTON})
    assert invalid.value.field == "query.objects[0].name"
    assert isinstance(invalid.value, ValueError)

    with pytest.raises(exemplar.InvalidArgumentError) as here:
        press.query({"target": [1, 2]})
    assert here.value.field == 'objects["target"]'

    with pytest.raises(exemplar.NotFoundError):
        client.skill("nothing").learn().result()
    with pytest.raises(FileNotFoundError):
        client.trials.submit("press", "absent.csv")
    with pytest.raises(exemplar.UnimplementedError, match="does not serve"):
        client.robot.status()


def test_a_call_that_is_cancelled_stays_cancelled(silent: str) -> None:
    with exemplar.Client(silent) as client:
        learning = client.skills.learn("press")
        threading.Timer(0.02, learning.cancel).start()
        for _ in range(2):
            with pytest.raises(exemplar.CancelledError):
                learning.result()
        with client.skills.learn("press") as left:
            pass
        with pytest.raises(exemplar.CancelledError):
            left.result()


def test_a_call_has_a_deadline(silent: str) -> None:
    with exemplar.Client(silent, timeout=0.01) as client:
        with pytest.raises(exemplar.DeadlineExceededError, match=silent) as late:
            client.skills.list()
        assert isinstance(late.value, TimeoutError)
        with pytest.raises(exemplar.DeadlineExceededError):
            client.skills.learn("press", timeout=0.01).result()
        with pytest.raises(exemplar.DeadlineExceededError):
            client.trials.export("any")
        with client.skills.query_stream("press", timeout=0.01) as stream, pytest.raises(TimeoutError):
            stream.query({"target": BUTTON})
        with pytest.raises(exemplar.InvalidArgumentError, match="timeout"):
            client.skills.list(timeout=0)
