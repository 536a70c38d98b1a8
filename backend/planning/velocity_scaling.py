"""Method A: speeds scaled down linearly with the distance (Mäkinen 2021, Section 3.3.1)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.machine.model import Machine
from backend.planning.proximity import Proximities, gradients, posed
from backend.planning.records import Thresholds
from backend.safety.scaling import APPROACHES, linear
from backend.spatial.types import Array, IntArray


class Scaled(NamedTuple):
    """factors: (n,) of each joint's rate; binding: indices of the pairs that set one below 1."""

    factors: Array
    binding: IntArray


def distances_ahead(
    machine: Machine, T_site_links: Array, T_next: Array, near: Proximities
) -> Array:
    """(k,) distances of the pairs when the links stand at T_next instead, both (L, 4, 4) [m].

    Along the present normal: the point moves exactly, the obstacle's face is taken as the plane
    through its point, which a convex obstacle never crosses.
    """
    point = _carried(machine, T_site_links, T_next, near.body, near.point)
    there = near.obstacle_point.copy()
    own = np.flatnonzero(near.other >= 0)
    if len(own):
        there[own] = _carried(
            machine, T_site_links, T_next, near.other[own], near.obstacle_point[own]
        )
    start = np.einsum("kx,kx->k", near.normal, near.point - near.obstacle_point)
    along = np.einsum("kx,kx->k", near.normal, point - there)
    return np.asarray(near.distance + along - start)


def scale_task(
    machine: Machine,
    q: Array,
    rates: Array,
    T_site_links: Array,
    near: Proximities,
    thresholds: Thresholds,
    dt: float,
    T_site_root: Array | None,
) -> Scaled:
    """One factor for all joints, Eq. (3.12), from the shortest distance that shrinks.

    Distances are those of the next step, so that p_l is not overstepped by one; pairs that part
    count for nothing: moving away is at full speed.
    """
    T_next = posed(machine, q + rates * dt, T_site_root)
    ahead = distances_ahead(machine, T_site_links, T_next, near)
    closing = np.flatnonzero(ahead < near.distance - 1e-12)
    s = linear(ahead[closing], thresholds.lower, thresholds.upper)
    least = float(s.min(initial=1.0))
    binding = closing[(s < 1.0) & (s <= least)]
    return Scaled(np.full(len(rates), least), np.asarray(binding, dtype=np.int64))


def scale_joints(
    machine: Machine,
    q: Array,
    rates: Array,
    T_site_links: Array,
    near: Proximities,
    thresholds: Thresholds,
    dt: float,
    T_site_root: Array | None,
) -> Scaled:
    """A factor per joint, as an operator's levers are: a joint is slowed by the pairs that its own
    motion closes, and by no others. Distances are those of the next step where that is nearer.
    """
    if not len(near):
        return Scaled(np.ones(len(rates)), np.zeros(0, dtype=np.int64))
    T_next = posed(machine, q + rates * dt, T_site_root)
    ahead = distances_ahead(machine, T_site_links, T_next, near)
    s = linear(np.minimum(ahead, near.distance), thresholds.lower, thresholds.upper)
    closes = gradients(machine, T_site_links, near) * np.sign(rates) < -APPROACHES
    factors = np.where(closes, s[:, None], 1.0)
    binding = np.flatnonzero((factors < 1.0).any(axis=1))
    return Scaled(factors.min(axis=0), binding.astype(np.int64))


def _carried(machine: Machine, T: Array, T_next: Array, bodies: IntArray, points: Array) -> Array:
    """(k, 3) where points that move with bodies are when the links stand at T_next."""
    link = machine.body_link_index[bodies]
    R, R_next = T[link, :3, :3], T_next[link, :3, :3]
    local = np.einsum("kyx,ky->kx", R, points - T[link, :3, 3])
    return np.asarray(np.einsum("kxy,ky->kx", R_next, local) + T_next[link, :3, 3])
