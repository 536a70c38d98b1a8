"""What an agent needs of a machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from backend.spatial.types import Array


@dataclass(frozen=True)
class Reading:
    """q, qd: (n,) joint values and rates in the machine's order [rad, rad/s]; time: when they came,
    on the clock that the driver was given [s].
    """

    q: Array
    qd: Array
    time: float


class Driver(Protocol):
    """A machine's joints and tracks. Nothing here may block for longer than a cycle."""

    def read(self) -> Reading | None:
        """The newest joint state, None before the first."""

    def write(self, joints: Array, tracks: Array) -> None:
        """joints: (n,) [rad/s]; tracks: (2,) left, right [m/s]. Given anew every cycle."""

    def stop(self) -> None:
        """Stands still from now on, until the next `write`."""

    def close(self) -> None:
        """Stops, and lets go of the machine."""
