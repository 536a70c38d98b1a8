"""Collision server: what is closest to each link's boxes, several pairs each.

Mäkinen 2021, Section 3.4, with his open problem answered: one closest pair for each link makes the
signal jump where faces are nearly parallel or two obstacles equally near (Section 5.2). Here every
link gets its k closest obstacles, and of each the corners that are about as near, so that what is
closest next is already there: a corner enters and leaves only `band` above the minimum of its pair.

All distances come from enumerating features, exact up to rounding, and never from GJK: python-fcl
over-estimates now and then, and is the peer that tests and benchmarks compare with (`peer`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.collision.box_distance import lower_bounds, pair_distances
from backend.collision.corner_kernels import corner_rows, patches
from backend.collision.kinds import BOXES
from backend.collision.scene import Scene
from backend.collision.search_kernels import search
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray

BAND = 0.05
"""Corners count that are at most this much farther away than the pair's closest points [m]."""
MOST = 8
"""Closest obstacles of each link, by default."""
_SAME = 1e-9  # distances nearer to each other than this are one [m]


@dataclass(frozen=True)
class Closest:
    """r rows, by link and ascending distance; the first of a link is its least distance.

    link, body: (r,) indices of the link's box and of the scene's names; feature: (r,) -1 for the
    closest points of the two bodies, 0-7 for the link's corner (bit k: sign along its axis k) with
    the body's nearest point, 8-15 for a box body's corner with the link's nearest point; distance:
    (r,) at least 0 [m]; depth: (r,) of the overlap of two boxes, else 0 [m]; touching: (r,);
    points: (r, 2, 3) on the link and on the body [m], the same where they touch.
    """

    link: IntArray
    body: IntArray
    feature: IntArray
    distance: Array
    depth: Array
    touching: BoolArray
    points: Array

    def __len__(self) -> int:
        return len(self.link)

    def least(self, links: int) -> Array:
        """(links,) the distance of each link, infinite where nothing is within reach [m]."""
        found = np.full(links, np.inf)
        np.minimum.at(found, self.link, self.distance)
        return found


def closest(scene: Scene, links: Boxes, reach: float, k: int = MOST, band: float = BAND) -> Closest:
    """The k closest obstacles of each link that are nearer than `reach` [m], with their corners.

    An obstacle is a box or a hull. Of a mesh or cloud, within `band` of its distance, each octant
    of the link finds the triangle or point closest to it, by the sign of the closest point along
    the link's axes. Then follow the corners of box pairs within `band` of their pair's distance,
    and the link's corners that are within `band` of its least distance to triangles and points.
    Where the closest points are a corner's, that corner's row stands for them. Raises ValueError
    unless k >= 1, reach and band >= 0.
    """
    if k < 1 or not (reach >= 0.0 and band >= 0.0):
        raise ValueError(f"k must be 1 or more, reach and band 0 or more, not {k}, {reach}, {band}")
    n = len(links)
    held = links.centers.copy(), links.rotations.copy(), links.half_extents.copy()
    counts, keys = np.zeros(n, np.int64), np.zeros((n, k), np.int64)
    items, distances = np.zeros((n, k), np.int64), np.zeros((n, k))
    found = counts, keys, items, distances, np.zeros((n, k, 2, 3))
    for one in scene.sets:
        wide = float(band) if one.patched else -1.0
        search(one.kind, one.tree.arrays, one.arrays, held, float(reach), wide, found)
    inside = _inside_hulls(scene, links)
    if not counts.any():
        return _closest(*inside)
    link, slot = np.nonzero(np.arange(k) < counts[:, None])
    body = keys[link, slot] // 8
    signed, points = distances[link, slot], found[4][link, slot]
    rows = link, body, np.full(len(link), -1), signed, points
    is_box = body < _boxes(scene)
    parts = [_box_corners(scene, held, rows, items[link, slot], is_box, band)]
    parts += [_surface_corners(scene, links, rows, ~is_box, band)]
    kept = ~_stood_for(rows, parts)
    joined = [tuple(v[kept] for v in rows), *parts, inside]
    return _closest(*(np.concatenate(column) for column in zip(*joined, strict=True)))


def pairs(boxes: Boxes, index: IntArray, reach: float) -> tuple[IntArray, Array, Array]:
    """Pairs of one machine's own bodies that are nearer than `reach` [m], ascending.

    index: (p, 2) the pairs that count. Returns (index (r, 2), distance (r,), negative on overlap,
    points (r, 2, 3)).
    """
    near = index[lower_bounds(boxes, boxes)[index[:, 0], index[:, 1]] <= reach]
    distance, points = pair_distances(boxes, boxes, near[:, 0].copy(), near[:, 1].copy())
    order = np.argsort(distance, kind="stable")
    order = order[distance[order] <= reach]
    return near[order], distance[order], points[order]


