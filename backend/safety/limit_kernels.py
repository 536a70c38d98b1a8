"""Compiled loops of `limits`: what the rows of an `Approach` leave of each motion.

Along a single motion k by s in direction d the room shrinks by c s + 1/2 b s^2, c = -d slope_k and
b = max(-bend_kk, 0): negative bends would give room back, which is not counted.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray

APPROACHES = 1e-3  # slopes below this do not count as approaching [m/rad, m/m]
NEGLIGIBLE = 1e-4  # a motion that uses less room than this until it stands moves away [m]
BISECTIONS = 12
STILL = 0.01  # slower motions are taken for standing [rad/s, m/s]


@njit(cache=True)
def _used(c: float, b: float, s: float) -> float:
    """Room used by a motion of s >= 0, at least 0 [m]."""
    return max(c * s + 0.5 * b * s * s, 0.0)


@njit(cache=True)
def _slope(value: float) -> float:
    return 0.0 if 0.0 < value < APPROACHES else value


@njit(cache=True)
def _farthest(c: float, b: float, room: float) -> float:
    """The greatest s with c s + 1/2 b s^2 <= room, for every smaller s, too."""
    room = max(room, 0.0)
    root = np.sqrt(c * c + 2.0 * b * room)
    if c > 0.0:
        return 2.0 * room / (c + root)  # keeps its digits for small b
    return (root - c) / b if b > 0.0 else np.inf


@njit(cache=True)
def _speed(s: float, T: float, a: float) -> float:
    if s <= 0.0:
        return 0.0
    return 2.0 * s / (T + np.sqrt(T * T + 2.0 * s / a)) if s < np.inf else np.inf


@njit(cache=True)
def _beside(v: float, c: float, b: float, room: float, w: float, T: float, a: float) -> float:
    """The greatest speed, at most v, of a motion beside a partner that closes with w [m/s]:
    what it uses until it stands, and w (T + v / a), fit into the room. Rounded down.
    """
    low, high = 0.0, v
    for _ in range(BISECTIONS):
        taken = _used(c, b, v * T + v * v / (2.0 * a))
        if taken <= NEGLIGIBLE or taken + w * (T + v / a) <= room:
            low = v
        else:
            high = v
        if low == high:
            break
        v = 0.5 * (low + high)
    return low


@njit(cache=True)
def _coasting(slope: Array, bend: Array, rates: Array, T: Array, a: Array, wish: Array) -> Array:
    """(m,) room that the present motions use until they stand, beyond what `wish` asks for [m]."""
    used = np.zeros(len(rates))
    for k in range(len(rates)):
        speed = abs(rates[k])
        if speed < STILL:
            continue
        d = 1.0 if rates[k] > 0.0 else -1.0
        c, b = _slope(-d * slope[k]), max(-bend[k, k], 0.0)
        used[k] = _used(c, b, speed * T[k] + speed * speed / (2.0 * a[k]))
        if wish[k] * d > 0.0:
            asked = abs(wish[k])
            used[k] = max(used[k] - _used(c, b, asked * T[k] + asked**2 / (2.0 * a[k])), 0.0)
    return used


@njit(cache=True)
def single(
    room: Array,
    slope: Array,
    bend: Array,
    closing: Array,
    rates: Array,
    full: Array,
    T: Array,
    a: Array,
    share: float,
) -> tuple[Array, IntArray]:
    """(speed (m, 2), row (m, 2)): the greatest speed of each motion alone in its negative and its
    positive direction, at most full, and the row that binds, -1 where none does.
    """
    m = len(full)
    speed, row = np.empty((m, 2)), np.full((m, 2), -1)
    for k in range(m):
        speed[k] = full[k]
    nothing = np.zeros(m)
    for r in range(len(room)):
        rest = _coasting(slope[r], bend[r], rates, T, a, nothing)
        total = rest.sum()
        for k in range(m):
            for side in range(2):
                d = 1.0 if side == 1 else -1.0
                c, b = _slope(-d * slope[r, k]), max(-bend[r, k, k], 0.0)
                if c <= 0.0 and b <= 0.0:
                    continue
                same = rates[k] * d > 0.0
                coasting = total - rest[k] if same else total
                v = min(
                    _speed(_farthest(c, b, share * room[r] - coasting), T[k], a[k]), speed[k, side]
                )
                v = _beside(v, c, b, room[r] - coasting, closing[r], T[k], a[k])
                if v < speed[k, side]:
                    speed[k, side], row[k, side] = v, r
    return speed, row


@njit(cache=True)
def _part(linear: float, square: float, room: float) -> float:
    """The greatest q in 0..1 with q linear + q^2 square <= room."""
    if linear + square <= room:
        return 1.0
    if room <= 0.0:
        return 0.0
    return 2.0 * room / (linear + np.sqrt(linear * linear + 4.0 * square * room))


@njit(cache=True)
def together(
    wish: Array,
    room: Array,
    slope: Array,
    bend: Array,
    closing: Array,
    rates: Array,
    T: Array,
    a: Array,
    share: float,
) -> tuple[Array, IntArray]:
    """(speed (m,), row (m,)): what is left of `wish` (m,) when all its motions happen at once.

    In every row the approaching motions are cut in proportion of their stopping distances; motions
    that do not approach are not touched, and give nothing back.
    """
    m = len(wish)
    speed, row = np.abs(wish), np.full(m, -1)
    s, used = np.empty(m), np.empty(m)
    for k in range(m):
        s[k] = speed[k] * T[k] + speed[k] ** 2 / (2.0 * a[k])
    for r in range(len(room)):
        linear = square = slowest = 0.0
        for k in range(m):
            used[k] = 0.0
            if s[k] == 0.0:
                continue
            d = 1.0 if wish[k] > 0.0 else -1.0
            c, b = _slope(-d * slope[r, k]), max(-bend[r, k, k], 0.0)
            used[k] = _used(c, b, s[k])
            if used[k] <= NEGLIGIBLE:
                used[k] = 0.0
            else:
                # c < 0: c q s + 1/2 b q^2 s^2 <= q^2 (c s + 1/2 b s^2) for q in 0..1.
                linear += max(c, 0.0) * s[k]
                square += used[k] - max(c, 0.0) * s[k]
                slowest = max(slowest, T[k] + abs(wish[k]) / a[k])
        if linear + square == 0.0:
            continue
        for k in range(m):
            for after in range(k + 1, m):
                if used[k] > 0.0 or used[after] > 0.0:
                    both = -bend[r, k, after] * s[k] * s[after]
                    both *= np.sign(wish[k]) * np.sign(wish[after])
                    if both > 0.0 and used[k] > 0.0 and used[after] > 0.0:
                        square += both
                    elif both > 0.0:
                        linear += both
        coasting = _coasting(slope[r], bend[r], rates, T, a, wish).sum()
        q = _part(linear, square, share * room[r] - coasting)
        if closing[r] > 0.0 and linear + square + closing[r] * slowest > room[r] - coasting:
            low, high = 0.0, q
            for _ in range(BISECTIONS):
                slowest = 0.0
                for k in range(m):
                    if used[k] > 0.0:
                        slowest = max(slowest, T[k] + _speed(q * s[k], T[k], a[k]) / a[k])
                fits = linear * q + square * q * q + closing[r] * slowest <= room[r] - coasting
                low, high = (q, high) if fits else (low, q)
                if low == high:
                    break
                q = 0.5 * (low + high)
            q = low
        if q >= 1.0:
            continue
        for k in range(m):
            if used[k] > 0.0:
                v = _speed(q * s[k], T[k], a[k])
                if v < speed[k]:
                    speed[k], row[k] = v, r
    return speed * np.sign(wish), row
