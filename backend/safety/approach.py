"""What motions of one machine bring it closer to another, in a form that brakes can be judged by.

Each row is one corner x of an own body and a plane between that body and one of the other machine,
with unit normal n pointing at the own body. While the other machine stands still, nothing touches
as long as every corner stays on its side, whatever the bodies' shapes: so a row is on the safe side
of the distance, and all corners of a body count, not only the closest point, which jumps about
(Mäkinen 2021, Section 5.2, an open problem there). To second order in the motion s (m,)

    room(s) = room + slope s + 1/2 s bend s,   slope_k = n . J_k,   bend_kl = n . (z_k x J_l)

J_k = z_k x (x - o_k) is the geometric Jacobian's column (Mäkinen 2021, Section 2.2); bend is our
addition: a swing that starts sideways comes closer later on. The exact rotation comes less close
than this (sin s < s, 1 - cos s < 1/2 s^2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.machine.model import Machine
from backend.safety.braking import accelerations, full_speeds, stopping_distance
from backend.safety.hulls import hulls
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray

SHARE = 0.5
"""Part of the room between two machines that one of them may use."""
AHEAD = 0.4
"""Horizon at which a partner's corners are looked ahead [s]."""


@dataclass(frozen=True)
class Motion:
    """How one placed machine moves. T_site_links: (L, 4, 4); T_site_root: (4, 4); rates: (n,)
    [rad/s]; base_velocity: (3,) [m/s]; yaw_rate [rad/s].
    """

    T_site_links: Array
    T_site_root: Array
    rates: Array
    base_velocity: Array
    yaw_rate: float

    def tracks(self, machine: Machine) -> Array:
        """(2,) speeds of the left and the right track [m/s], without slip."""
        forward = float(self.T_site_root[:3, 0] @ self.base_velocity)
        turn = 0.5 * machine.tracks.gauge * self.yaw_rate
        return np.array([forward - turn, forward + turn])


@dataclass(frozen=True)
class Approach:
    """r rows about m = n + 2 motions: the joints [rad], the left and the right track [m].

    index: (r, 2) into `own` and `others`, names of bodies "boom/0" and "right:boom/0", and of whole
    parts; room: (r,) distance left before p_l, less what both poses may be wrong by [m]; slope:
    (r, m); bend: (r, m, m); closing: (r,) speed at which the other machine comes nearer [m/s];
    rates: (m,) the own motions now [rad/s, m/s]; age: of the own data [s]; share: part of the room
    that this machine may use: all of it beside what stands still.
    """

    index: IntArray
    own: tuple[str, ...]
    others: tuple[str, ...]
    room: Array
    slope: Array
    bend: Array
    closing: Array
    rates: Array
    age: float
    share: float = SHARE


def approach(
    machine: Machine,
    own: Motion,
    other_machine: Machine,
    other: Motion,
    other_name: str,
    keep: float,
    age: float,
    delay: float,
) -> Approach:
    """Every row that a stop from full speed could use up.

    keep: p_l and what both poses may be wrong by [m]; age: of the own data [s]; delay: the longest
    total delay that commands can have [s].
    """
    its = hulls(other_machine)
    boxes = its.placed(other.T_site_links)
    twists = _twists(other_machine, other, its.moves, boxes[0])
    others = tuple(f"{other_name}:{name}" for name in its.names)
    least = np.zeros(len(its.group))
    return _rows(machine, own, boxes, twists, least, its.group, others, keep, age, delay, SHARE)


def approach_standing(
    machine: Machine,
    own: Motion,
    boxes: Boxes,
    names: tuple[str, ...],
    keep: float,
    age: float,
    delay: float,
) -> Approach:
    """The same towards boxes (k) that do not move. keep: p_l and what the own pose may be wrong by
    [m]. The machine may use all of the room: nothing else comes nearer meanwhile.
    """
    still = np.zeros((len(boxes), 3))
    return approach_moving(machine, own, boxes, still, still[:, 0], names, keep, age, delay)


