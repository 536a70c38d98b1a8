"""The arm, the course and the place of one machine at one stamp of its own clock."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from backend.fusion import imu
from backend.fusion.align import (
    blend,
    bracket,
    extrapolation_sigma,
    recent,
    slope,
    slope_sigma,
    turn,
)
from backend.fusion.plausible import Entry
from backend.fusion.rig import Rig
from backend.fusion.streams import Buffer, Streams
from backend.spatial.types import Array

JOINT_WINDOW = 0.1  # of finite-difference joint rates [s]
BASE_WINDOW = 0.5  # of the base's velocity and yaw rate [s]
SIGNIFICANT = 3.0  # base rates below this many sigmas are taken for standing still
FARTHEST = 0.2  # a swing is carried on at its rate no further than this [s]
LONGEST_GAP = 2.0  # sigma grows no further: the pose is long stale by then [s]


def tilt(pitch: float, roll: float) -> Array:
    """(3, 3) Ry(-pitch) Rx(roll), written out: this runs for every machine in every cycle."""
    cp, sp, cr, sr = math.cos(pitch), math.sin(pitch), math.cos(roll), math.sin(roll)
    return np.array([[cp, -sp * sr, -sp * cr], [0.0, cr, -sr], [sp, cp * sr, cp * cr]])


@dataclass(frozen=True)
class Arm:
    """q, rates: (n,) [rad, rad/s], 0 where unknown; unknown: those joints' indices.

    pitch, roll of the root [rad] with sigma_tilt (0 for a base taken as level); sigma: of a joint
    whose angle is measured, as the swing's always is; sigma_each: (n,) with those told by strokes,
    None where there are none.
    """

    q: Array
    rates: Array
    sigma: float
    sigma_each: Array | None
    unknown: tuple[int, ...]
    pitch: float
    roll: float
    sigma_tilt: float
    from_imus: bool
    stamp: float
    samples: tuple[Entry, ...]

    def swing_at(self, stamps: list[float], wraps: bool) -> Array:
        """(k,) the swing at several stamps [rad]."""
        samples, last = self.samples, self.samples[-1].stamp if self.samples else -math.inf
        swing, rate = float(self.q[0]), float(self.rates[0])
        found = []
        for stamp in stamps:
            if stamp <= last:
                a, b, fraction, _ = bracket(samples, stamp)
                found.append(a.value[0] + fraction * turn(b.value[0], a.value[0], wraps))
            else:
                ahead = max(-FARTHEST, min(FARTHEST, stamp - self.stamp))
                found.append(swing + rate * ahead)
        return np.array(found)


@dataclass(frozen=True)
class Course:
    """Yaw of the root [rad] at the common time, its rate [rad/s] and sigma [rad]."""

    yaw: float
    rate: float
    sigma: float


@dataclass(frozen=True)
class Place:
    """position: (3,) of the root, site frame [m]; velocity: (3,) [m/s]; sigma of one axis [m]."""

    position: Array
    velocity: Array
    sigma: float


def joints_at(rig: Rig, streams: Streams, stamp: float) -> Arm:
    """Joints from joint samples, tilt from an IMU, missing joints from the IMUs of their parts."""
    n = len(rig.continuous)
    entries, at = _series(streams.joints, stamp)
    q, rates, sigma = [math.nan] * n, [math.nan] * n, rig.config.sigma_joints
    each: Array | None = None
    if entries:
        q, rates, sigma, each = _joint_samples(rig, entries, at)
    if not streams.joints.entries:
        rates = [0.0] * n  # left over from before a clock step: for drawing, at rest
    missing = any(map(math.isnan, q))
    readings = _readings(rig, streams, stamp, tilt_only=not missing)
    base = imu.up_in_root(rig, readings, q[0])
    if missing and readings:
        q, rates = imu.fill(rig, readings, base, q, rates)
        base = base or imu.up_in_root(rig, readings, q[0])
        sigma = max([sigma, *(math.sqrt(2.0) * reading.sigma for reading in readings.values())])
    pitch, roll = imu.pitch_roll(base.up) if base else (0.0, 0.0)
    return Arm(
        q=_known(q),
        rates=_known(rates),
        sigma=sigma,
        sigma_each=None if each is None else np.maximum(each, sigma),
        unknown=tuple(k for k, value in enumerate(q) if math.isnan(value)),
        pitch=pitch,
        roll=roll,
        sigma_tilt=base.sigma if base else 0.0,
        from_imus=missing and bool(readings),
        stamp=stamp,
        samples=streams.joints.entries,
    )


def _readings(rig: Rig, streams: Streams, stamp: float, tilt_only: bool) -> dict[int, imu.Reading]:
    """The IMUs at `stamp` by the joint that moves them (-1: tracks), the newest of each part.

    tilt_only: those of the arm are not needed.
    """
    newest: dict[int, tuple[float, str]] = {}
    for name, buffer in streams.attitudes.items():
        joint = rig.imus[name].joint
        if buffer.last is not None and not (tilt_only and joint > 0):
            rank = (buffer.last.arrival, name)
            newest[joint] = max(rank, newest.get(joint, rank))
    readings = {}
    for joint, (_, name) in newest.items():
        entries, at = _series(streams.attitudes[name], stamp)
        limit = rig.config.max_extrapolation
        readings[joint] = imu.read(rig.imus[name], entries, at, limit)
    return readings


def _known(values: list[float]) -> Array:
    return np.array([0.0 if math.isnan(value) else value for value in values])


def _joint_samples(
    rig: Rig, entries: tuple[Entry, ...], stamp: float
) -> tuple[list[float], list[float], float, Array | None]:
    """(q, rates, sigma, sigma of each) at `stamp`, the last as in `Arm`; rates from the samples, or
    a line through the last 0.1 s.
    """
    a, b, fraction, gap = bracket(entries, stamp)
    q = blend(a.value, b.value, fraction, rig.continuous)
    if a.velocity and b.velocity:
        rates = blend(a.velocity, b.velocity, fraction, (False,) * len(q))
    else:
        rows = recent(entries, stamp, JOINT_WINDOW)
        rates = slope([row.stamp for row in rows], [row.value for row in rows], rig.continuous)
    limit = rig.config.max_extrapolation
    grown = 0.0
    if gap != 0.0:
        ahead = min(max(gap, 0.0), limit)
        q = tuple(value + rate * ahead for value, rate in zip(q, rates, strict=True))
        growth = [
            extrapolation_sigma(min(abs(gap), LONGEST_GAP), rate, joint.max_acceleration, limit)
            for rate, joint in zip(rates, rig.machine.joints, strict=True)
        ]
        grown = max(0.0 if math.isnan(g) else g for g in growth)
    each = None
    if a.sigmas or b.sigmas:
        told = [row.sigmas or (0.0,) * len(q) for row in (a, b)]
        each = np.hypot(np.max(told, axis=0), grown)
    return list(q), list(rates), math.hypot(rig.config.sigma_joints, grown), each


def yaw_at(rig: Rig, streams: Streams, stamp: float, M: Array, arm: Arm) -> Course:
    """Yaw of the tracks: heading minus the sensor axis's azimuth in the levelled root frame.

    On level ground, for a sensor on the upper body: heading - offset - swing. Each heading is
    reduced with the swing of its own time. M: (3, 3) tilt of the root.
    """
    entries, at = _series(streams.heading, stamp)
    if not entries:
        return Course(0.0, 0.0, rig.config.sigma_heading)
    rows = _around(entries, at)
    stamps = [row.stamp for row in rows]
    axis = rig.forward.at(arm.swing_at(stamps, rig.continuous[0])) @ M.T
    azimuth = np.arctan2(axis[:, 1], axis[:, 0]).tolist()
    yaws: list[tuple[float, ...]] = [
        (row.value[0] - az,) for row, az in zip(rows, azimuth, strict=True)
    ]
    sigma = max(rows[-1].sigma, rows[-2].sigma) if len(rows) > 1 else rows[0].sigma
    if rig.machine.heading_of == "upper":
        sigma = math.hypot(sigma, arm.sigma)
    value, (rate,), grown = _carried(rig, stamps, yaws, at, (True,), sigma, _yaw_acceleration(rig))
    yaw = value[0]
    if rig.frame.heading_reference == "true":
        place = streams.position.last
        yaw = rig.frame.grid_yaw(yaw, np.array(place.value if place else (0.0, 0.0, 0.0)))
    return Course(turn(yaw, 0.0, True), rate, grown)


def root_at(rig: Rig, streams: Streams, stamp: float, M: Array, arm: Arm, course: Course) -> Place:
    """Position of the root: antenna minus its lever arm, each sample with the swing of its time.

    sigma^2 = antenna^2 + (sigma_yaw * horizontal lever)^2 + (sigma_tilt * vertical lever)^2.
    """
    entries, at = _series(streams.position, stamp)
    if not entries:
        return Place(np.zeros(3), np.zeros(3), rig.config.sigma_limit)
    rows = _around(entries, at)
    stamps = [row.stamp for row in rows]
    lever = rig.antenna.at(arm.swing_at(stamps, rig.continuous[0])) @ M.T
    yaw = course.yaw + course.rate * (np.array(stamps) - at)
    c, s = np.cos(yaw), np.sin(yaw)
    roots = np.array([row.value for row in rows])
    roots[:, 0] -= c * lever[:, 0] - s * lever[:, 1]
    roots[:, 1] -= s * lever[:, 0] + c * lever[:, 1]
    roots[:, 2] -= lever[:, 2]
    sigma = max(rows[-1].sigma, rows[-2].sigma) if len(rows) > 1 else rows[0].sigma
    values = [tuple(row) for row in roots.tolist()]
    straight = (False, False, False)
    acceleration = rig.machine.tracks.max_acceleration
    value, velocity, grown = _carried(rig, stamps, values, at, straight, sigma, acceleration)
    out = math.hypot(lever[-1, 0], lever[-1, 1])
    total = math.hypot(grown, course.sigma * out, arm.sigma_tilt * float(lever[-1, 2]))
    return Place(np.array(value), np.array(velocity), total)


def _carried(
    rig: Rig,
    stamps: list[float],
    values: list[tuple[float, ...]],
    stamp: float,
    circular: tuple[bool, ...],
    sigma: float,
    acceleration: float,
) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    """(value, rate, sigma) at `stamp` of a slow quantity: interpolated, or carried on at its rate.

    The rate is that of a line through the samples; one that the noise explains is zero.
    """
    rate = slope(stamps, values, circular)
    if math.hypot(*rate) < SIGNIFICANT * slope_sigma(stamps, sigma):
        rate = (0.0,) * len(circular)
    limit = rig.config.max_extrapolation
    for (t0, v0), (t1, v1) in pairwise(zip(stamps, values, strict=True)):
        if t0 <= stamp <= t1:
            return blend(v0, v1, (stamp - t0) / (t1 - t0), circular), rate, sigma
    end = -1 if stamp > stamps[-1] else 0
    gap = stamp - stamps[end]
    ahead = min(max(gap, 0.0), limit)
    value = tuple(v + r * ahead for v, r in zip(values[end], rate, strict=True))
    growth = extrapolation_sigma(min(abs(gap), LONGEST_GAP), math.hypot(*rate), acceleration, limit)
    return value, rate, math.hypot(sigma, growth)


def _around(entries: tuple[Entry, ...], stamp: float) -> tuple[Entry, ...]:
    """The recent samples up to `stamp` and the first one after it."""
    rows = recent(entries, stamp, BASE_WINDOW)
    after = bracket(entries, stamp)[1]
    return (*rows, after) if after.stamp > rows[-1].stamp else rows


def _series(buffer: Buffer, stamp: float) -> tuple[tuple[Entry, ...], float]:
    """The samples and the stamp to read them at: after a clock step the last one as it was."""
    if buffer.entries or buffer.last is None:
        return buffer.entries, stamp
    return (buffer.last,), buffer.last.stamp


def _yaw_acceleration(rig: Rig) -> float:
    """Of the tracks turning on the spot: track acceleration over half the gauge [rad/s^2]."""
    tracks = rig.machine.tracks
    return tracks.max_acceleration / max(tracks.gauge / 2.0, 0.5)
