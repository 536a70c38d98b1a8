"""LiDARs' points as they come: sensor_msgs/PointCloud2 to a record.

Many programs write PointCloud2, each with fields, paddings and an order of bytes of its own; x, y
and z are taken from wherever the message says they are, and each point's time where it has one that
can be understood; the rest is left. One key carries all of a machine's LiDARs; the header's
frame_id tells whose points they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from backend.shell.link.codec import DecodeError, message_of, stamp_of, text_of
from backend.shell.link.topics import topic
from backend.spatial.types import AnyArray

MAX_FIELDS = 64
FORMATS = {7: "f4", 8: "f8"}  # sensor_msgs/PointField: FLOAT32, FLOAT64
TIMES = {
    ("time", 7): ("f4", 1.0),
    ("time", 8): ("f8", 1.0),
    ("t", 6): ("u4", 1e-9),
    ("t", 7): ("f4", 1.0),
    ("offset_time", 6): ("u4", 1e-9),
    ("timestamp", 8): ("f8", 1.0),
}
"""How drivers write when a point was measured, by the field's name and type: the format, and the
unit [s]. Since the stamp of the message, but for `timestamp`, which is the clock's."""
LONGEST = 1.0
"""No turn takes longer [s]; what says so is no time."""


@dataclass(frozen=True)
class Cloud:
    """One turn of one LiDAR. sensor: the mount's name; stamp: the machine's clock [s]; arrival:
    local clock [s]; points: (n, 3) float32, in the frame of the sensor [m], all finite; times: (n,)
    when each was measured, since the stamp [s], None where the message does not tell.
    """

    machine: str
    sensor: str
    stamp: float
    arrival: float
    points: AnyArray
    times: AnyArray | None = None


def decode_cloud(payload: bytes, machine: str, arrival: float) -> Cloud:
    """The cloud in `payload`, published by `machine`; arrival: local clock [s].

    Points of which a coordinate is no finite float32 are left out. Raises DecodeError for anything
    malformed; the memory used is bounded by the payload's size.
    """
    try:
        msg = message_of(topic("points"), payload)
        stamp = stamp_of(msg)
        return Cloud(machine, text_of(msg.header.frame_id), stamp, arrival, *_points(msg, stamp))
    except DecodeError:
        raise
    except Exception as error:  # whatever strangers' bytes provoke in the decoder
        raise DecodeError(f"points: {error}") from error


def _points(msg: Any, stamp: float) -> tuple[AnyArray, AnyArray | None]:
    """(n, 3) and (n,) float32, copies that no longer hold on to the message's buffer."""
    height, width, step, row = msg.height, msg.width, msg.point_step, msg.row_step
    _check(len(msg.data) == row * height, f"{len(msg.data)} bytes are not {height} rows of {row}")
    _check(row >= width * step, f"{width} points of {step} bytes do not fit into a row of {row}")
    dtype, unit, absolute = _dtype(msg.fields, step, bool(msg.is_bigendian))
    if width * height == 0:
        return np.zeros((0, 3), dtype=np.float32), None
    data = np.ascontiguousarray(msg.data)
    found: AnyArray = np.ndarray((height, width), dtype, data, 0, (row, step))
    out = np.empty((height * width, 3), dtype=np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        for k, name in enumerate("xyz"):
            out[:, k] = found[name].reshape(-1)
    times = None
    if unit:
        with np.errstate(over="ignore", invalid="ignore"):
            told = found[_TIME].reshape(-1).astype(float) * unit - (stamp if absolute else 0.0)
        if (np.abs(told) <= LONGEST).all():
            times = told.astype(np.float32)
    finite = np.isfinite(out).all(axis=1)
    if not finite.all():
        out = out[finite]
        times = None if times is None else times[finite]
    out.setflags(write=False)
    return out, times


_TIME = "when"


def _dtype(fields: Any, step: int, big: bool) -> tuple[np.dtype[Any], float, bool]:
    """Where x, y, z and the time are in a point of `step` bytes, and how they are written; the
    time's unit [s], 0 without one; whether it is the clock's.
    """
    _check(len(fields) <= MAX_FIELDS, f"{len(fields)} fields, allowed are {MAX_FIELDS}")
    formats, offsets = [], []
    for name in "xyz":
        named = [field for field in fields if field.name == name]
        _check(len(named) == 1, f"{len(named)} fields are called {name}, needed is one")
        field = named[0]
        known = field.datatype in FORMATS and field.count <= 1
        _check(known, f"{name} is of type {field.datatype}; allowed is one float32 or float64")
        code = FORMATS[field.datatype]
        fits = field.offset + int(code[1]) <= step
        _check(fits, f"{name} at byte {field.offset} is outside of a point of {step} bytes")
        formats.append((">" if big else "<") + code)
        offsets.append(field.offset)
    names, unit, absolute = list("xyz"), 0.0, False
    for field in fields:
        code, size = TIMES.get((field.name, field.datatype), ("", 0.0))
        if code and not unit and field.count <= 1 and field.offset + int(code[1]) <= step:
            names.append(_TIME)
            formats.append((">" if big else "<") + code)
            offsets.append(field.offset)
            unit, absolute = size, field.name == "timestamp"
    known = {"names": names, "formats": formats, "offsets": offsets, "itemsize": step}
    return np.dtype(known), unit, absolute  # type: ignore[call-overload]


def _check(holds: bool, otherwise: str) -> None:
    if not holds:
        raise DecodeError(f"points: {otherwise}")
