"""How far a machine can move from where it is before it touches something.

Conservative advancement: while the gap of a pair is g and no point of it moves faster than v per
unit of the direction, nothing touches within the next g / v. The gap along separating axes never
exceeds the distance and is positive whenever there is one, so no step passes a contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.cspace.margins_kernel import advance
from backend.machine.kinematics import link_poses
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray

TOLERANCE = 1e-8
"""Bodies that are closer than they can move in this many radians count as touching (tens of
nanometres). A margin is shorter than the motion to first contact by this, divided by the sine of
the angle at which the surfaces meet: far below 1e-4 rad unless they only graze."""


@dataclass(frozen=True)
class Margin:
    """One direction of motion. free: how far, in units of the direction; own, hit: body index and
    obstacle (or body) index of first contact, None at a limit; with_self: whether `hit` is a body
    of the machine itself.
    """

    free: float
    own: int | None
    hit: int | None
    with_self: bool


def margins(
    machine: Machine, q: Array, obstacles: Boxes, eta: float = 0.0, slack: Array | None = None
) -> list[Margin]:
    """Every joint's margins [rad]: joint 0 negative, joint 0 positive, joint 1 negative, ...

    q: (n,) [rad]; obstacles in the machine's root frame; eta: the distance to them that counts as
    contact [m]; slack: (n,) what each joint may be wrong by, which is what matters between the
    machine's own bodies [rad]. Never optimistic; see TOLERANCE. In contact already, the margin is
    0. The swing of a machine without limits ends after a whole turn.
    """
    n = len(machine.joints)
    directions = np.repeat(np.eye(n), 2, axis=0) * np.tile([-1.0, 1.0], n)[:, None]
    return along(machine, q, directions, obstacles, eta, slack)


def margin(
    machine: Machine, q: Array, direction: Array, obstacles: Boxes, eta: float = 0.0
) -> Margin:
    """How far the joints can go along q + s direction, s >= 0, before first contact or a limit.

    direction: (n,) joint rates, such as a joystick's; when they are in rad/s, `free` is in seconds.
    Only pairs that move against each other count. Otherwise as `margins`.
    """
    return along(machine, q, np.asarray(direction, dtype=float)[None], obstacles, eta)[0]


def along(
    machine: Machine,
    q: Array,
    directions: Array,
    obstacles: Boxes,
    eta: float = 0.0,
    slack: Array | None = None,
) -> list[Margin]:
    """`margin` in several directions (k, n) at once."""
    q, directions = np.asarray(q, dtype=float), np.asarray(directions, dtype=float)
    if not (np.isfinite(q).all() and np.isfinite(directions).all()):
        raise ValueError("joint values and directions must be finite numbers")
    itself, apart = machine.self_pair_index, machine.self_pair_joints
    far, T = machine.stretched_levers, link_poses(machine, q)
    wrong = np.zeros(len(itself))
    if slack is not None:
        reach = np.where(apart, far[itself[:, 0]] + far[itself[:, 1]], 0.0)
        wrong = reach @ np.asarray(slack, dtype=float)
    fastest = np.abs(directions).max(axis=1, initial=0.0)
    free, pair = advance(
        (machine.link_matrices, machine.link_parents, machine.link_joints),
        machine.body_link_index,
        machine.body_joints,
        _arrays(machine.bodies),
        _arrays(obstacles),
        itself,
        apart,
        far,
        float(eta),
        wrong,
        T,
        q,
        directions,
        np.where(np.count_nonzero(directions, axis=1) == 1, np.abs(directions).argmax(axis=1), -1),
        _axes(machine, T),
        _limits(machine, q, directions, fastest),
        TOLERANCE / np.maximum(fastest, 1e-300),
    )
    return [_named(free[k], pair[k], len(obstacles), itself) for k in range(len(directions))]


def _named(free: float, pair: int, obstacles: int, itself: IntArray) -> Margin:
    if pair < 0:
        return Margin(float(free), None, None, False)
    against = pair - len(itself)
    if against < 0:
        return Margin(float(free), int(itself[pair, 0]), int(itself[pair, 1]), True)
    return Margin(float(free), against // obstacles, against % obstacles, False)


def _limits(machine: Machine, q: Array, directions: Array, fastest: Array) -> Array:
    """(k,) the s at which the first joint meets its limit; a whole turn when nothing limits."""
    moving = directions != 0.0
    end = np.where(directions > 0.0, machine.upper, machine.lower) - q
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.where(moving, end / directions, np.inf).min(axis=1, initial=np.inf)
        turn = np.where(fastest > 0.0, 2.0 * math.pi / fastest, 0.0)
    return np.asarray(np.maximum(np.minimum(first, turn), 0.0))


def _axes(machine: Machine, T: Array) -> Array:
    """(joints, 2, 3) origins and unit vectors of the joints' axes at link poses T, root frame."""
    links = machine.joint_links
    axes = (T[links, :3, :3] @ machine.joint_axes[:, :, None])[:, :, 0]
    return np.stack([T[links, :3, 3], axes], axis=1)


def _arrays(boxes: Boxes) -> tuple[Array, Array, Array]:
    return boxes.centers.copy(), boxes.rotations.copy(), boxes.half_extents.copy()
