"""The inner loops of annealing boxes, compiled: what is outside of them, and what sticks out.

A box is c (3,), R (3, 3), h (3,): {c + R q: |q| <= h}. The field is coarse on purpose, so that it
stays in the processor's cache: int8 in UNITs [m] above the tolerance, at origin + index * step.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import AnyArray, Array, IntArray

UNIT = 0.0025  # [m]
_FAR = 0.31  # [m] from here on the field is cut off
_MISSING = 0.02  # [m] cost of a point outside, and of sticking out, before how far counts
_SMALLEST = 0.01  # [m] half extents
_REFRESH = 300  # moves between two updates of the weights and the list of points outside


@njit(cache=True, nogil=True, fastmath=True)  # type: ignore[untyped-decorator]
def outside(points: Array, R: Array, c: Array, h: Array, out: Array) -> None:
    """out (n,): how far points (n, 3) are outside of a box, across its nearest side; 0 inside."""
    for i in range(len(points)):
        x, y, z = points[i, 0] - c[0], points[i, 1] - c[1], points[i, 2] - c[2]
        most = 0.0
        for a in range(3):
            most = max(most, abs(x * R[0, a] + y * R[1, a] + z * R[2, a]) - h[a])
        out[i] = most


@njit(cache=True, nogil=True, fastmath=True)  # type: ignore[untyped-decorator]
def _nearest(field: AnyArray, origin: Array, step: float, x: float, y: float, z: float) -> float:
    nx, ny, nz = field.shape
    i, j = int((x - origin[0]) / step + 0.5), int((y - origin[1]) / step + 0.5)
    k = int((z - origin[2]) / step + 0.5)
    if i < 0 or j < 0 or k < 0 or i >= nx or j >= ny or k >= nz:
        return _FAR + 0.01
    return float(field[i, j, k] * UNIT)


@njit(cache=True, nogil=True, fastmath=True)  # type: ignore[untyped-decorator]
def _between(field: AnyArray, origin: Array, step: float, x: float, y: float, z: float) -> float:
    nx, ny, nz = field.shape
    fx, fy, fz = (x - origin[0]) / step, (y - origin[1]) / step, (z - origin[2]) / step
    if fx < 0 or fy < 0 or fz < 0 or fx >= nx - 1 or fy >= ny - 1 or fz >= nz - 1:
        return _FAR + 0.01
    i, j, k = int(fx), int(fy), int(fz)
    fx, fy, fz = fx - i, fy - j, fz - k
    gx, gy, gz = 1.0 - fx, 1.0 - fy, 1.0 - fz
    near = gy * (field[i, j, k] * gz + field[i, j, k + 1] * fz)
    near += fy * (field[i, j + 1, k] * gz + field[i, j + 1, k + 1] * fz)
    far = gy * (field[i + 1, j, k] * gz + field[i + 1, j, k + 1] * fz)
    far += fy * (field[i + 1, j + 1, k] * gz + field[i + 1, j + 1, k + 1] * fz)
    return float((near * gx + far * fx) * UNIT)


@njit(cache=True, nogil=True, fastmath=True)  # type: ignore[untyped-decorator]
def sticking_out(
    field: AnyArray,
    origin: Array,
    step: float,
    spacing: float,
    R: Array,
    c: Array,
    h: Array,
    limit: float,
) -> float:
    """The area of a box's surface above the tolerance, times how far above [m^3].

    Cells of a face are quartered down to `spacing` [m] where they may be above. Gives up where the
    sum exceeds `limit`.
    """
    total, slack = 0.0, 0.9 * step
    stack = np.empty((64, 4))
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        nu = max(1, int(np.ceil(2.0 * h[u] / (8.0 * spacing))))
        nv = max(1, int(np.ceil(2.0 * h[v] / (8.0 * spacing))))
        du, dv = 2.0 * h[u] / nu, 2.0 * h[v] / nv
        for cell in range(2 * nu * nv):
            w = h[a] if cell % 2 else -h[a]
            stack[0, 0] = -h[u] + du * ((cell // 2) % nu + 0.5)
            stack[0, 1] = -h[v] + dv * ((cell // 2) // nu + 0.5)
            stack[0, 2], stack[0, 3] = du, dv
            top = 1
            while top > 0:
                top -= 1
                p, q, eu, ev = stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3]
                x = c[0] + R[0, a] * w + R[0, u] * p + R[0, v] * q
                y = c[1] + R[1, a] * w + R[1, u] * p + R[1, v] * q
                z = c[2] + R[2, a] * w + R[2, u] * p + R[2, v] * q
                reach = 0.5 * np.sqrt(eu * eu + ev * ev) + slack
                d = _nearest(field, origin, step, x, y, z)
                if -d >= reach:
                    continue
                if reach < d < _FAR:
                    total += eu * ev * (d + _MISSING)
                    continue
                cut_u, cut_v = eu > 1.01 * spacing, ev > 1.01 * spacing
                if not (cut_u or cut_v):
                    d = _between(field, origin, step, x, y, z)
                    if d > 0.0:
                        total += max(eu, 0.01) * max(ev, 0.01) * (d + _MISSING)
                    continue
                for k in range(4):
                    if (k % 2 and not cut_u) or (k // 2 and not cut_v):
                        continue
                    stack[top, 0] = p + ((0.5 if k % 2 else -0.5) * eu / 2.0 if cut_u else 0.0)
                    stack[top, 1] = q + ((0.5 if k // 2 else -0.5) * ev / 2.0 if cut_v else 0.0)
                    stack[top, 2] = eu / 2.0 if cut_u else eu
                    stack[top, 3] = ev / 2.0 if cut_v else ev
                    top += 1
        if total > limit:
            return total
    for k in range(8):
        p, q, w = h[0] * (k % 2 * 2 - 1), h[1] * (k // 2 % 2 * 2 - 1), h[2] * (k // 4 * 2 - 1)
        x = c[0] + R[0, 0] * p + R[0, 1] * q + R[0, 2] * w
        y = c[1] + R[1, 0] * p + R[1, 1] * q + R[1, 2] * w
        z = c[2] + R[2, 0] * p + R[2, 1] * q + R[2, 2] * w
        d = _between(field, origin, step, x, y, z)
        if d > 0.0:
            total += 0.0008 * (d + 0.2 * _MISSING)
    return total


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _turn(R: Array, axis: int, angle: float) -> None:
    """Turn a box's axes about one of them, in place."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    cosine, sine = np.cos(angle), np.sin(angle)
    for b in range(3):
        p, q = R[b, u], R[b, v]
        R[b, u], R[b, v] = cosine * p + sine * q, cosine * q - sine * p


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _move_side(R: Array, c: Array, h: Array, a: int, sign: float, by: float) -> None:
    """Move the side of axis a at its low (-1) or high (1) end outward by `by` [m], in place."""
    by = max(by, 2.0 * (_SMALLEST - h[a]))
    h[a] += by / 2.0
    for b in range(3):
        c[b] += sign * by / 2.0 * R[b, a]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _either() -> float:
    return 1.0 if np.random.random() < 0.5 else -1.0  # noqa: NPY002


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _vary(R: Array, c: Array, h: Array, draw: float) -> None:
    """Vary a box in place by a random length, 3 to 150 mm. draw: 0..1, what: sides, place, turn
    about the middle or a corner, all at once."""
    scale = np.exp(np.random.uniform(np.log(0.003), np.log(0.15)))  # noqa: NPY002
    a = np.random.randint(3)  # noqa: NPY002
    if draw < 0.42:
        for _ in range(1 if draw < 0.29 else 2):
            by = 2.0 * scale * np.random.normal()  # noqa: NPY002
            _move_side(R, c, h, np.random.randint(3), _either(), by)  # noqa: NPY002
    elif draw < 0.58:
        for b in range(3):
            c[b] += scale * np.random.normal()  # noqa: NPY002
    elif draw < 0.89:
        before = R.copy()
        arm = max(h[(a + 1) % 3], h[(a + 2) % 3])
        _turn(R, a, 1.5 * scale * np.random.normal() / arm)  # noqa: NPY002
        for b in range(3 if draw < 0.73 else 0):
            corner = h[b] * _either()
            for e in range(3):
                c[e] += (before[e, b] - R[e, b]) * corner
    else:
        for b in range(3):
            h[b] = max(h[b] + scale * np.random.normal(), _SMALLEST)  # noqa: NPY002
            c[b] += 0.7 * scale * np.random.normal()  # noqa: NPY002
        _turn(R, a, scale * np.random.normal())  # noqa: NPY002


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _reach(R: Array, c: Array, h: Array, point: Array) -> None:
    """Grow or shift a box to hold a point, and turn or shrink it a little, in place."""
    for a in range(3):
        q = R[0, a] * (point[0] - c[0]) + R[1, a] * (point[1] - c[1]) + R[2, a] * (point[2] - c[2])
        by = abs(q) - h[a] + 1e-6
        if by > 1e-6:
            sign = 1.0 if q > 0.0 else -1.0
            if np.random.random() < 0.3:  # noqa: NPY002
                for b in range(3):
                    c[b] += sign * by * R[b, a]
            else:
                _move_side(R, c, h, a, sign, by)
    scale = np.exp(np.random.uniform(np.log(0.003), np.log(0.15)))  # noqa: NPY002
    if np.random.random() < 0.4:  # noqa: NPY002
        _turn(R, np.random.randint(3), scale * np.random.normal())  # noqa: NPY002
    if np.random.random() < 0.4:  # noqa: NPY002
        by = -abs(scale * np.random.normal())  # noqa: NPY002
        _move_side(R, c, h, np.random.randint(3), _either(), by)  # noqa: NPY002


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _two_least(away: Array, first: Array, second: Array, which: IntArray, i: int) -> None:
    """Of the column i of away (k, n): its least value, in row `which`, and the next."""
    first[i], second[i] = 1e9, 1e9
    for k in range(len(away)):
        d = away[k, i]
        if d < first[i]:
            second[i], first[i], which[i] = first[i], d, k
        elif d < second[i]:
            second[i] = d
