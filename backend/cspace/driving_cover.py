"""The union of many convex pieces with holes, from the few of them that make up its edge."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from backend.cspace.driving_hidden import covering, exposed, outermost
from backend.cspace.minkowski import Pieces, polygons
from backend.spatial.types import Array, BoolArray, IntArray

_SPECK = 1e-6
"""A free place smaller than this counts as taken: rounding of the overlay can make such [m^2]."""

_GRID = 8
"""Samples of a free place along each side, from which the pieces to cut out first are chosen."""


def union(pieces: list[shapely.Polygon]) -> BaseGeometry:
    """The union as a Polygon or MultiPolygon; an empty Polygon for no pieces."""
    return shapely.union_all(pieces) if pieces else shapely.Polygon()


def cover(pieces: Pieces) -> BaseGeometry:
    """The union of all pieces.

    First of their outlines, holes filled. A free place within them lies in the holes of those
    outlines that lie in no other one; what all the pieces leave of it is cut out again.
    """
    if len(pieces) == 0:
        return shapely.Polygon()
    every = np.array(polygons(pieces.points, pieces.start), dtype=object)
    outer: IntArray = np.flatnonzero(outermost(pieces.points, pieces.start)).astype(np.int64)
    outline = _outline(pieces, every, outer)
    if not np.isin(outer, pieces.owner).any():
        return outline
    hole = _holes(pieces)
    owners = outer[np.isin(outer, pieces.owner)]
    free = _parts(union(list(shapely.intersection(every[owners], hole[owners]))))
    left = _left(free, pieces, every, hole)
    return shapely.difference(outline, union(left)) if left else outline


def _outline(pieces: Pieces, every: Array, outer: IntArray) -> BaseGeometry:
    """Union of the filled outlines `outer`, of which only the exposed ones are put together.

    The edge of the union consists of exposed edges alone. A hole among the exposed ones therefore
    is free as a whole or, where one that was left out lies in it, taken as a whole.
    """
    chosen = outer[exposed(pieces.points, pieces.start, outer)]
    made = union(list(every[chosen]))
    parts = []
    for part in _parts(made):
        rings = []
        for ring in part.interiors:
            inside = shapely.get_coordinates(shapely.point_on_surface(shapely.Polygon(ring)))
            if not covering(pieces.points, pieces.start, outer, inside).any():
                rings.append(ring)
        parts.append(shapely.Polygon(part.exterior, rings))
    return parts[0] if len(parts) == 1 else shapely.MultiPolygon(parts)


def _holes(pieces: Pieces) -> Array:
    """(p,) geometry of each piece's holes, None where there are none."""
    hole = np.full(len(pieces), None, dtype=object)
    rings = np.array(polygons(pieces.holes, pieces.hole_start), dtype=object)
    for k in np.unique(pieces.owner):
        mine = rings[pieces.owner == k]
        hole[k] = mine[0] if len(mine) == 1 else shapely.union_all(mine)
    return hole


def _left(
    places: list[shapely.Polygon], pieces: Pieces, every: Array, hole: Array
) -> list[shapely.Polygon]:
    """What all the pieces leave free of the places.

    The piece that covers most samples of a place is cut out of it first: mostly a few leave
    nothing. When none covers a sample, all that still touch the place are cut out.
    """
    left = []
    todo = [(place, np.arange(len(pieces))) for place in places]
    while todo:
        place, near = todo.pop()
        if place.area <= _SPECK:
            continue
        shapely.prepare(place)
        near = near[shapely.intersects(every[near], place)]
        taken = _taken(pieces, near, _samples(place))
        if not taken.any():
            rest = _remainder(place, every[near], hole[near])
            left += [g for g in _parts(rest) if g.area > _SPECK]
            continue
        best = int(np.argmax(taken.sum(axis=1)))
        rest = _without(place, every[near[best]], hole[near[best]])
        near = np.delete(near, best)
        todo += [(part, near) for part in _parts(rest)]
    return left


def _taken(pieces: Pieces, near: IntArray, samples: Array) -> BoolArray:
    """Whether piece near[k] covers each of the samples: (k, samples)."""
    taken = covering(pieces.points, pieces.start, near, samples)
    holes = np.flatnonzero(np.isin(pieces.owner, near))
    clear = covering(pieces.holes, pieces.hole_start, holes, samples)
    row = np.searchsorted(near, pieces.owner[holes])
    for k, n in enumerate(row):
        taken[n] &= ~clear[k]
    return taken


def _remainder(place: shapely.Polygon, every: Array, hole: Array) -> BaseGeometry:
    rest: BaseGeometry = place
    for k in np.flatnonzero(~shapely.covers(hole, place)):
        rest = _without(rest, every[k], hole[k])
    return rest


def _without(place: BaseGeometry, piece: BaseGeometry, hole: BaseGeometry | None) -> BaseGeometry:
    rest = shapely.difference(place, piece)
    return rest if hole is None else shapely.union(rest, shapely.intersection(place, hole))


def _samples(place: shapely.Polygon) -> Array:
    """Points (k, 2) of a place: a grid over its bounds, and one for certain."""
    west, south, east, north = place.bounds
    s = (np.arange(_GRID) + 0.5) / _GRID
    x, y = np.meshgrid(west + s * (east - west), south + s * (north - south))
    grid = np.stack([x.ravel(), y.ravel()], axis=1)
    sure = shapely.get_coordinates(shapely.point_on_surface(place))
    return np.concatenate([grid[shapely.contains_xy(place, grid)], sure])


def _parts(geometry: BaseGeometry) -> list[shapely.Polygon]:
    return [g for g in shapely.get_parts(geometry) if g.geom_type == "Polygon" and not g.is_empty]
