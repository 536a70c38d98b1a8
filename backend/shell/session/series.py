"""Values over the time of a session: clearances, joint angles, ages, levels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.safety.record import Level
from backend.spatial.types import AnyArray

Key: TypeAlias = tuple[str, ...]
"""("clearance", "left|right"), ("age", machine, stream), ("joint", machine, role) or
("level", machine)."""

NAMES = [level.name for level in Level]


@dataclass(frozen=True)
class Row:
    """One moment's values. time: on the session's line [ns]; NaN where unknown."""

    time: int
    values: dict[Key, float]


def row_of_document(time: int, document: Mapping[str, Any]) -> Row:
    """Of a snapshot's document. Raises KeyError and TypeError for what is none."""
    values: dict[Key, float] = {}
    for pair in document["pairs"]:
        known = [v for v in (pair["distance"], pair["at_least"]) if v is not None and v == v]
        values[("clearance", f"{pair['a']}|{pair['b']}")] = known[0] if known else math.nan
    for name, machine in document["machines"].items():
        for stream, age in machine["ages"].items():
            values[("age", name, stream)] = math.inf if age is None else age
        for role, angle in machine["joints"].items():
            values[("joint", name, role)] = math.nan if angle is None else angle
    for concern in document["concerns"]:
        key = ("level", concern["machine"])
        values[key] = max(values.get(key, 0.0), float(Level[concern["level"]]))
    return Row(time, values)


def row_of_snapshot(time: int, snapshot: Snapshot, config: Config) -> Row:
    """Of a snapshot."""
    values: dict[Key, float] = {
        ("clearance", f"{pair.a}|{pair.b}"): pair.distance for pair in snapshot.pairs
    }
    for name, state in snapshot.machines.items():
        for stream, status in state.pose.streams.items():
            values[("age", name, stream)] = status.age
        for joint, angle in zip(config.machines[name].joints, state.pose.joints, strict=True):
            values[("joint", name, joint.role)] = float(angle)
    for concern in snapshot.concerns:
        key = ("level", concern.machine)
        values[key] = max(values.get(key, 0.0), float(concern.level))
    return Row(time, values)


@dataclass(frozen=True)
class Series:
    """times: (n,) [ns]; columns: (n,) each, NaN where unknown."""

    times: AnyArray
    columns: dict[Key, AnyArray]


EMPTY = Series(np.zeros(0, np.int64), {})


@dataclass
class SeriesBuilder:
    """Rows, one by one, in the order of time."""

    _times: list[int] = field(default_factory=list)
    _columns: dict[Key, list[float]] = field(default_factory=dict)

    def add(self, row: Row) -> None:
        count = len(self._times)
        self._times.append(row.time)
        for key, value in row.values.items():
            column = self._columns.get(key)
            if column is None:
                column = self._columns[key] = []
            if len(column) < count:
                column.extend([math.nan] * (count - len(column)))
            column.append(value)

    def series(self) -> Series:
        count = len(self._times)
        columns = {
            key: np.array(column + [math.nan] * (count - len(column)), dtype=np.float32)
            for key, column in self._columns.items()
        }
        return Series(np.array(self._times, dtype=np.int64), columns)


def series_document(
    series: Series, begin: int, start: float, end: float, points: int
) -> dict[str, Any]:
    """What backend.documents.session.SeriesDocument describes. start, end: [s] since `begin` [ns].

    With fewer points than rows, an interval keeps its smallest clearance, its worst level and its
    greatest age, and of joints the first value.
    """
    first = int(np.searchsorted(series.times, begin + round(start * 1e9)))
    last = int(np.searchsorted(series.times, begin + round(end * 1e9), side="right"))
    count = last - first
    edges = first + np.unique(np.linspace(0, count, min(points, count) + 1).astype(int)[:-1])
    document: dict[str, Any] = {
        "time": ((series.times[edges] - begin) / 1e9).tolist(),
        "clearance": {},
        "ages": {},
        "joints": {},
        "levels": {},
    }
    if count == 0:
        return document
    for key, column in series.columns.items():
        values = _reduced(key[0], column[:last], edges)
        if key[0] == "clearance":
            document["clearance"][key[1]] = _plain(values, 3)
        elif key[0] == "level":
            document["levels"][key[1]] = [None if v != v else NAMES[int(v)] for v in values]
        else:
            group = "ages" if key[0] == "age" else "joints"
            document[group].setdefault(key[1], {})[key[2]] = _plain(values, 4)
    return document


def _reduced(kind: str, column: AnyArray, edges: AnyArray) -> AnyArray:
    if kind == "joint":
        return column[edges]
    reduce = np.fmin if kind == "clearance" else np.fmax  # NaN only where nothing is known
    return np.asarray(reduce.reduceat(column, edges))


def _plain(values: AnyArray, digits: int) -> list[float | None]:
    return [round(v, digits) if math.isfinite(v) else None for v in values.tolist()]
