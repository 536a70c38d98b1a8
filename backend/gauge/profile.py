"""The profile of an alignment: height and gradient over the distance in plan.

Points of vertical intersection (PVI) joined by straight grades; a grade's break may be rounded by a
circular arc or by one or two parabolas tangent to both grades.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from backend.spatial.types import Array

SHORTEST = 1e-3  # of a vertical curve's length and radius [m]
REACH = 0.1  # how far beyond its ends a profile is continued by its end's grade [m]


@dataclass(frozen=True)
class Pvi:
    """A point of vertical intersection. s: distance from the alignment's start; z: height [m].

    kind: "point", "circle" (length or radius) or "parabola" (lengths before and after s); radius
    unsigned; NaN for what is not stated.
    """

    s: float
    z: float
    kind: str = "point"
    radius: float = math.nan
    length: float = math.nan
    length_in: float = math.nan
    length_out: float = math.nan


@dataclass(frozen=True)
class Piece:
    """From s on: z = z0 + g x + a x² (+ a circle's rest), x = s - s0; radius 0 for a polynomial,
    else signed: positive for a sag, whose lowest point then is (s0, z0)."""

    s: float
    s0: float
    z0: float
    g: float
    a: float = 0.0
    radius: float = 0.0


Report = Callable[[int, str, float, float, str], None]


@dataclass(frozen=True)
class Profile:
    """name; pvis in order of s; pieces: what `build` made of them."""

    name: str
    pvis: tuple[Pvi, ...]
    pieces: tuple[Piece, ...]
    _table: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        rows = [(p.s, p.s0, p.z0, p.g, p.a, p.radius) for p in self.pieces]
        table = np.array(rows).reshape(-1, 6)
        table[:, 0] = np.maximum.accumulate(table[:, 0])
        object.__setattr__(self, "_table", table)

    @property
    def range(self) -> tuple[float, float]:
        """First and last distance with a height [m]."""
        return self.pvis[0].s, self.pvis[-1].s

    def at(self, s: Array) -> tuple[Array, Array]:
        """Height [m] and gradient (rise over distance in plan) at s (k,); NaN outside its range."""
        first, last = self.range
        j = np.clip(np.searchsorted(self._table[:, 0], s, side="right") - 1, 0, None)
        _, s0, z0, g, a, radius = self._table[j].T
        x = s - s0
        root = np.sqrt(np.maximum(radius**2 - x * x, np.finfo(float).tiny))
        z = z0 + g * x + a * x * x + np.sign(radius) * (np.abs(radius) - root * (radius != 0))
        slope = g + 2 * a * x + np.where(radius != 0, np.sign(radius) * x / root, 0.0)
        known = (s >= first - REACH) & (s <= last + REACH)
        return np.where(known, z, np.nan), np.where(known, slope, np.nan)


def build(
    name: str, pvis: list[Pvi], conflict: Report, skip: Callable[[int, str], None]
) -> Profile:
    """The profile through at least two PVIs with rising s.

    conflict(i, what, stated, used, unit) and skip(i, why) are told of PVI i. A circle's radius
    decides where it fits between its neighbours, else its length; a curve that fits by neither
    leaves the break of grade as it is. Raises ValueError with fewer than two PVIs.
    """
    if len(pvis) < 2:
        raise ValueError("it has fewer than two points")
    grades = [(b.z - a.z) / (b.s - a.s) for a, b in pairwise(pvis)]
    pieces: list[Piece] = []
    free = pvis[0].s  # where the last curve ended
    for i, pvi in enumerate(pvis[:-1]):
        if i > 0 and pvi.kind != "point":
            before, after = grades[i - 1], grades[i]
            room = pvi.s - free, pvis[i + 1].s - pvi.s
            try:
                if pvi.kind == "circle":
                    curve, end = _circle(i, pvi, before, after, room, conflict)
                else:
                    curve, end = _parabola(pvi, before, after, room)
            except ValueError as error:
                skip(i, str(error))
            else:
                pieces += curve
                pieces.append(Piece(end, pvi.s, pvi.z, after))
                free = end
                continue
        pieces.append(Piece(pvi.s, pvi.s, pvi.z, grades[i]))
        free = pvi.s
    return Profile(name, tuple(pvis), tuple(pieces))


def _circle(
    i: int, pvi: Pvi, before: float, after: float, room: tuple[float, float], conflict: Report
) -> tuple[list[Piece], float]:
    """Pieces of the arc and the distance at which it ends."""
    turn = math.atan(after) - math.atan(before)
    if abs(turn) < 1e-12:
        return [], pvi.s
    stated = [pvi.radius, pvi.length / abs(turn)]
    radius = next((r for r in stated if _fits(r, turn, before, after, room)), math.nan)
    if math.isnan(radius):
        raise ValueError(
            f"its circle (radius {pvi.radius:g} m, length {pvi.length:g} m) does not fit between "
            "its neighbours; the break of grade is left sharp"
        )
    if math.isfinite(pvi.radius) and abs(radius - pvi.radius) > 1e-3:
        conflict(i, "radius of the vertical curve", pvi.radius, radius, "m")
    if math.isfinite(pvi.length) and not _same_length(pvi.length, radius, turn):
        conflict(i, "length of the vertical curve", pvi.length, radius * abs(turn), "m")
    tangent = radius * math.tan(abs(turn) / 2)
    begin = pvi.s - tangent * math.cos(math.atan(before))
    end = pvi.s + tangent * math.cos(math.atan(after))
    z_begin = pvi.z - tangent * math.sin(math.atan(before))
    sag = math.copysign(1.0, turn)
    slope = math.atan(before)
    top_s = begin - sag * radius * math.sin(slope)
    top_z = z_begin - sag * radius * (1.0 - math.cos(slope))
    return [Piece(begin, top_s, top_z, 0.0, 0.0, sag * radius)], end


def _same_length(stated: float, radius: float, turn: float) -> bool:
    """Programs state the arc or its projection."""
    arc = radius * abs(turn)
    projected = 2 * radius * math.tan(abs(turn) / 2)
    return min(abs(stated - arc), abs(stated - projected)) <= 1e-3 or abs(stated - arc) < 1e-4 * arc


def _fits(
    radius: float, turn: float, before: float, after: float, room: tuple[float, float]
) -> bool:
    if not SHORTEST <= radius < math.inf:
        return False
    tangent = radius * math.tan(abs(turn) / 2)
    return (
        tangent * math.cos(math.atan(before)) <= room[0] + 1e-3
        and tangent * math.cos(math.atan(after)) <= room[1] + 1e-3
    )


def _parabola(
    pvi: Pvi, before: float, after: float, room: tuple[float, float]
) -> tuple[list[Piece], float]:
    """Two parabolas that meet below or above the PVI; with equal lengths they are one."""
    l1, l2 = pvi.length_in, pvi.length_out
    if not (SHORTEST <= l1 < math.inf and SHORTEST <= l2 < math.inf):
        raise ValueError("its parabola has no length; the break of grade is left sharp")
    if l1 > room[0] + 1e-3 or l2 > room[1] + 1e-3:
        raise ValueError(
            f"its parabola of {l1 + l2:g} m does not fit between its neighbours; the break of "
            "grade is left sharp"
        )
    offset = l1 * l2 * (after - before) / (2 * (l1 + l2))  # of the curve from the PVI
    begin, end = pvi.s - l1, pvi.s + l2
    first = Piece(begin, begin, pvi.z - before * l1, before, offset / l1**2)
    second = Piece(pvi.s, end, pvi.z + after * l2, after, offset / l2**2)
    return [first, second], end
