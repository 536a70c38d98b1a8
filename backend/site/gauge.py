"""The working gauge that a site file's own tables describe, in the site frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.gauge.centreline import LineThroughPoints
from backend.gauge.choose import Options
from backend.gauge.features import (
    Area,
    Buried,
    Ceiling,
    Feature,
    KeepIn,
    Overhead,
    OverheadRule,
    Pole,
    Track,
    TrackRule,
)
from backend.gauge.rules import DEFAULT_RULES, Rules, volumes_of
from backend.gauge.volumes import LimitVolume
from backend.site.gauge_tables import Gauge, GaugeArea, Point, TrackEnvelope, WireDistances
from backend.site.site import Site
from backend.spatial.types import Array


def site_volumes(site: Site, more: Iterable[Feature] = ()) -> tuple[LimitVolume, ...]:
    """The limit volumes of a site's tables, and of features from elsewhere in the site frame.

    Raises InputError with one sentence: file, feature, what is allowed.
    """
    try:
        return volumes_of([*site_features(site), *more], site_rules(site))
    except InputError as error:
        raise InputError(f"{site.path}: gauge: {error}") from error


def site_rules(site: Site) -> Rules:
    """The rules of the file, with defaults for what it does not give."""
    table, rules = site.gauge.rules, DEFAULT_RULES
    given = table.model_dump(exclude={"track", "overhead"}, exclude_none=True)
    for field in ("tolerance", "radius"):
        value = getattr(site.gauge, field)
        if value is not None:
            given[field] = value
    return replace(
        rules,
        track=_track_rule(table.track, rules.track),
        overhead=_wire_rule(table.overhead, rules.overhead),
        **given,
    )


def site_options(site: Site) -> Options:
    """What the file switches on and off."""
    switched = dict.fromkeys(site.gauge.on, True) | dict.fromkeys(site.gauge.off, False)
    return Options(switched=switched)


def site_features(site: Site) -> tuple[Feature, ...]:
    """The features of the file's tables. Raises InputError for a track that is no line."""
    gauge, frame, rules = site.gauge, site.frame, site_rules(site)
    found: list[Feature] = []
    for track in gauge.track:
        points = frame.from_projected(np.array(track.points))
        cant = np.array(track.cant) if len(track.cant) > 1 else track.cant[0]
        line = LineThroughPoints(track.name, points, cant, track.gauge, track.state)
        found.append(Track(line, _track_rule(track, rules.track)))
    for wire in gauge.overhead:
        points = frame.from_projected(np.array(wire.points))
        rule = _wire_rule(wire, rules.overhead)
        found.append(Overhead(wire.name, points, wire.state, wire.sag, rule))
    for pole in gauge.pole:
        base = frame.from_projected(np.array([pole.base]))[0]
        found.append(Pole(pole.name, base, pole.radius, pole.height, pole.state, pole.clearance))
    found += _areas(gauge, frame)
    for inside in gauge.keep_in:
        ring = _ring(inside.polygon, frame)
        bottom, top = _height(inside.bottom, frame), _height(inside.top, frame)
        found.append(KeepIn(inside.name, ring, bottom, top, inside.state))
    for pipe in gauge.buried:
        points = frame.from_projected(np.array(pipe.points))
        found.append(Buried(pipe.name, points, pipe.diameter, pipe.state, pipe.clearance))
    if gauge.ceiling is not None:
        ceiling = gauge.ceiling
        around = None if ceiling.polygon is None else _ring(ceiling.polygon, frame)
        height = ceiling.height - frame.origin[2]
        found.append(Ceiling(ceiling.name, height, around, ceiling.state))
    return tuple(found)


def _areas(gauge: Gauge, frame: SiteFrame) -> list[Feature]:
    def area(table: GaugeArea, **kind: Any) -> Area:
        return Area(
            name=table.name,
            polygon=_ring(table.polygon, frame),
            bottom=table.bottom - frame.origin[2],
            top=table.top - frame.origin[2],
            state=table.state,
            clearance=table.clearance,
            **kind,
        )

    return [
        *(area(table, kind="building") for table in gauge.building),
        *(area(table, kind="road") for table in gauge.road),
        *(area(table, kind="keep_out") for table in gauge.keep_out),
    ]


def _track_rule(table: TrackEnvelope, default: TrackRule) -> TrackRule:
    given = {
        field: value
        for field in TrackEnvelope.model_fields
        if (value := getattr(table, field)) is not None
    }
    widths = ("half_width", "from_rail", "profile")
    if any(field in given for field in widths):
        # One way to say how wide replaces another.
        given = {"from_rail": None, "profile": None} | given
    if given.get("profile") is not None:
        given["profile"] = np.array(given["profile"])
    if given.get("pivot") == "none":
        given["pivot"] = None
    return replace(default, **given)


def _wire_rule(table: WireDistances, default: OverheadRule) -> OverheadRule:
    given = {field: getattr(table, field) for field in WireDistances.model_fields}
    return replace(default, **{k: v for k, v in given.items() if v is not None})


def _ring(points: tuple[Point, ...], frame: SiteFrame) -> Array:
    """(k, 2) in the site frame."""
    return np.asarray(np.array(points) - np.array(frame.origin[:2]))


def _height(value: float | None, frame: SiteFrame) -> float | None:
    return None if value is None else value - frame.origin[2]
