"""Persons, erasure, retention and backups, against services of their own."""

import asyncio
import pathlib
import tarfile
from collections.abc import Iterator

import pytest

import exemplar
from conftest import Station


@pytest.fixture
def own(tmp_path: pathlib.Path) -> Iterator[exemplar.Client]:
    station = Station(tmp_path)
    with exemplar.Client(station.learning(), recorder=station.recorder()) as client:
        yield client
    station.programs.end()


def test_a_backup_brings_back_what_it_holds_and_nobody_who_was_erased(
    own: exemplar.Client, files: list[pathlib.Path], tmp_path: pathlib.Path
) -> None:
    for number, file in enumerate(files):
        own.trials.submit("press", file, person="anna" if number < 2 else "ben")
    own.skills.learn("press").result()
    assert [p.person for p in own.learning_data.persons()] == ["anna", "ben"]
    assert len(own.trials.list(person="anna")) == 2

    path = tmp_path / "backup.tar"
    with exemplar.BackupWriter(path) as writer:
        own.learning_data.backup(writer)
        own.recorder_data.backup(writer)
    held = exemplar.verify_backup(path)
    assert {service.service: service.counts for service in held.services} == {
        "learning": {"trials": len(files), "skills": 1, "versions": 1},
        "recorder": {"recordings": 0},
    }
    with tarfile.open(path) as archive:
        assert archive.getnames()[-1] == "manifest.json"
    with pytest.raises(exemplar.AlreadyExistsError), exemplar.BackupWriter(path):
        pass

    foreseen = own.learning_data.erase("anna", dry_run=True).result()
    assert {item.kind for item in foreseen.items} == {"trial", "skill version"}
    erasing = own.learning_data.erase("anna")
    assert all(0 <= progress.fraction <= 1 for progress in erasing)
    actions = {(item.kind, item.action) for item in erasing.result().items}
    assert ("skill version", "relearned") in actions
    assert [p.person for p in own.learning_data.persons()] == ["ben"]
    assert own.learning_data.erase("anna").result().items == ()

    with pytest.raises(exemplar.FailedPreconditionError) as refused:
        own.learning_data.restore(path)
    assert refused.value.field == "header.mode"
    report = own.learning_data.restore(path, mode="replace")
    assert [item.kind for item in report.items if item.action == "left out"][:2] == ["trial", "trial"]
    assert [p.person for p in own.learning_data.persons()] == ["ben"]
    assert asyncio.run(persons(own)) == ["ben"]


async def persons(client: exemplar.Client) -> list[str]:
    """The same from an asynchronous client."""
    async with exemplar.AsyncClient(client._link.settings.address(exemplar._wire.method("TrialService/List"))) as other:
        return [p.person for p in await other.learning_data.persons()]


def test_damaged_backups_are_refused(own: exemplar.Client, files: list[pathlib.Path], tmp_path: pathlib.Path) -> None:
    trial = own.trials.submit("press", files[0]).trial
    own.trials.set_person(trial.id, "anna")
    assert own.trials.get(trial.id).person == "anna"
    path, broken = tmp_path / "backup.tar", tmp_path / "broken.tar"
    with exemplar.BackupWriter(path) as writer:
        own.learning_data.backup(writer)
    whole = path.read_bytes()
    for data in (b"", b"no archive", whole[:700], whole[: len(whole) // 2], whole[:-1024]):
        broken.write_bytes(data)
        with pytest.raises(exemplar.DataLossError):
            exemplar.verify_backup(broken)
    middle = len(whole) // 4
    broken.write_bytes(whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :])
    with pytest.raises(exemplar.DataLossError):
        own.learning_data.restore(broken, mode="replace")
    with pytest.raises(exemplar.NotFoundError):
        own.recorder_data.restore(path)
    with pytest.raises(ZeroDivisionError), exemplar.BackupWriter(tmp_path / "never.tar"):
        raise ZeroDivisionError
    assert not list(tmp_path.glob("never*"))


def test_what_is_old_goes(own: exemplar.Client, files: list[pathlib.Path]) -> None:
    own.trials.submit("press", files[0])
    assert own.learning_data.apply_retention(dry_run=True).items == ()
    shown = own.learning_data.apply_retention(dry_run=True, keep_days=1e-9)
    assert [(item.kind, item.action) for item in shown.items] == [("trial", "deleted")]
    assert len(own.trials.list()) == 1
    own.learning_data.apply_retention(keep_days=1e-9)
    assert own.trials.list() == ()
    assert own.recorder_data.apply_retention(keep_days=1e-9).items == ()
