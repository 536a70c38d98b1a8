"""How fast a motion may be, from the distance that it closes."""

from __future__ import annotations

import numpy as np

from backend.spatial.types import Array

APPROACHES = 1e-3
"""A joint approaches when a unit of its motion shortens the distance by more than this [m/rad]."""


def linear(distance: Array | float, stop_below: float, slow_below: float) -> Array:
    """Fraction of full speed: 0 at or below p_l, 1 at or above p_u, linear between.

    Mäkinen 2021, Eq. (3.11) corrected: (p_i - p_l) / (p_u - p_l).
    """
    span = slow_below - stop_below
    if not span > 0.0:
        raise ValueError(f"slow_below ({slow_below}) must exceed stop_below ({stop_below})")
    scaled = (np.asarray(distance, dtype=float) - stop_below) / span
    return np.asarray(np.where(np.isfinite(scaled), np.clip(scaled, 0.0, 1.0), 0.0))


def allowed_speeds(gradients: Array, fractions: Array) -> Array:
    """Most restrictive fraction per joint and direction: (n, 2), (negative, positive).

    gradients: (k, n) change of each close pair's distance per unit of joint motion [m/rad];
    fractions: (k,) allowed speed of motion that shortens that distance. Moving away stays free.
    """
    n = gradients.shape[1]
    f = fractions[:, None]
    negative = np.where(gradients > APPROACHES, f, 1.0).min(axis=0, initial=1.0)
    positive = np.where(gradients < -APPROACHES, f, 1.0).min(axis=0, initial=1.0)
    return np.stack([negative, positive], axis=1).reshape(n, 2)
