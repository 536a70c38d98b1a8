"""What Figs. 5-7 of Yamashita and Kikuuwe 2025 plot of a trajectory: its swing and lift with the
limits of two masses, and the simple one from which it could have begun.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.machine.model import Machine
from backend.planning.trajectory.records import Task
from backend.spatial.types import Array, IntArray
from backend.stability.masses import MassModel, mass_model, why_unknown
from backend.stability.polygon import support_polygon
from backend.stability.simple_model import TwoMasses, critical_lift, critical_swing, two_masses

_H = 1e-3  # [s] of the central differences


SMOOTHED = 0.25
"""Half the time over which an acceleration is taken from what sensors saw [s]."""


class Motion(NamedTuple):
    """time: (m,) [s]; q: (m, n) [rad]; swing: (m,) [rad/s]; lift: (m,) upward acceleration of the
    moving mass [m/s^2]; critical_swing, critical_lift: (m,) where the machine tips on level ground,
    infinite where nowhere, NaN where masses are not known.
    """

    time: Array
    q: Array
    swing: Array
    lift: Array
    critical_swing: Array
    critical_lift: Array


def motion_of(
    machine: Machine, payload: float, t: Array, q: Array, rates: Array, accelerations: Array
) -> Motion:
    """Of rows t (m,); q, rates, accelerations (m, n). payload: at the end point [kg]."""
    unknown = np.full(len(t), np.nan)
    if why_unknown(machine):
        return Motion(t, q, rates[:, 0], unknown, unknown, unknown)
    masses = mass_model(machine, payload)
    near = [q + k * _H * rates + 0.5 * (k * _H) ** 2 * accelerations for k in (-1, 0, 1)]
    two = [_two(machine, masses, one) for one in near]
    z, r = [t_.H + t_.r_TB[..., 2] for t_ in two], [_rho(t_) for t_ in two]
    lift, outward = (one[2] - 2.0 * one[1] + one[0] for one in (z, r))
    return _limited(t, q, rates[:, 0], two[1], lift / _H**2, outward / _H**2)


def seen_motion(
    machine: Machine, payload: float, t: Array, q: Array, rates: Array, picked: IntArray
) -> Motion:
    """Of what sensors saw at times t (m,) [s], at the rows picked (k,): accelerations by parabolas
    over SMOOTHED either way.
    """
    unknown = np.full(len(picked), np.nan)
    some = t[picked], q[picked], rates[picked, 0]
    if why_unknown(machine) or not len(picked):
        return Motion(*some, unknown, unknown, unknown)
    masses = mass_model(machine, payload)
    two = _two(machine, masses, q)
    lift = _bent(t, two.H + two.r_TB[..., 2], picked)
    outward = np.nan_to_num(_bent(t, _rho(two), picked))
    return _limited(*some, _two(machine, masses, q[picked]), lift, outward)


def initial_motion(machine: Machine, task: Task, goal: Array, step: float = 0.05) -> Motion:
    """Straight to the goal (n,) in joint space, as fast as the joints alone allow: all begin and
    end together, whatever is in the way and however the machine stands.
    """
    way = goal - task.q
    size = np.maximum(np.abs(way), 1e-9)
    v = float((task.max_velocity(machine) / size).min())
    a = float((task.max_acceleration(machine) / size).min())
    v = min(v, float(np.sqrt(a)))  # no more than accelerating half the way reaches
    rise, end = v / a, v / a + 1.0 / v
    t = np.append(np.arange(0.0, end - 1e-6, step), end)
    left = end - t
    s = np.where(
        t < rise,
        0.5 * a * t**2,
        np.where(left < rise, 1.0 - 0.5 * a * left**2, v * (t - 0.5 * rise)),
    )
    ds = np.minimum(np.minimum(a * t, a * left), v)
    dds = np.where(t < rise, a, np.where(left < rise, -a, 0.0))
    rows = (task.q + s[:, None] * way, ds[:, None] * way, dds[:, None] * way)
    return motion_of(machine, task.payload, t, *rows)


def _two(machine: Machine, masses: MassModel, q: Array) -> TwoMasses:
    return two_masses(masses, support_polygon(machine), q)


def _limited(
    t: Array, q: Array, swing: Array, two: TwoMasses, lift: Array, outward: Array
) -> Motion:
    return Motion(
        *(t, q, swing, lift),
        critical_swing(two, np.nan_to_num(lift), outward).min(axis=-1),
        critical_lift(two).min(axis=-1),
    )


def _rho(two: TwoMasses) -> Array:
    return np.hypot(two.r_TB[..., 0], two.r_TB[..., 1])


def _bent(t: Array, values: Array, picked: IntArray) -> Array:
    """Second derivative (k,) of a parabola through the values near the times of the rows picked,
    NaN where there are too few.
    """
    out = np.full(len(picked), np.nan)
    for k, row in enumerate(picked.tolist()):
        first = int(np.searchsorted(t, t[row] - SMOOTHED))
        last = int(np.searchsorted(t, t[row] + SMOOTHED))
        if last - first >= 5 and t[last - 1] - t[first] > SMOOTHED:
            out[k] = 2.0 * np.polyfit(t[first:last] - t[row], values[first:last], 2)[0]
    return out
