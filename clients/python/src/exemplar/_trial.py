"""One demonstration as numpy arrays, and as a CSV file."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ._errors import InvalidArgumentError
from ._pose import Array

_POSE = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")
_WRENCH = {"fx": "_n", "fy": "_n", "fz": "_n", "tx": "_nm", "ty": "_nm", "tz": "_nm"}


@dataclass(frozen=True, eq=False, init=False)
class ScalarSeries:
    """Named channels sampled together: names (c), time_s (n,) increasing, values (n, c)."""

    names: tuple[str, ...]
    time_s: Array
    values: Array

    def __init__(self, names: Iterable[str], time_s: npt.ArrayLike, values: npt.ArrayLike) -> None:
        object.__setattr__(self, "names", tuple(names))
        object.__setattr__(self, "time_s", _times(time_s))
        object.__setattr__(self, "values", _table(values, len(self.time_s), len(self.names), "values"))


@dataclass(frozen=True, eq=False, init=False)
class PoseSeries:
    """Poses of a frame in the robot's base frame.

    time_s: (n,) increasing. positions: (n, 3) m. quaternions: (n, 4) qx qy qz qw, or None.
    """

    time_s: Array
    positions: Array
    quaternions: Array | None

    def __init__(
        self, time_s: npt.ArrayLike, positions: npt.ArrayLike, quaternions: npt.ArrayLike | None = None
    ) -> None:
        times = _times(time_s)
        object.__setattr__(self, "time_s", times)
        object.__setattr__(self, "positions", _table(positions, len(times), 3, "positions"))
        given = None if quaternions is None else _table(quaternions, len(times), 4, "quaternions")
        object.__setattr__(self, "quaternions", given)


@dataclass(frozen=True, eq=False)
class Trial:
    """A demonstration. Each stream has time stamps of its own; all may be absent but one of joints and end effectors.

    joints: rad, or m for those of prismatic_joints. measured_joints: the same as the robot measured them.
    end_effectors: one a hand, the main one named "". objects: by name. hands: opening, 0 closed to 1 open.
    tactile: N a sensor. wrench: fx fy fz (N) tx ty tz (N m) at the tool. label: a person's own phase numbers.
    """

    joints: ScalarSeries | None = None
    measured_joints: ScalarSeries | None = None
    prismatic_joints: tuple[str, ...] = ()
    end_effectors: Mapping[str, PoseSeries] = field(default_factory=dict)
    objects: Mapping[str, PoseSeries] = field(default_factory=dict)
    hands: ScalarSeries | None = None
    tactile: ScalarSeries | None = None
    wrench: ScalarSeries | None = None
    label: ScalarSeries | None = None
    source: str = "trial.csv"
    start: datetime | None = None
    notices: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """From the first to the last sample of joints and end effectors."""
        times = [series.time_s for series in self.end_effectors.values()]
        if self.joints is not None:
            times.append(self.joints.time_s)
        times = [time_s for time_s in times if len(time_s)]
        if not times:
            return 0.0
        return float(max(t[-1] for t in times) - min(t[0] for t in times))

    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str:
        """The trial as the CSV text that the services read, also written to `path`.

        One row a time stamp of any stream; a stream's cells are empty where it has no sample. `start` is not kept.
        """
        streams = list(self._columns())
        if not streams:
            raise InvalidArgumentError("the trial is empty", "trial")
        time_s = np.unique(np.concatenate([times for times, _, _ in streams]))
        columns: list[list[str]] = [[repr(float(t)) for t in time_s]]
        header = ["time_s"]
        for times, names, values in streams:
            rows = np.searchsorted(time_s, times)
            header += names
            for column in values.T:
                cells = [""] * len(time_s)
                for row, value in zip(rows, column, strict=True):
                    cells[row] = repr(float(value))
                columns.append(cells)
        text = io.StringIO(newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(zip(*columns, strict=True))
        if path is not None:
            Path(path).write_text(text.getvalue(), encoding="utf-8")
        return text.getvalue()

    @classmethod
    def from_csv(cls, source: str | os.PathLike[str]) -> Trial:
        """Reads a trial file.

        The service reads the same and mends more: what is to be stored as it is can be submitted by its path.
        Raises InvalidArgumentError with the column at fault.
        """
        path = Path(source)
        return cls._from_text(path.read_text(encoding="utf-8-sig"), path.name)

    @classmethod
    def _from_text(cls, text: str, source: str) -> Trial:
        rows = [row for row in csv.reader(io.StringIO(text)) if row]
        if len(rows) < 2:
            raise InvalidArgumentError(f"{source} holds no samples", source)
        header = [name.strip() for name in rows[0]]
        table = np.empty((len(rows) - 1, len(header)))
        for sample, row in enumerate(rows[1:]):
            if len(row) != len(header):
                what = f"has {len(row)} cells, the header {len(header)}"
                raise InvalidArgumentError(f"{source}: sample {sample + 1} {what}", source)
            table[sample] = [_cell(word, sample, name, source) for word, name in zip(row, header, strict=True)]
        return _Columns(header, table, source).trial()

    def _columns(self) -> Iterable[tuple[Array, list[str], Array]]:
        """Time stamps, column names and values of each stream."""
        suffix = dict.fromkeys(self.prismatic_joints, "_m")
        for joints, ending in ((self.joints, ""), (self.measured_joints, "_measured")):
            if joints is not None:
                names = [name + suffix.get(name, "_rad") + ending for name in joints.names]
                yield joints.time_s, names, joints.values
        for prefix, group in (("ee", self.end_effectors), ("object", self.objects)):
            for name, series in group.items():
                stem = "_".join(part for part in (prefix, name) if part)
                if series.quaternions is None:
                    yield series.time_s, [f"{stem}_{part}" for part in _POSE[:3]], series.positions
                else:
                    poses = np.hstack([series.positions, series.quaternions])
                    yield series.time_s, [f"{stem}_{part}" for part in _POSE], poses
        if self.hands is not None:
            names = [f"hand_{name}_open" if name else "hand_open" for name in self.hands.names]
            yield self.hands.time_s, names, self.hands.values
        if self.tactile is not None:
            names = [f"tactile_{name}_n" for name in self.tactile.names]
            yield self.tactile.time_s, names, self.tactile.values
        if self.wrench is not None:
            for name in self.wrench.names:
                if name not in _WRENCH:
                    raise InvalidArgumentError(f'wrench channel "{name}" is none of {", ".join(_WRENCH)}', "wrench")
            names = [f"wrench_{name}{_WRENCH[name]}" for name in self.wrench.names]
            yield self.wrench.time_s, names, self.wrench.values
        if self.label is not None:
            yield self.label.time_s, ["label"], self.label.values


class _Columns:
    """A table's columns, taken away group by group."""

    def __init__(self, header: list[str], table: Array, source: str) -> None:
        if len(set(header)) < len(header):
            raise InvalidArgumentError(f"{source}: a column stands twice in the header", source)
        if "time_s" not in header:
            raise InvalidArgumentError(f"{source}: no column time_s in the header", "time_s")
        self._column = {name: table[:, i] for i, name in enumerate(header)}
        self._source = source
        time_s = self._column.pop("time_s")
        self._time_s = time_s - time_s[0]

    def trial(self) -> Trial:
        """The groups that are known by their names; all other columns are left over."""
        end_effectors = self._poses("ee", may_be_unnamed=True)
        objects = self._poses("object", may_be_unnamed=False)
        hands = {"hand_open": ""} if "hand_open" in self._column else {}
        hand_series = self._scalars({**hands, **self._between("hand_", "_open")})
        tactile = self._scalars(self._between("tactile_", "_n"))
        forces = {f"wrench_{name}{unit}": name for name, unit in _WRENCH.items()}
        wrench = self._scalars({column: name for column, name in forces.items() if column in self._column})
        label = self._scalars({"label": "label"} if "label" in self._column else {})
        measured = self._scalars({**self._between("", "_rad_measured"), **self._between("", "_m_measured")})
        prismatic = self._between("", "_m")
        both = {**self._between("", "_rad"), **prismatic}
        joints = self._scalars({column: both[column] for column in self._column if column in both})
        if joints is None and not end_effectors:
            what = "neither joints nor an end effector among the columns"
            raise InvalidArgumentError(f"{self._source}: {what}", "ee_x_m")
        return Trial(
            joints=joints,
            measured_joints=measured,
            prismatic_joints=tuple(prismatic.values()),
            end_effectors=end_effectors,
            objects=objects,
            hands=hand_series,
            tactile=tactile,
            wrench=wrench,
            label=label,
            source=self._source,
            notices=tuple(f'column "{name}" is ignored' for name in self._column),
        )

    def _between(self, prefix: str, suffix: str) -> dict[str, str]:
        """Columns with what stands between prefix and suffix."""
        named = {}
        for column in self._column:
            name = column.removeprefix(prefix).removesuffix(suffix)
            if name and column == prefix + name + suffix:
                named[column] = name
        return named

    def _poses(self, prefix: str, may_be_unnamed: bool) -> dict[str, PoseSeries]:
        series = {}
        for column in [name for name in self._column if name.endswith("_x_m")]:
            stem = column.removesuffix("_x_m")
            name = stem.removeprefix(prefix).removeprefix("_")
            if not (stem.startswith(f"{prefix}_") or (may_be_unnamed and stem == prefix)):
                continue
            parts = [f"{stem}_{part}" for part in _POSE]
            if any(part in self._column for part in parts[3:]):
                time_s, values = self._take(parts)
                series[name] = PoseSeries(time_s, values[:, :3], values[:, 3:])
            else:
                series[name] = PoseSeries(*self._take(parts[:3]))
        return series

    def _scalars(self, columns: Mapping[str, str]) -> ScalarSeries | None:
        if not columns:
            return None
        return ScalarSeries(tuple(columns.values()), *self._take(list(columns)))

    def _take(self, names: list[str]) -> tuple[Array, Array]:
        """The rows in which a group has values; it must have all or none."""
        for name in names:
            if name not in self._column:
                raise InvalidArgumentError(f"{self._source}: column {name} is missing", name)
        values = np.column_stack([self._column.pop(name) for name in names])
        empty = np.isnan(values)
        rows = ~empty.any(axis=1)
        half = np.flatnonzero(empty.any(axis=1) & ~empty.all(axis=1))
        if len(half):
            name = names[int(np.flatnonzero(empty[half[0]])[0])]
            raise InvalidArgumentError(
                f"{self._source}: sample {half[0] + 1}: {name} is empty, others of its group are not",
                name,
            )
        return self._time_s[rows], values[rows]


def _cell(word: str, sample: int, column: str, source: str) -> float:
    """A number; NaN for an empty cell."""
    try:
        return float(word) if word.strip() else np.nan
    except ValueError:
        what = f'"{word}" is no number'
        raise InvalidArgumentError(f"{source}: sample {sample + 1}: {column}: {what}", column) from None


def _times(values: npt.ArrayLike) -> Array:
    time_s = np.array(values, dtype=float)
    if time_s.ndim != 1 or not np.isfinite(time_s).all() or (np.diff(time_s) <= 0).any():
        raise InvalidArgumentError("time_s must be one row of increasing numbers", "time_s")
    return time_s


def _table(values: npt.ArrayLike, rows: int, columns: int, name: str) -> Array:
    table = np.array(values, dtype=float)
    if table.shape != (rows, columns):
        raise InvalidArgumentError(f"{name} has shape {table.shape}, must be ({rows}, {columns})", name)
    if not np.isfinite(table).all():
        raise InvalidArgumentError(f"{name} must be finite", name)
    return table
