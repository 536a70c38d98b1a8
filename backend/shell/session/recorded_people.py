"""The people of a recorded snapshot document, as they were."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from backend.documents.people import LEAST_INDEX
from backend.pipeline.config import Config
from backend.pipeline.people_records import (
    Inside,
    Judged,
    Missing,
    PartnerRisk,
    People,
    Sensor,
    Tracked,
)
from backend.safety.area_records import Within
from backend.safety.people import Risks
from backend.safety.swing_risk import Boundaries, Risk
from backend.spatial.types import Array
from backend.tracking.records import Status

Document = Mapping[str, Any]


def recorded_people(document: Document | None, now: float, config: Config) -> People | None:
    """None where nobody watched. now: the snapshot's time [s]. Raises KeyError, TypeError or
    ValueError for what is missing or of the wrong kind.
    """
    if document is None:
        return None
    tracks = list(document["tracks"])
    # Older recordings have none of these.
    partners, boundaries = list(document.get("machines", ())), document.get("boundaries")
    return People(
        str(document["reason"]),
        _number(document["age"], math.nan),
        tuple(
            Sensor(
                str(one["machine"]),
                str(one["name"]),
                now - float(one["age"]),
                _place(one["position"]),
                int(one["points"]),
            )
            for one in document["sensors"]
        ),
        _tracked(tracks),
        tuple(
            Missing(
                int(one["id"]),
                _place(one["position"]),
                now - float(one["seen"]),
                now - float(one["lost"]),
            )
            for one in document["lost"]
        ),
        {
            name: _judged(name, document["risks"], partners, config)
            for name in config.own
            if any(one["machine"] == name for one in (*document["risks"], *partners))
        },
        Boundaries(_pair(boundaries["index"]), _pair(boundaries["ttc"]))
        if boundaries
        else Boundaries(),
        tuple(
            Inside(
                int(one["id"]),
                str(one["machine"]),
                Within[str(one["area"]).upper()],
                Within[str(one["area_ahead"]).upper()],
            )
            for one in document.get("inside", ())
        ),
    )


def _tracked(tracks: list[Document]) -> Tracked:
    k = len(tracks)

    def column(shape: tuple[int, ...], *path: str) -> Array:
        values = []
        for one in tracks:
            value: Any = one
            for name in path:
                value = value[name]
            values.append(value)
        return np.array(values, dtype=float).reshape(k, *shape)

    return Tracked(
        np.array([int(one["id"]) for one in tracks], dtype=np.int64),
        tuple(str(one["kind"]) for one in tracks),
        np.array([Status[str(one["status"]).upper()] for one in tracks], dtype=np.int64),
        column((3,), "position"),
        column((2,), "velocity"),
        column((), "yaw"),
        column((3,), "size"),
        column((), "sigma"),
        column((), "unseen"),
        column((2,), "ahead", "position"),
        column((2, 2), "ahead", "cov"),
    )


def _judged(name: str, risks: list[Document], partners: list[Document], config: Config) -> Judged:
    own = [one for one in risks if one["machine"] == name]
    bodies = {f"{name}:{body}": k for k, body in enumerate(config.machines[name].body_names)}
    columns = {
        key: np.array([_number(one[key], unknown) for one in own])
        for key, unknown in _NUMBERS.items()
    }
    nearest = tuple(str(one["body"]) for one in own)
    return Judged(
        columns["distance"],
        nearest,
        Risks(
            np.array([bodies.get(body, 0) for body in nearest], dtype=np.int64),
            columns["ttc"],
            columns["index"],
            columns["ttc_ahead"],
            columns["index_ahead"],
            np.array([Risk[str(one["level"])] for one in own], dtype=np.int64),
            np.zeros(len(own), dtype=np.int64),
        ),
        tuple(_partner(one) for one in partners if one["machine"] == name),
    )


def _partner(one: Document) -> PartnerRisk:
    return PartnerRisk(
        str(one["machine"]),
        str(one["other"]),
        str(one["body"]),
        str(one["other_body"]),
        _number(one["ttc"], math.inf),
        _number(one["index"], math.inf),
        _number(one["ttc_ahead"], math.inf),
        _number(one["index_ahead"], math.inf),
        int(Risk[str(one["level"])]),
    )


_NUMBERS = {
    "distance": math.nan,
    **dict.fromkeys(("ttc", "index", "ttc_ahead", "index_ahead"), math.inf),
}
"""A risk's numbers, and what it means where JSON has none."""


def _number(value: Any, unknown: float) -> float:
    if value is None:
        return unknown
    return -math.inf if value == LEAST_INDEX else float(value)


def _pair(values: Any) -> tuple[float, float]:
    first, second = (float(value) for value in values)
    return first, second


def _place(values: Any) -> tuple[float, float, float]:
    x, y, z = (math.nan if value is None else float(value) for value in values)
    return x, y, z
