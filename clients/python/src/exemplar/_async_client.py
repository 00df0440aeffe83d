"""The client for asyncio: Client call by call, with the same names, parameters and values."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Mapping, Sequence

from . import _calls, _data
from ._aio import AsyncLink, AsyncMotionStream, AsyncOperation, AsyncSubscription
from ._calls import Content, JointStart, Options, Sample, TrialFile
from ._connection import Credentials, QueryStream, Settings
from ._data import BackupFile, BackupWriter, RestoreMode
from ._pose import Objects, PoseLike
from ._trial import Trial
from ._values import (
    DataReport,
    Evaluation,
    ExecutionResult,
    Feedback,
    Motion,
    PersonInfo,
    Plan,
    Progress,
    RecorderStatus,
    RobotStatus,
    Segmentation,
    SkillInfo,
    SkillReport,
    SkillVersion,
    Submission,
    Suggestions,
    TeleoperationFeedback,
    TeleoperationResult,
    TopicInfo,
    TrialInfo,
)


class AsyncClient:
    """All services of a system.

    server: HOST:PORT that serves everything; without it, the environment variable EXEMPLAR_SERVER, then
    127.0.0.1:50051. learning, executor, recorder: addresses of single services that are elsewhere. timeout: limit of
    each call in seconds, None for none; learning, planning and executing have none. Every call takes a `timeout` of
    its own (math.inf: none). tls_ca: PEM file of the CA of the servers, which turns TLS on; tls_cert, tls_key: PEM
    files of your own; token: sent with each call, "@FILE" reads a file. Without them, EXEMPLAR_TLS_CA,
    EXEMPLAR_TLS_CERT, EXEMPLAR_TLS_KEY and EXEMPLAR_TOKEN.

    Errors are exceptions derived from ExemplarError, with code, message and field. Nothing is connected before the
    first call. Belongs to one event loop. Use it as an asynchronous context manager, or await close().
    """

    def __init__(
        self,
        server: str | None = None,
        *,
        learning: str | None = None,
        executor: str | None = None,
        recorder: str | None = None,
        timeout: float | None = 30.0,
        tls_ca: str | None = None,
        tls_cert: str | None = None,
        tls_key: str | None = None,
        token: str | None = None,
    ) -> None:
        credentials = Credentials(tls_ca, tls_cert, tls_key, token)
        self._link = AsyncLink(Settings(server, learning, executor, recorder, timeout, credentials))
        self.trials = AsyncTrials(self._link)
        self.skills = AsyncSkills(self._link)
        self.robot = AsyncRobot(self._link)
        self.recorder = AsyncRecorder(self._link)
        self.topics = AsyncTopics(self._link)
        self.learning_data = AsyncData(self._link, _data.LEARNING)
        self.recorder_data = AsyncData(self._link, _data.RECORDER)

    def skill(self, name: str, version: int = 0) -> AsyncSkill:
        """One skill by name, without asking whether it is there. version: 0 for the current one."""
        return AsyncSkill(self, name, version)

    async def close(self) -> None:
        """Ends all calls and connections."""
        await self._link.close()

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()


class AsyncTrials:
    """Demonstrations, kept for skills."""

    def __init__(self, link: AsyncLink) -> None:
        self._link = link

    async def submit(
        self, skill: str, trial: TrialFile, *, person: str = "", timeout: float | None = None
    ) -> Submission:
        """Stores a trial for a skill: the path of a CSV or MCAP file, or a Trial. Once answered, it is safe.

        person: whose demonstration it is, a pseudonymous id; "": as the recording says.
        """
        return await self._link.upload(_calls.submit(skill, trial, person), timeout)

    async def list(self, skill: str = "", *, person: str = "", timeout: float | None = None) -> tuple[TrialInfo, ...]:
        """The trials of a skill in the order of submission; "": of all skills, of everybody."""
        return await self._link.unary(_calls.list_trials(skill, person), timeout)

    async def get(self, trial_id: str, *, timeout: float | None = None) -> TrialInfo:
        """What is known of one trial."""
        return await self._link.unary(_calls.get_trial(trial_id), timeout)

    async def load(self, trial_id: str, *, timeout: float | None = None) -> Trial:
        """A trial's samples."""
        return await self._link.unary(_calls.load_trial(trial_id), timeout)

    async def segments(
        self, trial_id: str, options: Options | None = None, *, timeout: float | None = None
    ) -> Segmentation:
        """Candidate episode boundaries of a stored trial."""
        return await self._link.upload(_calls.segments(trial_id, options), timeout)

    async def segments_of(
        self, trial: TrialFile, options: Options | None = None, *, timeout: float | None = None
    ) -> Segmentation:
        """The same of a file or a Trial, which is not stored."""
        return await self._link.upload(_calls.segments_of(trial, options), timeout)

    async def export(self, trial_id: str, *, timeout: float | None = None) -> bytes:
        """The trial as a CSV file, its streams interpolated onto the times of the densest."""
        return await self._link.download(_calls.export_trial(trial_id), timeout)

    async def delete(self, trial_id: str, *, timeout: float | None = None) -> None:
        """Removes a trial; skills that were learned from it stay as they are."""
        return await self._link.unary(_calls.delete_trial(trial_id), timeout)

    async def set_person(self, trial_id: str, person: str, *, timeout: float | None = None) -> None:
        """Says whose demonstration a trial is ("": unknown): a stored one, or one that a skill was learned from."""
        return await self._link.unary(_calls.set_person(trial_id, person), timeout)


