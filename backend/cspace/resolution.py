"""How densely live images sample the machines' motion, Sun 2020, Section 5.1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.spatial.types import Array


@dataclass(frozen=True)
class Resolution:
    """points_per_second [1/s]; points_per_metre [1/m] of travel; points_per_radian: (n,) [1/rad].

    inf at standstill: the next point falls on the last one.
    """

    points_per_second: float
    points_per_metre: float
    points_per_radian: Array


def resolution(cycle_time: float, travel_speed: float, joint_speeds: Array) -> Resolution:
    """Temporal and spatial resolution: 10/V and 10/q' for the paper's cycle of 0.1 s.

    cycle_time > 0 [s] from one image to the next, as measured; travel_speed [m/s] and joint_speeds
    (n,) [rad/s], either sign. Raises ValueError on a cycle time that is not positive and finite.
    """
    if not (np.isfinite(cycle_time) and cycle_time > 0.0):
        raise ValueError(f"cycle_time must be a positive number of seconds, not {cycle_time}")
    rate = 1.0 / cycle_time
    with np.errstate(divide="ignore"):
        per_metre = np.divide(rate, np.abs(np.float64(travel_speed)))
        per_radian = np.divide(rate, np.abs(np.asarray(joint_speeds, dtype=float)))
    return Resolution(rate, float(per_metre), np.asarray(per_radian))