def approach_moving(
    machine: Machine,
    own: Motion,
    boxes: Boxes,
    velocity: Array,
    least: Array,
    names: tuple[str, ...],
    keep: float,
    age: float,
    delay: float,
) -> Approach:
    """The same towards boxes (k) that move but do not turn, people for one. velocity: (k, 3) [m/s];
    least: (k,) speed at which each may come nearer whatever it does now [m/s]. The machine may use
    all of the room that is left by what comes nearer until it stands.
    """
    k = len(boxes)
    twice = np.concatenate([np.arange(k)] * 2)  # each is its own hull, too
    twists = velocity[twice], np.zeros((2 * k, 3))
    held = boxes.centers[twice], boxes.rotations[twice], boxes.half_extents[twice]
    group, both = k + twice, names * 2
    return _rows(machine, own, held, twists, least[twice], group, both, keep, age, delay, 1.0)


def standing_reach(machine: Machine, keep: float, delay: float) -> float:
    """No body of the machine comes closer to `keep` of what is farther away than this [m], before
    it stands from full speed.
    """
    stop = stopping_distance(full_speeds(machine), delay, accelerations(machine))
    far = machine.bounding_radius + float(np.linalg.norm(machine.arm.T_root_swing[:3, 3]))
    turning = (stop[-2] + stop[-1]) / machine.tracks.gauge * far
    levers = machine.stretched_levers.max(axis=0, initial=0.0)
    return float(levers @ stop[:-2] + stop[-1] + turning + keep)


def _rows(
    machine: Machine,
    own: Motion,
    others: tuple[Array, Array, Array],
    twists: tuple[Array, Array],
    least: Array,
    group: IntArray,
    names: tuple[str, ...],
    keep: float,
    age: float,
    delay: float,
    share: float,
) -> Approach:
    from backend.safety.approach_kernels import rows  # compiled code, which playback can do without

    full, a = full_speeds(machine), accelerations(machine)
    axes, origins = _axes(machine, own.T_site_links)
    mine = hulls(machine)
    T = own.T_site_root
    index, room, slope, bend, closing = rows(
        mine.placed(own.T_site_links),
        others,
        twists,
        np.ascontiguousarray(least, dtype=float),
        (mine.group, group),
        mine.moves,
        axes,
        origins,
        (T[:3, 0].copy(), np.array([0.0, 0.0, 1.0]), T[:3, 3].copy(), machine.tracks.gauge),
        stopping_distance(full, delay, a),
        keep,
        np.array([AHEAD, 2.0 * AHEAD]),
        float((delay + full / a).max()),
        share,
    )
    rates = np.append(own.rates, own.tracks(machine))
    return Approach(index, mine.names, names, room, slope, bend, closing, rates, age, share)


def _axes(machine: Machine, T_site_links: Array) -> tuple[Array, Array]:
    """Unit axes (n, 3) and origins (n, 3) of the joints, site frame."""
    T = T_site_links[machine.joint_links]
    axes = (T[:, :3, :3] @ machine.joint_axes[:, :, None])[:, :, 0]
    return np.ascontiguousarray(axes), T[:, :3, 3].copy()


def _twists(
    machine: Machine, motion: Motion, moves: BoolArray, centers: Array
) -> tuple[Array, Array]:
    """Velocities of the boxes' centres and angular velocities, (k, 3) each [m/s, rad/s]."""
    axes, origins = _axes(machine, motion.T_site_links)
    turning = axes * motion.rates[:, None]
    moved = moves.astype(float)
    yaw = np.array([0.0, 0.0, motion.yaw_rate])
    omega = moved @ turning + yaw
    # v = sum_k w_k x (c - o_k) = (sum_k w_k) x c - sum_k w_k x o_k
    v = _cross(omega, centers) - moved @ _cross(turning, origins)
    v += motion.base_velocity - np.cross(yaw, motion.T_site_root[:3, 3])
    return v, omega


def _cross(a: Array, b: Array) -> Array:
    """(k, 3), as numpy's, which is slow on small arrays."""
    out = np.empty_like(a)
    out[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    out[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    out[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return out


def joined(parts: list[Approach]) -> Approach:
    """The rows of several partners as one; at least one part, all of the same share."""
    if len(parts) == 1:
        return parts[0]
    offsets = np.cumsum([0, *(len(p.others) for p in parts[:-1])])
    return Approach(
        np.concatenate([p.index + np.array([0, k]) for p, k in zip(parts, offsets, strict=True)]),
        parts[0].own,
        tuple(name for p in parts for name in p.others),
        np.concatenate([p.room for p in parts]),
        np.concatenate([p.slope for p in parts]),
        np.concatenate([p.bend for p in parts]),
        np.concatenate([p.closing for p in parts]),
        parts[0].rates,
        parts[0].age,
        parts[0].share,
    )
