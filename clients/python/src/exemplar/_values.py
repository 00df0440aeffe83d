"""What the services answer, as values.

SI units, named at the end of a field. Poses are in the robot's base frame, quaternions are qx qy qz qw. Times without a
date count from the start of their trial or motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from ._pose import Array, Pose


@dataclass(frozen=True)
class Progress:
    """How far a long call has come: `fraction` in [0, 1], never back; `step` for a person."""

    fraction: float
    step: str


@dataclass(frozen=True)
class TopicInfo:
    """A topic of the station as the gateway sees it; counts since the gateway started, rates over the last second.

    `type` is its name on the network, `schema` its IDL ("" where no writer brought one).
    """

    topic: str
    type: str
    schema: str
    keyed: bool
    reliable: bool
    transient_local: bool
    writers: int
    received: int
    lost: int
    rate_hz: float
    bytes_per_s: float
    subscriptions: int
    may_publish: bool


@dataclass(frozen=True)
class TopicSample:
    """One sample. Stamps are nanoseconds since the Unix epoch: as the writer's middleware stamped it, and as the
    gateway received it. `value` holds the members where they were asked for and could be read; `error` says why not.
    `cdr` begins with the 4-byte encapsulation header.
    """

    topic: str
    writer: str
    sequence: int
    source_stamp_ns: int
    received_ns: int
    value: dict[str, Any] | None
    error: str
    cdr: bytes


@dataclass(frozen=True)
class TopicBatch:
    """What came since the last one. `missed`: samples dropped since the beginning because this client was slow."""

    topics: tuple[TopicInfo, ...]
    samples: tuple[TopicSample, ...]
    missed: int


@dataclass(frozen=True)
class TrialInfo:
    """A stored trial. `id` is stable, made from content and skill."""

    id: str
    skill: str
    source: str
    submitted: datetime | None
    duration_s: float
    streams: tuple[str, ...]
    samples: int
    notices: tuple[str, ...]
    person: str
    """Whose demonstration it is, a pseudonymous id; "": unknown."""


@dataclass(frozen=True)
class Submission:
    """A trial that was taken. `duplicate`: the skill had the same one, nothing was stored twice."""

    trial: TrialInfo
    duplicate: bool


@dataclass(frozen=True)
class Marker:
    """A candidate episode boundary; `kind` is "beginning" or "ending"."""

    time_s: float
    frame: int
    kind: str
    cause: str
    score: float


@dataclass(frozen=True, eq=False)
class Segmentation:
    """MSV segmentation of one trial (Eqs. 1 to 4 of the paper) on n uniform frames.

    time_s, msv: (n,). touch_term: (n,), or (0,) without touch. c, k: cut-off and ratio of Eqs. 3 and 4.
    c_along, high_along: (n,) of threshold=local, else (0,).
    """

    id: str
    time_s: Array
    msv: Array
    touch_term: Array
    c: float
    k: float
    c_tactile: float
    c_replaced: bool
    markers: tuple[Marker, ...]
    c_along: Array
    high_along: Array


@dataclass(frozen=True, eq=False)
class TrialReport:
    """What learning found in one trial. markers_s: (m,) on the trial's own time."""

    id: str
    source: str
    duration_s: float
    candidates: int
    markers_s: Array
    c: float
    k: float
    cutoff_hz: float
    target: Pose | None
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class MethodScore:
    """How well a method predicted each trial from the others. frechet_by_trial_m: as SkillReport.trials."""

    method: str
    frechet_m: float
    end_error_m: float
    frechet_by_trial_m: Array
    chosen: bool


@dataclass(frozen=True, eq=False)
class ContactReport:
    """One meeting of the tool with an object. point: (3,) m in the object's frame."""

    object: str
    begin_s: float
    end_s: float
    point: Array
    spread_m: float
    touch_measured: bool


