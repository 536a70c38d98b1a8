"""The volume that a machine's arm can reach with any boom, stick, bucket and swing.

Boom, stick and bucket turn about parallel axes, so each body moves in its own slab across the arm's
plane and its side view is swept three times in the plane: about the bucket's axis, then with the
stick, then with the boom. The result depends on the description only and is kept per machine.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from backend.cspace.driving_profile import Revolved, joined, make_runs, revolve, subdivide
from backend.machine import kinematics
from backend.machine.model import PARTS, Machine
from backend.spatial import transform
from backend.spatial.boxes import Boxes
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array, IntArray


def swept_arm(machine: Machine, tolerance: float) -> Revolved:
    """All bodies above the swing joint, in every posture within the joint limits and any swing.

    About the swing axis, heights from the swing joint's origin [m]. Contains the true solid and
    exceeds its radii by at most about `tolerance` [m]. Computed once per machine and tolerance.
    """
    return _swept(ByIdentity(machine), tolerance)


@lru_cache(maxsize=32)
def _swept(key: ByIdentity[Machine], tolerance: float) -> Revolved:
    machine = key.value
    q = np.array(
        [0.0 if j.continuous else float(np.clip(0.0, j.lower, j.upper)) for j in machine.joints]
    )
    T_root_links = kinematics.link_poses(machine, q)
    boxes = kinematics.body_boxes(machine, T_root_links)
    parts = np.array([machine.part_of_body(b) for b in range(len(boxes))])
    T_swing_root = transform.inverse(swing_frame(machine))
    upper = moved(boxes.take(parts == "upper"), T_swing_root)
    # In the arm's plane: x forward, y along the boom's axis, z along the swing axis.
    boom = next(i for i, link in enumerate(machine.links) if link.joint == 1)
    normal = T_swing_root[:3, :3] @ T_root_links[boom, :3, :3] @ machine.links[boom].axis
    normal = normal - np.array([0.0, 0.0, normal[2]])
    normal /= np.linalg.norm(normal)
    forward = np.cross(normal, [0.0, 0.0, 1.0])
    T_plane_root = (
        transform.make(np.stack([forward, normal, [0, 0, 1]]), np.zeros(3)) @ T_swing_root
    )
    pivots, turns = [], []
    for k in (3, 2, 1):
        i = next(i for i, link in enumerate(machine.links) if link.joint == k)
        axis = T_plane_root[:3, :3] @ T_root_links[i, :3, :3] @ machine.links[i].axis
        if abs(abs(axis[1]) - 1.0) > 1e-6:
            raise ValueError(f"{machine.joints[k].name}: its axis is not across the arm's plane")
        pivots.append(transform.apply(T_plane_root, T_root_links[i, None, :3, 3])[0, [0, 2]])
        # A turn about +y moves z towards x: clockwise in (x, z).
        sign = -np.sign(axis[1])
        low, high = machine.joints[k].lower - q[k], machine.joints[k].upper - q[k]
        if not np.isfinite(high - low):
            low, high = -np.pi, np.pi
        turns.append((min(sign * low, sign * high), float(high - low)))
    solids = [revolve(upper, tolerance)]
    slabs: dict[tuple[float, float, int], list[Polygon]] = {}
    for b in np.flatnonzero(~np.isin(parts, ("tracks", "upper"))):
        outline, left, right = _side_view(machine, int(b), T_plane_root, T_root_links, boxes)
        first = 3 - min(PARTS.index(str(parts[b])) - 1, 3)
        slabs.setdefault((round(left, 6), round(right, 6), first), []).append(outline)
    profiles = []
    for (left, right, first), outlines in slabs.items():
        region: BaseGeometry = shapely.union_all(outlines)
        for k in range(first, 3):
            region = sweep(region, pivots[k], *turns[k], tolerance / 9.0)
        profiles.append(_revolved_slab(region, left - 1e-6, right + 1e-6, 0.25 * tolerance))
    solids.append(runs_of(shapely.union_all(profiles), 0.5 * tolerance))
    return joined(solids)


def swing_frame(machine: Machine) -> Array:
    """T_root_swing (4, 4): origin of the swing joint, z along the swing axis upwards."""
    return machine.arm.T_root_swing


def moved(boxes: Boxes, T: Array) -> Boxes:
    """The boxes mapped by T (4, 4)."""
    return Boxes(transform.apply(T, boxes.centers), T[:3, :3] @ boxes.rotations, boxes.half_extents)


def _side_view(
    machine: Machine, b: int, T_plane_root: Array, T_root_links: Array, boxes: Boxes
) -> tuple[Polygon, float, float]:
    """Outline of body b in the arm's plane (x, z) and its extent along y [m].

    A box that stands askew in the plane is replaced by the prism of its shadow. Bodies beyond a
    tilt or rotator joint get a ball about the tool's first such joint that holds them in any turn.
    """
    corners = transform.apply(T_plane_root, boxes.corners()[b])
    i, top = machine.body_links[b], -1
    radius = 0.0
    here = corners
    while i >= 0 and machine.links[i].joint != 3:
        if machine.links[i].joint > 3:
            top = i
            pivot = transform.apply(T_plane_root, T_root_links[i, None, :3, 3])[0]
            reach = float(np.linalg.norm(here - pivot, axis=1).max())
            radius = max(
                reach, radius + float(np.linalg.norm(here[0] - pivot)) if radius else reach
            )
            here = np.array([pivot])
        i = machine.links[i].parent
    if top < 0:
        hull = shapely.convex_hull(shapely.MultiPoint(corners[:, [0, 2]]))
        # A nanometre makes up for rounding in what follows.
        return hull.buffer(1e-9, join_style="mitre"), corners[:, 1].min(), corners[:, 1].max()
    angle = np.arange(64) * (np.pi / 32)
    ring = here[0, [0, 2]] + radius / np.cos(np.pi / 64) * np.stack(
        [np.cos(angle), np.sin(angle)], axis=1
    )
    return Polygon(ring), here[0, 1] - radius, here[0, 1] + radius


def sweep(
    region: BaseGeometry, pivot: Array, begin: float, turn: float, tolerance: float
) -> BaseGeometry:
    """What a plane region covers turning about `pivot` (2,) from `begin` by `turn` >= 0 [rad].

    In polar coordinates a turn is a shift of the angle. The boundary is split where its distance
    from the pivot has an extremum; the part between covers the strip between its first and last
    position and the two arcs of its ends: the outer drawn by tangents, the inner by chords.
    """
    if turn > 3.0:
        half = sweep(region, pivot, begin, 0.5 * turn, 0.5 * tolerance)
        return sweep(half, pivot, 0.0, 0.5 * turn, 0.5 * tolerance)
    pieces = [_turned(region, pivot, begin)]
    for polygon in getattr(region, "geoms", [region]):
        for ring in (polygon.exterior, *polygon.interiors):
            for chain in _chains(np.asarray(ring.coords)[:-1, :2] - pivot):
                pieces.append(_strip(chain, begin, turn, tolerance, pivot))  # noqa: PERF401
    return shapely.union_all(shapely.make_valid(np.array(pieces, dtype=object)))


def _turned(region: BaseGeometry, pivot: Array, angle: float) -> BaseGeometry:
    c, s = np.cos(angle), np.sin(angle)
    return shapely.transform(region, lambda p: (p - pivot) @ np.array([[c, s], [-s, c]]) + pivot)


def _chains(ring: Array) -> list[Array]:
    """The closed ring (n, 2) about the origin as chains whose distance from it grows."""
    following = np.roll(ring, -1, axis=0)
    d = following - ring
    s = -(ring * d).sum(axis=1) / np.maximum((d * d).sum(axis=1), 1e-300)
    foot = (s > 1e-9) & (s < 1.0 - 1e-9)
    points = []
    for k in range(len(ring)):
        points.append(ring[k])
        if foot[k]:
            points.append(ring[k] + s[k] * d[k])
    p = np.array(points)
    rising = np.linalg.norm(np.roll(p, -1, axis=0), axis=1) >= np.linalg.norm(p, axis=1)
    turning = np.flatnonzero(rising != np.roll(rising, 1))
    if len(turning) == 0:
        return []
    chains = []
    for k, first in enumerate(turning):
        last = turning[(k + 1) % len(turning)]
        length = (last - first) % len(p)
        chain = p[(first + np.arange(length + 1)) % len(p)]
        chains.append(chain if rising[first] else chain[::-1])
    return chains


def _strip(chain: Array, begin: float, turn: float, tolerance: float, pivot: Array) -> Polygon:
    def at(points: Array, angle: float) -> Array:
        c, s = np.cos(angle), np.sin(angle)
        return np.asarray(points @ np.array([[c, s], [-s, c]]))

    def arc(point: Array, outside: bool) -> Array:
        radius = float(np.linalg.norm(point))
        step = 2.0 * np.sqrt(2.0 * tolerance / max(radius, tolerance))
        n = max(1, int(np.ceil(turn / min(step, 0.5))))
        if outside:
            angles = begin + (np.arange(n) + 0.5) * turn / n
            grow = 1.0 / np.cos(0.5 * turn / n)
        else:
            angles, grow = begin + np.arange(1, n) * turn / n, 1.0
        direction = np.arctan2(point[1], point[0]) + angles
        return np.asarray(radius * grow * np.stack([np.cos(direction), np.sin(direction)], axis=1))

    ring = [at(chain, begin), arc(chain[-1], True), at(chain[::-1], begin + turn)]
    ring.append(arc(chain[0], False)[::-1])
    return Polygon(np.concatenate(ring) + pivot)


def _revolved_slab(
    region: BaseGeometry, left: float, right: float, tolerance: float
) -> BaseGeometry:
    """(r, z) profile of a region (x, z) with y from left to right, turned about the z axis."""
    far, near = max(abs(left), abs(right)), max(left, -right, 0.0)
    low, high, a, b = trapezoids(region)

    def radii(k: IntArray, z: Array) -> tuple[Array, Array]:
        s = (z - low[k]) / (high[k] - low[k])
        first = a[k, 0] + s * (a[k, 1] - a[k, 0])
        last = b[k, 0] + s * (b[k, 1] - b[k, 0])
        nearest = np.maximum(np.maximum(first, -last), 0.0)
        return np.hypot(nearest, near), np.hypot(np.maximum(-first, last), far)

    made = subdivide(low, high, radii, tolerance)
    r = np.stack([made.inner[:, 0], made.outer[:, 0], made.outer[:, 1], made.inner[:, 1]], axis=1)
    z = np.stack([made.low, made.low, made.high, made.high], axis=1)
    return shapely.union_all(shapely.polygons(np.stack([r, z], axis=2)))


def trapezoids(region: BaseGeometry) -> tuple[Array, Array, Array, Array]:
    """A plane region cut at the heights of its vertices: low, high (n,), left and right (n, 2).

    left, right: abscissas at the lower and upper end of each trapezoid.
    """
    p, q = _edges(region)
    levels = np.unique(np.concatenate([p[:, 1], q[:, 1]]))
    levels = levels[np.append(True, np.diff(levels) > 1e-10)]
    p1, q1 = np.minimum(p[:, 1], q[:, 1]), np.maximum(p[:, 1], q[:, 1])
    columns: list[list[Array]] = [[], [], [], []]
    for low, high in pairwise(levels):
        middle = 0.5 * (low + high)
        crossing = (p1 < middle) & (q1 > middle)
        a, d = p[crossing], (q - p)[crossing]
        slope = d[:, 0] / d[:, 1]
        order = np.argsort(a[:, 0] + slope * (middle - a[:, 1]), kind="stable")
        ends = np.stack([a[:, 0] + slope * (h - a[:, 1]) for h in (low, high)], axis=1)[order]
        n = len(ends) // 2
        for column, value in zip(
            columns,
            (np.full(n, low), np.full(n, high), ends[0::2][:n], ends[1::2][:n]),
            strict=True,
        ):
            column.append(value)
    low, high, left, right = (np.concatenate(c) for c in columns)
    return low, high, left, right


def _edges(region: BaseGeometry) -> tuple[Array, Array]:
    """Ends p, q (n, 2) of all edges of a region's rings."""
    starts, stops = [], []
    for polygon in getattr(region, "geoms", [region]):
        for ring in (polygon.exterior, *polygon.interiors) if polygon.area > 0.0 else ():
            points = np.asarray(ring.coords)[:, :2]
            starts.append(points[:-1])
            stops.append(points[1:])
    return np.concatenate(starts), np.concatenate(stops)


def runs_of(profile: BaseGeometry, tolerance: float) -> Revolved:
    """A profile in (r, z) as runs; radii grow by at most `tolerance` [m]."""
    low, high, left, right = trapezoids(profile)
    runs = []
    open_: list[list[int]] = []
    by_low: dict[float, list[int]] = {}
    for k in range(len(low)):
        by_low.setdefault(float(low[k]), []).append(k)
    # Trapezoids stack into one column while exactly one stands on another and both share an edge.
    for level in sorted(by_low):
        fresh = by_low[level]
        standing = [c for c in open_ if high[c[-1]] == level]
        taken: set[int] = set()
        for column in standing:
            top = column[-1]
            fits = [
                k
                for k in fresh
                if k not in taken
                and abs(left[k, 0] - left[top, 1]) < 1e-6
                and abs(right[k, 0] - right[top, 1]) < 1e-6
            ]
            if len(fits) == 1:
                column.append(fits[0])
                taken.add(fits[0])
        open_ += [[k] for k in fresh if k not in taken]
    for column in open_:
        c = np.array(column)
        runs.append(make_runs(low[c], high[c], left[c], right[c], tolerance))
    return joined(runs)
