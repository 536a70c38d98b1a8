"""Compiled: which postures a resting machine would tip over in, one by one or by whole cells."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, IntArray
from backend.stability.wrench_kernel import _about

CENTRE, MAYBE, WHOLE = 1, 2, 4
"""Bits of a cell: it tips at its centre, perhaps somewhere, everywhere."""
_DEEPEST = 64  # halvings of a grid on top of each other


@njit(cache=True)
def least_moment(
    tree: tuple[IntArray, IntArray],
    frames: tuple[Array, Array, Array],
    bodies: tuple[Array, Array],
    edges: tuple[Array, Array],
    g: Array,
    q: Array,
    room: tuple[Array, Array, Array],
) -> float:
    """Least moment of the weight about any edge [N m], negative where the machine tips.

    tree, frames: as in `wrench_kernel`; bodies: (B,) masses, (B, 3) centres; edges: (k, 2) inward
    normals, (k,) the edges' distances from the origin along them; g: (3,); q: (n,); room: (B, 3,
    3), (B, 3) and (3, 3) to work in.
    """
    parents, joints = tree
    R0, p0, axes = frames
    masses, coms = bodies
    R, p, turned = room
    x, y, z, total = 0.0, 0.0, 0.0, 0.0
    for b in range(len(masses)):
        above = parents[b]
        if above < 0:
            R[b], p[b] = R0[b], p0[b]
        else:
            angle = q[joints[b]]
            _about(axes[b], np.sin(angle), np.cos(angle), turned)
            for r in range(3):
                p[b, r] = p[above, r]
                for c in range(3):
                    p[b, r] += R[above, r, c] * p0[b, c]
            for r in range(3):
                a0 = R[above, r, 0] * R0[b, 0, 0] + R[above, r, 1] * R0[b, 1, 0]
                a1 = R[above, r, 0] * R0[b, 0, 1] + R[above, r, 1] * R0[b, 1, 1]
                a2 = R[above, r, 0] * R0[b, 0, 2] + R[above, r, 1] * R0[b, 1, 2]
                a0 += R[above, r, 2] * R0[b, 2, 0]
                a1 += R[above, r, 2] * R0[b, 2, 1]
                a2 += R[above, r, 2] * R0[b, 2, 2]
                for c in range(3):
                    R[b, r, c] = a0 * turned[0, c] + a1 * turned[1, c] + a2 * turned[2, c]
        m, c0, c1, c2 = masses[b], coms[b, 0], coms[b, 1], coms[b, 2]
        total += m
        x += m * (p[b, 0] + R[b, 0, 0] * c0 + R[b, 0, 1] * c1 + R[b, 0, 2] * c2)
        y += m * (p[b, 1] + R[b, 1, 0] * c0 + R[b, 1, 1] * c1 + R[b, 1, 2] * c2)
        z += m * (p[b, 2] + R[b, 2, 0] * c0 + R[b, 2, 1] * c1 + R[b, 2, 2] * c2)
    normals, offsets = edges
    tx, ty = z * g[1] - y * g[2], x * g[2] - z * g[0]
    least = np.inf
    for e in range(len(offsets)):
        moment = tx * normals[e, 1] - ty * normals[e, 0] + total * g[2] * offsets[e]
        least = min(least, moment)
    return least


@njit(cache=True)
def tipping_postures(
    tree: tuple[IntArray, IntArray],
    frames: tuple[Array, Array, Array],
    bodies: tuple[Array, Array],
    edges: tuple[Array, Array],
    g: Array,
    q: Array,
) -> Array:
    """(m,) least moment [N m] of postures q (m, n)."""
    count = len(bodies[0])
    room = np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros((3, 3))
    out = np.empty(len(q))
    for i in range(len(q)):
        out[i] = least_moment(tree, frames, bodies, edges, g, q[i], room)
    return out


@njit(cache=True)
def tipping_cells(
    tree: tuple[IntArray, IntArray],
    frames: tuple[Array, Array, Array],
    bodies: tuple[Array, Array],
    edges: tuple[Array, Array],
    g: Array,
    q: Array,
    grid: tuple[Array, Array, IntArray],
    turning: tuple[Array, Array],
) -> Array:
    """(a, b, c, d) uint8: CENTRE, MAYBE and WHOLE of the cells over the first four joints.

    q: (n,) of which the others are held; grid: (4,) lower edges and steps [rad], (4,) counts;
    turning: (4,) the most that any edge's moment changes per joint [N m/rad], and (4,) how far off
    the joints themselves may be [rad]. Cells of which a bound says the same are not looked at one
    by one: halves are, where it does not.
    """
    lower, steps, counts = grid
    slope, slack = turning
    count = len(bodies[0])
    room = np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros((3, 3))
    out = np.zeros((counts[0], counts[1], counts[2], counts[3]), dtype=np.uint8)
    at = q.copy()
    stack = np.zeros((_DEEPEST, 2, 4), dtype=np.int64)
    stack[0, 1] = counts
    top = 1
    off = 0.0
    for k in range(4):
        off += slope[k] * slack[k]
    while top > 0:
        top -= 1
        first, last = stack[top, 0].copy(), stack[top, 1].copy()
        widest, most, bound = -1, 0.0, 0.0
        for k in range(4):
            at[k] = lower[k] + 0.5 * (first[k] + last[k]) * steps[k]
            part = 0.5 * slope[k] * (last[k] - first[k]) * steps[k]
            bound += part
            if last[k] - first[k] > 1 and (widest < 0 or part > most):
                widest, most = k, part
        least = least_moment(tree, frames, bodies, edges, g, at, room)
        code = 0
        if least < 0.0:
            code |= CENTRE
        if least - bound - off < 0.0:
            code |= MAYBE
        if least + bound < 0.0:
            code |= WHOLE
        if widest >= 0 and code != 0 and code != CENTRE | MAYBE | WHOLE:
            middle = (first[widest] + last[widest]) // 2
            stack[top, 0], stack[top, 1] = first, last
            stack[top, 1, widest] = middle
            stack[top + 1, 0], stack[top + 1, 1] = first, last
            stack[top + 1, 0, widest] = middle
            top += 2
        elif code:
            out[first[0] : last[0], first[1] : last[1], first[2] : last[2], first[3] : last[3]] = (
                code
            )
    return out
