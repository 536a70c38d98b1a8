"""Candidate boxes: each alone keeps within the room, and is as large as the room lets it be."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from backend.machine import fitting_kernels as kernels
from backend.machine.fitting_field import Field
from backend.spatial.rotation import about_axis
from backend.spatial.types import Array, BoolArray, IntArray

_SPACING = 0.04  # [m] of the points at which a box's surface is looked at
_ROUGH = 0.1  # [m] the same while turning a box
_BEYOND = 0.06  # [m] a box grows so far beyond the points
_RATES = (0.02, 0.8)  # [m] range of a side's first step in growing


@dataclass(eq=False)
class Pool:
    """Boxes {p: low <= R^T p <= high}: R (n, 3, 3), low, high (n, 3) [m], as lists over n.

    triangles: (m, 3, 3) whose edges suggest orientations; points: (k, 3) to be covered;
    holds: over n, (k,) whether the box holds each point.
    """

    triangles: Array
    points: Array
    room: Field
    tolerance: float
    rng: np.random.Generator
    R: list[Array] = field(default_factory=list)
    low: list[Array] = field(default_factory=list)
    high: list[Array] = field(default_factory=list)
    holds: list[BoolArray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._normals = np.cross(
            self.triangles[:, 1] - self.triangles[:, 0], self.triangles[:, 2] - self.triangles[:, 0]
        )
        self._areas = np.linalg.norm(self._normals, axis=1)
        self._odds = np.cumsum(np.sqrt(self._areas))

    def __len__(self) -> int:
        return len(self.R)

    def axes(self) -> Array:
        """Likely axes (3, 3): the frame's, a triangle's, or turned to one about a frame's axis."""
        draw, turned = self.rng.random(), self.rng.random() < 0.2
        R = np.eye(3)
        t = int(np.searchsorted(self._odds, self.rng.random() * self._odds[-1]))
        if draw > 0.35 and self._areas[t] > 1e-12:
            z = self._normals[t] / self._areas[t]
            edges = self.triangles[t] - np.roll(self.triangles[t], 1, axis=0)
            x = edges[int(np.argmax((edges**2).sum(axis=1)))]
            x = x / np.linalg.norm(x)
            if draw < 0.6:
                b = (x, z)[int(self.rng.integers(2))]
                a = int(self.rng.integers(3))
                R = about_axis(np.eye(3)[a], float(np.arctan2(b[(a + 2) % 3], b[(a + 1) % 3])))
            else:
                R = np.stack([x, np.cross(z, x), z], axis=1)
        return self.jittered(R, 5.0) if turned else R

    def jittered(self, R: Array, degrees: float) -> Array:
        """R turned about a random axis by a normal angle of that deviation."""
        axis = self.rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        return np.asarray(R @ about_axis(axis, np.radians(degrees) * self.rng.normal()))

    def offer(self, R: Array, members: Array, turn: bool = False) -> bool:
        """Add the box around members (n, 3), grown; False where none with such axes is clear.

        turn: look for the axes near R.
        """
        R, members = np.ascontiguousarray(R), np.ascontiguousarray(members)
        at = (self.room.values, self.room.origin, self.room.step, self.tolerance)
        if turn:
            found, R = kernels.settled(*at, _ROUGH, R, members)
            if not found:
                return False
        low, high = kernels.bounds(members, R)
        if not kernels.clear(*at, _SPACING, R, low, high, -1):
            return False
        self._add(R, low, high)
        return True

    def regrow(self, room: Field, tolerance: float) -> None:
        """Grow all boxes further into a larger room."""
        self.room, self.tolerance = room, tolerance
        boxes = list(zip(self.R, self.low, self.high, strict=True))
        self.R, self.low, self.high, self.holds = [], [], [], []
        for box in boxes:
            self._add(*box)

    def also(self, points: Array) -> None:
        """More points (n, 3) to be covered."""
        self.points = np.ascontiguousarray(np.concatenate([self.points, points]))
        for k, box in enumerate(zip(self.R, self.low, self.high, strict=True)):
            self.holds[k] = np.concatenate([self.holds[k], kernels.held(points, *box)])

    def keep(self, rows: IntArray) -> None:
        """Keep these boxes, in this order."""
        for values in (self.R, self.low, self.high, self.holds):
            values[:] = [values[k] for k in rows]

    def _add(self, R: Array, low: Array, high: Array) -> None:
        at = (self.room.values, self.room.origin, self.room.step, self.tolerance)
        lowest, highest = kernels.bounds(self.points, R)
        rates = np.exp(self.rng.uniform(np.log(_RATES[0]), np.log(_RATES[1]), 6))
        low, high = kernels.grown(
            *at,
            _SPACING,
            R,
            low,
            high,
            np.minimum(lowest - _BEYOND, low),
            np.maximum(highest + _BEYOND, high),
            rates,
        )
        self.R.append(R)
        self.low.append(low)
        self.high.append(high)
        self.holds.append(kernels.held(self.points, R, low, high))
