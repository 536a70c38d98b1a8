"""What LiDARs saw, as a message of a recording: every number comes back bit by bit."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from backend.pipeline.people_records import Missing, Seen, Sensor
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
    identity, status = (np.array(document[name], dtype=np.int64) for name in _WHOLE)
    state, cov, ahead, ahead_cov, last_seen = (
        np.array(document[name], dtype=np.float64).reshape(k, *shape)
        for name, shape in _SHAPES.items()
    )
    if identity.shape != (k,) or status.shape != (k,):
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
        float(document["time"]), float(document["ready"]), sensors, identity, status, state, cov,
        ahead, ahead_cov, last_seen, lost,
    )  # fmt: skip


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
