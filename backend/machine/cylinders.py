"""Hydraulic cylinders and the bucket's linkage: what they sweep over a joint's whole range.

A barrel turns about a pin on one link and its rod ends at a pin on another. The bodies of a machine
are boxes fixed to links, so the sweep is expressed in the frame of one carrying link and fitted
together with that link's own mesh. The sweep is thinnest in the frame in which the cylinder turns
least (a boom cylinder: the boom).

Rod and bucket often meet over a four-bar linkage: a rocker pinned to the barrel's link and a tie
pinned to the bucket share a pin, and the rod ends at it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from backend.spatial import transform
from backend.spatial.types import Array, IntArray, frozen

SAMPLES = 49
"""Postures over a joint's range that keep every arc between two within 0.5 mm of its chord."""

CHORD = 3e-4  # [m] postures are left out where the others pass this close


@dataclass(frozen=True)
class Strut:
    """A part between two pins. triangles: (n, 3, 3) [m] in the part's own frame.

    pin: (3,) where it is pinned; toward: (3,) a point on its axis on the way to the other pin.
    hinge: (3,) unit direction of the pins, in the part's own frame.
    """

    triangles: Array
    pin: Array
    toward: Array
    hinge: Array

    def __post_init__(self) -> None:
        for name, shape in (
            ("triangles", (None, 3, 3)),
            ("pin", (3,)),
            ("toward", (3,)),
            ("hinge", (3,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), shape, name))
        if np.linalg.norm(np.cross(self.toward - self.pin, self.hinge)) < 1e-9:
            raise ValueError("toward must not lie on the pin's own axis")


@dataclass(frozen=True)
class Linkage:
    """The four-bar between the barrel's link and the rod's link.

    rocker_pivot: (3,) on the barrel's link; tie_pivot: (3,) on the rod's link [m]. The common pin
    is rocker_length from the one and tie_length from the other, on the side `side` (+1 left, -1
    right) of the line rocker pivot -> tie pivot, seen against the hinge's direction.
    """

    rocker_pivot: Array
    tie_pivot: Array
    rocker_length: float
    tie_length: float
    side: int
    rocker: Strut | None
    tie: Strut | None

    def __post_init__(self) -> None:
        for name in ("rocker_pivot", "tie_pivot"):
            object.__setattr__(self, name, frozen(getattr(self, name), (3,), name))
        if self.rocker_length <= 0.0 or self.tie_length <= 0.0:
            raise ValueError("rocker_length and tie_length must be positive")
        if self.side not in (-1, 1):
            raise ValueError("side must be 1 or -1")


@dataclass(frozen=True)
class Cylinder:
    """A hydraulic cylinder (or a pair, one Strut holding both). Links by their URDF names.

    barrel_pivot: (3,) in barrel_link; rod_pivot: (3,) in rod_link, None with a linkage [m].
    carried_by: the link in whose frame the bodies are. hinge: (3,) unit direction of the pins,
    in carried_by's frame. barrel, rod: None where only the pins are stated. closed_length [m]: from
    pin to pin where a stroke sensor reads 0; None for the shortest over the joint's range.
    """

    name: str
    barrel_link: str
    barrel_pivot: Array
    rod_link: str
    rod_pivot: Array | None
    carried_by: str
    hinge: Array
    barrel: Strut | None = None
    rod: Strut | None = None
    linkage: Linkage | None = None
    closed_length: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "barrel_pivot", frozen(self.barrel_pivot, (3,), "barrel_pivot"))
        object.__setattr__(self, "hinge", frozen(self.hinge, (3,), "hinge"))
        if (self.rod_pivot is None) == (self.linkage is None):
            raise ValueError("give either rod_pivot or a linkage")
        if (self.barrel is None) != (self.rod is None):
            raise ValueError("give both barrel and rod, or neither")
        if self.rod_pivot is not None:
            object.__setattr__(self, "rod_pivot", frozen(self.rod_pivot, (3,), "rod_pivot"))

    @property
    def has_bodies(self) -> bool:
        """Whether any part of it is stated, not only its pins."""
        bar = self.linkage
        of_bar = (None, None) if bar is None else (bar.rocker, bar.tie)
        return any(part is not None for part in (self.barrel, self.rod, *of_bar))

    @property
    def links(self) -> tuple[str, ...]:
        """The links whose poses decide where the cylinder is."""
        return tuple(dict.fromkeys((self.barrel_link, self.rod_link, self.carried_by)))


def strut_poses(cylinder: Cylinder, poses: Mapping[str, Array]) -> list[tuple[Strut, Array]]:
    """Where each part of the cylinder is: pairs of a part and T_carrier_part (k, 4, 4).

    poses: for each of `cylinder.links` its poses T_any_link (k, 4, 4) in one common frame. Raises
    ValueError when the linkage cannot close in one of them.
    """
    T_carrier_any = transform.inverse(poses[cylinder.carried_by])
    T_barrel = T_carrier_any @ poses[cylinder.barrel_link]
    T_rod = T_carrier_any @ poses[cylinder.rod_link]
    foot = _point(T_barrel, cylinder.barrel_pivot)
    parts: list[tuple[Strut | None, Array, Array]] = []  # its pin, and the way to the other
    linkage = cylinder.linkage
    if linkage is None:
        assert cylinder.rod_pivot is not None
        head = _point(T_rod, cylinder.rod_pivot)
    else:
        a, c = _point(T_barrel, linkage.rocker_pivot), _point(T_rod, linkage.tie_pivot)
        head = common_pin(
            a, c, linkage.rocker_length, linkage.tie_length, linkage.side, cylinder.hinge
        )
        parts += [(linkage.rocker, a, head - a), (linkage.tie, c, head - c)]
    parts += [(cylinder.barrel, foot, head - foot), (cylinder.rod, head, foot - head)]
    return [
        (strut, _placed(strut, pin, way, cylinder.hinge))
        for strut, pin, way in parts
        if strut is not None
    ]


