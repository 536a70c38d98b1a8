"""A work cycle as few postures, with a bound on where the bodies are between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.errors import InputError
from backend.machine import kinematics
from backend.machine.model import Machine
from backend.spatial.transform import apply
from backend.spatial.types import Array, IntArray

TOLERANCE = 0.02
"""[m] by which bodies may leave the hull of two kept postures that follow each other."""

_LONGEST = 64  # recorded postures that one step may pass over


@dataclass(frozen=True)
class Cycle:
    """postures: (m, n) [rad], passed through in a straight line in joint space, in order; slack:
    (m - 1,) how far the machine may have been off that line [m].
    """

    postures: Array
    slack: Array

    @property
    def ends(self) -> IntArray:
        """(S, 2) numbers of the postures that each step is between; one still posture is a step."""
        m = len(self.postures)
        if m == 1:
            return np.zeros((1, 2), dtype=np.int64)
        return np.stack([np.arange(m - 1), np.arange(1, m)], axis=1)


def bulges(machine: Machine, turns: Array) -> Array:
    """(k, B) how far a body may be outside of the hull of its two ends when the joints turn
    evenly by turns (k, n) [rad] [m].

    A point's way x(u), 0 <= u <= 1, is off its chord by |x''| / 8 at most, and of the joints i, j
    |d2x / dqi dqj| is at most the lever about the one nearer to the body.
    """
    levers = machine.stretched_levers
    shorter = np.minimum(levers[:, :, None], levers[:, None, :])
    size = np.abs(turns)
    return np.asarray(np.einsum("ki,kj,bij->kb", size, size, shorter) / 8.0)


def thinned(machine: Machine, postures: Array, tolerance: float = TOLERANCE) -> Cycle:
    """The fewest, greedily, of recorded postures (m, n) [rad] between which no body leaves the hull
    of its two ends by more than `tolerance` [m].

    Steps that turn too far are cut. Between two recorded postures joints are taken to turn evenly.
    Raises InputError for postures that are not finite or of another machine.
    """
    q = _checked(machine, postures)
    kept, slack, at = [0], [], 0
    while at < len(q) - 1:
        reach, off = 1, 0.0
        for step in range(2, min(_LONGEST, len(q) - 1 - at) + 1):
            strayed = _strayed(machine, q[at : at + step + 1])
            bulge = float(bulges(machine, q[None, at + step] - q[at]).max(initial=0.0))
            if strayed + bulge > tolerance:
                break
            reach, off = step, strayed
        at += reach
        kept.append(at)
        slack.append(off)
    return cut(machine, Cycle(q[kept], np.array(slack)), tolerance)


def cut(machine: Machine, cycle: Cycle, tolerance: float = TOLERANCE) -> Cycle:
    """The same motion with more postures, so that no step's bulge is above `tolerance` [m]."""
    q = cycle.postures
    postures, slack = [q[0]], []
    for first, last, off in zip(q[:-1], q[1:], cycle.slack, strict=True):
        bulge = float(bulges(machine, last[None] - first).max(initial=0.0))
        parts = max(1, int(np.ceil(np.sqrt(bulge / tolerance) - 1e-9)))
        for k in range(1, parts + 1):
            postures.append(first + (last - first) * (k / parts))
            slack.append(off)
    return Cycle(np.array(postures), np.array(slack))


@dataclass(frozen=True)
class Swept:
    """A cycle's bodies in the frame of the track, as `along_kernels.stretch` takes them; far: (B,)
    of a body's points from the frame's origin, at most [m].
    """

    centers: Array
    rotations: Array
    halves: Array
    corners: Array
    ends: IntArray
    middles: Array
    radii: Array
    bulge: Array
    far: Array


def swept(machine: Machine, cycle: Cycle, T_track_root: Array) -> Swept:
    """The bodies of all postures, and what is certain of them in between."""
    q, ends = cycle.postures, cycle.ends
    T = kinematics.link_poses(machine, q, T_track_root)[:, machine.body_link_index]
    R, p = T[..., :3, :3], T[..., :3, 3]
    centers = (R @ machine.bodies.centers[:, :, None])[..., 0] + p
    corners = apply(T, machine.body_corners)
    turns = q[ends[:, 1]] - q[ends[:, 0]]
    slack = cycle.slack if len(cycle.slack) else np.zeros(1)
    moved = machine.body_joints.any(axis=1)
    bulge = bulges(machine, turns) + slack[:, None] * moved
    both = np.concatenate([corners[ends[:, 0]], corners[ends[:, 1]]], axis=2)
    middles = both.mean(axis=2)
    radii = np.linalg.norm(both - middles[:, :, None], axis=-1).max(axis=2)
    far = np.linalg.norm(corners, axis=-1).max(axis=(0, 2)) + bulge.max(axis=0)
    halves = machine.bodies.half_extents
    solid = centers, R @ machine.bodies.rotations, halves, corners
    # The kernels of boxes are compiled for arrays that are not written.
    for values in solid:
        values.setflags(write=False)
    return Swept(*solid, ends, middles, radii, bulge, far)


def _strayed(machine: Machine, q: Array) -> float:
    """How far any point was, at most, from where it is when the joints turn evenly from the first
    of the postures q (k, n) to the last [m]."""
    turn = q[-1] - q[0]
    size = float(turn @ turn)
    u = np.clip((q - q[0]) @ turn / size, 0.0, 1.0) if size > 0.0 else np.zeros(len(q))
    off = np.abs(q - (q[0] + u[:, None] * turn))
    # Between two recorded postures the joints turn evenly, too: the ends are the worst.
    return float((off @ machine.stretched_levers.T).max(initial=0.0))


def _checked(machine: Machine, postures: Array) -> Array:
    q = np.asarray(postures, dtype=float)
    n = len(machine.joints)
    if q.ndim != 2 or q.shape[1] != n or not len(q) or not np.isfinite(q).all():
        raise InputError(
            f"the work cycle has shape {q.shape} or numbers that are not finite; allowed are one "
            f"or more postures of {n} finite angles."
        )
    return q
