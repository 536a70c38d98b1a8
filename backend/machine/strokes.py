"""Joint angles from cylinder strokes, and back (Rasul 2021, Eq. 21-23, with the pins' own places).

Everything happens in the plane across a joint's axis, as complex numbers about the axis. Barrel and
rod span a triangle with the axis, whose sides the pins give: the law of cosines, which is what the
paper's equations say of boom and arm. At the bucket a rocker and a tie stand between rod and link:
their common pin is the corner of a second triangle, and its place follows the joint.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from backend.spatial.types import Array

BEYOND = 0.005
"""How far [m] a stroke may read beyond those of the joint's range and still be believed."""

CLOSE = 1e-7  # [rad] of a last step, whose square is what it leaves


@dataclass(frozen=True)
class FourBar:
    """Rocker and tie in the plane: pivot of the rocker, their lengths [m], and the side (+1 left,
    -1 right of rocker pivot -> tie pivot) on which they meet.
    """

    pivot: complex
    rocker: float
    tie: float
    side: int


@dataclass(frozen=True)
class Stroke:
    """One joint's cylinder. Points are complex, about the joint's axis, seen against it, in the
    frame of the barrel's side of the joint [m].

    names: how JointState may call it, the first by the joint's role. joint: index into
    Machine.joints. foot: the barrel's pin; pin: the rod's, or the tie's on the rod's link, at joint
    value 0, which the joint turns by turn * q (turn -1: the barrel is on the moved link). lateral:
    from the barrel's pin to the rod's along the axis [m].
    closed_length: from pin to pin where the sensor reads 0 [m].
    angles [rad] and lengths [m]: over the joint's range, lengths growing.
    """

    names: tuple[str, ...]
    joint: int
    foot: complex
    pin: complex
    turn: int
    lateral: float
    four_bar: FourBar | None
    closed_length: float
    angles: tuple[float, ...] = ()
    lengths: tuple[float, ...] = ()

    @property
    def shortest(self) -> float:
        """The least that the sensor reads over the joint's range [m]."""
        return self.lengths[0] - self.closed_length

    @property
    def longest(self) -> float:
        """The most that the sensor reads over the joint's range [m]."""
        return self.lengths[-1] - self.closed_length


def length_and_slope(stroke: Stroke, q: Array | float) -> tuple[Array, Array]:
    """From pin to pin [m], and its derivative by the joint [m/rad], at joint values q (any shape).

    Eq. (21)-(23), solved for the stroke. NaN where rocker and tie do not meet.
    """
    head, moved = _head(stroke, np.asarray(q))
    way = head - stroke.foot
    length = np.sqrt(way.real**2 + way.imag**2 + stroke.lateral**2)
    return length, (way.conjugate() * moved).real / length


def position(stroke: Stroke, q: Array | float) -> Array:
    """What the sensor reads at joint values q [m], `closed_length` taken off."""
    return np.asarray(length_and_slope(stroke, q)[0] - stroke.closed_length)


def rate(stroke: Stroke, q: Array | float, velocity: Array | float) -> Array:
    """The joint's rate [rad/s] at joint values q from the rod's velocity [m/s]; q outside the
    range counts as its end.
    """
    low, high = sorted((stroke.angles[0], stroke.angles[-1]))
    slope = length_and_slope(stroke, np.minimum(np.maximum(q, low), high))[1]
    return np.asarray(velocity / slope)


def angle(stroke: Stroke, read: float) -> float:
    """The joint's value [rad] where the sensor reads `read` [m], to 1e-9 rad inside the range.

    Up to `BEYOND` outside the range the joint goes on at the end's slope; NaN further out, and for
    what is no number. Newton's method inside the interval of a table that holds the solution.
    """
    length = read + stroke.closed_length
    lengths, angles = stroke.lengths, stroke.angles
    if not lengths[0] - BEYOND <= length <= lengths[-1] + BEYOND:
        return math.nan
    if length < lengths[0] or length > lengths[-1]:
        end = 0 if length < lengths[0] else -1
        at_end = float(length_and_slope(stroke, angles[end])[1])
        return angles[end] + (length - lengths[end]) / at_end
    k = min(bisect_right(lengths, length), len(lengths) - 1)
    share = (length - lengths[k - 1]) / (lengths[k] - lengths[k - 1])
    below, above = angles[k - 1], angles[k]  # of the shorter and the longer length
    q = below + share * (above - below)
    for _ in range(50):
        now, slope = map(float, length_and_slope(stroke, q))
        below, above = (q, above) if now < length else (below, q)
        after = q - (now - length) / slope
        if abs(after - q) < CLOSE:
            return after
        inside = min(below, above) <= after <= max(below, above)
        q = after if inside else (below + above) / 2.0
    return q


def _head(stroke: Stroke, q: Array) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """The rod's pin and its derivative by q."""
    z = stroke.pin * np.exp(1j * stroke.turn * q)
    dz = 1j * stroke.turn * z
    bar = stroke.four_bar
    if bar is None:
        return z, dz
    # The corner of the triangle rocker pivot, tie pivot, common pin: along and across the line d
    # between the pivots, as shares of its length.
    d = z - bar.pivot
    n, dn = d.real**2 + d.imag**2, 2.0 * (d.conjugate() * dz).real
    excess = bar.rocker**2 - bar.tie**2
    along, dalong = 0.5 + excess / (2.0 * n), -excess * dn / (2.0 * n * n)
    with np.errstate(invalid="ignore", divide="ignore"):
        across = bar.side * np.sqrt(bar.rocker**2 / n - along**2)
        dacross = -(bar.rocker**2 * dn / (n * n) + 2.0 * along * dalong) / (2.0 * across)
    corner, turned = along + 1j * across, dalong + 1j * dacross
    return bar.pivot + d * corner, dz * corner + d * turned
