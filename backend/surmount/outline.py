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
    ends = np.stack([middle - a * along, middle + a * along], axis=-2)
    apart, meets = _to_quadrant(ends, h)
    return np.asarray(np.where(meets < 0.0, meets, apart) - r)


def body_clearance(corners: Array, h: float) -> Array:
    """(...) of convex bodies with corners (..., k, 2), x and z, to step and ground, negative inside
    [m]."""
    apart, meets = _to_quadrant(corners, h)
    return np.asarray(np.minimum(corners[..., 1].min(axis=-1), np.where(meets < 0.0, meets, apart)))


def _to_quadrant(corners: Array, h: float) -> tuple[Array, Array]:
    """(...) distance of the hull of corners (..., k, 2) to the quadrant x >= 0, z <= h where they
    are apart, and the larger of what all of it is before x = 0 and what of it is over the top is
    above that: below 0 where they meet.
    """
    x, z = corners[..., 0], corners[..., 1]
    before = -x.max(axis=-1)
    i, j = np.triu_indices(corners.shape[-2], 1)
    xi, xj, zi, zj = x[..., i], x[..., j], z[..., i], z[..., j]
    crosses = (xi < 0.0) != (xj < 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.where(crosses, zi + (zj - zi) * (-xi) / np.where(crosses, xj - xi, 1.0), np.inf)
    over = np.minimum(at.min(axis=-1), np.where(x >= 0.0, z, np.inf).min(axis=-1)) - h
    # The nearest points are a corner of the body, or the edge and a side of it.
    of_corners = np.hypot(np.maximum(-x, 0.0), np.maximum(z - h, 0.0)).min(axis=-1)
    dx, dz = xj - xi, zj - zi
    length = np.maximum(dx**2 + dz**2, 1e-300)
    t = np.clip((-xi * dx + (h - zi) * dz) / length, 0.0, 1.0)
    of_edge = np.sqrt(((xi + t * dx) ** 2 + (zi + t * dz - h) ** 2).min(axis=-1))
    return np.minimum(of_corners, of_edge), np.maximum(over, before)
