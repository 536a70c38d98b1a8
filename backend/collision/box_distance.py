"""Exact distance between oriented boxes by enumerating their features.

The closest points of two separated convex polyhedra lie on a vertex and a face, or on two edges.
Boxes have 8 vertices and 12 edges, so all cases are tried: free of GJK's tolerances, which is why
it decides where python-fcl only proposes.
"""

from __future__ import annotations

import numpy as np

from backend.collision import box_kernels, plane_kernels
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, IntArray


def distances(a: Boxes, b: Boxes) -> tuple[Array, Array]:
    """Distance of a[k] and b[k] with the closest points.

    Returns distance (k,) [m], negative (minus the penetration depth) on overlap, and points
    (k, 2, 3) on a and on b; on overlap both are one point near the middle of the overlap.
    """
    if len(a) != len(b):
        raise ValueError(f"pairs need equally many boxes, not {len(a)} and {len(b)}")
    every = np.arange(len(a))
    return pair_distances(a, b, every, every)


def pair_distances(a: Boxes, b: Boxes, i: IntArray, j: IntArray) -> tuple[Array, Array]:
    """The same for the pairs a[i[k]], b[j[k]]; i, j: (k,) indices."""
    found, points = box_kernels.distances(*_arrays(a), *_arrays(b), i, j)
    return found, points


def separations(a: Boxes, b: Boxes) -> Array:
    """Largest gap of a[k] and b[k] along the 15 separating axes: (k,) [m].

    A positive gap proves separation and bounds the distance from below; a negative one is minus
    the penetration depth.
    """
    if len(a) != len(b):
        raise ValueError(f"pairs need equally many boxes, not {len(a)} and {len(b)}")
    return np.asarray(box_kernels.separations(*_arrays(a), *_arrays(b)))


def lower_bounds(a: Boxes, b: Boxes) -> Array:
    """(n, m) lower bounds of the distances of all pairs, 0 where they may touch [m]."""
    return np.asarray(box_kernels.lower_bounds(*_arrays(a), *_arrays(b)))


def away(a: Boxes, b: Boxes, i: int, j: int) -> Array:
    """(3,) unit vector from b[j] to a[i] along the separating axis of the largest gap: on overlap
    the shortest way out.
    """
    normal = np.empty(3)
    one, two = (tuple(v[k].copy() for v in _arrays(boxes)) for boxes, k in ((a, i), (b, j)))
    plane_kernels.separating_plane(*one, *two, 0.0, normal)
    return normal


def _arrays(boxes: Boxes) -> tuple[Array, Array, Array]:
    return boxes.centers, boxes.rotations, boxes.half_extents
