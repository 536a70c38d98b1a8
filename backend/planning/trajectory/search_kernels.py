"""Compiled: two trees that grow towards each other (RRT-Connect), and short cuts."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.planning.trajectory.sweep_kernels import Boxed, Chain, Pairs, blocker, within
from backend.spatial.types import Array, IntArray


@njit(cache=True, nogil=True)
def free_edge(
    chain: Chain, boxes: Boxed, pairs: Pairs, turn: tuple[Array, Array], x0: Array, x1: Array
) -> int:
    """`blocker` from x0 to x1, where q = turn[0] @ x + turn[1]."""
    return blocker(chain, boxes, pairs, turn[0] @ x0 + turn[1], turn[0] @ x1 + turn[1])


@njit(cache=True, nogil=True)
def connect(
    chain: Chain,
    boxes: Boxed,
    pairs: Pairs,
    turn: tuple[Array, Array],
    ends: tuple[Array, Array],
    room: tuple[Array, Array],
    weights: Array,
    starts: Array,
    goals: Array,
    draws: Array,
    longest: float,
    hits: IntArray,
) -> Array:
    """(m, k) a free polyline from one of `starts` (a, k) to one of `goals` (b, k); (0, k) if none.

    ends: lower and upper joint values; room: where `draws` (d, k) in 0..1 are spread; weights: (k,)
    of the metric; longest: of one step in it; hits: (p,) counts what was in the way.
    """
    count, dim = draws.shape
    size = 2 * count + len(starts) + len(goals) + 2
    nodes = np.empty((2, size, dim))
    parent = np.full((2, size), -1)
    used = np.array([len(starts), len(goals)])
    nodes[0, : len(starts)] = starts
    nodes[1, : len(goals)] = goals
    low, high = ends
    for k in range(count):
        a = k % 2
        b = 1 - a
        target = room[0] + draws[k] * (room[1] - room[0])
        near = _nearest(nodes[a], used[a], target, weights)
        new = _towards(nodes[a, near], target, weights, longest)
        if not within(turn[0] @ new + turn[1], low, high):
            continue
        hit = free_edge(chain, boxes, pairs, turn, nodes[a, near], new)
        if hit >= 0:
            hits[hit] += 1
            continue
        if used[a] >= size or used[b] >= size:
            break
        nodes[a, used[a]] = new
        parent[a, used[a]] = near
        used[a] += 1
        at = _nearest(nodes[b], used[b], new, weights)
        while used[b] < size:
            step = _towards(nodes[b, at], new, weights, longest)
            if not within(turn[0] @ step + turn[1], low, high):
                break
            hit = free_edge(chain, boxes, pairs, turn, nodes[b, at], step)
            if hit >= 0:
                hits[hit] += 1
                break
            nodes[b, used[b]] = step
            parent[b, used[b]] = at
            at = used[b]
            used[b] += 1
            if np.abs(step - new).max() == 0.0:
                return _joined(nodes, parent, used[a] - 1, at, a)
    return np.empty((0, dim))


@njit(cache=True, nogil=True)
def shorten(
    chain: Chain,
    boxes: Boxed,
    pairs: Pairs,
    turn: tuple[Array, Array],
    weights: Array,
    path: Array,
    draws: Array,
) -> Array:
    """The polyline (m, k) after short cuts between points drawn along it; draws: (d, 2) in 0..1."""
    now = path.copy()
    for k in range(len(draws)):
        if len(now) < 3:
            break
        along = np.zeros(len(now))
        for i in range(1, len(now)):
            along[i] = along[i - 1] + _far(now[i - 1], now[i], weights)
        u = draws[k].min() * along[-1]
        v = draws[k].max() * along[-1]
        i = min(np.searchsorted(along, u, side="right") - 1, len(now) - 2)
        j = min(np.searchsorted(along, v, side="right") - 1, len(now) - 2)
        if j <= i:
            continue
        p = now[i] + (u - along[i]) / max(along[i + 1] - along[i], 1e-300) * (now[i + 1] - now[i])
        r = now[j] + (v - along[j]) / max(along[j + 1] - along[j], 1e-300) * (now[j + 1] - now[j])
        if _far(p, r, weights) > v - u - 1e-6:
            continue
        hit = free_edge(chain, boxes, pairs, turn, p, r)
        if hit >= 0:
            continue
        shorter = np.empty((i + 1 + 2 + len(now) - 1 - j, now.shape[1]))
        shorter[: i + 1] = now[: i + 1]
        shorter[i + 1] = p
        shorter[i + 2] = r
        shorter[i + 3 :] = now[j + 1 :]
        now = shorter
    return now


@njit(cache=True, nogil=True)
def _far(a: Array, b: Array, weights: Array) -> float:
    square = 0.0
    for k in range(len(weights)):
        square += (weights[k] * (a[k] - b[k])) ** 2
    return np.sqrt(square)


@njit(cache=True, nogil=True)
def _nearest(nodes: Array, used: int, x: Array, weights: Array) -> int:
    best, at = np.inf, 0
    for i in range(used):
        square = 0.0
        for k in range(len(weights)):
            square += (weights[k] * (nodes[i, k] - x[k])) ** 2
        if square < best:
            best, at = square, i
    return at


@njit(cache=True, nogil=True)
def _towards(start: Array, x: Array, weights: Array, longest: float) -> Array:
    d = _far(start, x, weights)
    if d <= longest:
        return x.copy()
    return start + longest / d * (x - start)


@njit(cache=True, nogil=True)
def _joined(nodes: Array, parent: IntArray, end_a: int, end_b: int, a: int) -> Array:
    first, second = (end_a, end_b) if a == 0 else (end_b, end_a)
    count, k = 0, first
    while k >= 0:
        count, k = count + 1, parent[0, k]
    k = parent[1, second]
    total = count
    while k >= 0:
        total, k = total + 1, parent[1, k]
    out = np.empty((total, nodes.shape[2]))
    k = first
    for i in range(count - 1, -1, -1):
        out[i] = nodes[0, k]
        k = parent[0, k]
    k = parent[1, second]
    for i in range(count, total):
        out[i] = nodes[1, k]
        k = parent[1, k]
    return out
