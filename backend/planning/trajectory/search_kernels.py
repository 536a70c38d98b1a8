"""Compiled: two trees that grow towards each other (RRT-Connect), and short cuts."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.planning.trajectory.sweep_kernels import Boxed, Chain, Pairs, blocker, within
from backend.spatial.types import Array, IntArray

World = tuple[Chain, Boxed, Pairs, tuple[Array, Array]]
"""Of `sweep_kernels`, and A (n, k), b (n,) of q = A x + b."""


@njit(cache=True, nogil=True)
def free_edge(world: World, x0: Array, x1: Array) -> int:
    """`blocker` from x0 to x1."""
    chain, boxes, pairs, (A, b) = world
    return blocker(chain, boxes, pairs, A @ x0 + b, A @ x1 + b)


@njit(cache=True, nogil=True)
def connect(
    world: World,
    ends: tuple[Array, Array],
    room: tuple[Array, Array],
    metric: tuple[Array, float],
    starts: Array,
    goals: Array,
    draws: Array,
    hits: IntArray,
) -> Array:
    """(m, k) a free polyline from one of `starts` (a, k) to one of `goals` (b, k); (0, k) if none.

    ends: lower and upper joint values; room: where `draws` (d, k) in 0..1 are spread; metric: its
    weights (k,), and the longest step in it; hits: (p,) counts what was in the way.
    """
    count, dim = draws.shape
    size = 2 * count + len(starts) + len(goals) + 2
    nodes = np.empty((2, size, dim))
    parent = np.full((2, size), -1)
    used = np.array([len(starts), len(goals)])
    nodes[0, : len(starts)] = starts
    nodes[1, : len(goals)] = goals
    weights = metric[0]
    for k in range(count):
        a = k % 2
        b = 1 - a
        target = room[0] + draws[k] * (room[1] - room[0])
        near = _nearest(nodes[a], used[a], target, weights)
        new = _grown(world, ends, metric, nodes[a], parent[a], used[a], near, target, hits)
        if new < 0:
            continue
        used[a] += 1
        target = nodes[a, new]
        at = _nearest(nodes[b], used[b], target, weights)
        while True:
            at = _grown(world, ends, metric, nodes[b], parent[b], used[b], at, target, hits)
            if at < 0:
                break
            used[b] += 1
            if np.abs(nodes[b, at] - target).max() == 0.0:
                return _joined(nodes, parent, new, at, a)
    return np.empty((0, dim))


@njit(cache=True, nogil=True)
def _grown(
    world: World,
    ends: tuple[Array, Array],
    metric: tuple[Array, float],
    nodes: Array,
    parent: IntArray,
    used: int,
    near: int,
    target: Array,
    hits: IntArray,
) -> int:
    """The new node of a tree, its first `used` of `nodes` taken, one step from node `near` towards
    `target`; -1 where something is in the way, which is counted, or no room is left.
    """
    A, b = world[3]
    step = _towards(nodes[near], target, metric[0], metric[1])
    if used >= len(nodes) or not within(A @ step + b, ends[0], ends[1]):
        return -1
    hit = free_edge(world, nodes[near], step)
    if hit >= 0:
        hits[hit] += 1
        return -1
    nodes[used] = step
    parent[used] = near
    return used


@njit(cache=True, nogil=True)
def shorten(world: World, weights: Array, path: Array, draws: Array) -> Array:
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
        p, r = _between(now, along, i, u), _between(now, along, j, v)
        if _far(p, r, weights) > v - u - 1e-6:
            continue
        if free_edge(world, p, r) >= 0:
            continue
        shorter = np.empty((i + 1 + 2 + len(now) - 1 - j, now.shape[1]))
        shorter[: i + 1] = now[: i + 1]
        shorter[i + 1] = p
        shorter[i + 2] = r
        shorter[i + 3 :] = now[j + 1 :]
        now = shorter
    return now


@njit(cache=True, nogil=True)
def _between(path: Array, along: Array, i: int, s: float) -> Array:
    """The point of a polyline's i-th leg at s, lengths `along` (m,) it."""
    share = (s - along[i]) / max(along[i + 1] - along[i], 1e-300)
    return path[i] + share * (path[i + 1] - path[i])


@njit(cache=True, nogil=True)
def _far(a: Array, b: Array, weights: Array) -> float:
    return np.sqrt(_square(a, b, weights))


@njit(cache=True, nogil=True)
def _square(a: Array, b: Array, weights: Array) -> float:
    square = 0.0
    for k in range(len(weights)):
        square += (weights[k] * (a[k] - b[k])) ** 2
    return square


@njit(cache=True, nogil=True)
def _nearest(nodes: Array, used: int, x: Array, weights: Array) -> int:
    best, at = np.inf, 0
    for i in range(used):
        square = _square(nodes[i], x, weights)
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
