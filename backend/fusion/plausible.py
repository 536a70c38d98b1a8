"""Samples to buffer entries; what cannot be true becomes None."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from backend.fusion.joint_columns import columns_of
from backend.fusion.rig import Rig
from backend.fusion.samples import (
    AttitudeSample,
    Fix,
    FixSample,
    HeadingSample,
    JointSample,
    ProjectedSample,
)
from backend.machine import strokes
from backend.machine.strokes import Stroke
from backend.spatial.types import Array

MAX_STAMP = 1e11  # [s], some 3,000 years
MAX_JOINT_RATE = 10.0  # [rad/s]
MOST_HEADING = 1000.0  # more turns than this are nonsense [rad]
MAX_RATE = 50.0  # of an IMU [rad/s]
MAX_DISTANCE = 1e5  # from the site's origin [m]
MAX_VARIANCE = 1e6  # [m^2, rad^2]


class Entry(NamedTuple):
    """One accepted sample. stamp: source clock; arrival: local clock [s].

    value, velocity: joints [rad, rad/s] (value NaN where a joint is not published, velocity empty
    when unknown), position [m], heading [rad], or IMU quaternion (w, x, y, z) and rate [rad/s].
    sigma: [m] or [rad], of one axis. Of joints only: sigmas, of each [rad], 0 where its angle is
    measured, and empty where all are; missing: (joint, why its value is NaN in words)
    where there is more to say than that it is not published.
    """

    stamp: float
    arrival: float
    value: tuple[float, ...]
    velocity: tuple[float, ...]
    sigma: float
    fix: Fix = Fix.NONE
    sigmas: tuple[float, ...] = ()
    missing: tuple[tuple[int, str], ...] = ()


def joints(rig: Rig, sample: JointSample) -> Entry | None:
    """All joints, or at least the swing (IMUs then give the others); further names are ignored.

    Of a joint that a cylinder moves its stroke may come instead of the angle; one that is more than
    5 mm outside those of the joint's range counts as not published, and `missing` says so.
    None when the swing is missing, a joint comes twice, lengths disagree, a value is not finite, is
    more than half a radian beyond the joint's limits or turns faster than 10 rad/s.
    """
    found = columns_of(sample.names, rig.columns, rig.cylinders, len(rig.continuous))
    n = len(sample.names)
    if found is None or sample.position.shape != (n,) or sample.velocity.shape not in ((n,), (0,)):
        return None
    position, velocity = sample.position.tolist(), sample.velocity.tolist()
    values, rates, missing = [], [], list(found.missing)
    sigmas = [0.0] * len(found.columns)
    for k, (column, which) in enumerate(zip(found.columns, found.strokes, strict=True)):
        if column < 0:
            values.append(math.nan)
            rates.append(math.nan)
            continue
        value, rate = position[column], velocity[column] if velocity else math.nan
        if which >= 0 and math.isfinite(value):
            stroke = rig.machine.strokes[which]
            angle = strokes.angle(stroke, value)
            if math.isnan(angle):
                missing.append((k, _outside(stroke, value)))
                values.append(math.nan)
                rates.append(math.nan)
                continue
            per_metre = float(strokes.rate(stroke, angle, 1.0))
            sigmas[k] = rig.config.sigma_stroke * abs(per_metre)
            value, rate = angle, rate * per_metre
        if not rig.low[k] <= value <= rig.high[k]:  # false for NaN, too
            return None
        if velocity and not abs(rate) <= MAX_JOINT_RATE:
            return None
        values.append(value)
        rates.append(rate)
    known = tuple(rates) if velocity else ()
    return Entry(
        sample.stamp,
        sample.arrival,
        tuple(values),
        known,
        rig.config.sigma_joints,
        sigmas=tuple(sigmas) if any(sigmas) else (),
        missing=tuple(missing),
    )


def _outside(stroke: Stroke, read: float) -> str:
    return f"cylinder reads {read:.3f} m, allowed: {stroke.shortest:.3f} to {stroke.longest:.3f} m"


def fix(rig: Rig, sample: FixSample) -> Entry | None:
    """A receiver's position; None when not on Earth, far from the site, or badly covariant."""
    on_earth = (
        abs(sample.latitude) <= 90.0
        and abs(sample.longitude) <= 360.0
        and -1000.0 <= sample.altitude <= 10000.0
    )
    if not on_earth or sample.fix is Fix.NONE:
        return None
    position = rig.frame.from_geodetic(sample.latitude, sample.longitude, sample.altitude)
    sigma = _sigma(sample.covariance)
    if sigma is None:
        return None
    sigma = max(sigma or rig.config.default_sigma[sample.fix], rig.config.least_sigma[sample.fix])
    return _placed(sample.stamp, sample.arrival, position, sigma, sample.fix)


