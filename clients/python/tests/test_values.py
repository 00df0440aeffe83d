"""What needs no service: poses, trial files, addresses."""

import dataclasses
import importlib.resources
import pathlib

import numpy as np
import pytest

import exemplar


def test_a_pose_survives_its_matrix() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        pose = exemplar.Pose(rng.normal(size=3), rng.normal(size=4))
        assert pose.quaternion is not None
        back = exemplar.Pose.from_matrix(pose.matrix())
        assert back.quaternion is not None
        np.testing.assert_allclose(back.position, pose.position)
        assert abs(float(back.quaternion @ pose.quaternion)) == pytest.approx(1)
        rotation = pose.matrix()[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1)


def test_a_quarter_turn_about_z_takes_x_to_y() -> None:
    pose = exemplar.Pose([0, 0, 0], [0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    np.testing.assert_allclose(pose.matrix() @ [1, 0, 0, 1], [0, 1, 0, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("position", "quaternion", "field"),
    [([1, 2], None, "position"), ([1, 2, np.nan], None, "position"), ([0, 0, 0], [0, 0, 0, 0], "quaternion")],
)
def test_what_is_no_pose_is_refused(position: list[float], quaternion: list[float] | None, field: str) -> None:
    with pytest.raises(exemplar.InvalidArgumentError) as refused:
        exemplar.Pose(position, quaternion)
    assert refused.value.field == field


def test_a_reflection_is_no_rotation() -> None:
    with pytest.raises(exemplar.InvalidArgumentError, match="rotation"):
        exemplar.Pose.from_matrix(np.diag([1.0, 1, -1, 1]))


def test_a_trial_file_comes_back_exactly(tmp_path: pathlib.Path) -> None:
    rng = np.random.default_rng(5)
    fast, slow = np.cumsum(rng.uniform(0.005, 0.02, 300)), np.cumsum(rng.uniform(0.05, 0.1, 40))
    fast, slow = fast - fast[0], slow
    quaternions = rng.normal(size=(300, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    trial = exemplar.Trial(
        joints=exemplar.ScalarSeries(("elbow", "rail"), fast, rng.normal(size=(300, 2))),
        measured_joints=exemplar.ScalarSeries(("elbow", "rail"), slow, rng.normal(size=(40, 2))),
        prismatic_joints=("rail",),
        end_effectors={
            "": exemplar.PoseSeries(fast, rng.normal(size=(300, 3)), quaternions),
            "left": exemplar.PoseSeries(slow, rng.normal(size=(40, 3))),
        },
        objects={"red_button": exemplar.PoseSeries(slow, rng.normal(size=(40, 3)))},
        hands=exemplar.ScalarSeries(("", "left"), slow, rng.uniform(size=(40, 2))),
        tactile=exemplar.ScalarSeries(("index_tip",), slow, rng.uniform(size=(40, 1))),
        wrench=exemplar.ScalarSeries(("fx", "fy", "fz", "tx", "ty", "tz"), slow, rng.normal(size=(40, 6))),
        label=exemplar.ScalarSeries(("label",), fast, rng.integers(0, 3, (300, 1))),
    )
    file = tmp_path / "trial.csv"
    trial.to_csv(file)
    back = exemplar.Trial.from_csv(file)
    for field in dataclasses.fields(exemplar.Trial):
        mine, theirs = getattr(trial, field.name), getattr(back, field.name)
        if isinstance(mine, exemplar.ScalarSeries):
            assert mine.names == theirs.names, field.name
            np.testing.assert_array_equal(mine.time_s, theirs.time_s)
            np.testing.assert_array_equal(mine.values, theirs.values)
        elif field.name in ("end_effectors", "objects"):
            assert mine.keys() == theirs.keys()
            for name, series in mine.items():
                np.testing.assert_array_equal(series.time_s, theirs[name].time_s)
                np.testing.assert_array_equal(series.positions, theirs[name].positions)
                if series.quaternions is None:
                    assert theirs[name].quaternions is None
                else:
                    np.testing.assert_array_equal(series.quaternions, theirs[name].quaternions)
    assert back.prismatic_joints == ("rail",)
    assert back.duration_s == trial.duration_s


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "no samples"),
        ("t,ee_x_m\n0,1\n", "time_s"),
        ("time_s,ee_x_m,ee_y_m\n0,1,2\n", "ee_z_m"),
        ("time_s,elbow_rad,elbow_rad\n0,1,2\n", "twice"),
        ("time_s,other\n0,1\n", "neither joints"),
        ("time_s,elbow_rad\n0,one\n", 'elbow_rad: "one"'),
        ("time_s,elbow_rad\n0,1\n0,2\n", "increasing"),
        ("time_s,elbow_rad\n0,1\n1\n", "sample 2 has 1 cells"),
        ("time_s,a_rad,b_rad\n0,1,2\n1,3,\n", "b_rad"),
    ],
)
def test_a_file_that_is_no_trial_says_why(tmp_path: pathlib.Path, text: str, word: str) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(text)
    with pytest.raises(exemplar.InvalidArgumentError, match=word):
        exemplar.Trial.from_csv(file)


def test_series_check_their_shapes() -> None:
    with pytest.raises(exemplar.InvalidArgumentError, match=r"\(2, 3\)"):
        exemplar.PoseSeries([0, 1], [[0, 0, 0]])
    with pytest.raises(exemplar.InvalidArgumentError, match="increasing"):
        exemplar.ScalarSeries(("a",), [1, 0], [[0], [0]])


def test_addresses_are_checked_and_default_to_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for address in ("nowhere", "host:", ":50051", "host:0", "host:65536"):
        with pytest.raises(exemplar.InvalidArgumentError, match="HOST:PORT"):
            exemplar.Client(address)
    monkeypatch.setenv("EXEMPLAR_SERVER", "broken")
    with pytest.raises(exemplar.InvalidArgumentError, match="broken"):
        exemplar.Client()
    exemplar.Client("127.0.0.1:1").close()
    with pytest.raises(exemplar.InvalidArgumentError) as refused:
        exemplar.Client("127.0.0.1:1", recorder="x")
    assert refused.value.field == "recorder"


def test_a_client_that_was_closed_says_so() -> None:
    with exemplar.Client("127.0.0.1:1") as client:
        pass
    with pytest.raises(exemplar.FailedPreconditionError, match="closed"):
        client.skills.list()


def test_the_package_announces_its_types() -> None:
    assert importlib.resources.files("exemplar").joinpath("py.typed").is_file()


def test_nobody_at_the_address_is_unavailable() -> None:
    with exemplar.Client("127.0.0.1:1") as client:
        with pytest.raises(exemplar.UnavailableError, match="no answer from 127") as gone:
            client.skills.list()
        assert isinstance(gone.value, ConnectionError)
        with pytest.raises(exemplar.UnavailableError):
            client.skills.learn("press").result()
        with client.skills.query_stream("press") as stream, pytest.raises(exemplar.UnavailableError):
            stream.query({"target": [0, 0, 0]})
