"""The crawler on ground and edge, seen from the side: where it stands for a lean, what it touches.

Step frame. P_b is the middle of its underside; a is half of the base between its end wheels, r
their radius, alpha the lean, positive with the end ahead raised.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from backend.errors import InputError
from backend.spatial.types import Array


def lean(z: Array, a: float, r: float) -> Array:
    """(m,) [rad] of a crawler whose rear wheel stands on the ground z = 0 and whose P_b is z (m,)
    above it: z = r + a sin(alpha) - r cos(alpha).
    """
    return np.asarray(np.arctan2(r, a) + np.arcsin((np.asarray(z) - r) / np.hypot(a, r)))


def rear_wheel(x: Array, alpha: Array, a: float, r: float) -> Array:
    """(m,) x of the rear wheel's centre P_c: Eq. (16), before the derivative."""
    return np.asarray(x - a * np.cos(alpha) - r * np.sin(alpha))


def on_both(alpha: float, h: float, a: float, r: float) -> tuple[float, float, float]:
    """(x, z, e) of a crawler whose rear wheel is on the ground and whose underside lies on the edge
    of a step of height h: P_b [m], and how far along the underside the edge is ahead of it [m].
    """
    s, c = np.sin(alpha), np.cos(alpha)
    rear = -(r + (h - r) * c) / s
    along = -rear * c + (h - r) * s
    x, z = rear + a * c + r * s, r + a * s - r * c
    return float(x), float(z), float(along - a)


def leans(h: float, a: float, r: float) -> tuple[float, float]:
    """The least and the greatest lean [rad] with the edge under the front half of the crawler: from
    the foremost point of its underside to P_b. Raises InputError where the step is too high.
    """

    def ahead(alpha: float) -> float:
        return on_both(alpha, h, a, r)[2]

    steepest = np.radians(75.0)
    if ahead(steepest) > a:
        raise InputError(
            f"reach: a step {h:.3f} m high is higher than the crawler can lean on: its base is "
            f"{2.0 * a:.3f} m."
        )
    low = float(brentq(lambda alpha: ahead(alpha) - a, 1e-3, steepest))
    high = steepest if ahead(steepest) > 0.0 else float(brentq(ahead, low, steepest))
    return low, high


def belt_clearance(x: Array, z: Array, alpha: Array, h: float, a: float, r: float) -> Array:
    """(m,) of the crawler's outline to the step's edge and faces, negative inside [m]."""
    c, s = np.cos(alpha), np.sin(alpha)
    middle = np.stack([x - r * s, z + r * c], axis=-1)
    along = np.stack([c, s], axis=-1)
    left = np.inf
    for side in (-1.0, 1.0):
        p = middle + side * a * along
        # To the quadrant x >= 0, z <= h from outside, and how deep within.
        out = np.maximum(np.stack([-p[..., 0], p[..., 1] - h], axis=-1), 0.0)
        inside = np.minimum(np.stack([-p[..., 0], p[..., 1] - h], axis=-1).max(axis=-1), 0.0)
        left = np.minimum(left, np.hypot(out[..., 0], out[..., 1]) + inside)
    # The edge itself to the segment between the wheels' centres; below it, it is inside.
    from_middle = np.array([0.0, h]) - middle
    t = (from_middle * along).sum(axis=-1)
    across = from_middle[..., 1] * c - from_middle[..., 0] * s
    beside = np.where(np.abs(t) <= a, -across, np.inf)
    return np.asarray(np.minimum(left, beside) - r)


def body_clearance(corners: Array, h: float) -> Array:
    """(...) of convex bodies with corners (..., 8, 2), x and z, to step and ground, from below
    [m]: no body is nearer, and negative where one is inside.

    A body is clear of the step when all of it is before it, or what of it is over the top is above
    that: the larger of both is told.
    """
    x, z = corners[..., 0], corners[..., 1]
    above = z.min(axis=-1)
    before = -x.max(axis=-1)
    i, j = np.triu_indices(corners.shape[-2], 1)
    xi, xj, zi, zj = x[..., i], x[..., j], z[..., i], z[..., j]
    crosses = (xi < 0.0) != (xj < 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.where(crosses, zi + (zj - zi) * (-xi) / np.where(crosses, xj - xi, 1.0), np.inf)
    over = np.minimum(at.min(axis=-1), np.where(x >= 0.0, z, np.inf).min(axis=-1)) - h
    return np.asarray(np.minimum(above, np.maximum(over, before)))
