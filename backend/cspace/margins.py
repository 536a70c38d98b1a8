"""How far a machine can move from where it is before it touches something.

Conservative advancement: while the smallest gap of all pairs is g and no point of a body moves
faster than v per radian, nothing touches within the next g / v. The gap along separating axes never
exceeds the distance and is positive whenever there is one, so no step passes a contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from backend.cspace.exact_boxes import gap
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


def margins(machine: Machine, q: Array, obstacles: Boxes, eta: float = 0.0) -> list[Margin]:
    """Every joint's margins [rad]: joint 0 negative, joint 0 positive, joint 1 negative, ...

    q: (n,) [rad]; obstacles in the machine's root frame; eta: how much the machine's bodies are
    grown [m]. Never optimistic; see TOLERANCE. In contact already, the margin is 0. The swing of
    a machine without limits ends after a whole turn.
    """
    directions = [
        sign * np.eye(len(machine.joints))[k]
        for k in range(len(machine.joints))
        for sign in (-1.0, 1.0)
    ]
    q = np.asarray(q, dtype=float)
    levers = _levers(machine, q, eta)
    return [_margin(machine, q, d, obstacles, eta, levers[0]) for d in directions]


def margin(
    machine: Machine, q: Array, direction: Array, obstacles: Boxes, eta: float = 0.0
) -> Margin:
    """How far the joints can go along q + s direction, s >= 0, before first contact or a limit.

    direction: (n,) joint rates, such as a joystick's; when they are in rad/s, `free` is in seconds.
    Only pairs that move against each other count. Otherwise as `margins`.
    """
    q, direction = np.asarray(q, dtype=float), np.asarray(direction, dtype=float)
    now, stretched = _levers(machine, q, eta)
    alone = np.count_nonzero(direction) == 1
    return _margin(machine, q, direction, obstacles, eta, now if alone else stretched)


def _margin(
    machine: Machine, q: Array, direction: Array, obstacles: Boxes, eta: float, levers: Array
) -> Margin:
    if not (np.isfinite(q).all() and np.isfinite(direction).all()):
        raise ValueError("joint values and direction must be finite numbers")
    end = _limit(machine, q, direction)
    fastest = float(np.abs(direction).max())
    if end <= 0.0 or fastest == 0.0:
        return Margin(max(end, 0.0), None, None, False)
    moved_by = _moved_by(machine)
    rate = np.where(moved_by, levers * np.abs(direction), 0.0)
    i, j = np.meshgrid(np.arange(len(rate)), np.arange(len(obstacles)), indexing="ij")
    itself = np.array(machine.self_pairs, dtype=np.int64).reshape(-1, 2)
    # Two bodies of one machine move against each other by the joints that carry only one of them.
    apart = moved_by[itself[:, 0]] != moved_by[itself[:, 1]]
    own_rate = np.where(apart, rate[itself[:, 0]] + rate[itself[:, 1]], 0.0).sum(axis=1)
    pairs = np.concatenate([np.stack([i.ravel(), j.ravel()], axis=1), itself])
    rates = np.concatenate([rate.sum(axis=1)[i.ravel()], own_rate])
    moving = rates > 0.0
    free, k = _advance(
        machine.link_matrices,
        np.array([link.parent for link in machine.links]),
        np.array([link.joint for link in machine.links]),
        machine.body_link_index,
        _arrays(machine.bodies.inflated(eta)),
        machine.bodies.half_extents.copy(),
        _arrays(obstacles),
        pairs[moving],
        rates[moving],
        len(np.flatnonzero(moving[: i.size])),
        q,
        direction,
        end,
        TOLERANCE / fastest,
    )
    if k < 0:
        return Margin(free, None, None, False)
    own, hit = pairs[moving][k]
    with_self = bool(np.flatnonzero(moving)[k] >= i.size)
    return Margin(free, int(own), int(hit), with_self)


def _limit(machine: Machine, q: Array, direction: Array) -> float:
    """The s at which the first joint meets its limit; a whole turn when nothing limits."""
    fastest = float(np.abs(direction).max())
    end = 2.0 * math.pi / fastest if fastest > 0.0 else 0.0
    for value, rate, low, high in zip(q, direction, machine.lower, machine.upper, strict=True):
        if rate != 0.0:
            end = min(end, ((high if rate > 0.0 else low) - value) / rate)
    return end


def _moved_by(machine: Machine) -> BoolArray:
    """(bodies, joints) which joints carry which body."""
    out = np.zeros((len(machine.bodies), len(machine.joints)), dtype=bool)
    for b, link in enumerate(machine.body_links):
        i = link
        while i >= 0:
            if machine.links[i].joint >= 0:
                out[b, machine.links[i].joint] = True
            i = machine.links[i].parent
    return out


def _levers(machine: Machine, q: Array, eta: float) -> tuple[Array, Array]:
    """(bodies, joints) how far from each joint's axis a point of each body is, at most [m]: at q,
    which does not change while that joint alone moves; and with the chain stretched.
    """
    corners = machine.bodies.inflated(eta).corners()
    now = np.zeros((len(corners), len(machine.joints)))
    stretched = np.zeros_like(now)
    T = link_poses(machine, q)
    Tb = T[machine.body_link_index]
    placed = corners @ np.swapaxes(Tb[:, :3, :3], 1, 2) + Tb[:, None, :3, 3]
    moved_by = _moved_by(machine)
    for i, link in enumerate(machine.links):
        if link.joint >= 0:
            axis = T[i, :3, :3] @ link.axis
            from_axis = np.cross(placed - T[i, :3, 3], axis)
            now[:, link.joint] = np.linalg.norm(from_axis, axis=2).max(axis=1)
    size = np.linalg.norm(corners, axis=2).max(axis=1)
    for b, first in enumerate(machine.body_links):
        length, i = float(size[b]), first
        while i >= 0:
            link = machine.links[i]
            if link.joint >= 0:
                stretched[b, link.joint] = length
            length += float(np.linalg.norm(link.T_parent_joint[:3, 3]))
            i = link.parent
    return np.where(moved_by, now + 1e-9, 0.0), stretched + 1e-9


def _arrays(boxes: Boxes) -> tuple[Array, Array, Array]:
    return boxes.centers.copy(), boxes.rotations.copy(), boxes.half_extents.copy()


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _place(
    M: Array, parents: IntArray, joints: IntArray, q: Array, link: int, c: Array, R: Array
) -> None:
    """Move center c (3,) and rotation R (3, 3) from the link's frame to the root's, in place."""
    T, moved, turned = np.empty((3, 4)), np.empty(3), np.empty((3, 3))
    i = link
    while i >= 0:
        s = v = 0.0
        if joints[i] >= 0:
            s, v = math.sin(q[joints[i]]), 1.0 - math.cos(q[joints[i]])
        for a in range(3):
            for b in range(4):
                T[a, b] = M[0, i, a, b] + s * M[1, i, a, b] + v * M[2, i, a, b]
        for a in range(3):
            moved[a] = T[a, 0] * c[0] + T[a, 1] * c[1] + T[a, 2] * c[2] + T[a, 3]
            for b in range(3):
                turned[a, b] = T[a, 0] * R[0, b] + T[a, 1] * R[1, b] + T[a, 2] * R[2, b]
        c[:] = moved
        R[:] = turned
        i = parents[i]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _advance(
    M: Array,
    parents: IntArray,
    joints: IntArray,
    body_links: IntArray,
    own: tuple[Array, Array, Array],
    as_built: Array,
    others: tuple[Array, Array, Array],
    pairs: IntArray,
    rates: Array,
    against: int,
    q: Array,
    direction: Array,
    end: float,
    step: float,
) -> tuple[float, int]:
    """(how far, the pair that ends it or -1). The first `against` pairs are with obstacles.

    Every pair has its own s up to which it is known to be apart; the smallest one is looked at.
    """
    safe = np.zeros(len(pairs))
    ca, cb = np.empty(3), np.empty(3)
    Ra, Rb = np.empty((3, 3)), np.empty((3, 3))
    for turn in range(2):
        # First every pair once, by the spheres around the boxes; then the nearest, as it comes.
        todo = len(pairs) if turn == 0 else 1 << 62
        n = 0
        while n < todo:
            k = n
            n += 1
            if turn == 1:
                k = -1
                for p in range(len(pairs)):
                    if k < 0 or safe[p] < safe[k]:
                        k = p
                if k < 0 or safe[k] >= end:
                    return end, -1
            s = safe[k]
            i, j = pairs[k, 0], pairs[k, 1]
            ca[:], Ra[:] = own[0][i], own[1][i]
            at = q + s * direction
            _place(M, parents, joints, at, body_links[i], ca, Ra)
            if k < against:
                cb[:], Rb[:] = others[0][j], others[1][j]
                hb = others[2][j]
            else:
                cb[:], Rb[:] = own[0][j], own[1][j]
                _place(M, parents, joints, at, body_links[j], cb, Rb)
                hb = as_built[j]
            ha = own[2][i]
            d = math.sqrt(((ca - cb) ** 2).sum())
            g = d - math.sqrt((ha**2).sum()) - math.sqrt((hb**2).sum())
            if turn == 0:
                safe[k] = max(g, 0.0) / rates[k]
                continue
            if g <= 0.1 * d:
                g = max(g, gap(ca, Ra, ha, cb, Rb, hb, math.inf))
            if g < rates[k] * step:
                return s, k
            safe[k] = s + g / rates[k]
    return end, -1
