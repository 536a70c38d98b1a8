"""Near misses: two machines came closer than their stop distance, and parted again."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from backend.pipeline.records import PairDistance, Snapshot

APART = 0.1  # beyond the stop distance, before the next near miss of a pair can begin [m]


@dataclass(frozen=True)
class NearMiss:
    """machine, part; other, other_part: who came close with what; distance: the smallest [m];
    at, begin, end: when it was smallest, when it began and ended, local clock [s].
    """

    machine: str
    part: str
    other: str
    other_part: str
    distance: float
    at: float
    begin: float
    end: float

    @property
    def text(self) -> str:
        """In an operator's words."""
        own, other = self.machine.upper(), self.other.upper()
        gap = f"{self.distance:.2f} m" if self.distance > 0.0 else "contact"
        return f"{own} {_word(self.part)} ↔ {other} {_word(self.other_part)} {gap}"


class NearMisses:
    """Watches the distances of all pairs. stop_below: the site's stop distance [m]."""

    def __init__(self, stop_below: float) -> None:
        self._stop_below = stop_below
        self._open: dict[tuple[str, str], NearMiss] = {}

    def update(self, snapshot: Snapshot) -> list[NearMiss]:
        """The near misses that ended with this snapshot. An unknown distance ends none."""
        ended = []
        for pair in snapshot.pairs:
            distance = pair.distance
            if math.isnan(distance):
                continue
            key = (pair.a, pair.b)
            now = self._open.get(key)
            if now is not None and distance > self._stop_below + APART:
                ended.append(replace(self._open.pop(key), end=snapshot.time))
            elif pair.near and (distance < self._stop_below if now is None else True):
                self._open[key] = _closer(now, pair, snapshot.time)
        return ended

    def close(self) -> list[NearMiss]:
        """Those that have not ended, at the end of a recording."""
        still, self._open = list(self._open.values()), {}
        return still


def _closer(now: NearMiss | None, pair: PairDistance, time: float) -> NearMiss:
    if now is not None and pair.distance >= now.distance:
        return replace(now, end=time)
    begin = time if now is None else now.begin
    return NearMiss(pair.a, pair.body_a, pair.b, pair.body_b, pair.distance, time, begin, time)


def _word(body: str) -> str:
    return body.partition("/")[0].replace("_", " ")
