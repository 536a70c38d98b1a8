"""Boxes of people and objects among the points of one scan (Rasul 2021, Sections 3.1-3.3).

    points → region of interest → without machines → without ground → clusters → boxes

A LiDAR sees one side of what it looks at. What is as small as a person gets a person's depth behind
what was seen, so that its centre is where the person stands and not where the beams met it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from backend.errors import InputError
from backend.perception.clusters import cluster
from backend.perception.ground import Plane, find_ground
from backend.perception.kernels import inside
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray

_FARTHEST = 1e8  # [m]


@dataclass(frozen=True)
class Settings:
    """reach: region of interest around the sensors [m]; low, high: heights above ground that count
    [m]; around: machines' bodies are taken out this much larger [m]; tolerance: of the ground [m];
    link: points nearer than this along the ground are one object, 0.4 to 2 [m]; fewest: points of
    an object; smallest: what is less high and less wide is left out [m]; largest: what is longer
    is left out, as a wall [m]; person: least depth of what is person-sized [m].
    """

    reach: float = 25.0
    low: float = 0.15
    high: float = 3.0
    around: float = 0.15
    tolerance: float = 0.1
    link: float = 0.4
    fewest: int = 5
    smallest: float = 0.15
    largest: float = 12.0
    person: float = 0.45

    def __post_init__(self) -> None:
        if not 0.1 <= self.link <= 2.0:
            raise InputError(f"detection: link is {self.link} m; allowed is 0.1 to 2 m.")
        if not 0.0 <= self.low < self.high:
            raise InputError("detection: 0 <= low < high is needed.")
        if not self.reach > 0.0 or self.fewest < 1:
            raise InputError("detection: reach must be above 0, fewest at least 1.")


class Objects(NamedTuple):
    """k boxes, upright. center: (k, 3) [m]; yaw: (k,) of their length [rad]; size: (k, 3) length,
    width, height [m]; points: (k,) how many of each.
    """

    center: Array
    yaw: Array
    size: Array
    points: IntArray


class Stages(NamedTuple):
    """What became of each point (n,). near: in the region of interest; machine: of a machine's own
    body; ground: on or below the ground; cluster: its object's number, -1 for none. plane: the
    ground, None when none was found; then all heights count from the lowest of the points.
    """

    near: BoolArray
    machine: BoolArray
    ground: BoolArray
    cluster: IntArray
    plane: Plane | None
    objects: Objects


def detect(
    points: Array,
    origin: Array,
    machines: Boxes,
    settings: Settings | None = None,
    plane: Plane | None = None,
) -> Stages:
    """Objects in one scan, and every stage on the way.

    points: (n, 3) in the site frame, z up [m]; origin: (3,) of the sensor, or (n, 3) of each
    point's own; machines: all machines' bodies where they are now; plane: the ground when it is
    known. Points that are no numbers, or not of this world, are left out.
    """
    settings = settings or Settings()
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"detection: points have the shape {points.shape}; needed is (n, 3).")
    finite = _sane(points)
    safe = np.where(finite[:, None], points, 0.0)
    origin = np.broadcast_to(origin, points.shape)
    near = finite & (np.hypot(*(safe - origin)[:, :2].T) <= settings.reach)
    machine = near & within(safe, machines, settings)
    rest = near & ~machine
    if plane is None:
        plane = find_ground(safe[rest], settings.tolerance)
    if plane is None:
        lowest = float(safe[rest, 2].min()) if rest.any() else 0.0
        height = safe[:, 2] - lowest
    else:
        height = plane.heights(safe)
    ground = rest & (height < settings.low)
    left = np.flatnonzero(rest & (height >= settings.low) & (height <= settings.high))
    found = cluster(safe[left], settings.link)
    objects, kept = _objects(safe[left], height[left], found, origin[left], settings)
    number = np.full(len(points), -1, np.int64)
    number[left] = kept[found] if len(found) else -1
    return Stages(near, machine, ground, number, plane, objects)


def within(points: Array, machines: Boxes, settings: Settings) -> BoolArray:
    """(n,) whether a point (n, 3) is a machine's own. machines: bodies where they were then."""
    grown = machines.inflated(settings.around)
    return np.asarray(
        inside(np.ascontiguousarray(points), grown.centers, grown.rotations, grown.half_extents),
        dtype=bool,
    )


