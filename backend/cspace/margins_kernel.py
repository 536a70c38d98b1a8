"""Conservative advancement of a machine's boxes along directions in joint space, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from backend.collision.fast_box_kernels import boxes_apart
from backend.cspace.exact_boxes import gap
from backend.machine.chain_kernel import in_parent, placed
from backend.spatial.types import Array, BoolArray, IntArray

CLOSE = 0.05
"""Where something counts as contact before it touches, and a gap is within this of it, the distance
itself is measured: corner to corner it is larger than the gap along every axis [m]."""


@njit(cache=True)  # type: ignore[untyped-decorator]
def place(
    M: Array,
    parents: IntArray,
    joints: IntArray,
    q: Array,
    link: int,
    until: int,
    c: Array,
    R: Array,
) -> None:
    """Move center c (3,) and rotation R (3, 3) from the link's frame to that of the link `until`
    below it, in place; -1 is what the root stands in.
    """
    T, moved, turned = np.empty((3, 4)), np.empty(3), np.empty((3, 3))
    i = link
    while i != until:
        in_parent(M, joints, q, i, T)
        for a in range(3):
            moved[a] = T[a, 0] * c[0] + T[a, 1] * c[1] + T[a, 2] * c[2] + T[a, 3]
            for b in range(3):
                turned[a, b] = T[a, 0] * R[0, b] + T[a, 1] * R[1, b] + T[a, 2] * R[2, b]
        c[:] = moved
        R[:] = turned
        i = parents[i]


@njit(cache=True)  # type: ignore[untyped-decorator]
def _common(parents: IntArray, a: int, b: int) -> int:
    """The link that carries both links and is nearest to them."""
    while a != b:
        if a > b:  # parents come first
            a = parents[a]
        else:
            b = parents[b]
    return a


@njit(cache=True)  # type: ignore[untyped-decorator]
def _spin(axis: Array, sine: float, versine: float, c: Array, R: Array) -> None:
    """Turn center c (3,) and rotation R (3, 3) about an axis (2, 3), origin and unit vector, in
    place; versine is 1 - cos of the angle.
    """
    o, u = axis[0], axis[1]
    x, y, z = c[0] - o[0], c[1] - o[1], c[2] - o[2]
    # v + sin (u x v) + (1 - cos) (u (u . v) - v)
    along = u[0] * x + u[1] * y + u[2] * z
    c[0] = o[0] + x + sine * (u[1] * z - u[2] * y) + versine * (u[0] * along - x)
    c[1] = o[1] + y + sine * (u[2] * x - u[0] * z) + versine * (u[1] * along - y)
    c[2] = o[2] + z + sine * (u[0] * y - u[1] * x) + versine * (u[2] * along - z)
    for b in range(3):
        x, y, z = R[0, b], R[1, b], R[2, b]
        along = u[0] * x + u[1] * y + u[2] * z
        R[0, b] = x + sine * (u[1] * z - u[2] * y) + versine * (u[0] * along - x)
        R[1, b] = y + sine * (u[2] * x - u[0] * z) + versine * (u[1] * along - y)
        R[2, b] = z + sine * (u[0] * y - u[1] * x) + versine * (u[2] * along - z)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _copy(c: Array, R: Array, to_c: Array, to_R: Array) -> None:
    for x in range(3):
        to_c[x] = c[x]
        for y in range(3):
            to_R[x, y] = R[x, y]


@njit(cache=True)  # type: ignore[untyped-decorator]
def limits(
    q: Array, directions: Array, lower: Array, upper: Array
) -> tuple[Array, Array, IntArray]:
    """Of directions (k, n) from q (n,): the s (k,) at which the first joint meets its limit, a
    whole turn when nothing limits; the fastest joint's rate (k,); the only joint (k,) that moves,
    -1 where there are more or none.
    """
    count, n = directions.shape
    ends, fastest, alone = np.zeros(count), np.zeros(count), np.full(count, -1, np.int64)
    for k in range(count):
        end, moving = math.inf, 0
        for j in range(n):
            rate = directions[k, j]
            if rate != 0.0:
                moving += 1
                alone[k] = j if moving == 1 else -1
                fastest[k] = max(fastest[k], abs(rate))
                end = min(end, ((upper[j] if rate > 0.0 else lower[j]) - q[j]) / rate)
        if moving:
            ends[k] = max(min(end, 2.0 * math.pi / fastest[k]), 0.0)
    return ends, fastest, alone


@njit(cache=True)  # type: ignore[untyped-decorator]
def axes_of(T: Array, links: IntArray, axes: Array) -> Array:
    """(joints, 2, 3) origins and unit vectors of the joints' axes at link poses T (L, 4, 4)."""
    out = np.empty((len(links), 2, 3))
    for j in range(len(links)):
        pose = T[links[j]]
        for a in range(3):
            out[j, 0, a] = pose[a, 3]
            out[j, 1, a] = (
                pose[a, 0] * axes[j, 0] + pose[a, 1] * axes[j, 1] + pose[a, 2] * axes[j, 2]
            )
    return out


