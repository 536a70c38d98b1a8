"""How far a machine can move from where it is before it touches something.

Conservative advancement: while the gap of a pair is g and no point of it moves faster than v per
unit of the direction, nothing touches within the next g / v. The gap along separating axes never
exceeds the distance and is positive whenever there is one, so no step passes a contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from backend.cspace.margins_kernel import advance, axes_of, limits
from backend.machine.kinematics import posture
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

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
    return along(machine, q, each_joint(len(machine.joints)), obstacles, eta, slack)


@lru_cache(maxsize=8)
def each_joint(n: int) -> Array:
    """(2 n, n) the directions of `margins`; read only."""
    directions: Array = np.repeat(np.eye(n), 2, axis=0) * np.tile([-1.0, 1.0], n)[:, None]
    directions.setflags(write=False)
    return directions


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
    q, directions = np.array(q, dtype=float), np.array(directions, dtype=float)
    if not (np.isfinite(q).all() and np.isfinite(directions).all()):
        raise ValueError("joint values and directions must be finite numbers")
    wrong = np.zeros(len(machine.self_pairs))
    if slack is not None:
        wrong = machine.self_pair_levers @ np.asarray(slack, dtype=float)
    ends, fastest, alone = limits(q, directions, machine.lower, machine.upper)
    T = posture(machine, q)
    free, pair = advance(
        (machine.link_matrices, machine.link_parents, machine.link_joints),
        machine.body_link_index,
        machine.body_joints,
        machine.body_arrays,
        (obstacles.centers.copy(), obstacles.rotations.copy(), obstacles.half_extents.copy()),
        machine.self_pair_index,
        machine.self_pair_joints,
        machine.stretched_levers,
        float(eta),
        wrong,
        T,
        q,
        directions,
        alone,
        axes_of(T, machine.joint_links, machine.joint_axes),
        ends,
        TOLERANCE / np.maximum(fastest, 1e-300),
    )
    n, itself = len(obstacles), machine.self_pairs
    return [_named(f, k, n, itself) for f, k in zip(free.tolist(), pair.tolist(), strict=True)]


def _named(free: float, pair: int, obstacles: int, itself: tuple[tuple[int, int], ...]) -> Margin:
    if pair < 0:
        return Margin(free, None, None, False)
    against = pair - len(itself)
    if against < 0:
        return Margin(free, *itself[pair], True)
    return Margin(free, against // obstacles, against % obstacles, False)
