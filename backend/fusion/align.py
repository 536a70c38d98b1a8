"""One stream's value at a given time: interpolated between samples, or extrapolated a little."""

from __future__ import annotations

import math
from bisect import bisect_right
from operator import itemgetter

from backend.fusion.plausible import Entry

_stamp = itemgetter(0)
POINTS = 10  # of a slope at most


def turn(a: float, b: float, circular: bool) -> float:
    """From b to a: the plain difference, or the shortest way round, in [-pi, pi) [rad]."""
    return (a - b + math.pi) % math.tau - math.pi if circular else a - b


def bracket(entries: tuple[Entry, ...], stamp: float) -> tuple[Entry, Entry, float, float]:
    """(a, b, fraction, gap): the two samples around `stamp` (source clock) and where between.

    Outside the samples both are the end's, and gap is how far beyond the last (positive) or before
    the first (negative) the time lies [s].
    """
    index = bisect_right(entries, stamp, key=_stamp)
    if index == len(entries):
        return entries[-1], entries[-1], 0.0, stamp - entries[-1].stamp
    if index == 0:
        return entries[0], entries[0], 0.0, stamp - entries[0].stamp
    a, b = entries[index - 1], entries[index]
    return a, b, (stamp - a.stamp) / (b.stamp - a.stamp), 0.0


def blend(
    a: tuple[float, ...], b: tuple[float, ...], fraction: float, circular: tuple[bool, ...]
) -> tuple[float, ...]:
    """a + fraction (b - a), angles the shortest way; circular: per component, what wraps."""
    return tuple(
        x + fraction * turn(y, x, wraps) for x, y, wraps in zip(a, b, circular, strict=True)
    )


def recent(entries: tuple[Entry, ...], stamp: float, window: float) -> tuple[Entry, ...]:
    """At most `POINTS` entries, evenly chosen, from `window` before `stamp` up to `stamp`.

    At least three where there are as many, so that slow streams have a slope, too; none older than
    a second.
    """
    stop = bisect_right(entries, stamp, key=_stamp)
    if stop == 0:
        return entries[:1]
    end = entries[stop - 1].stamp
    start = bisect_right(entries, end - window, 0, stop, key=_stamp)
    start = max(0, min(start, stop - 3))
    while entries[start].stamp < end - 1.0:
        start += 1
    stride = -(-(stop - start) // POINTS)
    return entries[start:stop][::-1][::stride][::-1]


def slope(
    stamps: list[float], rows: list[tuple[float, ...]], circular: tuple[bool, ...]
) -> tuple[float, ...]:
    """Least-squares rate of change of each component [unit/s], zeros from fewer than two rows.

    Angles are taken relative to the last row, the shortest way, so that a wrap is no rate.
    """
    n, width = len(stamps), len(circular)
    mean = sum(stamps) / n
    spread = sum((t - mean) ** 2 for t in stamps)
    if n < 2 or spread <= 0.0:
        return (0.0,) * width
    last = rows[-1]
    weights = [(t - mean) / spread for t in stamps]
    rates = []
    for k in range(width):
        end, wraps, rate = last[k], circular[k], 0.0
        for weight, row in zip(weights, rows, strict=True):
            rate += weight * turn(row[k], end, wraps)
        rates.append(rate)
    return tuple(rates)


def slope_sigma(stamps: list[float], sigma: float) -> float:
    """Standard deviation of `slope` for independent errors `sigma` of each row, inf below two."""
    mean = sum(stamps) / len(stamps)
    spread = sum((t - mean) ** 2 for t in stamps)
    return sigma / math.sqrt(spread) if spread > 0.0 else math.inf


def extrapolation_sigma(gap: float, speed: float, acceleration: float, limit: float) -> float:
    """What `gap` seconds beyond the samples add to sigma.

    Within `limit` the value moves on at its velocity, and 3 sigma covers the largest acceleration,
    a gap^2 / 2; beyond, it is held, and the way at `speed` over the excess is added.
    """
    return acceleration * gap * gap / 6.0 + abs(speed) * max(0.0, gap - limit)
