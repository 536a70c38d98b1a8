"""What bears a machine on a manoeuvre, from where it is and how the ground lies: geometry alone.

Whatever of the belts and of the bucket's edge is on the ground, or would be within a hair, bears
it. It is a second way to what `judge` works out from loads, and needs nothing but the poses, so
that it holds for any manoeuvre, given or read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.contact.crawler import Crawler, crawler_of
from backend.contact.outfit import edge_half_width, edge_radius
from backend.machine.kinematics import end_point_of, link_poses
from backend.machine.model import Machine
from backend.spatial.types import Array
from backend.stability.footing import standing_on

SAMPLES = 120
"""Along each belt."""
HAIR = 0.004
"""Of the tracks' length: so near to the ground a belt is on it."""
HELD = 0.02
"""Of the tracks' length: so near to the ground the bucket's edge is."""
LIFTED = 0.03
"""Of the tracks' length: with more under all of it a belt bears nothing."""
MOST = 6
"""Points: two ends of two belts, and two of the bucket's edge."""


@dataclass(frozen=True)
class Ledge:
    """One step. edge: (2,) a point of it, way: (2,) unit, across it; before, behind: height of the
    ground on either side [m]; depth: of what lies behind, after which it is as before [m].
    """

    edge: Array
    way: Array
    before: float
    behind: float
    depth: float = math.inf

    def along(self, points: Array) -> Array:
        """(...) of points (..., 2 or more): across the edge, 0 on it [m]."""
        return np.asarray((points[..., :2] - self.edge) @ self.way)

    def height(self, points: Array) -> Array:
        """(...) of the ground under points (..., 2 or more) [m]."""
        s = self.along(points)
        return np.where((s >= 0.0) & (s <= self.depth), self.behind, self.before)


def bearing(machine: Machine, q: Array, T_site_root: Array, ledge: Ledge) -> Array:
    """(m, MOST, 3) points that bear the machine in postures q (m, n) on bases (m, 4, 4), NaN where
    there are fewer, site frame [m].
    """
    crawler, length = crawler_of(machine), machine.tracks.length
    found = np.full((len(q), MOST, 3), np.nan)
    for k, side in enumerate((-1.0, 1.0)):
        y = side * crawler.half_width
        points = _underside(crawler, y, T_site_root, ledge)
        gap = points[..., 2] - ledge.height(points + 1e-9 * _flat(ledge.way))
        least = gap.min(axis=1)
        on = gap <= np.maximum(least, 0.0)[:, None] + HAIR * length
        on &= (least <= LIFTED * length)[:, None]
        s = ledge.along(points)
        for j, (pick, none) in enumerate(((np.argmin, np.inf), (np.argmax, -np.inf))):
            row = pick(np.where(on, s, none), axis=1)
            chosen = points[np.arange(len(q)), row]
            found[:, 2 * k + j] = np.where(on.any(axis=1)[:, None], chosen, np.nan)
    poses = link_poses(machine, q, T_site_root)
    tips = np.array([end_point_of(machine, one) for one in poses])
    axes = poses[:, machine.end_link, :3, :3] @ machine.joint_axes[3]
    on = tips[:, 2] - ledge.height(tips) <= edge_radius(machine) + HELD * length
    half = edge_half_width(machine)
    for k, sign in ((4, -1.0), (5, 1.0)):
        found[:, k] = np.where(on[:, None], tips + sign * half * axes, np.nan)
    return found


def margins(machine: Machine, payload: float, q: Array, T_site_root: Array, points: Array) -> Array:
    """(m,) of the centre of mass to the edge of what bears it, -inf where that has no area [m].

    points: (m, k, 3) of `bearing`. The masses must be known.
    """
    found = np.full(len(q), -np.inf)
    for k, (row, T, borne) in enumerate(zip(q, T_site_root, points, strict=True)):
        yaw = math.atan2(float(T[1, 0]), float(T[0, 0]))
        stands = standing_on(machine, payload, row, T, yaw, borne[np.isfinite(borne).all(axis=1)])
        if not stands.reason:
            found[k] = stands.margin
    return found


def _underside(crawler: Crawler, y: float, T_site_root: Array, ledge: Ledge) -> Array:
    """(m, SAMPLES + 1, 3) of one belt from below, the last one where it passes over the edge."""
    a, r = crawler.half_base, crawler.radius
    x = np.linspace(-a - r, a + r, SAMPLES)
    local = np.stack([crawler.middle + x, np.full(SAMPLES, y), _below(x, a, r)], axis=1)
    R, p = T_site_root[:, :3, :3], T_site_root[:, :3, 3]
    points = local @ np.swapaxes(R, 1, 2) + p[:, None]
    # Along its flat part it is a line: where that is over the edge it touches first.
    start, end = (
        (R @ np.array([crawler.middle + s * a, y, 0.0])) + p for s in (-1.0, 1.0)
    )  # fmt: skip
    before, after = ledge.along(start), ledge.along(end)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(before * after < 0.0, before / (before - after), 0.0)
    over = start + share[:, None] * (end - start)
    return np.concatenate([points, over[:, None]], axis=1)


def _below(x: Array, a: float, r: float) -> Array:
    """Height of the belt's underside at x from its middle [m]."""
    out = np.clip(np.abs(x) - a, 0.0, r)
    return np.asarray(r - np.sqrt(r**2 - out**2))


def _flat(way: Array) -> Array:
    return np.array([*way, 0.0])
