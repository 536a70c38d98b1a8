"""Every body that swings against every object beside it: gaps along the circle about the axis.

Rasul 2021, Section 4 judges the bucket alone, as a radial line; here the edges of all boxes are
sampled, and each sample that passes through an object's ring is such a line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.safety.people import Risks
from backend.safety.swing_arcs_kernel import gaps
from backend.safety.swing_risk import Boundaries, Swing, reached, risk, speeding
from backend.spatial.types import Array, IntArray

SAMPLES = 7  # of an edge
_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]
HEADROOM = 0.3
"""Bodies this far above or below an object do not pass it by [m]."""


class Objects(NamedTuple):
    """k people or objects about the swing axis. place, velocity: (k, 2) [m, m/s]; radius: (k,);
    low, high: (k,) heights of the ends along the axis [m]; sigma: (k,) of the place [m].
    """

    place: Array
    velocity: Array
    radius: Array
    low: Array
    high: Array
    sigma: Array


def judge_swing(
    corners: Array,
    swing: Swing,
    now: Objects,
    ahead: Objects,
    horizon: float,
    boundaries: Boundaries,
    uncertainty: float,
) -> Risks:
    """Time to collision, warning index and level of each object, now and after `horizon` [s].

    corners: (b, 8, 3) of the boxes that swing, in a frame with z along the axis, at the present
    swing angle; swing: its `angle` is not used.
    """
    turned = _turned(swing, horizon)
    later = Swing(0.0, *_rate_after(swing, horizon), swing.fastest, swing.deceleration)
    points = _samples(corners)
    ttc, index, side = _judged(points, corners, swing, now, 0.0, uncertainty)
    ttc2, index2, _ = _judged(points, corners, later, ahead, turned, uncertainty)
    k = len(now.radius)
    body = ttc.argmin(axis=0) if len(corners) else np.zeros(k, np.int64)
    first = ttc.min(axis=0, initial=np.inf), index.min(axis=0, initial=np.inf)
    then = ttc2.min(axis=0, initial=np.inf), index2.min(axis=0, initial=np.inf)
    tied = ~np.isfinite(first[0]) & (index.min(axis=0, initial=np.inf) < np.inf)
    if len(corners):
        body = np.where(tied, index.argmin(axis=0), body)
    level = np.maximum(risk(first[0], first[1], boundaries), risk(then[0], then[1], boundaries))
    return Risks(body, *first, *then, level, side)


def _samples(corners: Array) -> tuple[Array, Array]:
    """Radius and angle (b, p) of points on the boxes' edges."""
    a, b = corners[:, [e[0] for e in _EDGES]], corners[:, [e[1] for e in _EDGES]]
    t = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    points = a[:, :, None, :2] + t * (b - a)[:, :, None, :2]
    flat = points.reshape(len(corners), len(_EDGES) * SAMPLES, 2)
    return np.linalg.norm(flat, axis=2), np.arctan2(flat[..., 1], flat[..., 0])


def _judged(
    points: tuple[Array, Array],
    corners: Array,
    swing: Swing,
    objects: Objects,
    turned: float,
    uncertainty: float,
) -> tuple[Array, Array, IntArray]:
    """(b, k) time to collision, (b, k) warning index, (k,) side that comes nearer."""
    far = np.maximum(np.hypot(*objects.place.T), 1e-6)
    place = np.arctan2(objects.place[:, 1], objects.place[:, 0])
    x, y = objects.place.T
    with np.errstate(over="ignore", invalid="ignore"):  # of what is no place
        turning = (x * objects.velocity[:, 1] - y * objects.velocity[:, 0]) / far**2
    low, high = corners[:, :, 2].min(axis=1), corners[:, :, 2].max(axis=1)
    reach = objects.radius + objects.sigma
    about = far, place, reach, objects.low, objects.high
    back, on, nearest = gaps(
        np.maximum(points[0], 1e-6),
        points[1],
        low,
        high,
        _spacing(corners),
        tuple(np.ascontiguousarray(values, dtype=float) for values in about),
        turned,
        HEADROOM,
    )
    both = back, on
    ttc = np.full(nearest.shape, np.inf)
    for sign, gap in zip((-1.0, 1.0), both, strict=True):
        safe = np.where(np.isfinite(gap), gap, 1e9)
        w = np.broadcast_to(sign * (swing.rate - turning), safe.shape)
        found = reached(safe, w, sign * swing.acceleration, speeding(swing))
        ttc = np.minimum(ttc, np.where(np.isfinite(gap), found, np.inf))
    ttc = np.where(nearest <= 0.0, 0.0, ttc)
    # Braking distances left in the direction of the motion; both directions at rest.
    if abs(swing.rate) > 0.02:
        left = on if swing.rate > 0.0 else back
        left = np.where(nearest <= 0.0, nearest, left)
    else:
        left = nearest
    braking = swing.rate**2 / (2.0 * swing.deceleration)
    room = left - np.arcsin(np.minimum(uncertainty / far, 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        index = np.where(braking > 1e-6, room / braking, np.where(room > 0.0, np.inf, -np.inf))
    index = np.where(np.isfinite(left), index, np.inf)
    if not swing.known:
        ttc, index = np.zeros_like(ttc), np.full_like(index, -np.inf)
    side = np.where(on.min(axis=0, initial=np.inf) <= back.min(axis=0, initial=np.inf), 1, 0)
    return ttc, index, side.astype(np.int64)


def _spacing(corners: Array) -> Array:
    """(b,) half the distance between two samples of the longest edge [m]."""
    edges = np.array(_EDGES)
    lengths = np.linalg.norm(corners[:, edges[:, 0]] - corners[:, edges[:, 1]], axis=2)
    return np.asarray(0.5 * lengths.max(axis=1, initial=0.0) / (SAMPLES - 1))


def _turned(swing: Swing, horizon: float) -> float:
    """How far the swing turns within `horizon` at its present acceleration [rad]."""
    t = min(horizon, speeding(swing))
    rate = swing.rate + swing.acceleration * t
    return swing.rate * t + 0.5 * swing.acceleration * t**2 + rate * (horizon - t)


def _rate_after(swing: Swing, horizon: float) -> tuple[float, float]:
    t = speeding(swing)
    if t <= horizon:
        return swing.rate + swing.acceleration * t, 0.0
    return swing.rate + swing.acceleration * horizon, swing.acceleration
