"""What `cockpit along --json` prints: where a work cycle would violate the limits along a track."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Literal

from pydantic import BaseModel, Field

from backend.machine.model import Machine
from backend.pipeline.along_track import Placement, Question, Stretch
from backend.spatial.types import Array

StateModel = Literal["clear", "violates", "undecided", "unknown"]
STATES = (
    "clear: certified for every station and the whole cycle; violates: certified for every "
    "station; undecided: neither, treat it as a violation; unknown: the track's place or height, "
    "or the limits there, are not known"
)


class StretchModel(BaseModel):
    """One piece of track; stations are distances from the track's start."""

    start: float = Field(description="[m]")
    end: float = Field(description="[m]")
    state: StateModel = Field(description=STATES)
    clearance: float | None = Field(
        description="smallest in the middle of the piece over the cycle's postures [m], negative "
        "on overlap; null beyond the cap, and where unknown"
    )
    at_least: float | None = Field(
        description="no clearance in all of the piece and the cycle is below [m]; null on overlap "
        "and where unknown"
    )
    part: str = Field(description="of the machine, the closest; empty without")
    body: str = Field(description="the closest body, as boom/0; empty without")
    limit: str = Field(description="the closest limit volume or obstacle; empty without")
    posture: dict[str, float] | None = Field(description="of the cycle then, by joint [rad]")


class BandModel(BaseModel):
    """Pieces of one state together."""

    start: float = Field(description="[m]")
    end: float = Field(description="[m]")
    state: StateModel
    clearance: float | None = Field(description="smallest, as above [m]")
    at: float | None = Field(description="station of the smallest [m]")
    part: str
    limit: str


class PlaceModel(BaseModel):
    """How the machine stands on the track."""

    station: float = Field(description="of the machine's root now [m]")
    lateral: float = Field(description="root to the left of the middle between the rails [m]")
    height: float = Field(description="root above the plane of the rails [m]")
    yaw: float = Field(description="its heading against the track's [rad]")
    assumed: bool = Field(description="whether it does not stand there: on the middle was assumed")


class AlongDocument(BaseModel):
    """A machine going along a track with one work cycle; what `cockpit along --json` prints."""

    site: str
    machine: str
    track: str
    length: float = Field(description="of the track [m]")
    place: PlaceModel
    eta: float = Field(description="a clearance of this or less is a violation [m]")
    cap: float = Field(description="how far was looked [m]")
    postures: int = Field(description="that the cycle was thinned to")
    tolerance: float = Field(
        description="bodies leave the hull of two postures that follow each other by no more; "
        "`at_least` counts it [m]"
    )
    bands: list[BandModel]
    stretches: list[StretchModel]


def along_document(
    names: tuple[str, str, str],
    machine: Machine,
    length: float,
    place: Placement,
    assumed: bool,
    question: Question,
    cycle: tuple[int, float],
    stretches: Sequence[Stretch],
) -> AlongDocument:
    """names: of site, machine and track; cycle: number of its postures, its tolerance [m]."""
    site, name, track = names
    return AlongDocument(
        site=site,
        machine=name,
        track=track,
        length=length,
        place=PlaceModel(**vars(place), assumed=assumed),
        eta=question.eta,
        cap=question.cap,
        postures=cycle[0],
        tolerance=cycle[1],
        bands=bands(stretches),
        stretches=[_stretch(machine, item) for item in stretches],
    )


def bands(stretches: Sequence[Stretch]) -> list[BandModel]:
    """Neighbours of one state as one band each, in order."""
    found = []
    for state, group in groupby(stretches, key=lambda item: item.state):
        items = list(group)
        worst = min(items, key=lambda item: _order(item.clearance))
        clearance = number(worst.clearance)
        found.append(
            BandModel(
                start=items[0].start,
                end=items[-1].end,
                state=state,
                clearance=clearance,
                at=None if clearance is None else 0.5 * (worst.start + worst.end),
                part=part_of(worst.body),
                limit=limit_of(worst.limit),
            )
        )
    return found


def part_of(body: str) -> str:
    """ "boom" of "boom/0"."""
    return body.split("/")[0]


def limit_of(name: str) -> str:
    """ "T2" of "gauge:T2/12", "wall" of "site:wall", "hall/0" of "site:hall/0"."""
    kind, _, rest = name.partition(":")
    return rest.rsplit("/", 1)[0] if kind == "gauge" else rest


def number(value: float) -> float | None:
    """None for what is not finite."""
    return value if math.isfinite(value) else None


def _order(value: float) -> float:
    return value if math.isfinite(value) else math.inf


def _stretch(machine: Machine, item: Stretch) -> StretchModel:
    return StretchModel(
        start=item.start,
        end=item.end,
        state=item.state,
        clearance=number(item.clearance),
        at_least=number(item.at_least),
        part=part_of(item.body),
        body=item.body,
        limit=limit_of(item.limit),
        posture=None if item.posture is None else _by_role(machine, item.posture),
    )


def _by_role(machine: Machine, q: Array) -> dict[str, float]:
    return {j.role: float(v) for j, v in zip(machine.joints, q, strict=True)}