class AsyncSkills:
    """Skills: learned from trials, asked for motions. version: 0 for the current one."""

    def __init__(self, link: AsyncLink) -> None:
        self._link = link

    def learn(
        self, name: str, options: Options | None = None, *, timeout: float | None = None
    ) -> AsyncOperation[Progress, SkillReport]:
        """Learns the next version from all trials of the skill. Cancelling it changes nothing."""
        return self._link.long(_calls.learn(name, options), timeout)

    async def get(self, name: str, *, version: int = 0, timeout: float | None = None) -> SkillReport:
        """The report of one version."""
        return await self._link.unary(_calls.get_skill(name, version), timeout)

    async def list(self, *, timeout: float | None = None) -> tuple[SkillInfo, ...]:
        """All skills, by name."""
        return await self._link.unary(_calls.list_skills(), timeout)

    async def versions(self, name: str, *, timeout: float | None = None) -> tuple[SkillVersion, ...]:
        """All versions of a skill, oldest first."""
        return await self._link.unary(_calls.versions(name), timeout)

    async def rollback(self, name: str, version: int, *, timeout: float | None = None) -> None:
        """Makes an older version the current one. Nothing is lost."""
        return await self._link.unary(_calls.rollback(name, version), timeout)

    async def query(
        self,
        name: str,
        objects: Objects,
        *,
        start: PoseLike | None = None,
        joint_start: JointStart | None = None,
        version: int = 0,
        timeout: float | None = None,
    ) -> Motion:
        """The motion for object poses by name (base frame).

        start: tool pose where the motion is to begin (None: the trials' mean). joint_start: joint positions there, by
        name or in the skill's joint order (rad or m).
        """
        call = _calls.query_skill(name, objects, start, joint_start, version)
        return await self._link.unary(call, timeout)

    def query_stream(self, name: str, *, version: int = 0, timeout: float | None = None) -> AsyncMotionStream:
        """Opens a stream of questions, for moving objects. timeout: of the whole stream (None: none)."""
        return AsyncMotionStream(QueryStream(name, version), self._link, timeout)

    async def evaluate(
        self, name: str, trial: TrialFile, *, version: int = 0, timeout: float | None = None
    ) -> Evaluation:
        """How far the skill's answer is from a trial that it was not learned from."""
        return await self._link.upload(_calls.evaluate(name, trial, version), timeout)

    async def suggest(
        self, name: str, count: int = 3, *, version: int = 0, timeout: float | None = None
    ) -> Suggestions:
        """Where another demonstration would tell most; count: 1 to 20 places."""
        return await self._link.unary(_calls.suggest(name, count, version), timeout)

    async def delete(self, name: str, *, timeout: float | None = None) -> None:
        """Removes all versions; the trials stay."""
        return await self._link.unary(_calls.delete_skill(name), timeout)

    async def export(self, name: str, *, version: int = 0, timeout: float | None = None) -> bytes:
        """The whole skill as a JSON document."""
        return await self._link.download(_calls.export_skill(name, version), timeout)


