"""The zero-moment point, its distance to the edges of the support polygon, and edges' moments.

Yamashita and Kikuuwe 2025, Eqs. (1)-(3), of the whole articulated machine instead of two masses.
The ZMP is the point of the root's z = 0 plane about which the ground's wrench has no moment along
that plane. A machine turns over an edge as soon as the moment of the wrench about it would have to
be negative: the ground can only push. These moments are affine in accelerations and quadratic in
rates, so that along a path q(s) they are a sdd + b sd^2 + c.
"""

from __future__ import annotations

import numpy as np

from backend.spatial.types import Array
from backend.stability.dynamics import Wrench, ground_wrench, rest_wrench, wrench_of
from backend.stability.masses import MassModel
from backend.stability.polygon import Polygon


def zmp(
    model: MassModel,
    q: Array,
    qd: Array,
    qdd: Array,
    T_site_root: Array | None = None,
) -> Array:
    """(..., 2) in the root frame [m]; NaN where nothing presses the machine to the ground.

    The arguments are those of `ground_wrench`; the base stands.
    """
    return zmp_of(ground_wrench(model, q, qd, qdd, T_site_root))


def zmp_of(wrench: Wrench) -> Array:
    """(..., 2) of a wrench [m], root frame."""
    up = np.where(wrench.f[..., 2] > 0.0, wrench.f[..., 2], np.nan)
    return np.stack([-wrench.tau[..., 1] / up, wrench.tau[..., 0] / up], axis=-1)


def edge_distances(point: Array, support: Polygon) -> Array:
    """(..., k) signed, of points (..., 2) to the lines of the edges, positive inside [m]."""
    away = np.asarray(point, dtype=float)[..., None, :] - support.vertices
    return np.asarray((away * support.normals).sum(axis=-1))


def margin(point: Array, support: Polygon) -> Array:
    """(...) signed distance of the ZMP (..., 2) to the nearest edge, positive inside [m].

    Outside it is the largest overhang over an edge's line. Where there is no ZMP it is -inf.
    """
    nearest = edge_distances(point, support).min(axis=-1)
    return np.asarray(np.where(np.isnan(nearest), -np.inf, nearest))


def share(point: Array, support: Polygon) -> Array:
    """(...) how much of the way from the polygon's centre to an edge is left: 1 there, 0 on an
    edge, negative outside; for rectangles the nearest in this sense is the edge that tips first.
    """
    left = (edge_distances(point, support) / support.inradii).min(axis=-1)
    return np.asarray(np.where(np.isnan(left), -np.inf, left))


def moments_of(wrench: Wrench, support: Polygon) -> Array:
    """(..., k) moments of a wrench about the edges [N m]: normal force times the ZMP's distance."""
    n, p = support.normals, support.vertices
    # e = (n_y, -n_x) along the edge; e . tau - e . (p x f), of which only f_z counts.
    turning = wrench.tau[..., :2] @ np.stack([n[:, 1], -n[:, 0]])
    return np.asarray(turning - wrench.f[..., 2:] * (p * n).sum(axis=1))


def edge_moments(
    model: MassModel,
    support: Polygon,
    q: Array,
    qd: Array,
    qdd: Array,
    T_site_root: Array | None = None,
) -> Array:
    """(..., k) about each edge [N m], >= 0 where the machine does not tip over that edge.

    The arguments are those of `ground_wrench`; the base stands.
    """
    return moments_of(ground_wrench(model, q, qd, qdd, T_site_root), support)


def edge_moment_terms(
    model: MassModel,
    support: Polygon,
    q: Array,
    dq_ds: Array,
    ddq_dss: Array,
    T_site_root: Array | None = None,
) -> tuple[Array, Array, Array]:
    """(a, b, c), each (..., k): the moments along a path q(s) are a sdd + b sd^2 + c [N m].

    q, dq_ds, ddq_dss: (..., n) of the path and its derivatives by s; qd = dq_ds sd and
    qdd = dq_ds sdd + ddq_dss sd^2.
    """
    q, first, second = (np.asarray(x, dtype=float) for x in (q, dq_ds, ddq_dss))
    nothing, still = np.zeros(3), np.zeros_like(first)
    a = wrench_of(model, q, still, first, nothing)
    b = wrench_of(model, q, first, second, nothing)
    c = rest_wrench(model, q, T_site_root)
    return moments_of(a, support), moments_of(b, support), moments_of(c, support)
