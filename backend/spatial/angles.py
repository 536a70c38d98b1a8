"""Angles on the circle [rad]."""

from __future__ import annotations

import numpy as np

from backend.spatial.types import Array


def wrap(angle: Array | float) -> Array:
    """Angle(s) mapped to [-pi, pi). angle: any shape [rad]."""
    return np.asarray((np.asarray(angle, dtype=float) + np.pi) % (2 * np.pi) - np.pi)


def difference(a: Array | float, b: Array | float) -> Array:
    """Shortest signed rotation from b to a, in [-pi, pi) [rad]."""
    return wrap(np.asarray(a, dtype=float) - np.asarray(b, dtype=float))


def interpolate(a: float, b: float, fraction: float) -> float:
    """The angle at `fraction` of the shortest way from a to b [rad], wrapped."""
    return float(wrap(a + fraction * difference(b, a)))
