"""Messages -> values. `m` is a message of the type that the .proto files name after the function."""

from __future__ import annotations

import json
from collections.abc import Iterable
from datetime import UTC, datetime

import numpy as np

from ._pose import Array, Pose
from ._trial import PoseSeries, ScalarSeries, Trial
from ._values import (
    Contact,
    ContactReport,
    DataItem,
    DataReport,
    Evaluation,
    ExecutionResult,
    Feedback,
    Marker,
    MethodScore,
    Motion,
    PersonInfo,
    Plan,
    Progress,
    RecorderStatus,
    RobotStatus,
    SeenObject,
    Segmentation,
    Situation,
    SkillInfo,
    SkillReport,
    SkillVersion,
    Submission,
    Suggestion,
    Suggestions,
    TeleoperationFeedback,
    TeleoperationResult,
    TopicBatch,
    TopicFigures,
    TopicInfo,
    TopicSample,
    TrialInfo,
    TrialReport,
)
from ._wire import Message


def array(values: Message) -> Array:
    """A repeated double."""
    return np.fromiter(values, dtype=float, count=len(values))


def table(values: Message, columns: int) -> Array:
    """A repeated double in row-major order."""
    flat = array(values)
    return flat.reshape(-1, columns) if columns else flat.reshape(0, 0)


def strings(values: Iterable[str]) -> tuple[str, ...]:
    return tuple(values)