class AsyncRobot:
    """The robot of the executor's station. One motion at a time."""

    def __init__(self, link: AsyncLink) -> None:
        self._link = link

    async def plan(
        self,
        skill: str,
        objects: Objects | None = None,
        *,
        speed: float = 1.0,
        start: PoseLike | None = None,
        follow: bool = False,
        version: int = 0,
        timeout: float | None = None,
    ) -> Plan:
        """Everything but the motion. Raises FailedPreconditionError when it is unsafe or out of reach.

        follow: for a target that moves, as it does now.
        """
        call = _calls.plan(skill, objects, speed, start, follow, version)
        return await self._link.unary(call, timeout)

    def execute(
        self,
        skill: str,
        objects: Objects | None = None,
        *,
        speed: float = 1.0,
        start: PoseLike | None = None,
        follow: bool = False,
        detached: bool = False,
        version: int = 0,
        timeout: float | None = None,
    ) -> AsyncOperation[Feedback, ExecutionResult]:
        """Plans and moves; feedback about ten times a second.

        objects: None for where they are seen now. speed: over 0, at most 1. start: tool pose to go to first. follow:
        the target moves, and is met where it will be; without `objects`. Cancelling the call slows the robot down and
        holds it. detached: the result comes once the robot moves, and the end of the call does not end the motion. A
        motion that was aborted is a result (`result.done` is false), one that was refused is an exception.
        """
        call = _calls.execute(skill, objects, speed, start, follow, detached, version)
        return self._link.long(call, timeout)

    async def status(self, *, timeout: float | None = None) -> RobotStatus:
        """State, joints, tool and the objects seen."""
        return await self._link.unary(_calls.robot_status(), timeout)

    async def pause(self, *, timeout: float | None = None) -> None:
        """Holds on the path."""
        return await self._link.unary(_calls.robot("Pause"), timeout)

    async def resume(self, *, timeout: float | None = None) -> None:
        """Goes on from there."""
        return await self._link.unary(_calls.robot("Resume"), timeout)

    async def cancel(self, *, timeout: float | None = None) -> None:
        """Ends the motion smoothly."""
        return await self._link.unary(_calls.robot("Cancel"), timeout)

    async def stop(self, *, timeout: float | None = None) -> None:
        """Ends it at once; motions are refused until reset()."""
        return await self._link.unary(_calls.robot("Stop"), timeout)

    async def reset(self, *, timeout: float | None = None) -> None:
        """Allows motions again after stop()."""
        return await self._link.unary(_calls.robot("Reset"), timeout)

    async def set_speed(self, factor: float, *, timeout: float | None = None) -> None:
        """Scales the speed of this and later motions; over 0, at most 1."""
        return await self._link.unary(_calls.set_speed(factor), timeout)

    def teleoperate(
        self, *, suit: str = "", touch: Sequence[str] = (), detached: bool = False, timeout: float | None = None
    ) -> AsyncOperation[TeleoperationFeedback, TeleoperationResult]:
        """Lets the robot follow the suit while the dead-man is held; feedback about ten times a second.

        suit: source of ircp/suit ("": the first that is heard). touch: objects of the scene that the robot's touch
        links may touch. Cancelling the call holds the robot and ends it; end_teleoperation() ends it with a result.
        detached: the result comes once the mode is on, which then lasts until end_teleoperation().
        """
        return self._link.long(_calls.teleoperate(suit, touch, detached), timeout)

    async def end_teleoperation(self, *, timeout: float | None = None) -> None:
        """Ends teleoperation, whoever began it; the robot holds."""
        return await self._link.unary(_calls.end_teleoperation(), timeout)