@dataclass(frozen=True, eq=False)
class SkillReport:
    """What learning found. markers_s: (m,) on the common time; contact_point: (3,) m in the target's frame."""

    skill: str
    version: int
    method: str
    target: str
    options: dict[str, str]
    frames: int
    duration_s: float
    joint_names: tuple[str, ...]
    trials: tuple[TrialReport, ...]
    markers_s: Array
    contact_begin_s: float | None
    contact_end_s: float | None
    contact_point: Array | None
    contact_spread_m: float
    mean_correlation: float
    plain_correlation: float
    methods: tuple[MethodScore, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    contacts: tuple[ContactReport, ...]


@dataclass(frozen=True)
class SkillInfo:
    """A skill and its current version."""

    name: str
    version: int
    versions: int
    method: str
    target: str
    trials: int
    learned: datetime | None


@dataclass(frozen=True)
class SkillVersion:
    """One version of a skill."""

    version: int
    current: bool
    method: str
    trial_ids: tuple[str, ...]
    learned: datetime | None


@dataclass(frozen=True, eq=False)
class Contact:
    """Frames [first, last] in which the tool meets an object; point: (3,) m, base frame."""

    object: str
    first: int
    last: int
    point: Array
    touch_measured: bool


@dataclass(frozen=True, eq=False)
class Motion:
    """A skill's answer: n frames, j joints, o objects.

    time_s: (n,) from 0. joints: (n, j) rad or m, the demonstrated style. positions: (n, 3) m and quaternions: (n, 4)
    of the tool in the base frame; positions is (0, 3) for a skill without end-effector path, quaternions None without
    orientation. hand_open: (n,) in [0, 1], or (0,). objectivity: (n, o) in [0, 1], one column an object of
    object_names. sigma_m: (n,) predicted standard error of the position, or (0,). markers_s: episode boundaries.
    objects: as asked, orientations filled in.
    """

    skill: str
    version: int
    time_s: Array
    joint_names: tuple[str, ...]
    joints: Array
    positions: Array
    quaternions: Array | None
    hand_open: Array
    object_names: tuple[str, ...]
    objectivity: Array
    sigma_m: Array
    markers_s: Array
    contacts: tuple[Contact, ...]
    objects: dict[str, Pose]
    warnings: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def duration_s(self) -> float:
        """Time of the last frame."""
        return float(self.time_s[-1]) if len(self.time_s) else 0.0

    def tool(self, frame: int) -> Pose:
        """The tool's pose at a frame; negative ones count from the end."""
        if len(self.positions) == 0:
            raise IndexError("the motion has no end-effector path")
        quaternions = self.quaternions
        return Pose(self.positions[frame], None if quaternions is None else quaternions[frame])

    def position_at(self, time_s: float | Array) -> Array:
        """Tool position(s) at any time(s), linear between frames, held outside: (3,) or (m, 3) m."""
        columns = [np.interp(time_s, self.time_s, column) for column in self.positions.T]
        return np.stack(columns, axis=-1)


@dataclass(frozen=True, eq=False)
class Situation:
    """What a query asks for: object poses, and where the motion begins.

    start: tool pose, None for the trials' mean. joint_start: (j,) rad or m in the order of joint_names (empty: the
    skill's joint order), or None.
    """

    objects: dict[str, Pose]
    start: Pose | None = None
    joint_start: Array | None = None
    joint_names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Evaluation:
    """How far the skill's answer is from a trial that it was not learned from."""

    frechet_m: float
    end_error_m: float
    end_angle_rad: float
    situation: Situation
    answer: Motion


@dataclass(frozen=True, eq=False)
class Suggestion:
    """A place of the target where another demonstration would tell much; sigma_m: the error predicted there."""

    object: str
    pose: Pose
    sigma_m: float
    nearest_trial_m: float
    reason: str


@dataclass(frozen=True, eq=False)
class Suggestions:
    """Best place first. typical_sigma_m: the median error where the trials had the target."""

    places: tuple[Suggestion, ...]
    typical_sigma_m: float
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """A motion that was found safe. clearance_m: smallest distance to anything, and of which two."""

    duration_s: float
    frames: int
    max_position_error_m: float
    max_contact_error_m: float
    clearance_m: float
    clearance_between: str
    time_stretch: float
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Feedback:
    """A robot on its way: `time_s` of `duration_s`; state "planning", "executing", "paused", ..."""

    state: str
    time_s: float
    duration_s: float
    tracking_error_rad: float
    touch_n: float


@dataclass(frozen=True, eq=False)
class ExecutionResult:
    """How an execution ended. tool_time_s: (n,) and tool: (n, 7), the tool as measured, base frame."""

    state: str
    detail: str
    plan: Plan
    tracking_error_rad: float
    clearance_m: float
    contact_error_m: float | None
    touch_onset_s: float | None
    touch_max_n: float
    commands_sent: int
    lateness_p99_s: float
    lateness_max_s: float
    objects: dict[str, Pose]
    tool_time_s: Array
    tool: Array

    @property
    def done(self) -> bool:
        """Whether it came to its end; else `detail` says why not."""
        return self.state == "done"


@dataclass(frozen=True)
class TeleoperationFeedback:
    """A robot that follows a suit: phase "holding", "approaching", "following", "blocked"; `detail` says why.

    behind_rad: largest over the joints, the operator's posture against the commanded one, and behind_joint which.
    clearance_m: of the last measured state, None where it was not measured.
    """

    state: str
    phase: str
    detail: str
    time_s: float
    behind_rad: float
    behind_joint: str
    tracking_error_rad: float
    touch_n: float
    clearance_m: float | None
    suit_rate_hz: float


@dataclass(frozen=True)
class TeleoperationResult:
    """How teleoperation ended. following_s: in which the robot followed. latency: from a suit sample to its command."""

    state: str
    detail: str
    duration_s: float
    following_s: float
    suit_samples: int
    suit_samples_left_out: int
    commands_sent: int
    holds: int
    blocks: int
    tracking_error_rad: float
    clearance_m: float | None
    touch_max_n: float
    latency_p50_s: float
    latency_p99_s: float
    latency_max_s: float

    @property
    def done(self) -> bool:
        """Whether it was ended as asked; else `detail` says what ended it."""
        return self.state == "done"


@dataclass(frozen=True, eq=False)
class SeenObject:
    """An object as the cameras saw it, `age_s` ago."""

    name: str
    pose: Pose
    age_s: float


@dataclass(frozen=True, eq=False)
class RobotStatus:
    """The robot of the station. joints: (j,) rad or m; (0,) when no state was received. tool: base_T_tool."""

    state: str
    detail: str
    speed: float
    joint_names: tuple[str, ...]
    joints: Array
    state_age_s: float
    tool: Pose | None
    objects: tuple[SeenObject, ...]


@dataclass(frozen=True)
class TopicFigures:
    """What a recorder counted on one topic."""

    topic: str
    type: str
    sent: int
    received: int
    lost: int
    rate_hz: float
    has_schema: bool
    writers: int


@dataclass(frozen=True)
class RecorderStatus:
    """A recorder. `file`: the present or last one, on the recorder's machine."""

    state: str
    detail: str
    file: str
    duration_s: float
    messages: int
    bytes: int
    topics: tuple[TopicFigures, ...]
    lost: int
    rate_hz: float
    bytes_per_s: float
    disk_free_bytes: int
    part: int
    pauses: int
    left_out: int
    buffered_s: float


@dataclass(frozen=True)
class PersonInfo:
    """One person's data in one service: `items` trials or recordings. `person` "": of nobody knows whom."""

    person: str
    items: int
    bytes: int
    first: datetime | None
    last: datetime | None


@dataclass(frozen=True)
class DataItem:
    """One thing that was done, or would be: `kind` "trial", `name` its id, `action` "deleted"."""

    kind: str
    name: str
    action: str
    detail: str
    bytes: int
    at: datetime | None


@dataclass(frozen=True)
class DataReport:
    """What was done to a service's data."""

    items: tuple[DataItem, ...]
    notices: tuple[str, ...]


@dataclass(frozen=True)
class BackupService:
    """What a backup holds of one service, "learning" or "recorder"."""

    service: str
    schema: int
    parts: int
    bytes: int
    counts: dict[str, int]
    notices: tuple[str, ...]


@dataclass(frozen=True)
class Backup:
    """What a backup file holds; `program` is the version of what wrote it."""

    made: datetime
    program: str
    services: tuple[BackupService, ...]
