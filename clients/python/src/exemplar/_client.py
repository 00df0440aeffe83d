"""The client that waits for each answer."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from . import _calls, _data
from ._calls import Content, JointStart, Options, Sample, TrialFile
from ._connection import Credentials, QueryStream, Settings
from ._data import BackupFile, BackupWriter, RestoreMode
from ._pose import Objects, PoseLike
from ._sync import Link, MotionStream, Operation, Subscription
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


class Client:
    """All services of a system.

    server: HOST:PORT that serves everything; without it, the environment variable EXEMPLAR_SERVER, then
    127.0.0.1:50051. learning, executor, recorder: addresses of single services that are elsewhere. timeout: limit of
    each call in seconds, None for none; learning, planning and executing have none. Every call takes a `timeout` of
    its own (math.inf: none). tls_ca: PEM file of the CA of the servers, which turns TLS on; tls_cert, tls_key: PEM
    files of your own; token: sent with each call, "@FILE" reads a file. Without them, EXEMPLAR_TLS_CA,
    EXEMPLAR_TLS_CERT, EXEMPLAR_TLS_KEY and EXEMPLAR_TOKEN.

    Errors are exceptions derived from ExemplarError, with code, message and field. Nothing is connected before the
    first call. Thread-safe. Use it as a context manager, or close() it.
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
        self._link = Link(Settings(server, learning, executor, recorder, timeout, credentials))
        self.trials = Trials(self._link)
        self.skills = Skills(self._link)
        self.robot = Robot(self._link)
        self.recorder = Recorder(self._link)
        self.topics = Topics(self._link)
        self.learning_data = Data(self._link, _data.LEARNING)
        self.recorder_data = Data(self._link, _data.RECORDER)

    def skill(self, name: str, version: int = 0) -> Skill:
        """One skill by name, without asking whether it is there. version: 0 for the current one."""
        return Skill(self, name, version)

    def close(self) -> None:
        """Ends all calls and connections."""
        self._link.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Trials:
    """Demonstrations, kept for skills."""

    def __init__(self, link: Link) -> None:
        self._link = link

    def submit(self, skill: str, trial: TrialFile, *, person: str = "", timeout: float | None = None) -> Submission:
        """Stores a trial for a skill: the path of a CSV or MCAP file, or a Trial. Once answered, it is safe.

        person: whose demonstration it is, a pseudonymous id; "": as the recording says.
        """
        return self._link.upload(_calls.submit(skill, trial, person), timeout)

    def list(self, skill: str = "", *, person: str = "", timeout: float | None = None) -> tuple[TrialInfo, ...]:
        """The trials of a skill in the order of submission; "": of all skills, of everybody."""
        return self._link.unary(_calls.list_trials(skill, person), timeout)

    def get(self, trial_id: str, *, timeout: float | None = None) -> TrialInfo:
        """What is known of one trial."""
        return self._link.unary(_calls.get_trial(trial_id), timeout)

    def load(self, trial_id: str, *, timeout: float | None = None) -> Trial:
        """A trial's samples."""
        return self._link.unary(_calls.load_trial(trial_id), timeout)

    def segments(self, trial_id: str, options: Options | None = None, *, timeout: float | None = None) -> Segmentation:
        """Candidate episode boundaries of a stored trial."""
        return self._link.upload(_calls.segments(trial_id, options), timeout)

    def segments_of(
        self, trial: TrialFile, options: Options | None = None, *, timeout: float | None = None
    ) -> Segmentation:
        """The same of a file or a Trial, which is not stored."""
        return self._link.upload(_calls.segments_of(trial, options), timeout)

    def export(self, trial_id: str, *, timeout: float | None = None) -> bytes:
        """The trial as a CSV file, its streams interpolated onto the times of the densest."""
        return self._link.download(_calls.export_trial(trial_id), timeout)

    def delete(self, trial_id: str, *, timeout: float | None = None) -> None:
        """Removes a trial; skills that were learned from it stay as they are."""
        return self._link.unary(_calls.delete_trial(trial_id), timeout)

    def set_person(self, trial_id: str, person: str, *, timeout: float | None = None) -> None:
        """Says whose demonstration a trial is ("": unknown): a stored one, or one that a skill was learned from."""
        return self._link.unary(_calls.set_person(trial_id, person), timeout)


