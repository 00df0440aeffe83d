"""Client of Exemplar: teaches a robot skills from a few demonstrations.

with exemplar.Client() as client:
    press = client.skill("press")
    press.submit("trial1.csv", "trial2.csv", "trial3.csv")
    press.learn().result()
    motion = press.query([0.45, -0.20, 0.06])
    print(motion.positions)

Everywhere: SI units, named at the end of a field (_s, _m, _n, _rad); poses are in the robot's base frame; quaternions
are qx qy qz qw.
"""

from ._aio import AsyncMotionStream, AsyncOperation, AsyncSubscription
from ._async_client import AsyncClient, AsyncSkill
from ._calls import Content, JointStart, Options, Sample, TrialFile
from ._client import Client, Skill
from ._data import BackupFile, BackupWriter, RestoreMode
from ._data import verify as verify_backup
from ._errors import (
    AlreadyExistsError,
    CancelledError,
    DataLossError,
    DeadlineExceededError,
    ExemplarError,
    FailedPreconditionError,
    InternalError,
    InvalidArgumentError,
    NotFoundError,
    PermissionDeniedError,
    ResourceExhaustedError,
    UnauthenticatedError,
    UnavailableError,
    UnimplementedError,
)
from ._pose import Objects, Pose, PoseLike
from ._recording import RecordedSample, Replayed, read_recording, replay, replay_async
from ._sync import MotionStream, Operation, Subscription
from ._trial import PoseSeries, ScalarSeries, Trial
from ._values import (
    Backup,
    BackupService,
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
    TopicFigures,
    TopicInfo,
    TopicSample,
    TrialInfo,
    TrialReport,
)

__all__ = [
    "AlreadyExistsError",
    "AsyncClient",
    "AsyncMotionStream",
    "AsyncOperation",
    "AsyncSkill",
    "AsyncSubscription",
    "Backup",
    "BackupFile",
    "BackupService",
    "BackupWriter",
    "CancelledError",
    "Client",
    "Contact",
    "ContactReport",
    "Content",
    "DataItem",
    "DataLossError",
    "DataReport",
    "DeadlineExceededError",
    "Evaluation",
    "ExecutionResult",
    "ExemplarError",
    "FailedPreconditionError",
    "Feedback",
    "InternalError",
    "InvalidArgumentError",
    "JointStart",
    "Marker",
    "MethodScore",
    "Motion",
    "MotionStream",
    "NotFoundError",
    "Objects",
    "Operation",
    "Options",
    "PermissionDeniedError",
    "PersonInfo",
    "Plan",
    "Pose",
    "PoseLike",
    "PoseSeries",
    "Progress",
    "RecordedSample",
    "RecorderStatus",
    "Replayed",
    "ResourceExhaustedError",
    "RestoreMode",
    "RobotStatus",
    "Sample",
    "ScalarSeries",
    "SeenObject",
    "Segmentation",
    "Situation",
    "Skill",
    "SkillInfo",
    "SkillReport",
    "SkillVersion",
    "Submission",
    "Subscription",
    "Suggestion",
    "Suggestions",
    "TeleoperationFeedback",
    "TeleoperationResult",
    "TopicFigures",
    "TopicInfo",
    "TopicSample",
    "Trial",
    "TrialFile",
    "TrialInfo",
    "TrialReport",
    "UnauthenticatedError",
    "UnavailableError",
    "UnimplementedError",
    "read_recording",
    "replay",
    "replay_async",
    "verify_backup",
]
