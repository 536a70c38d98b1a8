"""Compiled loops of `approach`: one row for every corner that a motion could bring too close."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.collision.plane_kernels import separating_plane
from backend.spatial.types import Array, BoolArray, IntArray

NEAR = 1.0  # gaps below this are measured exactly [m]


@njit(cache=True)
def _cross(a: Array, b: Array, out: Array) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@njit(cache=True)
def _corner(c: Array, R: Array, h: Array, which: int, out: Array) -> None:
    for x in range(3):
        out[x] = c[x]
        for k in range(3):
            out[x] += R[x, k] * (h[k] if which >> k & 1 else -h[k])


@njit(cache=True)
def _closing(
    n: Array, c: Array, R: Array, h: Array, v: Array, w: Array, horizons: Array
) -> tuple[float, float]:
    """(height of a box along n [m], speed at which that height grows [m/s], at least 0).

    v, w: (3,) velocity of the box's centre and its angular velocity [m/s, rad/s]. Every corner
    counts, so that one that overtakes the foremost within the horizons [s] is not missed.
    """
    y, r, turned = np.empty(3), np.empty(3), np.empty(3)
    top = -np.inf
    for which in range(8):
        _corner(c, R, h, which, y)
        top = max(top, _dot(n, y))
    speed = 0.0
    for which in range(8):
        _corner(c, R, h, which, y)
        for x in range(3):
            r[x] = y[x] - c[x]
        _cross(w, r, turned)
        rise = _dot(n, v) + _dot(n, turned)
        for horizon in horizons:
            speed = max(speed, (_dot(n, y) - top) / horizon + rise)
    return top, speed


@njit(cache=True)
def rows(
    own: tuple[Array, Array, Array],
    other: tuple[Array, Array, Array],
    twists: tuple[Array, Array],
    least: Array,
    groups: tuple[IntArray, IntArray],
    moves: BoolArray,
    axes: Array,
    origins: Array,
    base: tuple[Array, Array, Array, float],
    reach: Array,
    keep: float,
    horizons: Array,
    longest: float,
    share: float,
) -> tuple[IntArray, Array, Array, Array, Array]:
    """(index (r, 2), room (r,), slope (r, m), bend (r, m, m), closing (r,)); see `Approach`.

    own, other: centers, rotations, half_extents, of bodies and then of hulls, boxes about all
    bodies of a link; twists: velocities (k, 3) of the other boxes' centres and their angular
    velocities; least: (k,) speed at which each may come nearer whatever it does now [m/s]; groups:
    the hull of each own and of each other box, a hull's own number for hulls.
    Hulls that are near each other are looked into, body by body.
    moves: (boxes, n); axes, origins: (n, 3) of the joints; base: ahead (3,), up (3,), origin (3,),
    gauge [m]; reach: (m,) how far each motion goes before it stands, from full speed; keep: the gap
    that must stay [m]; longest: stopping time [s]; share: part of the room that may be used.
    """
    ca, Ra, ha = own
    cb, Rb, hb = other
    m = axes.shape[0] + 2
    most_rows = ca.shape[0] * cb.shape[0] * 8
    index, room = np.empty((most_rows, 2), np.int64), np.empty(most_rows)
    slope, bend = np.empty((most_rows, m)), np.empty((most_rows, m, m))
    closing = np.empty(most_rows)
    count = 0
    normal, x = np.empty(3), np.empty((8, 3))
    J, K, most = np.empty((8, m, 3)), np.empty((8, m, m, 3)), np.empty(8)
    near = np.zeros((ca.shape[0], cb.shape[0]), np.bool_)
    for i in range(ca.shape[0] - 1, -1, -1):  # hulls first
        hull_i = groups[0][i]
        known = False
        for j in range(cb.shape[0] - 1, -1, -1):
            hull_j = groups[1][j]
            is_hull = hull_i == i
            if is_hull != (hull_j == j) or not (is_hull or near[hull_i, hull_j]):
                continue
            gap = separating_plane(
                ca[i], Ra[i], ha[i], cb[j], Rb[j], hb[j], 0.0 if is_hull else NEAR, normal
            )
            if is_hull and gap < NEAR:
                near[i, j] = True
                continue
            if not known:
                known = True
                for which in range(8):
                    _corner(ca[i], Ra[i], ha[i], which, x[which])
                    _motions(x[which], moves[i], axes, origins, base, J[which], K[which])
                    most[which] = _most(J[which], K[which], reach)
            top, speed = _closing(normal, cb[j], Rb[j], hb[j], twists[0][j], twists[1][j], horizons)
            speed = max(speed, least[j])
            n0, n1, n2 = normal[0], normal[1], normal[2]
            for which in range(8):
                # On overlap the plane cuts both boxes: the gap is that of the pair.
                left = n0 * x[which, 0] + n1 * x[which, 1] + n2 * x[which, 2] - top
                left = (left if gap > 0.0 else gap) - keep
                if most[which] <= share * left and most[which] <= left - speed * longest:
                    continue
                used = 0.0
                for k in range(m):
                    c = n0 * J[which, k, 0] + n1 * J[which, k, 1] + n2 * J[which, k, 2]
                    slope[count, k] = c
                    used += abs(c) * reach[k]
                    for after in range(k, m):
                        b = n0 * K[which, k, after, 0] + n1 * K[which, k, after, 1]
                        b += n2 * K[which, k, after, 2]
                        bend[count, k, after] = bend[count, after, k] = b
                        used += (0.5 if after == k else 1.0) * abs(b) * reach[k] * reach[after]
                if used <= share * left and used <= left - speed * longest:
                    continue
                index[count, 0], index[count, 1] = i, j
                room[count], closing[count] = left, speed
                count += 1
    return (
        index[:count].copy(),
        room[:count].copy(),
        slope[:count].copy(),
        bend[:count].copy(),
        closing[:count].copy(),
    )


@njit(cache=True)
def _motions(
    x: Array,
    moves: BoolArray,
    axes: Array,
    origins: Array,
    base: tuple[Array, Array, Array, float],
    J: Array,
    K: Array,
) -> None:
    """Writes how a corner x (3,) moves: J (m, 3) first and K (m, m, 3) second derivatives.

    K_kl = z_k x J_l for a joint k that carries the joint l; the base carries them all.
    """
    ahead, up, root, gauge = base
    n = axes.shape[0]
    r, turned = np.empty(3), np.empty(3)
    J[:] = 0.0
    K[:] = 0.0
    for k in range(n):
        if moves[k]:
            for d in range(3):
                r[d] = x[d] - origins[k, d]
            _cross(axes[k], r, J[k])
    for d in range(3):
        r[d] = x[d] - root[d]
    _cross(up, r, turned)
    for k in range(n):
        if moves[k]:
            for after in range(k, n):
                _cross(axes[k], J[after], K[k, after])
                K[after, k] = K[k, after]
    # Of the tracks: v = (left + right) / 2 forwards, omega = (right - left) / gauge.
    spin = np.empty((2, 3))
    for side in range(2):
        turn = (-1.0 if side == 0 else 1.0) / gauge
        for d in range(3):
            spin[side, d] = turn * up[d]
            J[n + side, d] = 0.5 * ahead[d] + turn * turned[d]
    for side in range(2):
        for k in range(n):
            _cross(spin[side], J[k], K[n + side, k])
            K[k, n + side] = K[n + side, k]
    for side in range(2):
        for second in range(2):
            _cross(spin[side], J[n + second], K[n + side, n + second])
    for d in range(3):  # forwards and turning: half of each order
        mixed = 0.5 * (K[n, n + 1, d] + K[n + 1, n, d])
        K[n, n + 1, d] = K[n + 1, n, d] = mixed


@njit(cache=True)
def _most(J: Array, K: Array, reach: Array) -> float:
    """The farthest that a corner can come within `reach` of all motions [m]."""
    most = 0.0
    for k in range(len(reach)):
        most += np.sqrt(_dot(J[k], J[k])) * reach[k]
        for after in range(len(reach)):
            length = np.sqrt(_dot(K[k, after], K[k, after]))
            most += 0.5 * length * reach[k] * reach[after]
    return most