def detect_above(
    points: Array, origin: Array, machines: Boxes, settings: Settings | None = None
) -> Stages:
    """Objects in a scan whose ground was taken out before: every height counts, from the lowest
    point within reach. Arguments as of `detect`.
    """
    settings = settings or Settings()
    points = np.asarray(points, dtype=float)
    lowest = 0.0
    if points.ndim == 2 and points.shape[1] == 3:
        finite = points[_sane(points)]
        near = np.hypot(*(finite - origin)[:, :2].T) <= settings.reach
        lowest = float(finite[near, 2].min()) if near.any() else 0.0
    level = Plane(np.array([0.0, 0.0, 1.0]), lowest, 0.0)
    return detect(points, origin, machines, replace(settings, low=0.0), level)


def _sane(points: Array) -> BoolArray:
    """(n,) whether all three are numbers, and no farther than coordinates of the earth."""
    return np.asarray((np.abs(points) < _FARTHEST).all(axis=1))


def _objects(
    points: Array, height: Array, found: IntArray, origin: Array, settings: Settings
) -> tuple[Objects, IntArray]:
    """The boxes, and each cluster's number among them, -1 for what is left out."""
    clusters = int(found.max()) + 1 if len(found) else 0
    kept = np.full(clusters, -1, np.int64)
    boxes: list[tuple[Array, float, Array, int]] = []
    order = np.argsort(found, kind="stable")
    ends = np.searchsorted(found[order], np.arange(clusters + 1))
    for c in range(clusters):
        index = order[ends[c] : ends[c + 1]]
        if len(index) < settings.fewest:
            continue
        box = _box(points[index], height[index], origin[index].mean(axis=0), settings)
        if box is not None:
            kept[c] = len(boxes)
            boxes.append((*box, len(index)))
    if not boxes:
        none = np.zeros(0)
        return Objects(np.zeros((0, 3)), none, np.zeros((0, 3)), np.zeros(0, np.int64)), kept
    center, yaw, size, count = zip(*boxes, strict=True)
    return Objects(np.array(center), np.array(yaw), np.array(size), np.array(count)), kept


_ANGLES: Array = np.deg2rad(np.arange(0.0, 90.0, 5.0))
_TURNS: Array = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)


def _box(
    points: Array, height: Array, origin: Array, settings: Settings
) -> tuple[Array, float, Array] | None:
    """The upright box of least area around points (m, 3); None for what is left out."""
    flat = points[:, :2]
    middle = flat.mean(axis=0)
    off = flat - middle
    along = off @ _TURNS.T  # (m, angles)
    across = off @ np.stack([-_TURNS[:, 1], _TURNS[:, 0]], axis=1).T
    low = np.stack([along.min(axis=0), across.min(axis=0)])
    high = np.stack([along.max(axis=0), across.max(axis=0)])
    best = int(np.argmin(np.prod(high - low + 0.02, axis=0)))
    lows, highs = low[:, best], high[:, best]
    axes = np.array([_TURNS[best], [-_TURNS[best, 1], _TURNS[best, 0]]])  # rows
    tall = float(height.max())
    size = highs - lows
    if size.max() > settings.largest or max(tall, size.max()) < settings.smallest:
        return None
    if size.max() < 1.2 and 0.5 < tall < 2.3:
        lows, highs = _deepened(lows, highs, axes, middle - origin[:2], settings.person)
        size = highs - lows
    center = middle + (0.5 * (lows + highs)) @ axes
    yaw, long, wide = float(_ANGLES[best]), float(size[0]), float(size[1])
    if wide > long:
        yaw, long, wide = yaw + 0.5 * np.pi, wide, long
    bottom = float(points[:, 2].max()) - tall
    return (
        np.array([center[0], center[1], bottom + 0.5 * tall]),
        yaw,
        np.array([long, wide, tall]),
    )


def _deepened(
    lows: Array, highs: Array, axes: Array, look: Array, person: float
) -> tuple[Array, Array]:
    """Each side at least a person's, grown away from the sensor where the beams came from. look:
    (2,) from the sensor to the object.
    """
    away = axes @ (look / max(float(np.linalg.norm(look)), 1e-9))
    lows, highs = lows.copy(), highs.copy()
    for k in range(2):
        missing = person - (highs[k] - lows[k])
        if missing <= 0.0:
            continue
        behind = 0.5 * (1.0 + away[k])  # 1: all of it on the high side
        highs[k] += missing * behind
        lows[k] -= missing * (1.0 - behind)
    return lows, highs
