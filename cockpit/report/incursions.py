"""When machines came closer than they should have, and how close."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Incursion:
    """One stretch below the slow distance. start, end, at [s]; pair: "left|right"; least [m] at
    `at`; open: the session began or ended, or the distance became unknown, during it.
    """

    pair: str
    start: float
    end: float
    at: float
    least: float
    open: bool


def incursions(
    time: Sequence[float],
    clearance: Mapping[str, Sequence[float | None]],
    slow_below: float,
    joined: float = 1.0,
) -> tuple[Incursion, ...]:
    """All incursions in order of time. time: (k,) [s]; clearance: pair -> (k,) [m], None unknown.

    Stretches less than `joined` [s] apart are one.
    """
    found: list[Incursion] = []
    for pair, values in clearance.items():
        mine: list[Incursion] = []
        begun: int | None = None
        for k in range(len(time) + 1):
            value = values[k] if k < len(time) else None
            if value is not None and value < slow_below:
                begun = k if begun is None else begun
                continue
            if begun is not None:
                mine.append(_stretch(pair, time, values, begun, k))
                begun = None
        found += _join(mine, joined)
    return tuple(sorted(found, key=lambda one: one.start))


def _stretch(
    pair: str, time: Sequence[float], values: Sequence[float | None], begun: int, k: int
) -> Incursion:
    inside = [(v, time[begun + i]) for i, v in enumerate(values[begun:k]) if v is not None]
    least, at = min(inside)
    cut = begun == 0 or k == len(time) or values[k] is None or values[begun - 1] is None
    return Incursion(pair, time[begun], time[k - 1], at, least, cut)


def _join(found: Sequence[Incursion], joined: float) -> list[Incursion]:
    merged: list[Incursion] = []
    for one in found:
        if merged and one.start - merged[-1].end < joined:
            last = merged.pop()
            least, at = min((last.least, last.at), (one.least, one.at))
            one = Incursion(one.pair, last.start, one.end, at, least, last.open or one.open)
        merged.append(one)
    return merged
