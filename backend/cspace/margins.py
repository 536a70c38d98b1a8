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
from backend.spatial.types import Array, BoolArray, IntArray

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
    itself = np.array(machine.self_pairs, dtype=np.int64).reshape(-1, 2)
    T = link_poses(machine, q)
    rates, itself_rates, far = _rates(machine, T, directions, itself)
    wrong = np.zeros(len(itself))
    if slack is not None:
        # Both bodies of a pair move by the joints that carry only one of them.
        apart = machine.body_joints[itself[:, 0]] != machine.body_joints[itself[:, 1]]
        reach = np.where(apart, far[itself[:, 0]] + far[itself[:, 1]], 0.0)
        wrong = reach @ np.asarray(slack, dtype=float)
    fastest = np.abs(directions).max(axis=1, initial=0.0)
    ends = np.array([_limit(machine, q, direction) for direction in directions])
    free, pair = advance(
        machine.link_matrices,
        machine.link_parents,
        machine.link_joints,
        machine.body_link_index,
        _arrays(machine.bodies),
        _arrays(obstacles),
        itself,
        rates,
        itself_rates,
        float(eta),
        wrong,
        T,
        q,
        directions,
        ends,
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


def _limit(machine: Machine, q: Array, direction: Array) -> float:
    """The s at which the first joint meets its limit; a whole turn when nothing limits."""
    fastest = float(np.abs(direction).max())
    end = 2.0 * math.pi / fastest if fastest > 0.0 else 0.0
    for value, rate, low, high in zip(q, direction, machine.lower, machine.upper, strict=True):
        if rate != 0.0:
            end = min(end, ((high if rate > 0.0 else low) - value) / rate)
    return max(end, 0.0)


def _rates(
    machine: Machine, T: Array, directions: Array, itself: IntArray
) -> tuple[Array, Array, Array]:
    """How fast bodies can move, per unit of each direction [m].

    (k, bodies) in the root frame; (k, pairs) of the machine's own pairs against each other; and
    (bodies, joints) levers of the stretched chain.
    """
    now, far = _levers(machine, T)
    carried: BoolArray = machine.body_joints
    alone = np.count_nonzero(directions, axis=1) == 1
    size = np.abs(directions)
    by_joint = np.where(alone[:, None, None], now, far) * size[:, None, :]  # (k, bodies, joints)
    apart = carried[itself[:, 0]] != carried[itself[:, 1]]
    both = by_joint[:, itself[:, 0]] + by_joint[:, itself[:, 1]]
    return by_joint.sum(axis=2), np.where(apart, both, 0.0).sum(axis=2), far


def _levers(machine: Machine, T: Array) -> tuple[Array, Array]:
    """(bodies, joints) how far from each joint's axis a point of each body is, at most [m]: at link
    poses T, which does not change while that joint alone moves; and with the chain stretched.
    """
    corners = machine.body_corners
    Tb = T[machine.body_link_index]
    placed = corners @ np.swapaxes(Tb[:, :3, :3], 1, 2) + Tb[:, None, :3, 3]
    now = np.zeros((len(corners), len(machine.joints)))
    for joint, link in enumerate(machine.joint_links):
        axis = T[link, :3, :3] @ machine.links[link].axis
        offset = placed - T[link, :3, 3]
        along_axis = offset @ axis
        squared = np.einsum("bci,bci->bc", offset, offset) - along_axis**2
        now[:, joint] = np.sqrt(np.maximum(squared, 0.0).max(axis=1))
    return np.where(machine.body_joints, now + 1e-9, 0.0), machine.stretched_levers


def _arrays(boxes: Boxes) -> tuple[Array, Array, Array]:
    return boxes.centers.copy(), boxes.rotations.copy(), boxes.half_extents.copy()