class Skills:
    """Skills: learned from trials, asked for motions. version: 0 for the current one."""

    def __init__(self, link: Link) -> None:
        self._link = link

    def learn(
        self, name: str, options: Options | None = None, *, timeout: float | None = None
    ) -> Operation[Progress, SkillReport]:
        """Learns the next version from all trials of the skill. Cancelling it changes nothing."""
        return self._link.long(_calls.learn(name, options), timeout)

    def get(self, name: str, *, version: int = 0, timeout: float | None = None) -> SkillReport:
        """The report of one version."""
        return self._link.unary(_calls.get_skill(name, version), timeout)

    def list(self, *, timeout: float | None = None) -> tuple[SkillInfo, ...]:
        """All skills, by name."""
        return self._link.unary(_calls.list_skills(), timeout)

    def versions(self, name: str, *, timeout: float | None = None) -> tuple[SkillVersion, ...]:
        """All versions of a skill, oldest first."""
        return self._link.unary(_calls.versions(name), timeout)

    def rollback(self, name: str, version: int, *, timeout: float | None = None) -> None:
        """Makes an older version the current one. Nothing is lost."""
        return self._link.unary(_calls.rollback(name, version), timeout)

    def query(
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
        return self._link.unary(call, timeout)

    def query_stream(self, name: str, *, version: int = 0, timeout: float | None = None) -> MotionStream:
        """Opens a stream of questions, for moving objects. timeout: of the whole stream (None: none)."""
        return MotionStream(QueryStream(name, version), self._link, timeout)

    def evaluate(self, name: str, trial: TrialFile, *, version: int = 0, timeout: float | None = None) -> Evaluation:
        """How far the skill's answer is from a trial that it was not learned from."""
        return self._link.upload(_calls.evaluate(name, trial, version), timeout)

    def suggest(self, name: str, count: int = 3, *, version: int = 0, timeout: float | None = None) -> Suggestions:
        """Where another demonstration would tell most; count: 1 to 20 places."""
        return self._link.unary(_calls.suggest(name, count, version), timeout)

    def delete(self, name: str, *, timeout: float | None = None) -> None:
        """Removes all versions; the trials stay."""
        return self._link.unary(_calls.delete_skill(name), timeout)

    def export(self, name: str, *, version: int = 0, timeout: float | None = None) -> bytes:
        """The whole skill as a JSON document."""
        return self._link.download(_calls.export_skill(name, version), timeout)


class Robot:
    """The robot of the executor's station. One motion at a time."""

    def __init__(self, link: Link) -> None:
        self._link = link

    def plan(
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
        return self._link.unary(call, timeout)

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
    ) -> Operation[Feedback, ExecutionResult]:
        """Plans and moves; feedback about ten times a second.

        objects: None for where they are seen now. speed: over 0, at most 1. start: tool pose to go to first. follow:
        the target moves, and is met where it will be; without `objects`. Cancelling the call slows the robot down and
        holds it. detached: the result comes once the robot moves, and the end of the call does not end the motion. A
        motion that was aborted is a result (`result.done` is false), one that was refused is an exception.
        """
        call = _calls.execute(skill, objects, speed, start, follow, detached, version)
        return self._link.long(call, timeout)

    def status(self, *, timeout: float | None = None) -> RobotStatus:
        """State, joints, tool and the objects seen."""
        return self._link.unary(_calls.robot_status(), timeout)

    def pause(self, *, timeout: float | None = None) -> None:
        """Holds on the path."""
        return self._link.unary(_calls.robot("Pause"), timeout)

    def resume(self, *, timeout: float | None = None) -> None:
        """Goes on from there."""
        return self._link.unary(_calls.robot("Resume"), timeout)

    def cancel(self, *, timeout: float | None = None) -> None:
        """Ends the motion smoothly."""
        return self._link.unary(_calls.robot("Cancel"), timeout)

    def stop(self, *, timeout: float | None = None) -> None:
        """Ends it at once; motions are refused until reset()."""
        return self._link.unary(_calls.robot("Stop"), timeout)

    def reset(self, *, timeout: float | None = None) -> None:
        """Allows motions again after stop()."""
        return self._link.unary(_calls.robot("Reset"), timeout)

    def set_speed(self, factor: float, *, timeout: float | None = None) -> None:
        """Scales the speed of this and later motions; over 0, at most 1."""
        return self._link.unary(_calls.set_speed(factor), timeout)

    def teleoperate(
        self, *, suit: str = "", touch: Sequence[str] = (), detached: bool = False, timeout: float | None = None
    ) -> Operation[TeleoperationFeedback, TeleoperationResult]:
        """Lets the robot follow the suit while the dead-man is held; feedback about ten times a second.

        suit: source of ircp/suit ("": the first that is heard). touch: objects of the scene that the robot's touch
        links may touch. Cancelling the call holds the robot and ends it; end_teleoperation() ends it with a result.
        detached: the result comes once the mode is on, which then lasts until end_teleoperation().
        """
        return self._link.long(_calls.teleoperate(suit, touch, detached), timeout)

    def end_teleoperation(self, *, timeout: float | None = None) -> None:
        """Ends teleoperation, whoever began it; the robot holds."""
        return self._link.unary(_calls.end_teleoperation(), timeout)


class Recorder:
    """Records a station's topics into MCAP files on the recorder's machine."""

    def __init__(self, link: Link) -> None:
        self._link = link

    def start(
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
        return self._link.unary(call, timeout)

    def stop(self, *, timeout: float | None = None) -> RecorderStatus:
        """Ends the file: complete and on the disk when this returns."""
        return self._link.unary(_calls.recorder("Stop"), timeout)

    def pause(self, *, timeout: float | None = None) -> RecorderStatus:
        """Leaves out what comes from now on."""
        return self._link.unary(_calls.recorder("Pause"), timeout)

    def resume(self, *, timeout: float | None = None) -> RecorderStatus:
        """Goes on in the same file."""
        return self._link.unary(_calls.recorder("Resume"), timeout)

    def mark_event(
        self,
        note: str,
        *,
        name: str = "",
        metadata: Mapping[str, str] | None = None,
        timeout: float | None = None,
    ) -> RecorderStatus:
        """Marks an event; without a recording, begins one (`name`) that holds the seconds before it as well."""
        return self._link.unary(_calls.mark_event(note, name, metadata), timeout)

    def status(self, *, timeout: float | None = None) -> RecorderStatus:
        """State, file, and what was sent, received and lost on each topic."""
        return self._link.unary(_calls.recorder("GetStatus"), timeout)


class Data:
    """What operators do with all that a service keeps: `client.learning_data` trials and skills,
    `client.recorder_data` recordings. All but persons() take the role "administer".
    """

    def __init__(self, link: Link, service: str) -> None:
        self._link = link
        self._service = service

    def persons(self, *, timeout: float | None = None) -> tuple[PersonInfo, ...]:
        """Whose trials or recordings there are."""
        return self._link.unary(_data.list_persons(self._service), timeout)

    def erase(
        self, person: str, *, dry_run: bool = False, timeout: float | None = None
    ) -> Operation[Progress, DataReport]:
        """Takes out everything of one person, and what was learned from it. dry_run: only says what would be done.

        What an erasure that broke off has done stays done; the next one finishes it.
        """
        return self._link.long(_data.erase_person(self._service, person, dry_run), timeout)

    def apply_retention(
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
        return self._link.unary(call, timeout)

    def backup(self, writer: BackupWriter, *, timeout: float | None = None) -> None:
        """Copies the service's data, while it goes on, into a file that may hold that of others as well.

        with exemplar.BackupWriter("station.tar") as writer:
            client.learning_data.backup(writer)
        """
        return self._link.copy(_data.backup(self._service, writer), timeout)

    def restore(
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
        return self._link.restore(_data.restore(self._service, file, mode, erased_in), timeout)


class Topics:
    """A station's topics, through the gateway (`server`)."""

    def __init__(self, link: Link) -> None:
        self._link = link

    def list(self, *topics: str, timeout: float | None = None) -> tuple[TopicInfo, ...]:
        """Those that were discovered, by name; of `topics` only, in which * stands for any text."""
        return self._link.unary(_calls.list_topics(topics), timeout)

    def subscribe(
        self,
        *topics: str,
        max_rate_hz: float = 0.0,
        queue: int = 0,
        content: Content = "value",
        last: bool = True,
        timeout: float | None = None,
    ) -> Subscription:
        """Samples of `topics` (none: of all) as they come, those that come up later among them.

        max_rate_hz: of each writer of a topic (0: all). queue: what may wait for this client; of more the oldest are
        dropped and counted as missed (0: as the gateway has it). content: "value" for the members, "cdr" for the bytes,
        or "both". last: begin with the last sample of each writer that keeps it. timeout: of the whole (None: none).
        """
        return self._link.subscribe(_calls.subscribe(topics, max_rate_hz, queue, content, last), timeout)

    def publish(
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
        return self._link.unary(_calls.publish(topic, sample, type, schema), timeout)


class Skill:
    """One skill of a client, by its name."""

    def __init__(self, client: Client, name: str, version: int) -> None:
        self._client = client
        self._target: str | None = None
        self.name = name
        self.version = version

    def submit(self, *trials: str | os.PathLike[str] | Trial) -> list[Submission]:
        """Stores trials for it, in order."""
        return [self._client.trials.submit(self.name, trial) for trial in trials]

    def learn(self, options: Options | None = None) -> Operation[Progress, SkillReport]:
        """Learns its next version from all of its trials."""
        return self._client.skills.learn(self.name, options)

    def report(self) -> SkillReport:
        """What learning found."""
        return self._client.skills.get(self.name, version=self.version)

    def query(
        self,
        objects: Objects | PoseLike,
        *,
        start: PoseLike | None = None,
        joint_start: JointStart | None = None,
    ) -> Motion:
        """The motion for object poses by name; a pose alone is that of the object that the skill is about."""
        return self._client.skills.query(
            self.name,
            self._named(objects),
            start=start,
            joint_start=joint_start,
            version=self.version,
        )

    def query_stream(self) -> MotionStream:
        """Opens a stream of questions, for moving objects."""
        return self._client.skills.query_stream(self.name, version=self.version)

    def execute(
        self,
        objects: Objects | PoseLike | None = None,
        *,
        speed: float = 1.0,
        start: PoseLike | None = None,
        follow: bool = False,
    ) -> Operation[Feedback, ExecutionResult]:
        """Carries it out; as `client.robot.execute`."""
        named = None if objects is None else self._named(objects)
        return self._client.robot.execute(
            self.name, named, speed=speed, start=start, follow=follow, version=self.version
        )

    def _named(self, objects: Objects | PoseLike) -> Objects:
        if isinstance(objects, Mapping):
            return objects
        if self._target is None:
            self._target = self.report().target
        return {self._target: objects}
