"""The compiled sums of `update`, track by track and model by model."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray
from backend.tracking.records import YAW

_TURN = 2.0 * np.pi


@njit(cache=True, nogil=True)
def compare(
    mean: Array, cov: Array, values: Array, noise: Array, h: IntArray
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """off (n, r, k, d), gain (n, r, s, d), S (n, r, d, d), likelihood (n, r, k), as of
    `update.Sight`; squared Mahalanobis distance (n, r, k) and log det S (n, r).

    mean: (n, r, s); cov: (n, r, s, s); values: (k, d); noise: (d,); h: (d,) measured numbers.
    """
    n, r, s = mean.shape
    k, d = values.shape
    off, gain, S = np.empty((n, r, k, d)), np.empty((n, r, s, d)), np.empty((n, r, d, d))
    likelihood, squared, log_det = np.empty((n, r, k)), np.empty((n, r, k)), np.empty((n, r))
    for t in range(n):
        for m in range(r):
            for a in range(d):
                for b in range(d):
                    S[t, m, a, b] = cov[t, m, h[a], h[b]]
                S[t, m, a, a] += noise[a] ** 2
            inverse, log_det[t, m] = _inverse(S[t, m])
            for x in range(s):
                for b in range(d):
                    value = 0.0
                    for a in range(d):
                        value += cov[t, m, x, h[a]] * inverse[a, b]
                    gain[t, m, x, b] = value
            for j in range(k):
                for a in range(d):
                    away = values[j, a] - mean[t, m, h[a]]
                    if h[a] == YAW:  # a box's yaw is known up to half a turn
                        away = (away + 0.5 * np.pi) % np.pi - 0.5 * np.pi
                    off[t, m, j, a] = away
                total = 0.0
                for a in range(d):
                    for b in range(d):
                        total += off[t, m, j, a] * inverse[a, b] * off[t, m, j, b]
                squared[t, m, j] = total
                likelihood[t, m, j] = np.exp(-0.5 * (total + log_det[t, m] + d * np.log(_TURN)))
    return off, gain, S, likelihood, squared, log_det


@njit(cache=True, nogil=True)
def _inverse(A: Array) -> tuple[Array, float]:
    """Inverse and log determinant of a positive definite matrix."""
    d = len(A)
    L, log_det = np.zeros((d, d)), 0.0
    for k in range(d):
        pivot = A[k, k]
        for z in range(k):
            pivot -= L[k, z] ** 2
        L[k, k] = np.sqrt(pivot)
        log_det += np.log(pivot)
        for x in range(k + 1, d):
            value = A[x, k]
            for z in range(k):
                value -= L[x, z] * L[k, z]
            L[x, k] = value / L[k, k]
    back = np.zeros((d, d))  # L^-1
    for c in range(d):
        back[c, c] = 1.0 / L[c, c]
        for x in range(c + 1, d):
            value = 0.0
            for z in range(c, x):
                value -= L[x, z] * back[z, c]
            back[x, c] = value / L[x, x]
    out = np.zeros((d, d))
    for a in range(d):
        for b in range(d):
            for z in range(max(a, b), d):
                out[a, b] += back[z, a] * back[z, b]
    return out, log_det


@njit(cache=True, nogil=True)
def update(
    mean: Array,
    cov: Array,
    mode: Array,
    sight: tuple[Array, Array, Array, Array],
    share: Array,
) -> tuple[Array, Array, Array]:
    """Mean, covariance and probability of every model after the detections.

    sight: off, gain, S and likelihood of `compare`; share: (n, k) probability that a detection is
    the track's.
    """
    off, gain, S, likelihood = sight
    n, r, s = mean.shape
    k, d = off.shape[2], off.shape[3]
    to_mean, to_cov, to_mode = mean.copy(), cov.copy(), np.empty((n, r))
    joint, shift, middle, half = np.empty(k), np.empty(d), np.empty((d, d)), np.empty((s, d))
    total = np.empty(k)
    for t in range(n):
        none, all_modes = 1.0, 0.0
        for j in range(k):
            none -= share[t, j]
            total[j] = 0.0
            for m in range(r):
                total[j] += mode[t, m] * likelihood[t, m, j]
        for m in range(r):
            missed, seen = none * mode[t, m], 0.0
            for j in range(k):
                joint[j] = share[t, j] * mode[t, m] * likelihood[t, m, j] / max(total[j], 1e-300)
                seen += joint[j]
            to_mode[t, m] = max(seen + missed, 1e-6)
            all_modes += to_mode[t, m]
            some = 0.0
            for a in range(d):
                shift[a] = 0.0
                for b in range(d):
                    middle[a, b] = 0.0
            for j in range(k):
                beta = joint[j] / max(seen + missed, 1e-300)
                some += beta
                if beta == 0.0:
                    continue
                for a in range(d):
                    shift[a] += beta * off[t, m, j, a]
                    for b in range(d):
                        middle[a, b] += beta * off[t, m, j, a] * off[t, m, j, b]
            for a in range(d):
                for b in range(d):
                    middle[a, b] -= shift[a] * shift[b] + some * S[t, m, a, b]
            K = gain[t, m]
            for x in range(s):
                for a in range(d):
                    to_mean[t, m, x] += K[x, a] * shift[a]
                    half[x, a] = 0.0
                    for b in range(d):
                        half[x, a] += K[x, b] * middle[b, a]
            P = to_cov[t, m]
            for x in range(s):
                for y in range(s):
                    for a in range(d):
                        P[x, y] += half[x, a] * K[y, a]
            for x in range(s):
                for y in range(x):
                    P[x, y] = P[y, x] = 0.5 * (P[x, y] + P[y, x])
        for m in range(r):
            to_mode[t, m] /= all_modes
    return to_mean, to_cov, to_mode
