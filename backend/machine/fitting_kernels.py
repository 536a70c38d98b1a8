"""The inner loops of box fitting, compiled: boxes {p: low <= R^T p <= high} in a field's room.

A field is given as values (nx, ny, nz) [m] at origin + index * step. A box is clear when no point
of its surface has a value over `tolerance`; its inside is then clear as well, since the space it
must avoid is connected and unbounded.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, BoolArray

_COARSE = 4  # a face is looked at in cells of so many spacings, and closer where one is in doubt
_TOO_MUCH = 1.0  # protrusion that turning a box does not end
_LEAST = 0.01  # [m] the smallest step by which a side grows
_INSIDE = 1e-9  # [m]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def value_at(values: Array, origin: Array, step: float, x: float, y: float, z: float) -> float:
    """The field between its nodes (trilinear); far beyond any tolerance off the grid."""
    fx, fy, fz = (x - origin[0]) / step, (y - origin[1]) / step, (z - origin[2]) / step
    i, j, k = int(np.floor(fx)), int(np.floor(fy)), int(np.floor(fz))
    nx, ny, nz = values.shape
    if i < 0 or j < 0 or k < 0 or i > nx - 2 or j > ny - 2 or k > nz - 2:
        return 1e3
    fx, fy, fz = fx - i, fy - j, fz - k
    gx, gy, gz = 1.0 - fx, 1.0 - fy, 1.0 - fz
    near = gy * (values[i, j, k] * gz + values[i, j, k + 1] * fz)
    near += fy * (values[i, j + 1, k] * gz + values[i, j + 1, k + 1] * fz)
    far = gy * (values[i + 1, j, k] * gz + values[i + 1, j, k + 1] * fz)
    far += fy * (values[i + 1, j + 1, k] * gz + values[i + 1, j + 1, k + 1] * fz)
    return float(near * gx + far * fx)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def clear(
    values: Array,
    origin: Array,
    step: float,
    tolerance: float,
    spacing: float,
    R: Array,
    low: Array,
    high: Array,
    skip: int,
) -> bool:
    """Whether a box is clear, seen at points `spacing` [m] apart; face `skip` (2 axis + 1 at its
    high end, -1 none) is not looked at."""
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        nu = max(1, int(np.ceil((high[u] - low[u]) / (_COARSE * spacing))))
        nv = max(1, int(np.ceil((high[v] - low[v]) / (_COARSE * spacing))))
        du, dv = (high[u] - low[u]) / nu, (high[v] - low[v]) / nv
        half = 0.5 * np.sqrt(du * du + dv * dv)
        mu, mv = max(1, int(np.ceil(du / spacing))), max(1, int(np.ceil(dv / spacing)))
        for side in range(2):
            if skip == 2 * a + side:
                continue
            w = high[a] if side else low[a]
            x, y, z = R[0, a] * w, R[1, a] * w, R[2, a] * w
            for i in range(nu):
                for j in range(nv):
                    p, q = low[u] + du * (i + 0.5), low[v] + dv * (j + 0.5)
                    d = value_at(
                        values,
                        origin,
                        step,
                        x + R[0, u] * p + R[0, v] * q,
                        y + R[1, u] * p + R[1, v] * q,
                        z + R[2, u] * p + R[2, v] * q,
                    )
                    if d > tolerance:
                        return False
                    if tolerance - d >= half:  # the field rises by no more than the way
                        continue
                    for ii in range(mu + 1):
                        p = low[u] + du * (i + ii / mu)
                        for jj in range(mv + 1):
                            q = low[v] + dv * (j + jj / mv)
                            d = value_at(
                                values,
                                origin,
                                step,
                                x + R[0, u] * p + R[0, v] * q,
                                y + R[1, u] * p + R[1, v] * q,
                                z + R[2, u] * p + R[2, v] * q,
                            )
                            if d > tolerance:
                                return False
    return True


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def protrusion(
    values: Array,
    origin: Array,
    step: float,
    tolerance: float,
    spacing: float,
    R: Array,
    low: Array,
    high: Array,
    limit: float,
) -> float:
    """How much of a box's surface is not clear, weighted with how far; 0 when it is clear.

    Gives up where the sum exceeds `limit`.
    """
    total = 0.0
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        nu = max(1, int(np.ceil((high[u] - low[u]) / spacing)))
        nv = max(1, int(np.ceil((high[v] - low[v]) / spacing)))
        for side in range(2):
            w = high[a] if side else low[a]
            for i in range(nu + 1):
                p = low[u] + (high[u] - low[u]) * i / nu
                for j in range(nv + 1):
                    q = low[v] + (high[v] - low[v]) * j / nv
                    d = value_at(
                        values,
                        origin,
                        step,
                        R[0, a] * w + R[0, u] * p + R[0, v] * q,
                        R[1, a] * w + R[1, u] * p + R[1, v] * q,
                        R[2, a] * w + R[2, u] * p + R[2, v] * q,
                    )
                    if d > tolerance:
                        total += min(d - tolerance, 1.0) ** 1.5
            if total > limit:
                return total
    return total


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def grown(
    values: Array,
    origin: Array,
    step: float,
    tolerance: float,
    spacing: float,
    R: Array,
    low: Array,
    high: Array,
    lowest: Array,
    highest: Array,
    rates: Array,
) -> tuple[Array, Array]:
    """A clear box grown until every side is blocked or at lowest..highest (3,) [m].

    rates: (6,) [m] first steps of the sides (axis 0 low, axis 0 high, axis 1 low ...): which side
    comes first where they compete. A blocked side halves its step.
    """
    low, high, rates = low.copy(), high.copy(), rates.copy()
    slab_low, slab_high = np.empty(3), np.empty(3)
    active = True
    while active:
        active = False
        for f in range(6):
            if rates[f] < _LEAST:
                continue
            a = f // 2
            slab_low[:], slab_high[:] = low, high
            if f % 2:
                slab_low[a], slab_high[a] = high[a], min(high[a] + rates[f], highest[a])
            else:
                slab_low[a], slab_high[a] = max(low[a] - rates[f], lowest[a]), low[a]
            if slab_high[a] - slab_low[a] < 1e-6:
                rates[f] = 0.0
                continue
            active = True
            inner = 2 * a + 1 - f % 2
            if clear(values, origin, step, tolerance, spacing, R, slab_low, slab_high, inner):
                low[a], high[a] = min(low[a], slab_low[a]), max(high[a], slab_high[a])
            else:
                rates[f] *= 0.5
    return low, high


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def settled(
    values: Array,
    origin: Array,
    step: float,
    tolerance: float,
    spacing: float,
    R: Array,
    points: Array,
) -> tuple[bool, Array]:
    """Axes near R (3, 3) along which the box around points (n, 3) is clear; (whether found, R).

    Turns about the box's own axes by less and less while that makes less of it protrude.
    """
    low, high = bounds(points, R)
    least = protrusion(values, origin, step, tolerance, spacing, R, low, high, _TOO_MUCH)
    for angle in (0.12, 0.06, 0.03, 0.015):
        if least > _TOO_MUCH:
            break
        for _ in range(2):
            gained = False
            for a in range(3):
                u, v = (a + 1) % 3, (a + 2) % 3
                for sine in (-angle, angle):
                    if least == 0.0:
                        return True, R
                    Q, cosine = R.copy(), np.sqrt(1.0 - sine * sine)
                    Q[:, u] = cosine * R[:, u] + sine * R[:, v]
                    Q[:, v] = cosine * R[:, v] - sine * R[:, u]
                    low, high = bounds(points, Q)
                    value = protrusion(
                        values, origin, step, tolerance, spacing, Q, low, high, least
                    )
                    if value < least:
                        least, R, gained = value, Q, True
            if not gained:
                break
    return least == 0.0, R


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def bounds(points: Array, R: Array) -> tuple[Array, Array]:
    """low, high (3,) of points (n, 3) along the columns of R."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(len(points)):
        for a in range(3):
            w = points[i, 0] * R[0, a] + points[i, 1] * R[1, a] + points[i, 2] * R[2, a]
            low[a], high[a] = min(low[a], w), max(high[a], w)
    return low, high


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def held(points: Array, R: Array, low: Array, high: Array) -> BoolArray:
    """(n,) whether points (n, 3) are in a box."""
    out = np.ones(len(points), np.bool_)
    for i in range(len(points)):
        for a in range(3):
            w = points[i, 0] * R[0, a] + points[i, 1] * R[1, a] + points[i, 2] * R[2, a]
            if w < low[a] - _INSIDE or w > high[a] + _INSIDE:
                out[i] = False
                break
    return out


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def lattice(triangles: Array, spacing: float) -> Array:
    """Points (m, 3) on triangles (n, 3, 3): rows parallel to the longest edge, ends included."""
    out = np.empty((4 * len(triangles) + 64, 3))
    count = 0
    for t in range(len(triangles)):
        longest, first = -1.0, 0
        for k in range(3):
            d = triangles[t, (k + 1) % 3] - triangles[t, k]
            length = np.sqrt((d * d).sum())
            if length > longest:
                longest, first = length, k
        a, b = triangles[t, first], triangles[t, (first + 1) % 3]
        c = triangles[t, (first + 2) % 3]
        across = np.cross(b - a, c - a)
        height = np.sqrt((across * across).sum()) / max(longest, 1e-12)
        rows = max(1, int(np.ceil(height / spacing)))
        for r in range(rows + 1):
            f = r / rows
            n = max(1, int(np.ceil(longest * (1.0 - f) / spacing)))
            if count + n + 1 > len(out):
                larger = np.empty((2 * (count + n + 1), 3))
                larger[:count] = out[:count]
                out = larger
            for i in range(n + 1):
                g = i / n
                for x in range(3):
                    start = a[x] + f * (c[x] - a[x])
                    end = b[x] + f * (c[x] - b[x])
                    out[count, x] = start + g * (end - start)
                count += 1
    return out[:count].copy()
