"""The driving zones of one state document, as `cockpit assess` prints them."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import shapely
from pydantic import BaseModel, Field
from shapely.geometry.base import BaseGeometry

from backend.cspace.driving import Exit, driving_zone, turning_zone, way_out
from backend.machine.model import Machine
from backend.pipeline.images import pair_key
from backend.pipeline.records import Body3D
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

Plane = tuple[float, float]
VARIANTS = ("as_is", "any_swing", "any_posture")


class PolygonDocument(BaseModel):
    """A polygon; the first point of a ring is not repeated."""

    exterior: list[Plane] = Field(description="counter-clockwise [m]")
    holes: list[list[Plane]] = Field(description="clockwise [m]")


class ExitDocument(BaseModel):
    direction: Plane = Field(description="unit vector of travel; from outside: straight away")
    length: float = Field(description="to drive until free, 0 outside [m]")


class DrivingZoneDocument(BaseModel):
    """Positions of the base at which it would touch the partner, bodies as built."""

    as_is: list[PolygonDocument] = Field(description="moved without turning")
    any_swing: list[PolygonDocument] = Field(description="swinging freely in its posture")
    any_posture: list[PolygonDocument] = Field(description="any boom, stick, bucket and swing")
    turning: list[PolygonDocument] = Field(description="as it is, turning on the spot")
    signed_distance: dict[str, float | None] = Field(
        description="of the base from each zone's edge, positive outside; null: no zone [m]"
    )
    exit: dict[str, ExitDocument] = Field(description="the shortest way out of each zone")


def driving_document(
    machines: dict[str, Machine],
    joints: dict[str, Array],
    T_bases: dict[str, Array],
    placed: dict[str, Body3D],
    origin: Array,
) -> dict[str, Any]:
    """Zones of every ordered pair; "left<-right" is "left must avoid right".

    joints: (n,) [rad]; T_bases: (4, 4) and placed: in the frame whose origin in the document's
    frame is `origin` (3,) [m].
    """
    return {
        pair_key(own, partner): _zone(
            machines[own], joints[own], T_bases[own], placed[partner].boxes, origin[:2]
        )
        for own, partner in permutations(machines, 2)
    }


def _zone(
    machine: Machine, q: Array, T_base: Array, partner: Boxes, origin: Array
) -> dict[str, Any]:
    zone = driving_zone(machine, q, T_base, partner)
    turning = turning_zone(machine, q, T_base, partner)
    exits = {**zone.exits, "turning": way_out(turning, T_base[:2, 3])}
    return {
        **{name: polygon_documents(getattr(zone, name), origin) for name in VARIANTS},
        "turning": polygon_documents(turning, origin),
        "signed_distance": {name: _finite(way.signed_distance) for name, way in exits.items()},
        "exit": {name: _exit(way) for name, way in exits.items()},
    }


def polygon_documents(geometry: BaseGeometry, origin: Array) -> list[dict[str, Any]]:
    """The polygons of a zone, moved by origin (2,) [m]."""
    parts = [p for p in shapely.get_parts(geometry) if not p.is_empty]
    oriented = [shapely.geometry.polygon.orient(p) for p in parts]

    def ring(line: BaseGeometry) -> list[list[float]]:
        points: list[list[float]] = (shapely.get_coordinates(line)[:-1] + origin).tolist()
        return points

    return [
        {"exterior": ring(p.exterior), "holes": [ring(hole) for hole in p.interiors]}
        for p in oriented
    ]


def _exit(way: Exit) -> dict[str, Any]:
    return {"direction": way.direction.tolist(), "length": way.length}


def _finite(distance: float) -> float | None:
    return distance if np.isfinite(distance) else None
