"""The pieces of an alignment in plan: lines, arcs, spirals and polylines.

Every piece has `length` [m] and `at(t)`: positions (k, 2) east, north [m], headings (k,) [rad]
counter-clockwise from east and curvatures (k,) [1/m], left positive, at t (k,) [m] from its start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import numpy as np

from backend.gauge.spirals import Shape
from backend.spatial.types import Array

Plan: TypeAlias = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Line:
    """Straight from start (2,) to end (2,) [m]."""

    start: Array
    end: Array
    name: str = ""
    kind: str = field(default="line", init=False)

    @cached_property
    def length(self) -> float:
        return math.dist(self.start, self.end)

    @cached_property
    def heading(self) -> float:
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    def at(self, t: Array) -> Plan:
        step = np.array([math.cos(self.heading), math.sin(self.heading)])
        return self.start + t[:, None] * step, np.full(len(t), self.heading), np.zeros(len(t))


@dataclass(frozen=True)
class Arc:
    """A circular arc from start (2,) with a heading [rad]; curvature [1/m] left positive."""

    start: Array
    heading: float
    curvature: float
    length: float
    name: str = ""
    kind: str = field(default="curve", init=False)

    @property
    def radius(self) -> float:
        return 1.0 / abs(self.curvature)

    @property
    def end(self) -> Array:
        return np.asarray(self.at(np.array([self.length]))[0][0])

    def at(self, t: Array) -> Plan:
        half = self.curvature * t / 2
        chord = t * np.sinc(half / np.pi)
        way = np.stack([np.cos(self.heading + half), np.sin(self.heading + half)], axis=1)
        xy = self.start + chord[:, None] * way
        return xy, self.heading + 2 * half, np.full(len(t), self.curvature)


@dataclass(frozen=True)
class Spiral:
    """A transition curve laid from start (2,) so that its chord points at `toward` (2,) [m].

    radii: at start and end, inf where straight [m]; law: the file's name of it.
    """

    start: Array
    toward: Array
    shape: Shape
    radii: tuple[float, float]
    law: str
    name: str = ""
    kind: str = field(default="spiral", init=False)

    @property
    def length(self) -> float:
        return self.shape.length

    @property
    def end(self) -> Array:
        return np.asarray(self.at(np.array([self.length]))[0][0])

    @cached_property
    def _turned(self) -> tuple[float, Array]:
        xy, _, _ = self.shape.local(np.array([0.0, self.length]))
        own, wanted = xy[1] - xy[0], self.toward - self.start
        return math.atan2(wanted[1], wanted[0]) - math.atan2(own[1], own[0]), xy[0]

    def at(self, t: Array) -> Plan:
        xy, heading, curvature = self.shape.local(t)
        angle, origin = self._turned
        c, s = math.cos(angle), math.sin(angle)
        turned = (xy - origin) @ np.array([[c, s], [-s, c]])
        return self.start + turned, heading + angle, curvature


@dataclass(frozen=True)
class Polyline:
    """Straight pieces between points (n, 2), n >= 2, no two in a row the same [m]."""

    points: Array
    name: str = ""
    kind: str = field(default="polyline", init=False)

    @property
    def start(self) -> Array:
        return np.asarray(self.points[0])

    @property
    def end(self) -> Array:
        return np.asarray(self.points[-1])

    @property
    def length(self) -> float:
        return float(self.distances[-1])

    @cached_property
    def distances(self) -> Array:
        """(n,) along the line to each point [m]."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def at(self, t: Array) -> Plan:
        j = np.clip(np.searchsorted(self.distances, t, side="right") - 1, 0, len(self.points) - 2)
        step = self.points[j + 1] - self.points[j]
        share = (t - self.distances[j]) / (self.distances[j + 1] - self.distances[j])
        xy = self.points[j] + share[:, None] * step
        return xy, np.arctan2(step[:, 1], step[:, 0]), np.zeros(len(t))


Element: TypeAlias = Line | Arc | Spiral | Polyline


def arc(start: Array, end: Array, left: bool, center: Array | None, radius: float) -> Arc:
    """The arc through start and end (2,) that turns left or right about a centre (2,), or with a
    radius and less than half a circle where no centre is given [m].

    Of the centre only its distance from the chord counts, so that the arc meets both ends exactly.
    Raises ValueError when there is no such arc.
    """
    chord = math.dist(start, end)
    if chord == 0.0:
        raise ValueError("its start is its end")
    along = (end - start) / chord
    side = 1.0 if left else -1.0
    if center is not None:
        normal = side * np.array([-along[1], along[0]])
        height = float((center - (start + end) / 2) @ normal)
    elif not (math.isfinite(radius) and radius > 0.0):
        raise ValueError("it has neither a centre nor a radius")
    elif 2 * radius < chord:
        raise ValueError(f"its radius {radius:g} m is less than half its chord {chord:g} m")
    else:
        height = math.sqrt(radius**2 - chord**2 / 4)
    half = math.atan2(chord / 2, height)  # beyond a quarter when the centre lies on the other side
    r = math.hypot(chord / 2, height)
    heading = math.atan2(along[1], along[0]) - side * half
    return Arc(np.asarray(start, dtype=float), heading, side / r, 2 * half * r)