class AsyncRecorder:
    """Records a station's topics into MCAP files on the recorder's machine."""

    def __init__(self, link: AsyncLink) -> None:
        self._link = link

    async def start(
        self,
        name: str = "",
        *,
        metadata: Mapping[str, str] | None = None,
        expected_topics: Sequence[str] = (),
        expect_timeout_s: float = 0.0,
        split_bytes: int = 0,
        split_s: float = 0.0,
        timeout: float | None = None,
    ) -> RecorderStatus:
        """Begins a file.

        name: without folder and ending; "": made from the time. metadata: kept in the file. expected_topics: waits
        until each has a writer, for expect_timeout_s (0: 5 s). split_bytes, split_s: a new file after so much (0: as
        the recorder was told).
        """
        call = _calls.start_recording(name, metadata, expected_topics, expect_timeout_s, split_bytes, split_s)
        return await self._link.unary(call, timeout)

    async def stop(self, *, timeout: float | None = None) -> RecorderStatus:
        """Ends the file: complete and on the disk when this returns."""
        return await self._link.unary(_calls.recorder("Stop"), timeout)

    async def pause(self, *, timeout: float | None = None) -> RecorderStatus:
        """Leaves out what comes from now on."""
        return await self._link.unary(_calls.recorder("Pause"), timeout)

    async def resume(self, *, timeout: float | None = None) -> RecorderStatus:
        """Goes on in the same file."""
        return await self._link.unary(_calls.recorder("Resume"), timeout)

    async def mark_event(
        self,
        note: str,
        *,
        name: str = "",
        metadata: Mapping[str, str] | None = None,
        timeout: float | None = None,
    ) -> RecorderStatus:
        """Marks an event; without a recording, begins one (`name`) that holds the seconds before it as well."""
        return await self._link.unary(_calls.mark_event(note, name, metadata), timeout)

    async def status(self, *, timeout: float | None = None) -> RecorderStatus:
        """State, file, and what was sent, received and lost on each topic."""
        return await self._link.unary(_calls.recorder("GetStatus"), timeout)


class AsyncData:
    """What operators do with all that a service keeps: `client.learning_data` trials and skills,
    `client.recorder_data` recordings. All but persons() take the role "administer".
    """

    def __init__(self, link: AsyncLink, service: str) -> None:
        self._link = link
        self._service = service

    async def persons(self, *, timeout: float | None = None) -> tuple[PersonInfo, ...]:
        """Whose trials or recordings there are."""
        return await self._link.unary(_data.list_persons(self._service), timeout)

    def erase(
        self, person: str, *, dry_run: bool = False, timeout: float | None = None
    ) -> AsyncOperation[Progress, DataReport]:
        """Takes out everything of one person, and what was learned from it. dry_run: only says what would be done.

        What an erasure that broke off has done stays done; the next one finishes it.
        """
        return self._link.long(_data.erase_person(self._service, person, dry_run), timeout)

    async def apply_retention(
        self,
        *,
        dry_run: bool = False,
        keep_days: float | None = None,
        keep_versions_days: float | None = None,
        needed_too: bool = False,
        timeout: float | None = None,
    ) -> DataReport:
        """Takes out what is too old. keep_days, keep_versions_days: in place of the service's own settings; 0: never.

        needed_too: trials that a current skill version was learned from go as well.
        """
        call = _data.apply_retention(self._service, dry_run, keep_days, keep_versions_days, needed_too)
        return await self._link.unary(call, timeout)

    async def backup(self, writer: BackupWriter, *, timeout: float | None = None) -> None:
        """Copies the service's data, while it goes on, into a file that may hold that of others as well.

        with exemplar.BackupWriter("station.tar") as writer:
            client.learning_data.backup(writer)
        """
        return await self._link.copy(_data.backup(self._service, writer), timeout)

    async def restore(
        self,
        file: BackupFile,
        *,
        mode: RestoreMode = "empty_only",
        erased_in: BackupFile | None = None,
        timeout: float | None = None,
    ) -> DataReport:
        """Puts the service's part of a backup back; all or nothing.

        People who were erased after their data came are left out: those whom the service, the backup, or a newer
        backup (erased_in) know.
        """
        call = await asyncio.to_thread(_data.restore, self._service, file, mode, erased_in)
        return await self._link.restore(call, timeout)


