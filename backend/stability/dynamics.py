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


class Wrench(NamedTuple):
    """f (..., 3) [N] and tau (..., 3) [N m] about the root's origin, root frame."""

    f: Array
    tau: Array


class Placed(NamedTuple):
    """Body frames in the root frame: R (B, ..., 3, 3), p (B, ..., 3) [m]; axes (B, ..., 3), of
    their joints; coms (B, ..., 3) [m].
    """

    R: Array
    p: Array
    axes: Array
    coms: Array


def placed(model: MassModel, q: Array) -> Placed:
    """The bodies at q (..., n) [rad]."""
    q = np.asarray(q, dtype=float)
    count, batch = len(model.masses), q.shape[:-1]
    R = np.empty((count, *batch, 3, 3))
    p = np.empty((count, *batch, 3))
    R0, p0 = model.T_parent_joint[:, :3, :3], model.T_parent_joint[:, :3, 3]
    s, v = np.sin(q), 1.0 - np.cos(q)
    for b in range(count):
        above, k = model.parents[b], model.joints[b]
        if above < 0:
            R[b], p[b] = R0[b], p0[b]
            continue
        x, y, z = model.axes[b]
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turned = (
            R0[b] + s[..., k, None, None] * (R0[b] @ K) + v[..., k, None, None] * (R0[b] @ K @ K)
        )
        R[b] = R[above] @ turned
        p[b] = R[above] @ p0[b] + p[above]
    lead = (slice(None), *([None] * len(batch)), slice(None), None)
    axes = (R @ model.axes[lead])[..., 0]
    coms = (R @ model.coms[lead])[..., 0] + p
    return Placed(R, p, axes, coms)


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
    return wrench_of(model, placed(model, q), qd, qdd, g)


def wrench_of(model: MassModel, at: Placed, qd: Array, qdd: Array, g: Array) -> Wrench:
    """The same for bodies that are placed already. g: (..., 3) in the root frame [m/s^2]."""
    qd, qdd, g = (np.asarray(x, dtype=float) for x in (qd, qdd, g))
    batch = np.broadcast_shapes(at.p.shape[1:-1], qd.shape[:-1], qdd.shape[:-1], g.shape[:-1])
    f, tau = np.zeros((*batch, 3)), np.zeros((*batch, 3))
    still = np.zeros(3)
    omega, alpha, origin = [still], [still], [still]  # by body; origin: acceleration of its frame
    for b, mass in enumerate(model.masses):
        above, k = model.parents[b], model.joints[b]
        w, dw, a = still, still, still
        if above >= 0:
            w0, dw0, z = omega[above], alpha[above], at.axes[b]
            r = at.p[b] - at.p[above]
            turn = qd[..., k, None] * z
            w = w0 + turn
            dw = dw0 + qdd[..., k, None] * z + cross(w0, turn)
            a = origin[above] + cross(dw0, r) + cross(w0, cross(w0, r))
            omega.append(w)
            alpha.append(dw)
            origin.append(a)
        c = at.coms[b] - at.p[b]
        force = mass * (a + cross(dw, c) + cross(w, cross(w, c)) - g)
        f += force
        tau += cross(at.coms[b], force)
        if above >= 0:
            tensor = at.R[b] @ model.tensors[b] @ np.swapaxes(at.R[b], -1, -2)
            spin = (tensor @ w[..., None])[..., 0]
            tau += (tensor @ dw[..., None])[..., 0] + cross(w, spin)
    return Wrench(f, tau)


def centre_of_mass(model: MassModel, q: Array) -> Array:
    """(..., 3) of everything [m], root frame. q: (..., n) [rad]."""
    coms = placed(model, q).coms
    return np.asarray(np.tensordot(model.masses, coms, 1) / model.total)


def cross(a: Array, b: Array) -> Array:
    """(..., 3) a x b; leading axes broadcast. numpy's own is slower."""
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.stack([x, y, z], axis=-1)