def time(m: Message, field: str) -> datetime | None:
    if not m.HasField(field):
        return None
    stamp = getattr(m, field)
    return datetime.fromtimestamp(stamp.seconds, UTC).replace(microsecond=stamp.nanos // 1000)


def vector(m: Message) -> Array:
    return np.array([m.x, m.y, m.z])


def pose(m: Message) -> Pose:
    q = m.rotation
    return Pose(vector(m.position), np.array([q.x, q.y, q.z, q.w]) if m.HasField("rotation") else None)


def named_poses(poses: Iterable[Message]) -> dict[str, Pose]:
    return {m.name: pose(m.pose) for m in poses}


def progress(m: Message) -> Progress:
    return Progress(m.fraction, m.step)


def topic_info(m: Message) -> TopicInfo:
    return TopicInfo(
        m.topic,
        m.type,
        m.schema,
        m.keyed,
        m.reliable,
        m.transient_local,
        m.writers,
        m.received,
        m.lost,
        m.rate_hz,
        m.bytes_per_s,
        m.subscriptions,
        m.may_publish,
    )


def topic_sample(m: Message) -> TopicSample:
    return TopicSample(
        m.topic,
        m.writer,
        m.sequence,
        m.source_stamp_ns,
        m.received_ns,
        json.loads(m.json) if m.json else None,
        m.json_error,
        m.cdr,
    )


def topic_batch(m: Message) -> TopicBatch:
    return TopicBatch(tuple(topic_info(x) for x in m.topics), tuple(topic_sample(x) for x in m.samples), m.missed)


def trial_info(m: Message) -> TrialInfo:
    return TrialInfo(
        m.id,
        m.skill,
        m.source,
        time(m, "submitted"),
        m.duration_s,
        strings(m.streams),
        m.samples,
        strings(m.notices),
        m.person,
    )


def submission(m: Message) -> Submission:
    return Submission(trial_info(m.trial), m.duplicate)


def scalar_series(m: Message, field: str) -> ScalarSeries | None:
    if not m.HasField(field):
        return None
    series = getattr(m, field)
    return ScalarSeries(strings(series.names), array(series.time_s), table(series.values, len(series.names)))


def pose_series(m: Message) -> PoseSeries:
    poses = table(m.poses, 7)
    return PoseSeries(array(m.time_s), poses[:, :3], poses[:, 3:] if m.has_orientation else None)


def trial(m: Message) -> Trial:
    return Trial(
        joints=scalar_series(m, "joints"),
        measured_joints=scalar_series(m, "measured_joints"),
        prismatic_joints=strings(m.prismatic_joints),
        end_effectors={series.name: pose_series(series) for series in m.end_effectors},
        objects={series.name: pose_series(series) for series in m.objects},
        hands=scalar_series(m, "hands"),
        tactile=scalar_series(m, "tactile"),
        wrench=scalar_series(m, "wrench"),
        label=scalar_series(m, "label"),
        source=m.source,
        start=time(m, "start"),
        notices=strings(m.notices),
    )


_MARKER_KINDS = {1: "beginning", 2: "ending"}


def segmentation(m: Message) -> Segmentation:
    s = m.segmentation
    return Segmentation(
        id=m.id,
        time_s=array(m.time_s),
        msv=array(s.msv),
        touch_term=array(s.touch_term),
        c=s.c,
        k=s.k,
        c_tactile=s.c_tactile,
        c_replaced=s.c_replaced,
        markers=tuple(Marker(x.time_s, x.frame, _MARKER_KINDS.get(x.kind, ""), x.cause, x.score) for x in s.markers),
        c_along=array(s.c_along),
        high_along=array(s.high_along),
    )


def trial_report(m: Message) -> TrialReport:
    return TrialReport(
        id=m.id,
        source=m.source,
        duration_s=m.duration_s,
        candidates=m.candidates,
        markers_s=array(m.markers_s),
        c=m.c,
        k=m.k,
        cutoff_hz=m.cutoff_hz,
        target=pose(m.target_pose) if m.HasField("target_pose") else None,
        notes=strings(m.notes),
    )


def method_score(m: Message) -> MethodScore:
    return MethodScore(m.method, m.frechet_m, m.end_error_m, array(m.frechet_by_trial_m), m.chosen)


def contact_report(m: Message) -> ContactReport:
    return ContactReport(m.object, m.begin_s, m.end_s, vector(m.point), m.spread_m, m.touch_measured)


def skill_report(m: Message) -> SkillReport:
    return SkillReport(
        skill=m.skill,
        version=m.version,
        method=m.method,
        target=m.target,
        options=dict(m.options),
        frames=m.frames,
        duration_s=m.duration_s,
        joint_names=strings(m.joint_names),
        trials=tuple(trial_report(x) for x in m.trials),
        markers_s=array(m.markers_s),
        contact_begin_s=m.contact_begin_s if m.HasField("contact_begin_s") else None,
        contact_end_s=m.contact_end_s if m.HasField("contact_end_s") else None,
        contact_point=vector(m.contact_point) if m.HasField("contact_point") else None,
        contact_spread_m=m.contact_spread_m,
        mean_correlation=m.mean_correlation,
        plain_correlation=m.plain_correlation,
        methods=tuple(method_score(x) for x in m.methods),
        warnings=strings(m.warnings),
        notes=strings(m.notes),
        contacts=tuple(contact_report(x) for x in m.contacts),
    )


def skill_info(m: Message) -> SkillInfo:
    return SkillInfo(m.name, m.version, m.versions, m.method, m.target, m.trials, time(m, "learned"))


def skill_version(m: Message) -> SkillVersion:
    return SkillVersion(m.version, m.current, m.method, strings(m.trial_ids), time(m, "learned"))


def motion(m: Message) -> Motion:
    tool = table(m.tool, 7)
    return Motion(
        skill=m.skill,
        version=m.version,
        time_s=array(m.time_s),
        joint_names=strings(m.joint_names),
        joints=table(m.joints, len(m.joint_names)) if m.joint_names else np.empty((len(m.time_s), 0)),
        positions=tool[:, :3],
        quaternions=tool[:, 3:] if m.has_orientation and len(tool) else None,
        hand_open=array(m.hand_open),
        object_names=strings(m.object_names),
        objectivity=table(m.objectivity, len(m.object_names)),
        sigma_m=array(m.sigma_m),
        markers_s=array(m.markers_s),
        contacts=tuple(Contact(c.object, c.first, c.last, vector(c.point), c.touch_measured) for c in m.contacts),
        objects=named_poses(m.objects),
        warnings=strings(m.warnings),
    )


def situation(m: Message) -> Situation:
    return Situation(
        objects=named_poses(m.objects),
        start=pose(m.start) if m.HasField("start") else None,
        joint_start=array(m.joint_start) if m.joint_start else None,
        joint_names=strings(m.joint_start_names),
    )


def evaluation(m: Message) -> Evaluation:
    return Evaluation(m.frechet_m, m.end_error_m, m.end_angle_rad, situation(m.query), motion(m.answer))


def suggestions(m: Message) -> Suggestions:
    places = (Suggestion(x.target.name, pose(x.target.pose), x.sigma_m, x.nearest_trial_m, x.reason) for x in m.places)
    return Suggestions(tuple(places), m.typical_sigma_m, strings(m.notes))


def plan(m: Message) -> Plan:
    return Plan(
        duration_s=m.duration_s,
        frames=m.frames,
        max_position_error_m=m.max_position_error_m,
        max_contact_error_m=m.max_contact_error_m,
        clearance_m=m.clearance_m,
        clearance_between=m.clearance_between,
        time_stretch=m.time_stretch,
        warnings=strings(m.warnings),
    )


def feedback(m: Message) -> Feedback:
    return Feedback(m.state, m.time_s, m.duration_s, m.tracking_error_rad, m.touch_n)


def execution_result(m: Message) -> ExecutionResult:
    return ExecutionResult(
        state=m.state,
        detail=m.detail,
        plan=plan(m.plan),
        tracking_error_rad=m.tracking_error_rad,
        clearance_m=m.clearance_m,
        contact_error_m=m.contact_error_m if m.HasField("contact_error_m") else None,
        touch_onset_s=m.touch_onset_s if m.HasField("touch_onset_s") else None,
        touch_max_n=m.touch_max_n,
        commands_sent=m.commands_sent,
        lateness_p99_s=m.lateness_p99_s,
        lateness_max_s=m.lateness_max_s,
        objects=named_poses(m.objects),
        tool_time_s=array(m.tool.time_s),
        tool=table(m.tool.poses, 7),
    )


def number(m: Message, field: str) -> float | None:
    return getattr(m, field) if m.HasField(field) else None


def teleoperation_feedback(m: Message) -> TeleoperationFeedback:
    return TeleoperationFeedback(
        state=m.state,
        phase=m.phase,
        detail=m.detail,
        time_s=m.time_s,
        behind_rad=m.behind_rad,
        behind_joint=m.behind_joint,
        tracking_error_rad=m.tracking_error_rad,
        touch_n=m.touch_n,
        clearance_m=number(m, "clearance_m"),
        suit_rate_hz=m.suit_rate_hz,
    )


def teleoperation_result(m: Message) -> TeleoperationResult:
    return TeleoperationResult(
        state=m.state,
        detail=m.detail,
        duration_s=m.duration_s,
        following_s=m.following_s,
        suit_samples=m.suit_samples,
        suit_samples_left_out=m.suit_samples_left_out,
        commands_sent=m.commands_sent,
        holds=m.holds,
        blocks=m.blocks,
        tracking_error_rad=m.tracking_error_rad,
        clearance_m=number(m, "clearance_m"),
        touch_max_n=m.touch_max_n,
        latency_p50_s=m.latency_p50_s,
        latency_p99_s=m.latency_p99_s,
        latency_max_s=m.latency_max_s,
    )


def robot_status(m: Message) -> RobotStatus:
    return RobotStatus(
        state=m.state,
        detail=m.detail,
        speed=m.speed,
        joint_names=strings(m.joint_names),
        joints=array(m.joints),
        state_age_s=m.state_age_s,
        tool=pose(m.tool) if m.HasField("tool") else None,
        objects=tuple(SeenObject(x.object.name, pose(x.object.pose), x.age_s) for x in m.objects),
    )


def topic_figures(m: Message) -> TopicFigures:
    return TopicFigures(m.topic, m.type, m.sent, m.received, m.lost, m.rate_hz, m.has_schema, m.writers)


def recorder_status(m: Message) -> RecorderStatus:
    return RecorderStatus(
        state=m.state,
        detail=m.detail,
        file=m.file,
        duration_s=m.duration_s,
        messages=m.messages,
        bytes=m.bytes,
        topics=tuple(topic_figures(x) for x in m.topics),
        lost=m.lost,
        rate_hz=m.rate_hz,
        bytes_per_s=m.bytes_per_s,
        disk_free_bytes=m.disk_free_bytes,
        part=m.part,
        pauses=m.pauses,
        left_out=m.left_out,
        buffered_s=m.buffered_s,
    )


def person_info(m: Message) -> PersonInfo:
    return PersonInfo(m.person, m.items, m.bytes, time(m, "first"), time(m, "last"))


def data_report(m: Message) -> DataReport:
    items = (DataItem(x.kind, x.name, x.action, x.detail, x.bytes, time(x, "at")) for x in m.items)
    return DataReport(tuple(items), strings(m.notices))