class AsyncTopics:
    """A station's topics, through the gateway (`server`)."""

    def __init__(self, link: AsyncLink) -> None:
        self._link = link

    async def list(self, *topics: str, timeout: float | None = None) -> tuple[TopicInfo, ...]:
        """Those that were discovered, by name; of `topics` only, in which * stands for any text."""
        return await self._link.unary(_calls.list_topics(topics), timeout)

    def subscribe(
        self,
        *topics: str,
        max_rate_hz: float = 0.0,
        queue: int = 0,
        content: Content = "value",
        last: bool = True,
        timeout: float | None = None,
    ) -> AsyncSubscription:
        """Samples of `topics` (none: of all) as they come, those that come up later among them.

        max_rate_hz: of each writer of a topic (0: all). queue: what may wait for this client; of more the oldest are
        dropped and counted as missed (0: as the gateway has it). content: "value" for the members, "cdr" for the bytes,
        or "both". last: begin with the last sample of each writer that keeps it. timeout: of the whole (None: none).
        """
        return self._link.subscribe(_calls.subscribe(topics, max_rate_hz, queue, content, last), timeout)

    async def publish(
        self,
        topic: str,
        sample: Sample,
        *,
        type: str = "",  # noqa: A002
        schema: str = "",
        timeout: float | None = None,
    ) -> None:
        """Sends one sample: its members by name, or its bytes. `type` and `schema` where nobody has told them.

        Raises FailedPreconditionError for a topic that the gateway may not write.
        """
        return await self._link.unary(_calls.publish(topic, sample, type, schema), timeout)


class AsyncSkill:
    """One skill of a client, by its name."""

    def __init__(self, client: AsyncClient, name: str, version: int) -> None:
        self._client = client
        self._target: str | None = None
        self.name = name
        self.version = version

    async def submit(self, *trials: str | os.PathLike[str] | Trial) -> list[Submission]:
        """Stores trials for it, in order."""
        return [await self._client.trials.submit(self.name, trial) for trial in trials]

    def learn(self, options: Options | None = None) -> AsyncOperation[Progress, SkillReport]:
        """Learns its next version from all of its trials."""
        return self._client.skills.learn(self.name, options)

    async def report(self) -> SkillReport:
        """What learning found."""
        return await self._client.skills.get(self.name, version=self.version)

    async def query(
        self,
        objects: Objects | PoseLike,
        *,
        start: PoseLike | None = None,
        joint_start: JointStart | None = None,
    ) -> Motion:
        """The motion for object poses by name; a pose alone is that of the object that the skill is about."""
        return await self._client.skills.query(
            self.name,
            await self._named(objects),
            start=start,
            joint_start=joint_start,
            version=self.version,
        )

    def query_stream(self) -> AsyncMotionStream:
        """Opens a stream of questions, for moving objects."""
        return self._client.skills.query_stream(self.name, version=self.version)

    async def execute(
        self,
        objects: Objects | PoseLike | None = None,
        *,
        speed: float = 1.0,
        start: PoseLike | None = None,
        follow: bool = False,
    ) -> AsyncOperation[Feedback, ExecutionResult]:
        """Carries it out; as `client.robot.execute`."""
        named = None if objects is None else await self._named(objects)
        return self._client.robot.execute(
            self.name, named, speed=speed, start=start, follow=follow, version=self.version
        )

    async def _named(self, objects: Objects | PoseLike) -> Objects:
        if isinstance(objects, Mapping):
            return objects
        if self._target is None:
            self._target = (await self.report()).target
        return {self._target: objects}
