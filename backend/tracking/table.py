"""Detections and tracks as tables of text: what `cockpit track` reads and prints.

In: a header `time,x,y` plus any of z, yaw, length, width, height; the rows of one scan share their
time, and a scan without detections is one row with blank x and y. Out: one row per track and scan.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator
from itertools import groupby

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array
from backend.tracking.motion import Noise
from backend.tracking.records import (
    HEIGHT,
    LENGTH,
    PX,
    PY,
    PZ,
    TURN,
    VX,
    VY,
    VZ,
    WIDTH,
    YAW,
    Detections,
    Settings,
    Status,
    Tracks,
)
from backend.tracking.tracker import later, nothing, now, track

COLUMNS = {
    "x": PX,
    "y": PY,
    "z": PZ,
    "yaw": YAW,
    "length": LENGTH,
    "width": WIDTH,
    "height": HEIGHT,
}
DEVIATION = {"z": 0.1, "yaw": 0.5, "length": 0.2, "width": 0.2, "height": 0.2}
"""Standard deviations that are assumed beside the places' own [m, rad]."""
SHOWN = (PX, PY, PZ, VX, VY, VZ, YAW, TURN, LENGTH, WIDTH, HEIGHT)
HEADER = [
    *("time", "track", "status", "x", "y", "z", "vx", "vy", "vz", "yaw", "turn_rate"),
    *("length", "width", "height", "x_1s", "y_1s", "z_1s"),
]
HORIZON = 1.0
"""Of the prediction in the last three columns [s]."""


def read(text: str, name: str, sigma: float = 0.08) -> list[Detections]:
    """Scans in the order of their times. sigma: standard deviation of x and y [m].

    Raises InputError with the line of what is wrong.
    """
    rows = csv.reader(io.StringIO(text))
    try:
        header = [word.strip() for word in next(rows, [])]
        _check(header, name)
        lines = [(rows.line_num, row) for row in rows if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(f"{name}: is not a CSV file: {error}.") from None
    present = [word for word in COLUMNS if word in header]
    measured = tuple(COLUMNS[word] for word in present)
    noise = np.array([DEVIATION.get(word, sigma) for word in present])
    parsed = [_row(line, row, header, present, name) for line, row in lines]
    scans: list[Detections] = []
    for time, members in groupby(parsed, key=lambda row: row[1]):
        group = list(members)
        if scans and time <= scans[-1].time:
            raise InputError(
                f"{name}, line {group[0][0]}: the scan at {time} s comes after one at "
                f"{scans[-1].time} s; scans must be in the order of their times, rows of one scan "
                "beside each other."
            )
        values = [values for _, _, values in group if values is not None]
        if len(values) < len(group) and len(group) > 1:
            raise InputError(
                f"{name}, line {group[0][0]}: the scan at {time} s has a row with blank x and y "
                "beside others; such a row stands alone, for a scan without detections."
            )
        scans.append(Detections(time, np.array(values).reshape(-1, len(present)), measured, noise))
    return scans


def followed(
    scans: Iterable[Detections], settings: Settings | None = None, noise: Noise | None = None
) -> Iterator[Tracks]:
    """The tracks after each scan."""
    tracks, next_id = nothing(), 1
    for scan in scans:
        tracks, next_id, _, _ = track(tracks, scan, next_id, settings, noise)
        yield tracks


def rows_of(tracks: Tracks, noise: Noise | None = None) -> Iterator[list[str]]:
    """One row per track, as in `HEADER`."""
    if not len(tracks):
        return
    mean, _ = now(tracks)
    ahead, _ = later(tracks, HORIZON, noise)
    for i in np.argsort(tracks.id, kind="stable"):
        yield [
            _number(tracks.time),
            str(int(tracks.id[i])),
            Status(int(tracks.status[i])).name.lower(),
            *(_number(value) for value in mean[i, list(SHOWN)]),
            *(_number(value) for value in _place(ahead[i])),
        ]


def _place(state: Array) -> Array:
    return np.asarray(state[[PX, PY, PZ]])


def _number(value: float) -> str:
    return f"{value:.6f}".rstrip("0").rstrip(".")


def _check(header: list[str], name: str) -> None:
    allowed = ["time", *COLUMNS]
    known = set(header) <= set(allowed) and len(set(header)) == len(header)
    if not known or not {"time", "x", "y"} <= set(header):
        raise InputError(
            f"{name}, line 1: the header is '{','.join(header)}'; needed are time, x and y, "
            f"allowed beside them {', '.join(allowed[3:])}, each once."
        )


def _row(
    line: int, row: list[str], header: list[str], present: list[str], name: str
) -> tuple[int, float, list[float] | None]:
    """(line, time, values), values None for a scan without detections."""
    if len(row) != len(header):
        raise InputError(
            f"{name}, line {line}: has {len(row)} cells, but the header has {len(header)}."
        )
    cells = {word: cell.strip() for word, cell in zip(header, row, strict=True)}
    time = _finite(cells["time"], "time", line, name)
    if not cells["x"] and not cells["y"]:
        return line, time, None
    return line, time, [_finite(cells[word], word, line, name) for word in present]


def _finite(cell: str, column: str, line: int, name: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{name}, line {line}: {column} is '{cell}'; allowed is a finite number.")
    return value
