"""Method B: the task is followed, and what is nearest pushes away (Mäkinen 2021, Section 3.3.2).

Eq. (3.13) is used as -grad U of U = mu/2 (1/p - 1/p_u)^2, so that it repels. With six joints and a
task of the whole pose, the projector I - J^+ J of Eq. (3.14) and (3.16) is zero: as printed nothing
is repelled. "first joints" leaves it out and lets swing, boom and stick alone repel, which is what
the text below Eq. (3.15) describes; "position kept" projects on what leaves the tool's position,
and so gives its attitude up; "printed" is there to show that it does nothing.
"""

from __future__ import annotations

import numpy as np

from backend.machine.kinematics import body_point_jacobians
from backend.machine.model import PARTS, Machine
from backend.machine.pose import damped_inverse
from backend.planning.proximity import Proximities, closest_per_group
from backend.planning.records import Projector, Thresholds
from backend.spatial.types import Array, IntArray

_FIRST = 3  # joints that repel, Eq. (3.16)
_NEAREST = 0.02  # [m] below which repulsion grows no further


def obstacle_avoidance_points(machine: Machine, near: Proximities) -> IntArray:
    """Indices of the closest pair of each of the thesis's boxes: base, cabin, boom, stick, and
    tilt, rotator and tool together (Section 2.2.1).
    """
    part = np.minimum([PARTS.index(machine.part_of_body(int(b))) for b in near.body], 4)
    return closest_per_group(near, part.astype(np.int64))


def repulsion_speed(distance: Array | float, gain: float, thresholds: Thresholds) -> Array:
    """Speed [m/s] away from what is at p = distance [m]: Eq. (3.13), 0 from p_u on."""
    p = np.maximum(np.asarray(distance, dtype=float), _NEAREST)
    return np.asarray(np.maximum(gain * (1.0 / p - 1.0 / thresholds.upper) / p**2, 0.0))


def repulsion(
    machine: Machine,
    T_site_links: Array,
    near: Proximities,
    J_task: Array,
    gain: float,
    thresholds: Thresholds,
    damping: float,
    projector: Projector,
) -> Array:
    """(n,) joint rates of the sum in Eq. (3.14), (3.16), of the pairs given. J_task: (6, n)."""
    n = J_task.shape[1]
    speed = repulsion_speed(near.distance, gain, thresholds)
    rates = np.zeros(n)
    pushing = np.flatnonzero(speed > 0.0)
    if not len(pushing):
        return rates
    close = near.take(pushing)
    J_O = body_point_jacobians(machine, T_site_links, close.body, close.point)  # Eq. (3.15)
    own = np.flatnonzero(close.other >= 0)
    if len(own):
        J_O[own] -= body_point_jacobians(
            machine, T_site_links, close.other[own], close.obstacle_point[own]
        )
    if projector == "first joints":
        J_O[:, :, _FIRST:] = 0.0
    for J, v, normal in zip(J_O, speed[pushing], close.normal, strict=True):
        rates += damped_inverse(J, damping) @ (v * normal)
    if projector == "printed":
        rates = rates - np.linalg.pinv(J_task) @ (J_task @ rates)
    elif projector == "position kept":
        rates = rates - np.linalg.pinv(J_task[:3]) @ (J_task[:3] @ rates)
    return rates
