"""LiDARs' points as they come: sensor_msgs/PointCloud2 to a record.

Many programs write PointCloud2, each with fields, paddings and an order of bytes of its own; x, y
and z are taken from wherever the message says they are, the rest is left. One key carries all of a
machine's LiDARs; the header's frame_id tells whose points they are.
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


@dataclass(frozen=True)
class Cloud:
    """One turn of one LiDAR. sensor: the mount's name; stamp: the machine's clock [s]; arrival:
    local clock [s]; points: (n, 3) float32, in the frame of the sensor [m], all finite.
    """

    machine: str
    sensor: str
    stamp: float
    arrival: float
    points: AnyArray


def decode_cloud(payload: bytes, machine: str, arrival: float) -> Cloud:
    """The cloud in `payload`, published by `machine`; arrival: local clock [s].

    Points of which a coordinate is no finite float32 are left out. Raises DecodeError for anything
    malformed; the memory used is bounded by the payload's size.
    """
    try:
        msg = message_of(topic("points"), payload)
        return Cloud(machine, text_of(msg.header.frame_id), stamp_of(msg), arrival, _points(msg))
    except DecodeError:
        raise
    except Exception as error:  # whatever strangers' bytes provoke in the decoder
        raise DecodeError(f"points: {error}") from error


def _points(msg: Any) -> AnyArray:
    """(n, 3) float32, a copy that no longer holds on to the message's buffer."""
    height, width, step, row = msg.height, msg.width, msg.point_step, msg.row_step
    _check(len(msg.data) == row * height, f"{len(msg.data)} bytes are not {height} rows of {row}")
    _check(row >= width * step, f"{width} points of {step} bytes do not fit into a row of {row}")
    dtype = _dtype(msg.fields, step, bool(msg.is_bigendian))
    if width * height == 0:
        return np.zeros((0, 3), dtype=np.float32)
    data = np.ascontiguousarray(msg.data)
    found: AnyArray = np.ndarray((height, width), dtype, data, 0, (row, step))
    out = np.empty((height * width, 3), dtype=np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        for k, name in enumerate("xyz"):
            out[:, k] = found[name].reshape(-1)
    finite = np.isfinite(out).all(axis=1)
    if not finite.all():
        out = out[finite]
    out.setflags(write=False)
    return out


def _dtype(fields: Any, step: int, big: bool) -> np.dtype[Any]:
    """Where x, y and z are in a point of `step` bytes, and how they are written."""
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
    return np.dtype(
        {"names": list("xyz"), "formats": formats, "offsets": offsets, "itemsize": step}
    )


def _check(holds: bool, otherwise: str) -> None:
    if not holds:
        raise DecodeError(f"points: {otherwise}")
