"""Tilt of the base, and joint angles where none are published, from IMUs on the links.

Tilt and the arm's angles use only the direction of gravity, so an IMU mounted at +-180 deg is like
any other. IMU yaw counts only for a swing that nothing else measures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from backend.fusion.align import bracket, extrapolation_sigma
from backend.fusion.plausible import Entry
from backend.fusion.rig import Hop, Imu, Rig
from backend.spatial.rotation import about_axis
from backend.spatial.types import Array

UP = np.array([0.0, 0.0, 1.0])
TILT_ACCELERATION = 0.5  # of a body standing on tracks, for extrapolation only [rad/s^2]
LEAST_SINE = 0.1  # a joint axis closer to the vertical than this leaves the joint unknown


class Reading(NamedTuple):
    """One part's IMU at the common time. quaternion: of the part in ENU; up: (3,) the vertical and
    rate: (3,) [rad/s], both in the part's frame; sigma of roll and pitch [rad]."""

    R_site_part: Array
    up: Array
    rate: Array
    sigma: float


def read(imu: Imu, entries: tuple[Entry, ...], stamp: float, limit: float) -> Reading:
    """The part's orientation at `stamp` (source clock), moved on by its rate up to `limit` [s]."""
    a, b, fraction, gap = bracket(entries, stamp)
    # Quaternions q and -q are one attitude: the nearer sign is the short way.
    sign = math.copysign(1.0, sum(x * y for x, y in zip(a.value, b.value, strict=True)))
    mixed = [x + fraction * (sign * y - x) for x, y in zip(a.value, b.value, strict=True)]
    rate = np.array([x + fraction * (y - x) for x, y in zip(a.velocity, b.velocity, strict=True)])
    R_site_link = _matrix(*mixed)
    speed = math.sqrt(float(rate @ rate))
    if gap > 0.0 and speed > 0.0:
        R_site_link = R_site_link @ about_axis(rate / speed, speed * min(gap, limit))
    sigma = max(a.sigma, b.sigma) + extrapolation_sigma(abs(gap), speed, TILT_ACCELERATION, limit)
    R_site_part = R_site_link @ imu.R_part_link.T
    return Reading(R_site_part, R_site_part[2], imu.R_part_link @ rate, sigma)


def _matrix(w: float, x: float, y: float, z: float) -> Array:
    """(3, 3) of one quaternion of any length; the batched one costs ten times as much here."""
    k = 2.0 / (w * w + x * x + y * y + z * z)
    return np.array(
        [
            [1.0 - k * (y * y + z * z), k * (x * y - w * z), k * (x * z + w * y)],
            [k * (x * y + w * z), 1.0 - k * (x * x + z * z), k * (y * z - w * x)],
            [k * (x * z - w * y), k * (y * z + w * x), 1.0 - k * (x * x + y * y)],
        ]
    )


def up_in_root(rig: Rig, readings: Mapping[int, Reading], swing: float) -> Reading | None:
    """The base's attitude: from an IMU on the tracks (-1), else on the upper body (0).

    None when neither is there, or when the swing that joins them is unknown (NaN).
    """
    if -1 in readings:
        return readings[-1]
    upper = readings.get(0)
    if upper is None or math.isnan(swing):
        return None
    hop = rig.arm[0]
    R_root_upper = hop.R @ about_axis(hop.axis, swing)
    R_site_root = upper.R_site_part @ R_root_upper.T
    return Reading(R_site_root, R_root_upper @ upper.up, np.zeros(3), upper.sigma)


def pitch_roll(up: Array) -> tuple[float, float]:
    """(pitch, roll) [rad] of a base that sees the vertical at `up` (3,).

    The third row of R = Rz(yaw) Ry(-pitch) Rx(roll) is (sin p, cos p sin r, cos p cos r).
    """
    x, y, z = up.tolist()
    return math.asin(max(-1.0, min(1.0, x))), math.atan2(y, z)


def swing_from_yaw(rig: Rig, readings: Mapping[int, Reading]) -> tuple[float, float]:
    """(swing [rad], its rate [rad/s]) from the orientations of tracks and upper body, else NaN."""
    base, upper = readings.get(-1), readings.get(0)
    if base is None or upper is None:
        return math.nan, math.nan
    hop = rig.arm[0]
    turned = hop.R.T @ base.R_site_part.T @ upper.R_site_part
    skew = np.array(
        [turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]
    )
    angle = math.atan2(float(hop.axis @ skew), float(np.trace(turned)) - 1.0)
    return angle, float(hop.axis @ (upper.rate - hop.R.T @ base.rate))


def fill(
    rig: Rig,
    readings: Mapping[int, Reading],
    base: Reading | None,
    q: Sequence[float],
    rates: Sequence[float],
) -> tuple[list[float], list[float]]:
    """Joint values and rates [rad, rad/s] with NaN values replaced from the parts' IMUs.

    The vertical is carried from the base (level when None) along the arm; at a joint without a
    value it is compared with what the part's own IMU sees. A joint stays NaN, with all that
    follow it and need it, when its part has no IMU or its axis is nearly vertical.
    """
    q, rates = list(q), list(rates)
    up, rate = (UP, np.zeros(3)) if base is None else (base.up, base.rate)
    if math.isnan(q[0]):
        q[0], rates[0] = swing_from_yaw(rig, readings)
    for hop in rig.arm:
        if hop.joint < 0:
            break
        up, rate = hop.R.T @ up, hop.R.T @ rate
        k = hop.joint
        if math.isnan(q[k]) and k in readings:
            q[k] = _angle(rig, hop, readings[k].up, up)
            rates[k] = float(hop.axis @ (readings[k].rate - rate))
        if math.isnan(q[k]):
            break
        R = about_axis(hop.axis, q[k])
        up, rate = R.T @ up, R.T @ rate + hop.axis * rates[k]
    return q, rates


def _angle(rig: Rig, hop: Hop, up_part: Array, up_joint: Array) -> float:
    """The turn about the hop's axis that carries `up_part` to `up_joint`, nearest mid-range."""
    along = float(hop.axis @ up_part)
    cosine = float(up_part @ up_joint) - along * float(hop.axis @ up_joint)
    sine = float(hop.axis @ np.cross(up_part, up_joint))
    if math.hypot(sine, cosine) < LEAST_SINE**2:
        return math.nan
    angle = math.atan2(sine, cosine)
    middle = (rig.low[hop.joint] + rig.high[hop.joint]) / 2.0
    return angle + 2.0 * math.pi * round((middle - angle) / (2.0 * math.pi))