@njit(cache=True)  # type: ignore[untyped-decorator]
def rings(centers: Array, rotations: Array, halves: Array, origin: Array, axis: Array) -> Array:
    """(n, 4) what boxes cover while they turn about an axis: least and largest distance from it,
    least and largest place along it [m]. origin: a point of the axis, axis: its unit vector, (3,).
    """
    out = np.empty((len(centers), 4))
    for i in range(len(centers)):
        at = 0.0
        for x in range(3):
            at += (centers[i, x] - origin[x]) * axis[x]
        away = 0.0
        for x in range(3):
            away += (centers[i, x] - origin[x] - at * axis[x]) ** 2
        away = math.sqrt(away)
        wide = high = 0.0
        for b in range(3):
            dot = 0.0
            for x in range(3):
                dot += rotations[i, x, b] * axis[x]
            high += halves[i, b] * abs(dot)
            wide += halves[i, b] * math.sqrt(max(1.0 - dot * dot, 0.0))
        wide = min(wide, math.sqrt((halves[i] ** 2).sum()))
        out[i, 0], out[i, 1] = away - wide, away + wide
        out[i, 2], out[i, 3] = at - high, at + high
    return out


@njit(cache=True)  # type: ignore[untyped-decorator]
def advance(
    chain: tuple[Array, IntArray, IntArray],
    links: IntArray,
    carried: BoolArray,
    own: tuple[Array, Array, Array],
    others: tuple[Array, Array, Array],
    itself: IntArray,
    against_itself: BoolArray,
    far: Array,
    eta: float,
    wrong: Array,
    T: Array,
    q: Array,
    directions: Array,
    alone: IntArray,
    axes: Array,
    ends: Array,
    steps: Array,
) -> tuple[Array, IntArray]:
    """(how far (k,), the pair that ends it (k,) or -1) along q + s directions[k], s <= ends[k].

    Pairs are numbered: first `itself` (p, 2) of own bodies, then own body i against obstacle j as
    p + i m + j. chain: Machine.link_matrices, .link_parents, .link_joints; carried: (n, joints)
    which joints move which body; against_itself: (p, joints) which joints move the bodies of a
    pair against each other; far: (n, joints) levers of the stretched chain [m]; eta: gap to an
    obstacle that counts as contact, wrong: (p,) the same among own bodies [m]; T: (L, 4, 4) link
    poses at q; alone: (k,) the only joint of a direction, -1 where there are more; axes:
    (joints, 2, 3) origins and unit vectors at q; steps: (k,) the least advance.
    """
    n, m, p = len(links), len(others[0]), len(itself)
    work, points = np.empty((11, 3)), np.empty((2, 3))
    centers, rotations = placed(own, links, T)
    radius, other_radius = np.empty(n), np.empty(m)
    for i in range(n):
        radius[i] = math.sqrt((own[2][i] ** 2).sum())
    for j in range(m):
        other_radius[j] = math.sqrt((others[2][j] ** 2).sum())
    apart = np.empty(p + n * m)  # at s = 0, less what counts as contact
    joints = axes.shape[0]
    turned, around = np.empty((joints, n, 4)), np.empty((joints, m, 4))
    for j in range(joints):
        turned[j] = rings(centers, rotations, own[2], axes[j, 0], axes[j, 1])
        around[j] = rings(others[0], others[1], others[2], axes[j, 0], axes[j, 1])
    # While one joint moves alone, a point keeps its distance from the axis; else the chain may
    # stretch.
    levers = np.zeros((len(ends), n, joints))
    rates, itself_rates = np.zeros((len(ends), n)), np.zeros((len(ends), p))
    horizon = np.zeros(n)
    for k in range(len(ends)):
        for i in range(n):
            for j in range(joints):
                if carried[i, j]:
                    levers[k, i, j] = turned[j, i, 1] + 1e-9 if alone[k] == j else far[i, j]
                    rates[k, i] += levers[k, i, j] * abs(directions[k, j])
            horizon[i] = max(horizon[i], rates[k, i] * ends[k])
        for c in range(p):
            for j in range(joints):
                if against_itself[c, j]:
                    both = levers[k, itself[c, 0], j] + levers[k, itself[c, 1], j]
                    itself_rates[k, c] += both * abs(directions[k, j])
    for k in range(len(apart)):
        i, j = (itself[k, 0], itself[k, 1]) if k < p else ((k - p) // m, (k - p) % m)
        if k >= p and horizon[i] == 0.0:
            apart[k] = math.inf
            continue
        cb = centers[j] if k < p else others[0][j]
        rb = radius[j] if k < p else other_radius[j]
        less = wrong[k] if k < p else eta
        d = 0.0
        for a in range(3):
            d += (centers[i, a] - cb[a]) ** 2
        d = math.sqrt(d)
        g = d - radius[i] - rb
        near = k < p or g - less < horizon[i]
        if near and g < 0.3 * d:
            Rb = rotations[j] if k < p else others[1][j]
            hb = own[2][j] if k < p else others[2][j]
            g = max(g, gap(centers[i], rotations[i], own[2][i], cb, Rb, hb, math.inf))
        apart[k] = g - less
    free, pair = ends.copy(), np.full(len(ends), -1, np.int64)
    chosen, safe = np.empty(len(apart), np.int64), np.empty(len(apart))
    ca, cb2 = np.empty(3), np.empty(3)
    Ra, Rb2 = np.empty((3, 3)), np.empty((3, 3))
    posture = np.empty(joints)
    for k in range(len(ends)):
        if ends[k] <= 0.0:
            continue
        count = 0
        single = alone[k]
        for c in range(len(apart)):
            rate = itself_rates[k, c] if c < p else rates[k, (c - p) // m]
            if rate > 0.0 and apart[c] < rate * ends[k]:
                if single >= 0:
                    # What turns about an axis stays in its ring: most pairs can never meet.
                    i = itself[c, 0] if c < p else (c - p) // m
                    other = turned[single, itself[c, 1]] if c < p else around[single, (c - p) % m]
                    less = wrong[c] if c < p else eta
                    ring = turned[single, i]
                    if (
                        max(ring[0], other[0]) > min(ring[1], other[1]) + less
                        or max(ring[2], other[2]) > min(ring[3], other[3]) + less
                    ):
                        continue
                chosen[count] = c
                safe[count] = max(apart[c], 0.0) / rate
                count += 1
        # The nearest first: the sooner a contact is found, the less far the others need to go.
        order = np.argsort(safe[:count])
        for at in range(count):
            c, s = chosen[order[at]], safe[order[at]]
            i, j = (itself[c, 0], itself[c, 1]) if c < p else ((c - p) // m, (c - p) % m)
            rate = itself_rates[k, c] if c < p else rates[k, i]
            less = wrong[c] if c < p else eta
            g = apart[c]
            if c < p:
                hb, rb = own[2][j], radius[j]
                _copy(centers[j], rotations[j], cb2, Rb2)
            else:
                hb, rb = others[2][j], other_radius[j]
                _copy(others[0][j], others[1][j], cb2, Rb2)
            while s < free[k]:
                if s > 0.0:
                    if single >= 0:
                        angle = s * directions[k, single]
                        sine, versine = math.sin(angle), 1.0 - math.cos(angle)
                        _copy(centers[i], rotations[i], ca, Ra)
                        if carried[i, single]:
                            _spin(axes[single], sine, versine, ca, Ra)
                        if c < p and carried[j, single]:
                            _copy(centers[j], rotations[j], cb2, Rb2)
                            _spin(axes[single], sine, versine, cb2, Rb2)
                    else:
                        for x in range(joints):
                            posture[x] = q[x] + s * directions[k, x]
                        _copy(own[0][i], own[1][i], ca, Ra)
                        if c < p:
                            # Against each other: what moves both alike is left out.
                            both = _common(chain[1], links[i], links[j])
                            place(chain[0], chain[1], chain[2], posture, links[i], both, ca, Ra)
                            _copy(own[0][j], own[1][j], cb2, Rb2)
                            place(chain[0], chain[1], chain[2], posture, links[j], both, cb2, Rb2)
                        else:
                            place(chain[0], chain[1], chain[2], posture, links[i], -1, ca, Ra)
                    d = 0.0
                    for x in range(3):
                        d += (ca[x] - cb2[x]) ** 2
                    d = math.sqrt(d)
                    g = d - radius[i] - rb
                    if g < 0.3 * d:
                        # A gap that carries to the end needs no better bound.
                        enough = less + rate * (free[k] - s) + CLOSE
                        g = max(g, gap(ca, Ra, own[2][i], cb2, Rb2, hb, enough))
                        if 0.0 < g < less + CLOSE and less > 0.0:
                            g = boxes_apart(ca, Ra, own[2][i], cb2, Rb2, hb, work, points)
                    g -= less
                if g < rate * steps[k]:
                    free[k], pair[k] = s, c
                    break
                s += g / rate
    return free, pair
