"""Sun 2020, Section 3.1: where B's swing centre must not be driven, Eqs. (4)-(11)."""

from __future__ import annotations

import numpy as np

from backend.cspace.sun import SunPose
from backend.spatial.types import Array, BoolArray


def yaw_samples(m: int) -> Array:
    """(m+1,) from 0 to 2 pi, both included [rad]. Sun 2020, Eq. (4)."""
    return np.linspace(0.0, 2.0 * np.pi, _count(m, "m") + 1)


def length_samples(d: float, n: int) -> Array:
    """(n+1,) from 0 to d, both included [m]. Sun 2020, Eq. (5)."""
    return np.linspace(0.0, d, _count(n, "n") + 1)


def link_points(position: Array, yaw: float, s: Array) -> Array:
    """(k, 2) site-frame points [m] at s (k,) [m] along the arm. Sun 2020, Eq. (6)."""
    return np.asarray(position + np.outer(s, [np.cos(yaw), np.sin(yaw)]))


def offset_points(yaw: float, s: Array, offset: float) -> Array:
    """(k, 2) points (x_s, y_s) [m] from A's centre, beside the arm. Sun 2020, Eqs. (7), (8).

    s: (k,) along the arm [m]; offset: +eta on the arm's left, -eta on its right [m]. The arm's own
    coordinates (s, offset) are rotated; the points of (6), rotated already, are not turned twice.
    """
    c, sn = np.cos(yaw), np.sin(yaw)
    s = np.asarray(s, dtype=float)
    return np.stack([s * c - offset * sn, s * sn + offset * c], axis=-1)


def contact_base(p_a: Array, p_s: Array, d_b: Array, theta_b: Array) -> tuple[Array, Array]:
    """B's swing centre (x, y) [m] when its end-point is on A. Sun 2020, Eq. (9) solved for B.

    p_a: (2,) A's centre [m]; p_s: (..., 2) of (8) [m]; d_b (...) [m]; theta_b (...) [rad]; the
    leading axes broadcast.
    """
    x = p_a[0] + p_s[..., 0] - d_b * np.cos(theta_b)
    y = p_a[1] + p_s[..., 1] - d_b * np.sin(theta_b)
    return np.asarray(x), np.asarray(y)


def co_xy(a: SunPose, b: SunPose, eta: float, m: int, n: int) -> tuple[Array, Array]:
    """CO_xy as printed: x, y (2, m+1, n+1) [m], [0] with +eta, [1] with -eta. Sun 2020, Eq. (10).

    Row i has yaw theta_B,i; column j has both the j-th point of A's arm and the j-th length of B's.
    """
    theta = yaw_samples(m)[:, None]
    d_b = length_samples(b.d, n)[None, :]
    s = length_samples(a.d, n)
    p_s = np.stack([offset_points(a.yaw, s, sign * _eta(eta)) for sign in (1.0, -1.0)])
    return contact_base(a.position, p_s[:, None, :, :], d_b, theta)


def zone_distance(a: SunPose, d_b: float, eta: float, points: Array) -> Array:
    """Signed distance (...) [m] of site points (..., 2) from the warning zone, negative inside.

    The zone is the set of Eq. (10) with every length of B up to d_b at every point of A's arm, its
    width from -eta to eta: A's rectangle grown by d_b. Exact, unlike the drawn polygon.
    """
    c, s = np.cos(a.yaw), np.sin(a.yaw)
    delta = np.asarray(points, dtype=float) - a.position
    along = delta[..., 0] * c + delta[..., 1] * s
    across = -delta[..., 0] * s + delta[..., 1] * c
    half = a.d / 2.0
    outside = np.stack([np.abs(along - half) - half, np.abs(across) - _eta(eta)], axis=-1)
    to_rectangle = np.linalg.norm(np.maximum(outside, 0.0), axis=-1)
    depth = np.minimum(outside.max(axis=-1), 0.0)
    return np.asarray(to_rectangle + depth - d_b)


def in_free(a: SunPose, d_b: float, eta: float, points: Array) -> BoolArray:
    """Whether B's centre at points (..., 2) [m] is in C_free = R^2 - CO_xy. Sun 2020, Eq. (11).

    The edge belongs to the obstacle.
    """
    return np.asarray(zone_distance(a, d_b, eta, points) > 0.0)


def warning_zone(a: SunPose, b_reach: float, eta: float, n: int = 64) -> Array:
    """Outline (k, 2) [m] of the zone that B's swing centre must not enter, counter-clockwise.

    b_reach: B's projected length d_B [m]; eta [m]; n: edges of a full circle, taken up to the next
    multiple of 4, then k = n.

    Eq. (10) prints one index j for A's arm and B's length, so its samples pair the fraction j/n of
    A with the same fraction of B: small circles at A's foot, the full one at its tip. That is part
    of what can happen. The zone drawn here lets every point of A's arm (-eta to eta wide) meet
    every length up to d_B at every yaw: A's rectangle grown by a disk of radius d_B; the printed
    samples lie inside it. The corners are circumscribed: their edges touch the true arcs from
    outside, so the drawing is never smaller than the zone (at most d_B (1/cos(pi/n) - 1) larger).
    """
    if b_reach < 0:
        raise ValueError(f"b_reach must not be negative, not {b_reach}")
    eta = _eta(eta)
    quarter = max(1, -(-_count(n, "n") // 4))
    step = np.pi / 2.0 / quarter
    angles = (np.arange(4 * quarter) + 0.5) * step
    radius = b_reach / np.cos(step / 2.0)
    # The four corners in the order of the quarters: front left, back left, back right, front right.
    corners = np.array([[a.d, eta], [0.0, eta], [0.0, -eta], [a.d, -eta]])
    local = np.repeat(corners, quarter, axis=0)
    local = local + radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    c, s = np.cos(a.yaw), np.sin(a.yaw)
    return np.asarray(a.position + local @ np.array([[c, s], [-s, c]]))


def _count(value: int, name: str) -> int:
    if value < 1:
        raise ValueError(f"{name} must be at least 1, not {value}")
    return value


def _eta(eta: float) -> float:
    if not (np.isfinite(eta) and eta >= 0.0):
        raise ValueError(f"eta must be 0 or more metres, not {eta}")
    return eta
