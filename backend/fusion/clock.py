"""The offset of a machine's clock, from round trips: local = remote + offset.

Each round trip bounds the offset: the remote clock was read after `sent` and before `received`, so
offset lies in [sent - remote, received - remote] whatever the delays were (the interval method of
Marzullo and Owicki 1983). The bounds of the last `WINDOW` seconds are intersected, each widened by
`DRIFT` times its age. An empty intersection is proof that one of the two clocks was stepped.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from backend.fusion.samples import ClockSample

WINDOW = 10.0  # [s]; an estimate older than this can no longer vouch that nothing was stepped
DRIFT = 6e-4  # two crystals at 50 ppm each, and NTP slewing at 500 ppm
MAX_ROUND_TRIP = 2.0  # longer ones say nothing useful [s]
MAX_SAMPLES = 64


class Bounds(NamedTuple):
    """One round trip: offset in [lower, upper] at the local time `at` [s]."""

    at: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Clock:
    """What is known of one machine's clock. stepped: local time of the last step seen, or -inf."""

    trips: tuple[Bounds, ...] = ()
    stepped: float = -math.inf
    received: int = 0
    rejected: int = 0

    def offset(self, now: float) -> tuple[float, float] | None:
        """Bounds of local minus remote [s] at `now`; None without a recent round trip."""
        fresh = [trip for trip in self.trips if now - trip.at <= WINDOW]
        return _intersection(fresh, now) if fresh else None


def _intersection(trips: Iterable[Bounds], now: float) -> tuple[float, float]:
    lower, upper = -math.inf, math.inf
    for at, low, high in trips:
        widening = DRIFT * (now - at)
        if low - widening > lower:
            lower = low - widening
        if high + widening < upper:
            upper = high + widening
    return lower, upper


def update(clock: Clock, sample: ClockSample) -> Clock:
    """The clock after one more round trip; a contradiction drops the past and sets `stepped`.

    Impossible trips (not finite, answered before they were asked, too long, older than the newest)
    are rejected and counted.
    """
    sent, remote, received = sample.sent, sample.remote, sample.received
    newest = clock.trips[-1].at if clock.trips else -math.inf
    possible = (
        math.isfinite(sent + remote + received)
        and max(abs(sent), abs(remote), abs(received)) < 1e11
        and 0.0 <= received - sent <= MAX_ROUND_TRIP
        and received > newest
    )
    if not possible:
        return Clock(clock.trips, clock.stepped, clock.received, clock.rejected + 1)
    own = DRIFT * (received - sent)  # the offset may have drifted while the trip was under way
    trip = Bounds(received, sent - remote - own, received - remote + own)
    # However old, the last trips still tell whether the clock was stepped since.
    lower, upper = _intersection(clock.trips, received)
    count = clock.received + 1
    if trip.upper < lower or trip.lower > upper:
        return Clock((trip,), received, count, clock.rejected)
    recent = tuple(t for t in clock.trips if received - t.at <= WINDOW)[-(MAX_SAMPLES - 1) :]
    return Clock((*recent, trip), clock.stepped, count, clock.rejected)
