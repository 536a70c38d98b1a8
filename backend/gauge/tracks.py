"""The working gauge of a track: its kinematic envelope along its centreline."""

from __future__ import annotations

import math

import numpy as np

from backend.errors import InputError
from backend.gauge.centreline import Centreline
from backend.gauge.features import Track, TrackRule
from backend.gauge.section import Section, rectangle, sections
from backend.gauge.sweep import Piece, Sweep, swept
from backend.gauge.volumes import LimitVolume, boxes_around
from backend.spatial.types import Array

STEP = 5.0
"""[m] A centreline is looked at so often for whether it is within the part that matters."""


def track_volume(
    track: Track, rule: TrackRule, tolerance: float, center: Array, radius: float
) -> LimitVolume:
    """The envelope of `track` where it is within `radius` of `center` (2,) [m].

    Its pieces are boxes where the cross-section is a rectangle. Raises InputError for a rule or a
    centreline that makes no envelope.
    """
    line = track.line
    parts = sections_of(rule, line)
    spacing = line.gauge + rule.rail_head
    upright = rule.from_rail is not None and rule.profile is None
    pieces: list[Piece] = []
    for start, end in stretches(line, center, radius):
        for part in parts:
            sweep = Sweep(
                line,
                part,
                tolerance,
                rule.widening,
                None if upright else rule.pivot,
                spacing,
                square=part.is_rectangle,
            )
            pieces += swept(sweep, start, end)
    boxes = boxes_around((piece.hull.vertices, piece.R) for piece in pieces)
    solid = all(part.is_rectangle for part in parts)
    return LimitVolume(
        name=track.name,
        kind="track",
        state=track.state,
        rule=words(rule),
        boxes=boxes,
        hulls=() if solid else tuple(piece.hull for piece in pieces),
        axis=_axis(line, pieces),
    )


def sections_of(rule: TrackRule, line: Centreline) -> tuple[Section, ...]:
    """The convex parts of the rule's cross-section. Raises InputError for an impossible one."""
    where = f"{line.name}: the track's envelope"
    if rule.profile is not None:
        return sections(rule.profile, where)
    half = rule.half_width
    if rule.from_rail is not None:
        half = line.gauge / 2.0 + rule.rail_head + rule.from_rail
    if not (half > 0.0 and rule.bottom < rule.top):
        raise InputError(
            f"{where} is {half} m to each side, from {rule.bottom} to {rule.top} m above the "
            "rails; allowed is a width above 0 and a bottom below the top."
        )
    return rectangle(half, rule.bottom, rule.top)


def stretches(line: Centreline, center: Array, radius: float) -> list[tuple[float, float]]:
    """From where to where [m] the line is within `radius` of `center` (2,), a little more at both
    ends, and its place in plan is known (finite).
    """
    count = max(1, math.ceil(line.length / STEP))
    s = np.linspace(0.0, line.length, count + 1)
    xy = line.at(s).xyz[:, :2]
    known = np.asarray(np.isfinite(xy).all(axis=1))
    apart = np.full(len(s), np.inf)
    apart[known] = np.linalg.norm(xy[known] - center, axis=1)
    # Whatever is within the radius between two of the places is within a step more of both.
    inside = apart <= radius + STEP
    edges = np.diff(np.concatenate([[0], inside.astype(int), [0]]))
    found = []
    for first, last in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0) - 1, strict=True):
        low, high = float(s[first]), float(s[last])
        if first > 0 and not known[first - 1]:
            low = _edge(line, low, float(s[first - 1]))
        if last < count and not known[last + 1]:
            high = _edge(line, high, float(s[last + 1]))
        found.append((low, high))
    return [(low, high) for low, high in found if high > low]


def _edge(line: Centreline, known: float, unknown: float) -> float:
    """The last station whose place is known, to a millimetre [m]."""
    while abs(unknown - known) > 1e-3:
        middle = (known + unknown) / 2.0
        if np.isfinite(line.at(np.array([middle])).xyz[:, :2]).all():
            known = middle
        else:
            unknown = middle
    return known


def words(rule: TrackRule) -> str:
    """The rule as people say it."""
    wider = f", widened by {rule.widening:g} m²/R" if rule.widening else ""
    if rule.profile is not None:
        return f"kinematic envelope of {len(rule.profile)} corners{wider}"
    if rule.from_rail is not None:
        return f"{rule.from_rail:g} m from the nearest rail{wider}"
    return f"{rule.half_width:g} m to each side of the centre line{wider}"


def _axis(line: Centreline, pieces: list[Piece]) -> Array | None:
    if not pieces:
        return None
    s = np.unique([station for piece in pieces for station in (piece.start, piece.end)])
    return np.asarray(line.at(s).xyz)