def projected(rig: Rig, sample: ProjectedSample) -> Entry | None:
    """A position in the site's CRS. It carries no fix type: its sigma stands for one.

    Up to 0.05 m (or unknown) counts as RTK fixed, up to 0.5 m as RTK float, above as single.
    """
    if sample.position.shape != (3,):
        return None
    sigma = _sigma(sample.covariance)
    if sigma is None:
        return None
    kind = Fix.RTK_FIXED if sigma <= 0.05 else Fix.RTK_FLOAT if sigma <= 0.5 else Fix.SINGLE
    sigma = sigma or rig.config.default_sigma[Fix.RTK_FIXED]
    return _placed(
        sample.stamp, sample.arrival, rig.frame.from_projected(sample.position), sigma, kind
    )


def heading(rig: Rig, sample: HeadingSample) -> Entry | None:
    """A heading; a negative variance is ROS's sign for "no orientation" and gives None."""
    if not abs(sample.heading) <= MOST_HEADING or not 0.0 <= sample.variance <= MAX_VARIANCE:
        return None
    sigma = math.sqrt(sample.variance) or rig.config.sigma_heading
    return Entry(
        sample.stamp, sample.arrival, (math.remainder(sample.heading, math.tau),), (), sigma
    )


def attitude(rig: Rig, sample: AttitudeSample) -> Entry | None:
    """An IMU's orientation; None for an unknown link or a quaternion far from unit length."""
    known = sample.link in rig.imus and 0.0 <= sample.variance <= MAX_VARIANCE
    if not known or sample.orientation.shape != (4,) or sample.rate.shape != (3,):
        return None
    q, rate = sample.orientation.tolist(), sample.rate.tolist()
    length = math.hypot(*q)
    if not 0.9 <= length <= 1.1 or not all(abs(w) <= MAX_RATE for w in rate):
        return None
    sigma = math.sqrt(sample.variance) or rig.config.sigma_tilt
    value = tuple(component / length for component in q)
    return Entry(sample.stamp, sample.arrival, value, tuple(rate), sigma)


def timely(stamp: float, arrival: float) -> bool:
    """Whether both times are numbers that a clock could show."""
    return abs(stamp) < MAX_STAMP and abs(arrival) < MAX_STAMP


def _sigma(covariance: Array) -> float | None:
    """Standard deviation along the worst axis [m], 0 when unknown; None when it is no covariance.

    The worst axis rather than a 2-D rms (which is the root of a sum over two axes, 41 % more than
    one axis has): one number that bounds every direction, height included.
    """
    if covariance.shape != (3, 3):
        return None
    if not np.abs(covariance).max() <= MAX_VARIANCE:
        return None
    if not covariance.any():
        return 0.0
    eigenvalues = np.linalg.eigvalsh(covariance)
    if eigenvalues[0] < -1e-9 or eigenvalues[2] <= 0.0:
        return None
    return math.sqrt(eigenvalues[2])


def _placed(stamp: float, arrival: float, position: Array, sigma: float, kind: Fix) -> Entry | None:
    east, north, up = position.tolist()
    if not max(abs(east), abs(north), abs(up)) <= MAX_DISTANCE:
        return None
    return Entry(stamp, arrival, (east, north, up), (), sigma, kind)
