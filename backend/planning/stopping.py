"""Whether a machine can stop: thresholds against its real decelerations, and stops looked ahead.

The thesis chooses p_u and p_l "such that joints can decelerate to a stop regardless of the initial
velocity" (Mäkinen 2021, Section 3.3.1) and leaves the check to the reader.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import Machine
from backend.machine.stopping import full_stopping_distances
from backend.planning.records import Thresholds
from backend.spatial.types import Array

_SPACING = 0.2  # [m] of the tool's way between two postures of a stop that are judged
_FEWEST, _MOST = 4, 24  # of them


def stopping_ways(machine: Machine, q: Array, latency: float) -> Array:
    """(n,) [m] how far the farthest point that a joint moves still travels after a stop from full
    speed is asked for: its lever about the joint's axis times the joint's stopping angle.

    q: (n,) [rad], the other joints' posture; latency [s], see `machine.stopping`.
    """
    T = link_poses(machine, np.asarray(q, dtype=float))
    corners = body_boxes(machine, T).corners()
    levers = np.zeros(len(machine.joints))
    for k, link in enumerate(machine.joint_links):
        axis = T[link, :3, :3] @ machine.joint_axes[k]
        r = corners[machine.body_joints[:, k]] - T[link, :3, 3]
        across = np.linalg.norm(r - (r @ axis)[..., None] * axis, axis=-1)
        levers[k] = across.max(initial=0.0)
    return np.asarray(levers * full_stopping_distances(machine, latency))


def threshold_warnings(
    machine: Machine, q: Array, thresholds: Thresholds, latency: float
) -> tuple[str, ...]:
    """A sentence for each joint that cannot stop within p_u, or only below p_l; none when all can.

    Scaling slows down from p_u on. A joint that needs more than p_u - p_l, braking as hard as it
    can, comes nearer than p_l; one that needs more than p_u enters the limit.
    """
    ways = stopping_ways(machine, q, latency)
    said = []
    for joint, way in zip(machine.joints, ways, strict=True):
        room = thresholds.upper - thresholds.lower
        if way <= room:
            continue
        where = "enters the limit" if way > thresholds.upper else "comes nearer than p_l"
        said.append(
            f"{joint.role} at full speed needs {way:.2f} m to stop and {where}: p_u = "
            f"{thresholds.upper:.2f} m and p_l = {thresholds.lower:.2f} m leave {room:.2f} m; "
            f"p_u must be at least {thresholds.lower + way:.2f} m."
        )
    return tuple(said)


def sufficient_thresholds(
    machine: Machine, q: Array, lower: float, latency: float = 0.0
) -> Thresholds:
    """p_l as given and a p_u from which scaling asks no joint for more than its deceleration.

    Along d' = -v (d - p_l)/(p_u - p_l) a joint brakes by at most w^2 r/(p_u - p_l), so that
    p_u - p_l must be twice the braking way, and what latency takes.
    """
    ways = 2.0 * stopping_ways(machine, q, 0.0).max() + stopping_ways(machine, q, latency).max()
    ways -= stopping_ways(machine, q, 0.0).max()
    return Thresholds(lower + float(ways), lower)


def braking_path(machine: Machine, q: Array, rates: Array, dt: float) -> Array:
    """(m, n) postures while all joints brake as hard as they can after `rates` (n,) were held for
    dt [s]: the first after dt, the last at rest; the longer the way, the more.
    """
    a = machine.max_acceleration
    way = float((0.5 * rates**2 / a).sum()) * machine.max_reach
    count = int(np.clip(np.ceil(way / _SPACING), _FEWEST, _MOST))
    t = np.linspace(0.0, float((np.abs(rates) / a).max()), count + 1)[:, None]
    braked = np.minimum(t, np.abs(rates) / a)
    return np.asarray(q + rates * dt + np.sign(rates) * (np.abs(rates) - 0.5 * a * braked) * braked)


def stoppable(
    machine: Machine,
    q: Array,
    before: Array,
    rates: Array,
    dt: float,
    clearance: Callable[[Array], Array],
    keep: float,
) -> tuple[Array, bool]:
    """`rates` (n,) where a stop after them stays clear, else `before` (n,) braked fully.

    clearance: postures (m, n) -> (m,) shortest distances [m]; clear is at least `keep` [m], or
    nowhere nearer than now. A machine that starts clear can then always stop clear, because the
    braking that is done was found clear one step earlier; exact but for what passes between the
    postures judged, which `keep` must cover. Returns the rates and whether they are the ones asked
    for.
    """
    path = braking_path(machine, q, rates, dt)
    found = clearance(np.concatenate([q[None], path]))
    if found[1:].min() >= min(keep, float(found[0])):
        return rates, True
    step = machine.max_acceleration * dt
    return np.asarray(np.sign(before) * np.maximum(np.abs(before) - step, 0.0)), False
