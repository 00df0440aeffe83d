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
    ResourceExhaustedError,
    UnavailableError,
)
from ._pose import Objects, Pose, PoseLike
from ._sync import MotionStream, Operation, Subscription
from ._trial import PoseSeries, ScalarSeries, Trial
from ._values import (
    Contact,
    ContactReport,
    Evaluation,
    ExecutionResult,
    Feedback,
    Marker,
    MethodScore,
    Motion,
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
    "CancelledError",
    "Client",
    "Contact",
    "ContactReport",
    "Content",
    "DataLossError",
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
    "Plan",
    "Pose",
    "PoseLike",
    "PoseSeries",
    "Progress",
    "RecorderStatus",
    "ResourceExhaustedError",
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
    "TopicFigures",
    "TopicInfo",
    "TopicSample",
    "Trial",
    "TrialFile",
    "TrialInfo",
    "TrialReport",
    "UnavailableError",
]
