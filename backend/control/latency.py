"""How long commands and data take there and back, and whether motion is locked because of it.

Delay is noticed from 100 ms on, and performance falls from 200 to 300 ms. Above `LOCKED_ABOVE` the
machine is locked until every round trip of the last `SETTLED` seconds was below `OPEN_BELOW`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from backend.safety.limiter import LOCKED_ABOVE

GOOD_BELOW = 0.1  # [s]
FAIR_BELOW = 0.25  # [s]
OPEN_BELOW = 0.25  # [s]
SETTLED = 2.0  # [s]
SILENT = 0.6
"""Without an answer for this long, nothing is known of the link [s]; agents report at 10 Hz."""


@dataclass(frozen=True)
class Trip:
    """at: when the answer came [s]; seconds: there and back."""

    at: float
    seconds: float


@dataclass(frozen=True)
class Link:
    """trips: of the last `SETTLED` seconds; last: the newest whatever its age; locked: latched."""

    trips: tuple[Trip, ...] = ()
    last: Trip | None = None
    locked: bool = False
    opened: float = -math.inf  # since when the newest trips are all short [s]


@dataclass(frozen=True)
class Condition:
    """round_trip: the longest of the last `SETTLED` seconds [s], inf when unknown; level: "ok",
    "slow", "bad", "locked" or "unknown"; locked: why nothing may move, in words, else empty.
    """

    round_trip: float
    level: str
    locked: str

    @property
    def known(self) -> bool:
        return math.isfinite(self.round_trip)


def measured(link: Link, trip: Trip) -> Link:
    """The link after an answer; a trip that is not a duration counts as endless."""
    seconds = trip.seconds if trip.seconds >= 0.0 else math.inf
    trip = Trip(trip.at, seconds)
    recent = tuple(t for t in link.trips if trip.at - t.at <= SETTLED)
    opened = link.opened
    if seconds >= OPEN_BELOW:
        opened = math.inf
    elif not math.isfinite(opened):
        opened = trip.at
    locked = link.locked
    if seconds > LOCKED_ABOVE:
        locked = True
    elif locked and trip.at - opened >= SETTLED:
        locked = False
    return replace(link, trips=(*recent, trip), last=trip, locked=locked, opened=opened)


def condition(link: Link, now: float) -> Condition:
    """What the link is like at `now` [s]."""
    if link.last is None:
        return Condition(math.inf, "unknown", "the machine has not answered yet")
    silence = now - link.last.at
    if silence > SILENT:
        return Condition(math.inf, "unknown", f"no answer from the machine for {silence:.1f} s")
    longest = max(t.seconds for t in link.trips if now - t.at <= SETTLED)
    if link.locked:
        limit = f"locked until below {1e3 * OPEN_BELOW:.0f} ms for {SETTLED:.0f} s"
        return Condition(longest, "locked", f"round trip {1e3 * longest:.0f} ms: {limit}")
    level = "ok" if longest < GOOD_BELOW else "slow" if longest < FAIR_BELOW else "bad"
    return Condition(longest, level, "")
