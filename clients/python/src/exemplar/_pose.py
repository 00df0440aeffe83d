"""Poses, and what may be given for one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ._errors import InvalidArgumentError

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False, init=False)
class Pose:
    """base_T_frame: where a frame is in the robot's base frame.

    position: (3,) m. quaternion: (4,) qx qy qz qw, unit; None where the orientation is unknown, or, for an object of
    a query, the trials' mean is to be taken.
    """

    position: Array
    quaternion: Array | None

    def __init__(self, position: npt.ArrayLike, quaternion: npt.ArrayLike | None = None) -> None:
        object.__setattr__(self, "position", numbers(position, 3, "position"))
        object.__setattr__(self, "quaternion", None if quaternion is None else _unit(quaternion))

    @classmethod
    def from_matrix(cls, matrix: npt.ArrayLike) -> Pose:
        """From a (4, 4) homogeneous matrix with a proper rotation."""
        m = np.asarray(matrix, dtype=float)
        if m.shape != (4, 4) or not np.isfinite(m).all():
            raise InvalidArgumentError(f"matrix has shape {m.shape}, must be 4 x 4 and finite", "matrix")
        r = m[:3, :3]
        if not np.allclose(r @ r.T, np.eye(3), atol=1e-6) or np.linalg.det(r) < 0:
            raise InvalidArgumentError("matrix holds no rotation in its first three rows", "matrix")
        # The four products q_i q give the quaternion up to its sign; the largest is the most exact.
        products = np.array(
            [
                [
                    1 + r[0, 0] - r[1, 1] - r[2, 2],
                    r[0, 1] + r[1, 0],
                    r[0, 2] + r[2, 0],
                    r[2, 1] - r[1, 2],
                ],
                [
                    r[0, 1] + r[1, 0],
                    1 - r[0, 0] + r[1, 1] - r[2, 2],
                    r[1, 2] + r[2, 1],
                    r[0, 2] - r[2, 0],
                ],
                [
                    r[0, 2] + r[2, 0],
                    r[1, 2] + r[2, 1],
                    1 - r[0, 0] - r[1, 1] + r[2, 2],
                    r[1, 0] - r[0, 1],
                ],
                [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + np.trace(r)],
            ]
        )
        return cls(m[:3, 3], products[int(np.argmax(np.diag(products)))])

    def matrix(self) -> Array:
        """The (4, 4) homogeneous matrix; without a quaternion, the rotation is the identity."""
        m = np.eye(4)
        m[:3, 3] = self.position
        if self.quaternion is not None:
            x, y, z, w = self.quaternion
            m[:3, :3] = [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        return m


PoseLike: TypeAlias = Pose | Sequence[float] | npt.NDArray[Any]
"""A Pose, x y z (m), or x y z qx qy qz qw; in the robot's base frame."""

Objects: TypeAlias = Mapping[str, PoseLike]
"""Object poses by name."""


def as_pose(value: PoseLike, field: str) -> Pose:
    """Reads what may stand for a pose; errors name `field`."""
    if isinstance(value, Pose):
        return value
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidArgumentError(f"{field} is {value!r}, must be numbers", field) from error
    if array.shape not in ((3,), (7,)):
        raise InvalidArgumentError(f"{field} has shape {array.shape}, must be x y z or x y z qx qy qz qw", field)
    try:
        return Pose(array[:3], array[3:] if len(array) == 7 else None)
    except InvalidArgumentError as error:
        raise InvalidArgumentError(f"{field}: {error.message}", field) from error


def _unit(values: npt.ArrayLike) -> Array:
    quaternion = numbers(values, 4, "quaternion")
    norm = float(np.linalg.norm(quaternion))
    if norm < 1e-9:
        raise InvalidArgumentError("quaternion is zero", "quaternion")
    return quaternion / norm


def numbers(values: npt.ArrayLike, count: int, field: str) -> Array:
    """`count` finite numbers."""
    array = np.array(values, dtype=float)
    if array.shape != (count,):
        raise InvalidArgumentError(f"{field} has shape {array.shape}, must be ({count},)", field)
    if not np.isfinite(array).all():
        raise InvalidArgumentError(f"{field} is {array.tolist()}, must be finite", field)
    return array
