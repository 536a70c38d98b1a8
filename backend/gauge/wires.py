"""Limit volumes along polylines: overhead lines, buried pipes and cables."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from backend.errors import InputError
from backend.gauge.features import Buried, Overhead, OverheadRule
from backend.gauge.volumes import LimitVolume, boxes_around, stack
from backend.spatial.types import Array


def overhead_volume(
    wire: Overhead, rule: OverheadRule, tolerance: float, center: Array, radius: float
) -> LimitVolume:
    """Upright prisms about a wire: `rule.beside` to its sides and past its ends, `rule.below` under
    and `rule.above` over it.

    A span that sags is a parabola below its chord, cut into equal parts of which each exceeds it by
    no more than `tolerance` [m]; a catenary of the same sag f over a span l hangs lower by up to
    f^3 / (3 l^2) between (0.1 mm for 1 m over 60 m), for which 0.4 f^3 / l^2 are added below. Where
    a wire turns, its parts go on to where their outer sides meet; where it turns by more than a
    right angle, by `rule.beside`. Raises InputError for points that coincide in plan and distances
    below 0.
    """
    points = _polyline(wire.name, wire.points)
    steps = np.diff(points[:, :2], axis=0)
    if not (np.linalg.norm(steps, axis=1) > 1e-6).all():
        raise InputError(f"{wire.name}: has a point right above another; allowed are spans.")
    if min(rule.below, rule.beside, rule.above, wire.sag) < 0.0 or rule.beside == 0.0:
        raise InputError(
            f"{wire.name}: a distance or the sag is below 0; allowed are 0 and more, and more than "
            "0 beside."
        )
    ends = _extensions(points, rule.beside)
    hulls, pieces = [], []
    for k, (a, b) in enumerate(pairwise(points)):
        if _too_far(a, b, center, radius + rule.beside):
            continue
        span = float(np.linalg.norm((b - a)[:2]))
        count = max(1, math.ceil(math.sqrt(wire.sag / tolerance)))
        drop = wire.sag / count**2
        below = rule.below + drop + 0.4 * wire.sag**3 / span**2
        t = np.linspace(0.0, 1.0, count + 1)
        nodes = a + t[:, None] * (b - a)
        nodes[:, 2] -= 4.0 * wire.sag * t * (1.0 - t)
        for n, (start, end) in enumerate(pairwise(nodes)):
            more = (ends[k] if n == 0 else 0.0, ends[k + 1] if n == count - 1 else 0.0)
            for vertices in _beams(start, end, more, rule, below, tolerance):
                hulls.append(stack(vertices))
                pieces.append((vertices, _along(end - start)))
    return LimitVolume(
        name=wire.name,
        kind="overhead",
        state=wire.state,
        rule=f"{rule.below:g} m below and {rule.beside:g} m beside the wire",
        boxes=boxes_around(pieces),
        hulls=tuple(hulls),
    )


def buried_volume(pipe: Buried, clearance: float, center: Array, radius: float) -> LimitVolume:
    """A box about every straight part, with `clearance` [m] around the pipe and past its ends.

    Contains everything within the clearance. Raises InputError for points that coincide.
    """
    points = _polyline(pipe.name, pipe.points)
    if not (np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6).all():
        raise InputError(f"{pipe.name}: has the same point twice in a row; allowed are stretches.")
    reach = pipe.diameter / 2.0 + clearance
    if not reach > 0.0:
        raise InputError(
            f"{pipe.name}: diameter and clearance leave nothing; allowed is more than 0."
        )
    pieces = []
    for a, b in pairwise(points):
        if not _too_far(a, b, center, radius + reach):
            R = _along(b - a)
            signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            corners = np.where(signs[:, :1] < 0, a, b) + reach * signs @ R.T
            pieces.append((corners, R))
    return LimitVolume(
        name=pipe.name,
        kind="buried",
        state=pipe.state,
        rule=f"{clearance:g} m around {pipe.diameter:g} m",
        boxes=boxes_around(pieces),
    )


def _polyline(name: str, points: Array) -> Array:
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2 or not np.isfinite(points).all():
        raise InputError(f"{name}: is no line; allowed are two or more points of three numbers.")
    return points


def _too_far(a: Array, b: Array, center: Array, radius: float) -> bool:
    """Whether all of the segment from a to b is farther from `center` in plan."""
    side = (b - a)[:2]
    t = np.clip((center - a[:2]) @ side / max(float(side @ side), 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(a[:2] + t * side - center)) > radius


def _extensions(points: Array, beside: float) -> Array:
    """(k,) how far the parts that meet at each point go on beyond it [m]."""
    steps = np.diff(points[:, :2], axis=0)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    turn = np.abs((np.diff(headings) + np.pi) % (2.0 * np.pi) - np.pi)
    inner = beside * np.minimum(np.tan(np.minimum(turn, np.pi / 2.0) / 2.0), 1.0)
    return np.concatenate([[beside], inner, [beside]])


def _beams(
    start: Array,
    end: Array,
    more: tuple[float, float],
    rule: OverheadRule,
    below: float,
    tolerance: float,
) -> list[Array]:
    """Prisms (8, 3), of two rings of four corners each, over the wire from start to end and `more`
    [m] past the ends. There the heights are those of the wire's end, in a prism of its own where
    going on along the slope would be off by more than `tolerance` [m].
    """
    step = (end - start)[:2]
    length = float(np.linalg.norm(step))
    ahead = np.array([*step / length, 0.0])
    slope = abs(float(end[2] - start[2])) / length
    first, last = start - more[0] * ahead, end + more[1] * ahead
    beams = []
    if more[0] * slope > tolerance:
        beams.append((first, start, 0.0))
        first = start
    if more[1] * slope > tolerance:
        beams.append((end, last, 0.0))
        last = end
    over = max(float(np.linalg.norm(first - start)), float(np.linalg.norm(last - end)))
    beams.append((first, last, slope * over))
    left = np.array([-ahead[1], ahead[0], 0.0]) * rule.beside
    found = []
    for a, b, slack in beams:
        low, high = np.array([0.0, 0.0, -below - slack]), np.array([0.0, 0.0, rule.above + slack])
        # Counter-clockwise in (left, up), which is so seen from ahead.
        rings = [[p - left + low, p + left + low, p + left + high, p - left + high] for p in (a, b)]
        found.append(np.array(rings).reshape(8, 3))
    return found


def _along(direction: Array) -> Array:
    """(3, 3) with x along `direction` and y level."""
    x = direction / np.linalg.norm(direction)
    y = np.array([-x[1], x[0], 0.0])
    size = float(np.linalg.norm(y))
    y = y / size if size > 1e-9 else np.array([0.0, 1.0, 0.0])
    return np.stack([x, y, np.cross(x, y)], axis=1)
