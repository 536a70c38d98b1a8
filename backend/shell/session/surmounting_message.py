"""What a machine climbed by plan, from a message of a recording: bit by bit as it was."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from backend.safety.surmounting import Surmounting


def surmounting_of(document: Mapping[str, Any], moved: float = 0.0) -> Surmounting:
    """moved: how much later than by its own time it is played [s].

    Raises ValueError, TypeError or KeyError for what is none.
    """
    x, y, z = _numbers(document["position"], 3)
    yaw, pitch, roll = _numbers(document["attitude"], 3)
    off, turned = _numbers(document["tolerance"], 2)
    support = tuple(_numbers(point, 3) for point in document["support"])
    return Surmounting(
        plan=str(document["plan"]),
        time=float(document["time"]) + moved,
        obstacles=tuple(str(name) for name in document["obstacles"]),
        phase=str(document["phase"]),
        touching=tuple(str(part) for part in document["touching"]),
        position=(x, y, z),
        attitude=(yaw, pitch, roll),
        tolerance=(off, turned),
        support=tuple((a, b, c) for a, b, c in support),
        margin=float(document["margin"]),
        clearance=float(document["clearance"]),
    )


def _numbers(values: Any, count: int) -> tuple[float, ...]:
    found = tuple(float(value) for value in values)
    if len(found) != count:
        raise ValueError(f"surmounting: {len(found)} numbers where {count} belong")
    return found
