"""What LiDARs saw, as a message of a recording: every number comes back bit by bit."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from backend.pipeline.people_records import Missing, Seen, Sensor
from backend.spatial.types import Array
from backend.tracking.records import STATE


def people_message(seen: Seen) -> dict[str, Any]:
    """Plain numbers, texts, lists and dicts."""
    return {
        "time": seen.time,
        "ready": seen.ready,
        "sensors": [asdict(sensor) for sensor in seen.sensors],
        **{name: getattr(seen, name).tolist() for name in _WHOLE},
        **{name: getattr(seen, name).tolist() for name in _SHAPES},
        "lost": [asdict(one) for one in seen.lost],
    }


def seen_of(document: dict[str, Any]) -> Seen:
    """Raises ValueError, TypeError or KeyError for what is no such message."""
    k = len(document["id"])
    whole = {name: np.array(document[name], dtype=np.int64) for name in _WHOLE}
    arrays = {name: _array(document[name], (k, *shape)) for name, shape in _SHAPES.items()}
    if any(values.shape != (k,) for values in whole.values()):
        raise ValueError("people: id and status must be as long as each other")
    sensors = tuple(
        Sensor(
            str(s["machine"]), str(s["name"]), float(s["time"]), _place(s["position"]),
            int(s["points"]),
        )
        for s in document["sensors"]
    )  # fmt: skip
    lost = tuple(
        Missing(int(m["id"]), _place(m["position"]), float(m["seen"]), float(m["lost"]))
        for m in document["lost"]
    )
    return Seen(
        float(document["time"]), float(document["ready"]), sensors, **whole, **arrays, lost=lost
    )


def _array(values: Any, shape: tuple[int, ...]) -> Array:
    return np.array(values, dtype=np.float64).reshape(shape)


def _place(values: Any) -> tuple[float, float, float]:
    x, y, z = values
    return float(x), float(y), float(z)


_WHOLE = ("id", "status")
_SHAPES: dict[str, tuple[int, ...]] = {
    "state": (STATE,),
    "cov": (4, 4),
    "ahead": (2,),
    "ahead_cov": (2, 2),
    "last_seen": (),
}