def swept_triangles(cylinder: Cylinder, poses: Mapping[str, Array]) -> Array:
    """The surface (n, 3, 3) [m] that the cylinder sweeps, in the frame of `cylinder.carried_by`.

    poses: as in `strut_poses`, at k >= 2 neighbouring postures over the joint's range (`SAMPLES`).
    Between two postures each connected piece of a part is replaced by the convex hull of both, so
    that nothing of it is missed but the arc's rise over its chord.
    """
    swept: list[Array] = []
    for strut, T in strut_poses(cylinder, poses):
        for piece in connected(strut.triangles):
            corners = np.unique(piece.reshape(-1, 3), axis=0)
            moved = _needed(transform.apply(T, corners))
            swept.extend(_hull(np.concatenate(pair)) for pair in pairwise(moved))
    return np.concatenate(swept)


def stroke(cylinder: Cylinder, poses: Mapping[str, Array]) -> Array:
    """Distance (k,) [m] between the pins of barrel and rod as they are placed; `poses` as in
    `strut_poses`. `strokes` tells it from the pins alone.
    """
    (barrel, T_barrel), (rod, T_rod) = strut_poses(cylinder, poses)[-2:]
    return np.asarray(
        np.linalg.norm(_point(T_rod, rod.pin) - _point(T_barrel, barrel.pin), axis=-1)
    )


def common_pin(a: Array, c: Array, from_a: float, from_c: float, side: int, hinge: Array) -> Array:
    """The pin (k, 3) at `from_a` [m] from a (k, 3) and `from_c` from c, in the plane across hinge.

    Two circles' intersection; side +1 is the one to the left of a -> c seen against `hinge`. The
    offset along the hinge is a's. Raises ValueError where the circles do not meet.
    """
    d = (c - a) - ((c - a) @ hinge)[:, None] * hinge
    r = np.linalg.norm(d, axis=1)
    along = (from_a**2 - from_c**2 + r**2) / (2.0 * r)
    height2 = from_a**2 - along**2
    if (height2 < 0.0).any():
        raise ValueError("the linkage does not close over the joint's whole range")
    u = d / r[:, None]
    return np.asarray(
        a + along[:, None] * u + side * np.sqrt(height2)[:, None] * np.cross(hinge, u)
    )


def tube(radius: float, length: float, spread: float = 0.0, sections: int = 12) -> Array:
    """A solid round bar as triangles (n, 3, 3): from the origin along x, pins along y.

    The polygon encloses the circle. spread: for a pair of bars, half the distance between them [m].
    """
    angle = 2.0 * np.pi * (np.arange(sections) + 0.5) / sections
    ring = radius / np.cos(np.pi / sections) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ends = [np.column_stack([np.full(sections, x), ring]) for x in (0.0, length)]
    one = _hull(np.concatenate(ends))
    if spread == 0.0:
        return one
    offset = np.array([0.0, spread, 0.0])
    return np.concatenate([one - offset, one + offset])


def connected(triangles: Array) -> list[Array]:
    """The triangles (n, 3, 3) grouped by shared corners (0.01 mm)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners = np.round(triangles.reshape(-1, 3), 5)
    _, index = np.unique(corners, axis=0, return_inverse=True)
    faces: IntArray = index.reshape(-1, 3).astype(np.int64)
    rows, columns = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    size = int(faces.max()) + 1
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    count, label = connected_components(graph, directed=False)
    return [triangles[label[faces[:, 0]] == k] for k in range(int(count))]


def _needed(moved: Array) -> Array:
    """The rows of moved (k, n, 3) between which all n points run straight within CHORD."""
    kept, first = [0], 0
    for last in range(2, len(moved)):
        a, b = moved[first], moved[last]
        d = b - a
        size2 = np.maximum((d * d).sum(axis=1), 1e-18)
        between = moved[first + 1 : last] - a
        share = np.clip((between * d).sum(axis=2) / size2, 0.0, 1.0)
        off = np.linalg.norm(between - share[:, :, None] * d, axis=2).max()
        if off > CHORD:
            first = last - 1
            kept.append(first)
    return moved[[*kept, len(moved) - 1]]


def _point(T: Array, p: Array) -> Array:
    """T (k, 4, 4) applied to one point (3,) -> (k, 3)."""
    return np.asarray(T[:, :3, :3] @ p + T[:, :3, 3])


def _frame(x: Array, hinge: Array) -> Array:
    """Right-handed frames (k, 3, 3): first axis along x (k, 3), second nearest to `hinge`."""
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    y = hinge - (x @ hinge)[:, None] * x
    y = y / np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _placed(strut: Strut, pin: Array, direction: Array, hinge: Array) -> Array:
    """T (k, 4, 4) that puts the strut's pin at `pin` (k, 3) and its axis along `direction`."""
    own = _frame((strut.toward - strut.pin)[None], strut.hinge)[0]
    R = _frame(direction, hinge) @ own.T
    return transform.make(R, pin - R @ strut.pin)


def _hull(points: Array) -> Array:
    """The convex hull's triangles (n, 3, 3); the points' own triangles when they are flat."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except QhullError:
        k = np.arange(1, len(points) - 1)
        return points[np.stack([np.zeros_like(k), k, k + 1], axis=1)]
    return np.asarray(points[hull.simplices])
