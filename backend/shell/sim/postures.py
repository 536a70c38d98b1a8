"""Joint values for a work cycle: named postures, and the waypoints of digging and dumping by IK.

Azimuths are in the root frame, counter-clockwise from the tracks' x; reach is horizontal from the
swing axis to the bucket tip; heights are above the plane of the tracks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from backend.errors import InputError
from backend.machine.inverse import inverse
from backend.machine.kinematics import swing_center
from backend.machine.model import Machine
from backend.spatial.types import Array

ATTITUDE_STEP = math.radians(2.0)
ATTITUDE_SEARCH = math.radians(100.0)


@dataclass(frozen=True)
class Spot:
    """Where the bucket works. azimuth [rad]; reach [m]; height of the tip [m], below ground < 0."""

    azimuth: float
    reach: float
    height: float


def posture_at(
    machine: Machine, spot: Spot, attitude: float, near: float = math.nan
) -> Array | None:
    """Joint values (n,) that put the bucket tip at the spot, or None when it is out of reach.

    attitude: wanted elevation of the line from bucket pivot to tip [rad]; the nearest one that
    the joint limits allow is taken. near: swing that the result's turn should be closest to.
    """
    center = swing_center(machine)
    x = center[0] + spot.reach * math.cos(spot.azimuth)
    y = center[1] + spot.reach * math.sin(spot.azimuth)
    offsets = np.arange(0.0, ATTITUDE_SEARCH, ATTITUDE_STEP)
    tried = attitude + np.stack([offsets, -offsets], axis=1).ravel()  # the nearest first
    solution = inverse(machine, np.array([x, y, spot.height]), tried)
    fits = np.flatnonzero(solution.reachable & solution.within_limits)
    if len(fits) == 0:
        return None
    q = np.array(solution.q[fits[0]])
    if machine.joints[0].continuous and math.isfinite(near):
        q[0] += 2.0 * math.pi * round((near - q[0]) / (2.0 * math.pi))
    return q


def dig_waypoints(machine: Machine, spot: Spot, near: float) -> Array | None:
    """(5, n): over the spot, at the ground, in it, dragged towards the machine, curled and lifted.

    spot.height is the bottom of the cut (negative). None when any of these is out of reach.
    """
    R = machine.max_reach
    points = (  # tip's way back from spot.reach, height, bucket attitude [deg]
        (0.00, 0.10 * R, -75.0),
        (0.00, 0.0, -90.0),
        (0.06 * R, spot.height, -110.0),
        (0.18 * R, spot.height, -135.0),
        (0.20 * R, 0.14 * R, -165.0),
    )
    return _chain(machine, spot, points, near)


def dump_waypoints(machine: Machine, spot: Spot, near: float) -> Array | None:
    """(2, n): over the spot with the bucket curled, and opened. None when out of reach."""
    closed = posture_at(machine, spot, math.radians(-160.0), near)
    if closed is None:
        return None
    opened = closed.copy()
    bucket = machine.joints[3]
    # Opening raises the tip: towards positive in Sun's sense, whatever the URDF's sign.
    wanted = opened[3] + machine.sun.signs[2] * math.radians(70.0)
    opened[3] = min(max(wanted, bucket.lower), bucket.upper)
    return np.stack([closed, opened])


def _chain(
    machine: Machine, spot: Spot, points: tuple[tuple[float, float, float], ...], near: float
) -> Array | None:
    rows = []
    for back, height, attitude in points:
        here = replace(spot, reach=spot.reach - back, height=height)
        q = posture_at(machine, here, math.radians(attitude), near)
        if q is None:
            return None
        rows.append(q)
    return np.stack(rows)


def default_spots(machine: Machine, start: Array) -> tuple[Spot, Spot]:
    """(dig, dump) for a machine whose site names no spots: dig ahead, dump to the left."""
    R = machine.max_reach
    ahead = machine.sun.azimuth_sign * float(start[0]) + machine.sun.azimuth_offset
    return Spot(ahead, 0.75 * R, -0.06 * R), Spot(ahead + math.radians(70.0), 0.7 * R, 0.25 * R)


def joints_from(machine: Machine, values: Mapping[str, float], base: Array, where: str) -> Array:
    """`base` (n,) with the joints named by role or URDF name replaced [rad]. Raises InputError."""
    q = np.array(base, dtype=np.float64)
    known = [joint.role for joint in machine.joints]
    for role, value in values.items():
        if role not in known:
            raise InputError(f'{where}: "{role}" is not a joint; allowed are {", ".join(known)}.')
        joint = machine.joints[known.index(role)]
        if not joint.lower - 1e-9 <= value <= joint.upper + 1e-9:
            raise InputError(
                f"{where}: {role} is {math.degrees(value):g} deg; allowed are "
                f"{math.degrees(joint.lower):g} to {math.degrees(joint.upper):g} deg."
            )
        q[known.index(role)] = value
    return q


def middle(machine: Machine) -> Array:
    """(n,) the middle of every joint's range, 0 for continuous joints [rad]."""
    return np.array(
        [0.0 if joint.continuous else 0.5 * (joint.lower + joint.upper) for joint in machine.joints]
    )
