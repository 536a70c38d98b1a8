"""The compiled recursion of `dynamics`: places each body, then sums what its motion needs."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray


@njit(cache=True)
def wrenches(
    tree: tuple[IntArray, IntArray],
    frames: tuple[Array, Array, Array],
    bodies: tuple[Array, Array, Array],
    q: Array,
    qd: Array,
    qdd: Array,
    g: Array,
) -> Array:
    """(k, 6) force [N] above moment about the origin [N m] that k states of a machine need, root
    frame.

    tree: (B,) parents and joints; frames: (B, 3, 3) and (B, 3) of each body in its parent's at
    joint value 0, (B, 3) unit axes; bodies: (B,) masses, (B, 3) centres, (B, 3, 3) tensors; q, qd,
    qdd: (k, n); g: (k, 3), as in `masses` and `dynamics`.
    """
    parents, joints = tree
    R0, p0, axes = frames
    masses, coms, tensors = bodies
    count, k = len(masses), len(q)
    out = np.zeros((k, 6))
    R, p = np.zeros((count, 3, 3)), np.zeros((count, 3))
    w, dw, a = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 3))
    turned, axis = np.zeros((3, 3)), np.zeros(3)
    for i in range(k):
        for b in range(count):
            above, j = parents[b], joints[b]
            if above < 0:
                R[b], p[b] = R0[b], p0[b]
                w[b], dw[b], a[b] = 0.0, 0.0, 0.0
            else:
                _about(axes[b], np.sin(q[i, j]), np.cos(q[i, j]), turned)
                _carry(R, p, R0, p0, turned, above, b)
                for r in range(3):
                    axis[r] = 0.0
                    for c in range(3):
                        axis[r] += R[b, r, c] * axes[b, c]
                v, u = qd[i, j], qdd[i, j]
                x, y, z = p[b, 0] - p[above, 0], p[b, 1] - p[above, 1], p[b, 2] - p[above, 2]
                ax, ay, az = _carried(w[above], dw[above], x, y, z)
                a[b, 0], a[b, 1], a[b, 2] = a[above, 0] + ax, a[above, 1] + ay, a[above, 2] + az
                cx, cy, cz = _cross(
                    w[above, 0], w[above, 1], w[above, 2], axis[0] * v, axis[1] * v, axis[2] * v
                )
                dw[b, 0] = dw[above, 0] + axis[0] * u + cx
                dw[b, 1] = dw[above, 1] + axis[1] * u + cy
                dw[b, 2] = dw[above, 2] + axis[2] * u + cz
                for r in range(3):
                    w[b, r] = w[above, r] + axis[r] * v
            x, y, z = _turned(R[b], coms[b, 0], coms[b, 1], coms[b, 2])
            ax, ay, az = _carried(w[b], dw[b], x, y, z)
            fx = masses[b] * (a[b, 0] + ax - g[i, 0])
            fy = masses[b] * (a[b, 1] + ay - g[i, 1])
            fz = masses[b] * (a[b, 2] + az - g[i, 2])
            tx, ty, tz = _cross(x + p[b, 0], y + p[b, 1], z + p[b, 2], fx, fy, fz)
            sx, sy, sz = _spun(R[b], tensors[b], w[b], dw[b])
            out[i, 0] += fx
            out[i, 1] += fy
            out[i, 2] += fz
            out[i, 3] += tx + sx
            out[i, 4] += ty + sy
            out[i, 5] += tz + sz
    return out


@njit(cache=True)
def body_centres(
    tree: tuple[IntArray, IntArray], frames: tuple[Array, Array, Array], coms: Array, q: Array
) -> Array:
    """(B, k, 3) the bodies' centres of mass at q (k, n), root frame; others as in `wrenches`."""
    parents, joints = tree
    R0, p0, axes = frames
    count, k = len(parents), len(q)
    out = np.zeros((count, k, 3))
    R, p, turned = np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros((3, 3))
    for i in range(k):
        for b in range(count):
            above, j = parents[b], joints[b]
            if above < 0:
                R[b], p[b] = R0[b], p0[b]
            else:
                _about(axes[b], np.sin(q[i, j]), np.cos(q[i, j]), turned)
                _carry(R, p, R0, p0, turned, above, b)
            for r in range(3):
                out[b, i, r] = p[b, r]
                for c in range(3):
                    out[b, i, r] += R[b, r, c] * coms[b, c]
    return out


@njit(cache=True)
def _carry(R: Array, p: Array, R0: Array, p0: Array, turned: Array, above: int, b: int) -> None:
    """Place body b, turned in its own frame by (3, 3), on the body above it."""
    for r in range(3):
        p[b, r] = p[above, r]
        for c in range(3):
            p[b, r] += R[above, r, c] * p0[b, c]
            mixed = 0.0
            for s in range(3):
                for t in range(3):
                    mixed += R[above, r, s] * R0[b, s, t] * turned[t, c]
            R[b, r, c] = mixed


@njit(cache=True)
def _cross(
    a0: float, a1: float, a2: float, b0: float, b1: float, b2: float
) -> tuple[float, float, float]:
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


@njit(cache=True)
def _turned(R: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@njit(cache=True)
def _carried(w: Array, dw: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """dw x r + w x (w x r)."""
    vx, vy, vz = _cross(w[0], w[1], w[2], x, y, z)
    cx, cy, cz = _cross(w[0], w[1], w[2], vx, vy, vz)
    tx, ty, tz = _cross(dw[0], dw[1], dw[2], x, y, z)
    return cx + tx, cy + ty, cz + tz


@njit(cache=True)
def _spun(R: Array, tensor: Array, w: Array, dw: Array) -> tuple[float, float, float]:
    """I dw + w x I w, of a tensor in the frame R."""
    turned = R.T
    ix, iy, iz = _turned(tensor, *_turned(turned, w[0], w[1], w[2]))
    ix, iy, iz = _turned(R, ix, iy, iz)
    cx, cy, cz = _cross(w[0], w[1], w[2], ix, iy, iz)
    jx, jy, jz = _turned(tensor, *_turned(turned, dw[0], dw[1], dw[2]))
    jx, jy, jz = _turned(R, jx, jy, jz)
    return cx + jx, cy + jy, cz + jz


@njit(cache=True)
def _about(axis: Array, s: float, c: float, out: Array) -> None:
    """Rodrigues' rotation into out (3, 3)."""
    v = 1.0 - c
    x, y, z = axis[0], axis[1], axis[2]
    out[0, 0], out[0, 1], out[0, 2] = c + v * x * x, v * x * y - s * z, v * x * z + s * y
    out[1, 0], out[1, 1], out[1, 2] = v * x * y + s * z, c + v * y * y, v * y * z - s * x
    out[2, 0], out[2, 1], out[2, 2] = v * x * z - s * y, v * y * z + s * x, c + v * z * z
