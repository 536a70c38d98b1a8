"""How the crawler's middle P_b moves: Jayasekara and Arisumi 2015, Eqs. (1)-(11).

u = t / t_f runs from 0 to 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from backend.spatial.types import Array
from backend.surmount.records import Spline


class Profile(NamedTuple):
    """Values and their first three derivatives by u, each (m,)."""

    value: Array
    first: Array
    second: Array
    third: Array


def smooth_step(u: Array) -> Profile:
    """The 7th-order polynomial of Eq. (3), from 0 to 1: speed, acceleration and jerk are 0 at both
    ends (1), (2); its first derivative is Eq. (4). u: (m,).
    """
    u = np.asarray(u, dtype=float)
    w = 1.0 - u
    value = u**4 * (35.0 + u * (-84.0 + u * (70.0 - 20.0 * u)))
    return Profile(
        value,
        140.0 * u**3 * w**3,
        420.0 * u**2 * w**2 * (1.0 - 2.0 * u),
        840.0 * u * w * (1.0 - 5.0 * u + 5.0 * u**2),
    )


def rise(s: Array, spline: Spline | None = None) -> Array:
    """Share of the height z_f1 at the share s (m,) of the way x_f1: the cubic of Eq. (7), level at
    both ends (5), (6); or a cubic spline through two points between, level at both ends, too.
    """
    s = np.asarray(s, dtype=float)
    if spline is None:
        return np.asarray(s**2 * (3.0 - 2.0 * s))
    knots, heights = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0], [0.0, spline.low, spline.high, 1.0]
    return np.asarray(CubicSpline(knots, heights, bc_type="clamped")(s))