_Rows = tuple[IntArray, IntArray, IntArray, Array, Array]
"""link, body, feature, signed distance, points."""


def _boxes(scene: Scene) -> int:
    return len(scene.sets[0].centers) if scene.sets and scene.sets[0].kind == BOXES else 0


def _closest(
    link: IntArray, body: IntArray, feature: IntArray, signed: Array, points: Array
) -> Closest:
    order = np.lexsort((feature, signed, link))
    signed = signed[order]
    return Closest(
        link[order],
        body[order],
        feature[order],
        np.maximum(signed, 0.0),
        np.maximum(-signed, 0.0),
        signed <= 0.0,
        points[order],
    )


def _box_corners(
    scene: Scene,
    links: tuple[Array, Array, Array],
    rows: _Rows,
    items: IntArray,
    is_box: BoolArray,
    band: float,
) -> _Rows:
    kept = is_box & (rows[3] > 0.0)
    if not kept.any():
        return _none()
    one = scene.sets[0]
    link, body = rows[0][kept], rows[1][kept]
    row, feature, distance, points = patches(
        links, (one.centers, one.rotations, one.half_extents), (link, items[kept], rows[3][kept]),
        band,
    )  # fmt: skip
    return link[row], body[row], feature, distance, points


def _surface_corners(
    scene: Scene, links: Boxes, rows: _Rows, kept: BoolArray, band: float
) -> _Rows:
    """Corners of the links that have triangles or points near, but touch none."""
    least = np.full(len(links), np.inf)
    np.minimum.at(least, rows[0][kept], rows[3][kept])
    near = np.flatnonzero(np.isfinite(least) & (least > 0.0))
    if not len(near):
        return _none()
    # Boxes.corners() counts the last axis fastest; features count the first axis fastest.
    order = [0, 4, 2, 6, 1, 5, 3, 7]
    corners = np.ascontiguousarray(links.take(near).corners()[:, order].reshape(-1, 3))
    limits = np.repeat(least[near] + band, 8)
    distance, item = np.full(len(corners), np.inf), np.zeros(len(corners), np.int64)
    body, point = np.zeros(len(corners), np.int64), np.zeros_like(corners)
    for one in scene.sets:
        if one.kind == BOXES:
            continue
        before = distance.copy()
        corner_rows(corners, limits, one.kind, one.tree.arrays, one.arrays, distance, item, point)
        nearer = distance < before
        body[nearer] = one.body[item[nearer]]
    found = np.isfinite(distance)
    feature = np.tile(np.arange(8), len(near))[found]
    points = np.stack([corners, point], axis=1)[found]
    return np.repeat(near, 8)[found], body[found], feature, distance[found], points


def _stood_for(rows: _Rows, corners: list[_Rows]) -> BoolArray:
    """(r,) whether a corner of the same link and body is just as near."""
    link, body, _, signed, _ = rows
    stood = np.zeros(len(link), dtype=bool)
    if not len(link):
        return stood
    width = int(max(body.max(), *(part[1].max(initial=0) for part in corners))) + 1
    for part in corners:
        if not len(part[0]):
            continue
        key = part[0] * width + part[1]
        order = np.lexsort((part[3], key))
        key, distance = key[order], part[3][order]
        own = link * width + body
        # Of equal keys the first is the least: distances ascend within them.
        at = np.minimum(np.searchsorted(key, own), len(key) - 1)
        stood |= (key[at] == own) & (np.abs(distance[at] - signed) <= _SAME)
    return stood


def _inside_hulls(scene: Scene, links: Boxes) -> _Rows:
    """Links whose middle is inside of a convex hull: they overlap even far from all its faces."""
    parts = [_none()]
    if not scene.hulls:
        return parts[0]
    for planes, body in scene.hulls:
        heights = links.centers @ planes[:, :3].T - planes[:, 3]
        link = np.flatnonzero(heights.max(axis=1, initial=-np.inf) <= 0.0)
        at = np.repeat(links.centers[link][:, None], 2, axis=1)
        parts.append(
            (link, np.full(len(link), body), np.full(len(link), -1), np.zeros(len(link)), at)
        )
    return _join(parts)


def _none() -> _Rows:
    nothing = np.zeros(0, np.int64)
    return nothing, nothing, nothing, np.zeros(0), np.zeros((0, 2, 3))


def _join(parts: list[_Rows]) -> _Rows:
    link, body, feature, signed, points = (
        np.concatenate([part[c] for part in parts]) for c in range(5)
    )
    return link, body, feature, signed, points
