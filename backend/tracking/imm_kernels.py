"""The compiled sums of `imm`, track by track and model by model."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, BoolArray
from backend.tracking.motion import CT
from backend.tracking.motion_kernel import turned
from backend.tracking.records import PZ, TURN, VX, VY, VZ, YAW


@njit(cache=True, nogil=True)
def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


@njit(cache=True, nogil=True)
def mix(mean: Array, cov: Array, mode: Array, change: Array) -> tuple[Array, Array, Array]:
    """Mean (n, c, s), covariance (n, c, s, s) and probability (n, c) of c mixtures of r models.

    mean: (n, r, s); cov: (n, r, s, s); mode: (n, r); change: (r, c), model i's part in mixture j.
    """
    n, r, s = mean.shape
    c = change.shape[1]
    to_mean, to_cov, prior = np.zeros((n, c, s)), np.zeros((n, c, s, s)), np.empty((n, c))
    weight, off = np.empty(r), np.empty(s)
    for t in range(n):
        for j in range(c):
            total = 0.0
            for i in range(r):
                weight[i] = mode[t, i] * change[i, j]
                total += weight[i]
            prior[t, j] = total
            yaw = 0.0
            for i in range(r):
                weight[i] /= max(total, 1e-300)
                yaw += weight[i] * _wrapped(mean[t, i, YAW] - mean[t, 0, YAW])
                for x in range(s):
                    to_mean[t, j, x] += weight[i] * mean[t, i, x]
            to_mean[t, j, YAW] = mean[t, 0, YAW] + yaw
            for i in range(r):
                for x in range(s):
                    off[x] = mean[t, i, x] - to_mean[t, j, x]
                off[YAW] = _wrapped(off[YAW])
                P, one, w = to_cov[t, j], cov[t, i], weight[i]
                for x in range(s):
                    for y in range(s):
                        P[x, y] += w * (one[x, y] + off[x] * off[y])
    return to_mean, to_cov, prior


@njit(cache=True, nogil=True)
def linear(mean: Array, cov: Array, F: Array, Q: Array, model: int) -> None:
    """One linear model of all tracks forward, in place. F, Q: (s, s)."""
    n, s = mean.shape[0], mean.shape[2]
    # Most of F is zero: its entries, row by row.
    at, entries = np.empty((s * s, 2), np.int64), 0
    for x in range(s):
        for y in range(s):
            if F[x, y] != 0.0:
                at[entries, 0], at[entries, 1] = x, y
                entries += 1
    after, half = np.empty(s), np.empty((s, s))
    for t in range(n):
        P, x_mean = cov[t, model], mean[t, model]
        after[:] = 0.0
        half[:] = 0.0
        for e in range(entries):
            x, z = at[e, 0], at[e, 1]
            f = F[x, z]
            after[x] += f * x_mean[z]
            for y in range(s):
                half[x, y] += f * P[z, y]
        x_mean[:] = after
        P[:] = Q
        for e in range(entries):
            y, z = at[e, 0], at[e, 1]
            f = F[y, z]
            for x in range(s):
                P[x, y] += half[x, z] * f


@njit(cache=True, nogil=True)
def unscent(
    mean: Array, cov: Array, of_mean: Array, of_cov: Array, spread: float, dt: float, fade: float
) -> tuple[Array, Array]:
    """(n, s), (n, s, s) of the turning model through sigma points, at the roots of spread * cov.

    of_mean, of_cov: (2 s + 1,) weights of the middle, then of the points on either side. Only the
    velocity and the turn rate turn anything: the root begins with them, and all its other columns,
    which leave them as they are, move with the middle and are summed at once.
    """
    n, s = mean.shape
    to_mean, to_cov = np.zeros((n, s)), np.zeros((n, s, s))
    curved = len(_CURVED)
    aside = s - curved  # pairs of points that move with the middle
    points, off = np.empty((1 + 2 * curved, s)), np.empty(s)
    weight, weight_cov = np.empty(len(points)), np.empty(len(points))
    weight[:], weight_cov[:] = of_mean[1], of_cov[1]
    weight[0], weight_cov[0] = (
        of_mean[0] + 2 * aside * of_mean[1],
        of_cov[0] + 2 * aside * of_cov[1],
    )
    rest, column = np.empty((s, s)), np.empty(s)
    for t in range(n):
        for x in range(s):
            points[0, x] = mean[t, x]
            for y in range(s):
                rest[x, y] = spread * cov[t, x, y]
        for k in range(curved):
            _split(rest, _CURVED[k], column)
            for x in range(s):
                points[1 + k, x] = mean[t, x] + column[x]
                points[1 + curved + k, x] = mean[t, x] - column[x]
        for y in range(s):
            rest[PZ, y] += dt * rest[VZ, y]
        for x in range(s):
            rest[x, PZ] += dt * rest[x, VZ]
        there, P = turned(points, dt, fade), to_cov[t]
        for k in range(len(points)):
            for x in range(s):
                to_mean[t, x] += weight[k] * there[k, x]
        for x in range(s):
            for y in range(s):
                P[x, y] = 2.0 * of_cov[1] * rest[x, y]
        for k in range(len(points)):
            for x in range(s):
                off[x] = there[k, x] - to_mean[t, x]
            for x in range(s):
                part = weight_cov[k] * off[x]
                for y in range(s):
                    P[x, y] += part * off[y]
    return to_mean, to_cov


_CURVED = (VX, VY, TURN)
"""What turns, or turns other numbers: the motion is linear in all else."""


@njit(cache=True, nogil=True)
def _split(A: Array, k: int, column: Array) -> None:
    """Takes one column of a root out of A, in place: A = column column^T + what is left, which has
    nothing of number k. A direction without variance has none in it either.
    """
    s = len(A)
    if A[k, k] > 0.0:
        scale = 1.0 / np.sqrt(A[k, k])
        for x in range(s):
            column[x] = A[x, k] * scale
        for x in range(s):
            for y in range(s):
                A[x, y] -= column[x] * column[y]
    else:
        column[:] = 0.0
    A[k, :] = 0.0
    A[:, k] = 0.0


@njit(cache=True, nogil=True)
def forward(
    mean: Array,
    cov: Array,
    F: Array,
    Q: Array,
    points: tuple[Array, Array, float],
    dt: float,
    fade: float,
) -> None:
    """All models of all tracks by dt [s], in place. F, Q: (r, s, s); points: of_mean, of_cov and
    spread of `unscent`, for the turning model.
    """
    for model in range(mean.shape[1]):
        if model != CT:
            linear(mean, cov, F[model], Q[model], model)
            continue
        to_mean, to_cov = unscent(
            mean[:, CT].copy(), cov[:, CT].copy(), points[0], points[1], points[2], dt, fade
        )
        mean[:, CT] = to_mean
        cov[:, CT] = to_cov + Q[CT]


@njit(cache=True, nogil=True)
def advance(
    modes: tuple[Array, Array, Array],
    change: Array,
    F: Array,
    Q: Array,
    points: tuple[Array, Array, float],
    dt: float,
    fade: float,
    steps: int,
) -> tuple[Array, Array, Array]:
    """Mixed and taken forward by dt, `steps` times."""
    mean, cov, mode = modes
    for _ in range(steps):
        mean, cov, mode = mix(mean, cov, mode, change)
        forward(mean, cov, F, Q, points, dt, fade)
    return mean, cov, mode


@njit(cache=True, nogil=True)
def ahead_each(
    modes: tuple[Array, Array, Array],
    once: BoolArray,
    one: tuple[Array, Array, Array, float],
    many: tuple[Array, Array, Array, float],
    steps: int,
    points: tuple[Array, Array, float],
    fade: float,
) -> tuple[Array, Array]:
    """(n, s), (n, s, s) mixtures: of tracks that are `once` (n,) after one step, of the others
    after `steps`. one, many: change, F, Q and dt [s] of such a step, as of `advance`.
    """
    mean, cov, mode = modes
    n, r, s = mean.shape
    to_mean, to_cov = np.empty((n, s)), np.empty((n, s, s))
    for group in range(2):
        chosen = np.flatnonzero(once if group == 0 else ~once)
        if len(chosen) == 0:
            continue
        some = (mean[chosen], cov[chosen], mode[chosen])
        if group == 0:
            some = advance(some, one[0], one[1], one[2], points, one[3], fade, 1)
        else:
            some = advance(some, many[0], many[1], many[2], points, many[3], fade, steps)
        mixed, spread, _ = mix(some[0], some[1], some[2], np.ones((r, 1)))
        for k in range(len(chosen)):
            to_mean[chosen[k]], to_cov[chosen[k]] = mixed[k, 0], spread[k, 0]
    return to_mean, to_cov
