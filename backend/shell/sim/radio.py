"""The radio between machine and cockpit: messages leave in batches and take their time.

Sun 2020, Section 5.1: the radio sends every 40 ms, and 100 ms pass in all from measurement to use.
A message waits for the next departure, then travels for what is left of the whole delay, so that
the oldest of a batch arrives `latency` after it was measured and the newest `latency - period`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Generic, TypeVar

M = TypeVar("M")


@dataclass(frozen=True)
class Radio:
    """period: between departures, 0 for none [s]; latency: whole delay, waiting included [s]."""

    period: float
    latency: float

    def __post_init__(self) -> None:
        if not (0.0 <= self.period < math.inf and 0.0 <= self.latency < math.inf):
            raise ValueError("period and latency must be 0 s or more")


@dataclass(frozen=True)
class OnAir(Generic[M]):
    """A message and when it arrives [s]."""

    arrival: float
    message: M


def arrival_time(stamp: float, radio: Radio) -> float:
    """When a message measured at `stamp` [s] arrives."""
    if radio.period == 0.0:
        return stamp + radio.latency
    # Half a microsecond: the float64 spacing of today's epoch seconds is 0.24 us.
    departure = math.ceil((stamp - 5e-7) / radio.period) * radio.period
    return max(stamp, departure) + max(radio.latency - radio.period, 0.0)


def send(
    on_air: tuple[OnAir[M], ...], stamp: float, message: M, radio: Radio
) -> tuple[OnAir[M], ...]:
    """The messages on air after one more. Order of sending is kept."""
    return (*on_air, OnAir(arrival_time(stamp, radio), message))


def receive(on_air: tuple[OnAir[M], ...], now: float) -> tuple[tuple[M, ...], tuple[OnAir[M], ...]]:
    """(messages that have arrived by `now`, messages still on air)."""
    if not on_air or on_air[0].arrival > now:
        return (), on_air
    arrived = tuple(item.message for item in on_air if item.arrival <= now)
    return arrived, tuple(item for item in on_air if item.arrival > now)
