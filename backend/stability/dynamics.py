"""The wrench that the ground must give an articulated machine (Newton-Euler), vectorised.

    f = sum m (a - g)        tau = sum c x m (a - g) + I alpha + omega x I omega

over all rigid bodies: tangential, centrifugal and Coriolis terms, rotational inertia, weight on any
slope. Everything in the root frame, about its origin; the base stands, or is accelerated along a
line. Leading axes of q, qd, qdd and T_site_root broadcast.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.spatial.types import Array
from backend.stability.masses import GRAVITY, MassModel
from backend.stability.wrench_kernel import body_centres, wrenches


class Wrench(NamedTuple):
    """f (..., 3) [N] and tau (..., 3) [N m] about the root's origin, root frame."""

    f: Array
    tau: Array


def centres(model: MassModel, q: Array) -> Array:
    """(B, ..., 3) centre of mass of each body [m], root frame. q: (..., n) [rad]."""
    q = np.asarray(q, dtype=float)
    rows = _rows(q, q.shape[:-1], q.shape[-1])
    found = body_centres(model.tree, model.frames, model.coms, rows)
    return np.asarray(found.reshape(len(model.masses), *q.shape[:-1], 3))


def down(T_site_root: Array | None) -> Array:
    """g (..., 3) [m/s^2] in the root frame: along the site's -z. None: level ground."""
    if T_site_root is None:
        return np.array([0.0, 0.0, -GRAVITY])
    return np.asarray(-GRAVITY * np.asarray(T_site_root, dtype=float)[..., 2, :3])


def ground_wrench(
    model: MassModel,
    q: Array,
    qd: Array,
    qdd: Array,
    T_site_root: Array | None = None,
    base_acceleration: Array | None = None,
) -> Wrench:
    """What the ground must give for this motion: q, qd, qdd (..., n) [rad, rad/s, rad/s^2].

    T_site_root: (..., 4, 4), level when None; base_acceleration: (..., 3) of the root [m/s^2], in
    the root frame; it stands when None.
    """
    g = down(T_site_root)
    if base_acceleration is not None:
        g = g - np.asarray(base_acceleration, dtype=float)
    return wrench_of(model, q, qd, qdd, g)


def wrench_of(model: MassModel, q: Array, qd: Array, qdd: Array, g: Array) -> Wrench:
    """The same in a field g (..., 3) [m/s^2], root frame; zero for what motion alone needs."""
    q, qd, qdd, g = (np.asarray(x, dtype=float) for x in (q, qd, qdd, g))
    n = q.shape[-1]
    batch = np.broadcast_shapes(q.shape[:-1], qd.shape[:-1], qdd.shape[:-1], g.shape[:-1])
    states = [_rows(x, batch, n) for x in (q, qd, qdd)]
    out = wrenches(
        model.tree,
        model.frames,
        (model.masses, model.coms, model.tensors),
        *states,
        _rows(g, batch, 3),
    ).reshape(*batch, 6)
    return Wrench(out[..., :3], out[..., 3:])


def rest_wrench(model: MassModel, q: Array, T_site_root: Array | None = None) -> Wrench:
    """What the ground must give at rest in q (..., n) [rad]; T_site_root: level when None."""
    still = np.zeros(np.shape(q))
    return wrench_of(model, q, still, still, down(T_site_root))


def _rows(values: Array, batch: tuple[int, ...], width: int) -> Array:
    """An own copy, never read-only: each mix of those would be compiled anew, in a live cycle."""
    rows = np.empty((*batch, width))
    rows[...] = values
    return rows.reshape(-1, width)


def centre_of_mass(model: MassModel, q: Array) -> Array:
    """(..., 3) of everything [m], root frame. q: (..., n) [rad]."""
    return np.asarray(np.tensordot(model.masses, centres(model, q), 1) / model.total)
