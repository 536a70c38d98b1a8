"""Smooth joint motions through waypoints, at rest at both ends.

The path is a cubic spline over the waypoints; time runs along it as minimum-jerk motion does
(Flash and Hogan 1985, Eq. (3)): s = 10 u^3 - 15 u^4 + 6 u^5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from backend.shell.sim.dynamics import Limits
from backend.spatial.types import Array

MARGIN = 0.9  # share of the actuators' speed and acceleration that a program asks for
SAMPLES = 200


@dataclass(frozen=True, eq=False)
class Motion:
    """start, duration [s]; path: joint values over s in 0..1 [rad]."""

    start: float
    duration: float
    path: CubicSpline

    @property
    def end(self) -> float:
        return self.start + self.duration

    @property
    def goal(self) -> Array:
        """(n,) [rad]"""
        return np.asarray(self.path(1.0), dtype=np.float64)


def path_through(waypoints: Array, limits: Limits) -> CubicSpline:
    """A spline over s in 0..1 through waypoints (k, n) [rad], k >= 2.

    Knots are spaced by the time that the slowest joint needs between neighbours.
    """
    points = np.asarray(waypoints, dtype=np.float64)
    spans = (np.abs(np.diff(points, axis=0)) / limits.velocity).max(axis=1)
    s = np.concatenate([[0.0], np.cumsum(np.maximum(spans, 1e-3))])
    return CubicSpline(s / s[-1], points, bc_type="natural" if len(points) > 2 else "not-a-knot")


def shortest(path: CubicSpline, limits: Limits) -> float:
    """The least duration [s] at which the path keeps to MARGIN of the limits; at least 0.1 s."""
    _, qd, qdd = _evaluate(path, np.linspace(0.0, 1.0, SAMPLES), 1.0)
    speed = float((np.abs(qd) / limits.velocity).max()) / MARGIN
    effort = float((np.abs(qdd) / limits.acceleration).max()) / MARGIN
    return max(0.1, speed, math.sqrt(effort))


def at(motion: Motion, t: float) -> tuple[Array, Array, Array]:
    """(q, qd, qdd), each (n,) [rad, rad/s, rad/s^2], at time t [s]; at rest outside the motion."""
    u = min(1.0, max(0.0, (t - motion.start) / motion.duration))
    q, qd, qdd = _evaluate(motion.path, np.array([u]), motion.duration)
    return q[0], qd[0], qdd[0]


def _evaluate(path: CubicSpline, u: Array, duration: float) -> tuple[Array, Array, Array]:
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    ds = 30.0 * u**2 * (1.0 - u) ** 2 / duration
    dds = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / duration**2
    slope = path(s, 1)
    q = np.asarray(path(s), dtype=np.float64)
    qd = np.asarray(slope * ds[:, None])
    qdd = np.asarray(path(s, 2) * ds[:, None] ** 2 + slope * dds[:, None])
    return q, qd, qdd
