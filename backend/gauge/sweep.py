"""Convex pieces that contain a cross-section swept along a track, and little more.

Each piece is a straight prism between two stations: its sides have the directions of the
cross-section's own at the middle and stand as close as the swept section lets them; its ends are
the planes of the two stations, or square where it has to be a box. Whatever lies in the piece lies
in the plane of some station between its ends, so that its distance from the section there bounds
its distance from the envelope; and of the points in a plane, the prism's edges are farthest out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.errors import InputError
from backend.gauge.centreline import Centreline
from backend.gauge.convex import outside_distance
from backend.gauge.frames import Pivot, TrackFrames, track_frames
from backend.gauge.section import Section
from backend.gauge.volumes import Hull, stack
from backend.spatial.types import Array, BoolArray

SPACING = 2.0
"""[m] Stations are looked at no farther apart; between them, second differences bound the error."""
LONGEST = 500.0
"""[m] of one piece."""
SHORTEST = 0.01
"""[m]: a line that takes shorter pieces is not smooth."""
CLOSE = 0.01
"""A piece is as long as can be to within this fraction."""


@dataclass(frozen=True)
class Sweep:
    """What is swept. widening: of the section to both sides, times the curvature [m^2]; pivot,
    spacing: see `track_frames`; square: pieces are boxes.
    """

    line: Centreline
    section: Section
    tolerance: float
    widening: float = 0.0
    pivot: Pivot | None = "as_told"
    spacing: float = 1.5
    square: bool = False

    def frames(self, s: Array) -> TrackFrames:
        return track_frames(self.line, s, self.pivot, self.spacing)

    def polygons(self, frames: TrackFrames) -> Array:
        """(k, m, 2): the section, widened."""
        return self.section.widened(self.widening * np.abs(frames.curvature))


@dataclass(frozen=True)
class Piece:
    """start, end: stations [m]; hull: its solid; R: (3, 3) its axes, x along the track; excess:
    farther than this from the envelope it is nowhere [m].
    """

    start: float
    end: float
    hull: Hull
    R: Array
    excess: float


def swept(sweep: Sweep, start: float, end: float) -> list[Piece]:
    """The fewest such pieces, to within a percent, from station `start` to `end` [m].

    Together they contain the envelope. Raises InputError where the line is not smooth enough, or
    its curves are tighter than the section is wide.
    """
    pieces: list[Piece] = []
    length = end - start
    at = start
    while at < end - 1e-9:
        piece = _longest(sweep, at, end, min(length, LONGEST))
        pieces.append(piece)
        at, length = piece.end, piece.end - piece.start
    return pieces


def _longest(sweep: Sweep, start: float, end: float, guess: float) -> Piece:
    """The longest piece from `start` that exceeds the envelope by no more than the tolerance."""
    limit = min(end - start, LONGEST)
    good, bad = 0.0, math.inf
    length = min(guess, limit)
    best = None
    while True:
        piece = _fitted(sweep, start, start + length if length < limit else start + limit)
        ratio = piece.excess / sweep.tolerance
        if ratio <= 1.0:
            best, good = piece, length
            if length >= limit or ratio >= 1.0 - 2.0 * CLOSE:
                return best
        else:
            bad = length
        if best is not None and bad - good <= CLOSE * good:
            return best
        if best is None and bad < SHORTEST:
            raise InputError(
                f"{sweep.line.name}: the line turns or tilts too sharply near {start:.2f} m to be "
                f"followed within {sweep.tolerance} m; allowed is a smooth line."
            )
        # The excess goes with the square of the length, but for twists and ends.
        length *= math.sqrt((1.0 - CLOSE) / max(ratio, 1e-4))
        margin = 0.3 * CLOSE * good
        if math.isinf(bad):
            length = min(max(length, (1.0 + CLOSE) * good), limit)
        elif not good + margin < length < bad - margin:
            length = (good + bad) / 2.0


def _fitted(sweep: Sweep, start: float, end: float) -> Piece:
    count = max(24, math.ceil((end - start) / SPACING))
    s = np.linspace(start, end, count + 1)
    frames = sweep.frames(s)
    polygons = sweep.polygons(frames)
    _check_width(sweep, frames, polygons, s)
    if not np.isfinite(frames.origin).all():
        raise InputError(
            f"{sweep.line.name}: the line's place or height is not known everywhere between "
            f"{start:.2f} and {end:.2f} m; allowed is a line that is."
        )
    piece = _prism(sweep, start, end, frames, polygons, _axes(frames, chord=True))
    if sweep.square and piece.excess > sweep.tolerance:
        # Where growing cant lifts the section, only a box along the track can end with the line.
        along = _prism(sweep, start, end, frames, polygons, _axes(frames, chord=False))
        piece = min(piece, along, key=lambda piece: piece.excess)
    return piece


def _prism(
    sweep: Sweep, start: float, end: float, frames: TrackFrames, polygons: Array, R: Array
) -> Piece:
    """The piece with axes R around the polygons of stations from start to end."""
    origin = frames.origin[len(polygons) // 2]
    local = (frames.place(polygons) - origin) @ R
    support = local[..., 1:] @ sweep.section.normals.T
    corners = _corners(sweep.section.normals, support.max(axis=(0, 1)) + _between(support))
    edges = origin + corners @ R[:, 1:].T
    slices, depth = _slices(frames, edges, R[:, 0])
    out = outside_distance(slices, polygons)
    excess = out.max() + float(_between(out).max())
    if not sweep.square:
        caps = edges[None] + depth[[0, -1], :, None] * R[:, 0]
        return Piece(start, end, stack(caps.reshape(-1, 3)), R, float(excess))
    along = local[..., 0]
    margin = float(_between(along).max())
    ends = along.min() - margin, along.max() + margin
    over = [
        _overhang(sweep, start, -1, float((depth[0] - ends[0]).max()), edges, R),
        _overhang(sweep, end, 1, float((ends[1] - depth[-1]).max()), edges, R),
    ]
    caps = np.stack([edges + x * R[:, 0] for x in ends])
    return Piece(start, end, stack(caps.reshape(-1, 3)), R, max(float(excess), *over))


def _axes(frames: TrackFrames, chord: bool) -> Array:
    """(3, 3): x along the chord or the track, y to the left as the section stands in the middle,
    z.
    """
    middle = len(frames.lateral) // 2
    x = frames.origin[-1] - frames.origin[0] if chord else frames.tangent[middle]
    x = x / np.linalg.norm(x)
    y = frames.lateral[middle]
    y = y - (y @ x) * x
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _between(values: Array) -> Array:
    """What a function may exceed its samples (k, ...) by between them: of a smooth one an eighth of
    its second differences, of one with a kink half of them; the most over all but the last axis.
    """
    if len(values) < 3:
        return np.zeros(values.shape[-1])
    second = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    return np.asarray(0.5 * second.max(axis=tuple(range(values.ndim - 1))) + 1e-9)


def _corners(normals: Array, support: Array) -> Array:
    """(m, 2) corners of {x: normals x <= support}, counter-clockwise; (m - 1) where a side is idle.

    normals: (m, 2), counter-clockwise.
    """
    while True:
        following = np.roll(normals, -1, axis=0)
        det = normals[:, 0] * following[:, 1] - normals[:, 1] * following[:, 0]
        b = np.roll(support, -1)
        x = (support * following[:, 1] - b * normals[:, 1]) / det
        y = (normals[:, 0] * b - following[:, 0] * support) / det
        corners = np.stack([x, y], axis=1)
        side = corners - np.roll(corners, 1, axis=0)
        length = normals[:, 0] * side[:, 1] - normals[:, 1] * side[:, 0]
        worst = int(length.argmin())
        if length[worst] >= -1e-12 or len(normals) == 3:
            return corners
        keep: BoolArray = np.arange(len(normals)) != worst
        normals, support = normals[keep], support[keep]


def _slices(frames: TrackFrames, edges: Array, x: Array) -> tuple[Array, Array]:
    """Where lines through `edges` (m, 3) along x (3,) meet the planes of k stations: (k, m, 2) in
    the planes, and (k, m) how far along.
    """
    to = frames.origin[:, None] - edges
    depth = (to * frames.tangent[:, None]).sum(-1) / (frames.tangent @ x)[:, None]
    offset = depth[..., None] * x - to
    yz = [(offset * axis[:, None]).sum(-1) for axis in (frames.lateral, frames.up)]
    return np.stack(yz, axis=-1), depth


def _overhang(sweep: Sweep, station: float, way: int, over: float, edges: Array, R: Array) -> float:
    """The excess of what a box has beyond the plane of its last station by up to `over` [m].

    There it is in the planes of the next stations; beyond the line's end, or where nothing is known
    of it, it is in none.
    """
    last = 0.0 if way < 0 else sweep.line.length
    frames = sweep.frames(np.array([station]))
    wide = np.abs(sweep.polygons(frames)[..., 0]).max() + sweep.tolerance
    reach = 1.1 * over / max(1.0 - wide * abs(float(frames.curvature[0])), 0.1) + 1e-6
    rest = abs(last - station)
    s = station + way * np.linspace(0.0, min(reach, rest), 4)
    frames = sweep.frames(s)
    if not np.isfinite(frames.origin).all():
        rest = 0.0
        frames = sweep.frames(s[:1])
    slices, _ = _slices(frames, edges, R[:, 0])
    excess = float(outside_distance(slices, sweep.polygons(frames)).max())
    return excess if reach <= rest else math.hypot(excess, max(over - rest, 0.0))


def _check_width(sweep: Sweep, frames: TrackFrames, polygons: Array, s: Array) -> None:
    tight = np.abs(polygons[..., 0]).max(axis=1) * np.abs(frames.curvature)
    worst = int(tight.argmax())
    if tight[worst] > 0.5:
        raise InputError(
            f"{sweep.line.name}: the radius is {1.0 / abs(frames.curvature[worst]):.1f} m at "
            f"{s[worst]:.1f} m; allowed is more than twice the envelope's half width."
        )
