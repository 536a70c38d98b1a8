"""Tables of poses (CSV, Parquet) to the messages that the sensors would have sent."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from backend.errors import InputError
from backend.machine.model import ROLES
from backend.shell.session.format import Message
from backend.shell.session.pose_columns import MACHINE, VALIDITY, Layout, read_layout
from backend.shell.session.pose_messages import SIGMA_POSITION, SIGMA_YAW, PoseMessages
from backend.shell.session.source import Problems, Progress, Source
from backend.shell.session.table_file import column_names, numbers, read_columns, where
from backend.site.site import Site
from backend.spatial.types import Array

SUFFIXES = (".csv", ".parquet")
_LATEST = 4e18  # [ns] about the year 2096


def is_table(path: Path) -> bool:
    return path.suffix in SUFFIXES


def read_poses(path: Path, site: Site, progress: Progress | None = None) -> Source:
    """Rows in order of their times. An empty cell is a value that was not measured then.

    Raises InputError for a table that cannot be read: file, line, column, value, what is allowed.
    """
    names = column_names(path)
    layout = read_layout(names, site, str(path))
    table = read_columns(path, [name for name in names if name in _wanted(layout)])
    if not table.num_rows:
        raise InputError(f"{path}: has no rows.")
    problems = Problems()
    columns = {name: numbers(table, name, path, problems) for name in layout.numeric}
    skipped = {f"column {name}": table.num_rows for name in layout.unused}
    machines = _machines(table, layout, site, path, problems, skipped)
    times = _times(columns.pop(layout.time[0]), layout, path)
    order = _in_time(times, machines, path, problems)
    rows = _Rows(path, site, layout, columns, problems)
    return Source(
        path=path,
        origin=f"table of poses: {path.name}",
        note="Sensor messages are made from a table of poses.",
        messages=_messages(rows, order, times, machines, progress),
        problems=problems,
        skipped=skipped,
    )


def _messages(
    rows: _Rows,
    order: Any,
    times: Any,
    machines: list[str] | None,
    progress: Progress | None,
) -> Iterator[Message]:
    for count, row in enumerate(order.tolist()):
        if machines is None:
            for name in rows.layout.machines:
                yield from rows.messages(row, int(times[row]), name, name)
        elif machines[row]:
            yield from rows.messages(row, int(times[row]), "", machines[row])
        if progress and count % 1000 == 0:
            progress(count / len(order))


class _Rows:
    """Rows of a table to messages. columns: (rows,) float by column, NaN where empty."""

    def __init__(
        self,
        path: Path,
        site: Site,
        layout: Layout,
        columns: dict[str, Array],
        problems: Problems,
    ) -> None:
        self.layout = layout
        self._path = path
        self._site = site
        self._columns = columns
        self._problems = problems
        self._encoders: dict[str, PoseMessages] = {}
        self._swing: dict[str, float] = {}

    def messages(self, row: int, time: int, group: str, machine: str) -> Iterator[Message]:
        """One machine's messages of one row; group: its key in the layout."""
        if machine not in self._encoders:
            self._encoders[machine] = PoseMessages(self._site, machine)
        encode = self._encoders[machine]
        values = self._values(row, group)
        joints = {role: values[role] for role in ROLES if role in values}
        if "swing" in joints:
            self._swing[machine] = joints["swing"]
            yield encode.joints(time, joints)
        swing = self._swing.get(machine, 0.0)
        if "yaw" not in values:
            return
        pitch, roll = values.get("pitch", 0.0), values.get("roll", 0.0)
        attitude = values["yaw"], pitch, roll
        if "pitch" in values or "roll" in values:
            yield encode.tilt(time, pitch, roll, values["yaw"])
        position = self._position(values)
        sigma = values.get("sigma_yaw", 0.0) or SIGMA_YAW
        yield encode.heading(time, attitude, swing, sigma, position)
        if position is not None:
            sigma = values.get("sigma_position", 0.0) or SIGMA_POSITION
            yield encode.base(time, position, attitude, swing, sigma)

    def _values(self, row: int, group: str) -> dict[str, float]:
        values = {}
        for column, (quantity, unit) in self.layout.machines[group].items():
            value = float(self._columns[column][row])
            if np.isfinite(value):
                values[quantity] = value * unit
            elif np.isinf(value):
                self._problems.add(
                    where(self._path, row),
                    f"column {column} is {value}; it counts as not measured",
                    kind=f"{column} infinite",
                )
        return values

    def _position(self, values: dict[str, float]) -> Array | None:
        """(3,) of the base in the site frame [m]; the site's ground where no height is given."""
        frame = self._site.frame
        if "easting" in values and "northing" in values:
            height = values.get("height", frame.origin[2])
            point = np.array([values["easting"], values["northing"], height])
            return frame.from_projected(point)
        if "latitude" in values and "longitude" in values:
            ground = values.get("height", frame.origin[2]) + frame.geoid_offset
            altitude = values.get("altitude", ground)
            return frame.from_geodetic(values["latitude"], values["longitude"], altitude)
        return None


