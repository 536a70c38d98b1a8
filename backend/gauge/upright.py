"""Limit volumes over polygons: poles, buildings, roads, keep-out and keep-in areas, ceilings."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from shapely.geometry.base import BaseGeometry

from backend.errors import InputError
from backend.gauge.convex import Rectangle, convex_parts, cover, polygon_of
from backend.gauge.features import Area, Ceiling, KeepIn, Pole
from backend.gauge.volumes import Hull, LimitVolume, prism
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import Array


def pole_volume(pole: Pole, clearance: float, tolerance: float) -> LimitVolume:
    """A prism around a pole, with as many sides as keep within `tolerance` [m]; one box."""
    radius = pole.radius + clearance
    if not (radius > 0.0 and pole.height > 0.0):
        raise InputError(f"{pole.name}: radius or height is not more than 0; allowed is more.")
    sides = max(4, math.ceil(math.pi / math.acos(radius / (radius + tolerance))))
    angles = 2.0 * math.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1) * radius / math.cos(math.pi / sides)
    x, y, bottom = (float(v) for v in pole.base)
    center = np.array([x, y])
    # A prism's corners stand out a little from the square around the pole.
    square = Rectangle(center, np.array([1.0, 0.0]), np.abs(ring).max(axis=0))
    top = bottom + pole.height
    return LimitVolume(
        name=pole.name,
        kind="pole",
        state=pole.state,
        rule=f"{clearance:g} m around the pole",
        boxes=upright_boxes([square], bottom, top),
        hulls=(prism(ring + center, bottom, top),),
    )


def area_volume(area: Area, clearance: float, excess: float, most: int) -> LimitVolume:
    """Prisms over an area and all within `clearance` [m] of it; boxes as few as exceed that by
    `excess` [m], if `most` for a convex part are enough.

    Raises InputError for a polygon that is none, and a top that is not above the bottom.
    """
    polygon = polygon_of(area.polygon, area.name)
    _check_heights(area.name, area.bottom, area.top)
    _check_clearance(area.name, clearance)
    hulls, boxes = _upright(polygon, area.bottom, area.top, excess, most, clearance)
    what = {"building": "the building", "road": "the road", "keep_out": "a keep-out area"}
    return LimitVolume(
        name=area.name,
        kind=area.kind,
        state=area.state,
        rule=what[area.kind] + (f" and {clearance:g} m around it" if clearance else ""),
        boxes=boxes,
        hulls=hulls,
    )


def keep_in_volume(area: KeepIn, depth: float, excess: float, most: int) -> LimitVolume:
    """Everything outside an area, up to `depth` [m] around, above and below it.

    Above and below count from its bottom and top, or from the site's origin where it has neither.
    Outside every side of the area's convex hull stands one box, which does not reach into the area
    by anything; what the hull has beyond the area is made of prisms. Raises InputError.
    """
    polygon = polygon_of(area.polygon, area.name)
    given = [z for z in (area.bottom, area.top) if z is not None] or [0.0]
    if area.bottom is not None and area.top is not None:
        _check_heights(area.name, area.bottom, area.top)
    bottom, top = min(given) - depth, max(given) + depth
    around = polygon.convex_hull
    sides = [_beyond(a, b, depth) for a, b in _sides(around)]
    hulls = [prism(_ring(side), bottom, top) for side in sides]
    boxes = [upright_boxes(sides, bottom, top)]
    slabs: list[tuple[BaseGeometry, float, float]] = [(around.difference(polygon), bottom, top)]
    if area.top is not None:
        slabs.append((polygon, area.top, top))
    if area.bottom is not None:
        slabs.append((polygon, bottom, area.bottom))
    for shape, z0, z1 in slabs:
        more, around_more = _upright(shape, z0, z1, excess, most)
        hulls += more
        boxes.append(around_more)
    return LimitVolume(
        name=area.name,
        kind="keep_in",
        state=area.state,
        rule="outside the area that machines stay in",
        boxes=concatenated(boxes),
        hulls=tuple(hulls),
    )


def ceiling_volume(
    ceiling: Ceiling, depth: float, center: Array, radius: float, excess: float, most: int
) -> LimitVolume:
    """A slab `depth` [m] thick above a height, over the polygon or within `radius` of `center`."""
    bottom, top = ceiling.height, ceiling.height + depth
    if ceiling.polygon is None:
        square = Rectangle(center, np.array([1.0, 0.0]), np.full(2, radius))
        hulls: tuple[Hull, ...] = ()
        boxes = upright_boxes([square], bottom, top)
    else:
        polygon = polygon_of(ceiling.polygon, ceiling.name)
        hulls, boxes = _upright(polygon, bottom, top, excess, most)
    return LimitVolume(
        name=ceiling.name,
        kind="ceiling",
        state=ceiling.state,
        rule="above the height limit",
        boxes=boxes,
        hulls=hulls,
    )


def upright_boxes(rectangles: Iterable[Rectangle], bottom: float, top: float) -> Boxes:
    """Boxes over rectangles, between two heights [m]."""
    centers, rotations, halves = [], [], []
    for r in rectangles:
        centers.append([*r.center, (bottom + top) / 2.0])
        x, y = r.axis
        rotations.append([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]])
        halves.append([*r.half, (top - bottom) / 2.0])
    n = len(centers)
    return Boxes(
        np.array(centers).reshape(n, 3),
        np.array(rotations).reshape(n, 3, 3),
        np.array(halves).reshape(n, 3),
    )


def _upright(
    shape: BaseGeometry, bottom: float, top: float, excess: float, most: int, clearance: float = 0.0
) -> tuple[tuple[Hull, ...], Boxes]:
    """Prisms over the polygons of `shape`, and over all within `clearance` of them, 2 % more; boxes
    around both, whose corners exceed them by 0.42 of the clearance besides `excess` [m].
    """
    grown = shape
    if clearance > 0.0:
        grown = shape.buffer(clearance / math.cos(math.pi / 16.0), quad_segs=4)
    hulls = tuple(prism(part, bottom, top) for part in convex_parts(grown))
    by = clearance / math.cos(math.pi / 16.0)
    found = [Rectangle(r.center, r.axis, r.half + by) for r in cover(shape, excess, most)]
    return hulls, upright_boxes(found, bottom, top)


def _check_heights(name: str, bottom: float, top: float) -> None:
    if not bottom < top:
        raise InputError(f"{name}: top is {top}; allowed is more than bottom ({bottom}).")


def _check_clearance(name: str, clearance: float) -> None:
    if not clearance >= 0.0:
        raise InputError(f"{name}: clearance is {clearance}; allowed is at least 0.")


def _sides(hull: BaseGeometry) -> list[tuple[Array, Array]]:
    ring = convex_parts(hull)[0]
    return list(zip(ring, np.roll(ring, -1, axis=0), strict=True))


def _beyond(a: Array, b: Array, depth: float) -> Rectangle:
    """What lies right of the way from a to b, `depth` far and that much longer at both ends."""
    length = float(np.linalg.norm(b - a))
    axis = (b - a) / length
    outward = np.array([axis[1], -axis[0]])
    return Rectangle(
        (a + b) / 2.0 + outward * depth / 2.0, axis, np.array([length / 2.0 + depth, depth / 2.0])
    )


def _ring(r: Rectangle) -> Array:
    across = np.array([-r.axis[1], r.axis[0]])
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * r.half
    return np.asarray(r.center + signs @ np.stack([r.axis, across]))