def _wanted(layout: Layout) -> set[str]:
    return {*layout.numeric, *((MACHINE, VALIDITY) if layout.long else ())}


def _times(column: Array, layout: Layout, path: Path) -> Any:
    """(rows,) int64 [ns]."""
    name, unit = layout.time
    values = np.asarray(column, dtype=np.float64) * unit
    bad = np.flatnonzero(~(np.isfinite(values) & (values >= 0.0) & (values < _LATEST)))
    if len(bad):
        row = int(bad[0])
        raise InputError(
            f"{where(path, row)}: column {name} is {column[row]}; allowed is a time from 0 on, in "
            "every row."
        )
    exact = column.dtype.kind in "iu"
    return column.astype(np.int64) if exact else np.round(values).astype(np.int64)


def _machines(
    table: Any,
    layout: Layout,
    site: Site,
    path: Path,
    problems: Problems,
    skipped: dict[str, int],
) -> list[str] | None:
    """The machine of each row, empty where the site has none of that name; None: a wide table."""
    if not layout.long:
        return None
    known = {machine.name for machine in site.machines}
    names = [str(name or "") for name in table.column(MACHINE).to_pylist()]
    if not known & set(names):
        found = ", ".join(sorted({f'"{name}"' for name in names})[:8])
        raise InputError(
            f"{path}: column {MACHINE} has {found}; allowed are {', '.join(sorted(known))}."
        )
    for row, name in enumerate(names):
        if name not in known:
            skipped[f'machine "{name}"'] = skipped.get(f'machine "{name}"', 0) + 1
            problems.add(
                where(path, row), f'machine "{name}" is not of the site', kind=f"machine {name}"
            )
    valid = [True] * len(names)
    if VALIDITY in table.column_names:
        valid = [value == "VALID" for value in table.column(VALIDITY).to_pylist()]
        if False in valid:
            problems.add(
                where(path, valid.index(False)),
                "rows that are not VALID are left out",
                count=valid.count(False),
            )
    return [n if n in known and good else "" for n, good in zip(names, valid, strict=True)]


def _in_time(times: Any, machines: list[str] | None, path: Path, problems: Problems) -> Any:
    """(rows,) int: the order of rows by time. A machine whose own rows go back in time is told."""
    names = np.array(machines if machines is not None else [""] * len(times))
    for name in np.unique(names):
        rows = np.flatnonzero(names == name)
        steps = np.diff(times[rows])
        of = f' of machine "{name}"' if name else ""
        for bad, text in ((steps < 0, "goes back"), (steps == 0, "comes twice")):
            at = np.flatnonzero(bad)
            if len(at):
                problems.add(
                    where(path, int(rows[at[0] + 1])),
                    f"the time{of} {text}; rows are taken in the order of their times",
                    kind=f"{name} {text}",
                    count=len(at),
                )
    return np.argsort(times, kind="stable")
