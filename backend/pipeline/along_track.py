"""What if a machine went along a track with its present work cycle: the strip where that would
violate the limits.

Every stretch of the track is certified for all of its stations and the whole cycle, or is said to
be undecided; a stretch that is clear is clear between the samples, too. Bounds: along the direction
of a separating plane a body's corners move by the way along the track times its share of that
direction, by what the track turns, and by the bulge of the cycle's steps. How the track turns
between samples is bounded by second differences, as for its own envelope (see
`backend.gauge.sweep`). Not from Mäkinen 2021, who judges the present place alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from backend.collision.box_distance import distances
from backend.errors import InputError
from backend.machine.model import Machine
from backend.pipeline import along_kernels
from backend.pipeline.along_cycle import Cycle, Swept, swept
from backend.site.named_bodies import SiteBodies
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray

Frames: TypeAlias = Callable[[Array], Array]
"""T_site_track (k, 4, 4) at stations (k,) [m], NaN where unknown."""

State: TypeAlias = Literal["clear", "violates", "undecided", "unknown"]

_SAMPLES = np.linspace(0.0, 1.0, 5)  # of a stretch at which the track is looked at
_MOST = 20_000  # stretches at once


@dataclass(frozen=True)
class Placement:
    """How a machine stands on a track: station of its root [m], how far it is to the left and above
    the rails [m], and its heading against the track's [rad]; the track says pitch and roll.
    """

    station: float
    lateral: float
    height: float
    yaw: float

    @property
    def T_track_root(self) -> Array:
        """(4, 4)."""
        return transform.make(
            rotation.rz(np.asarray(self.yaw)), np.array([0.0, self.lateral, self.height])
        )


@dataclass(frozen=True)
class Stretch:
    """Stations from start to end [m], one verdict. clearance: the smallest in the middle of it over
    the cycle's kept postures, negative on overlap, infinite beyond the cap; at_least: no clearance
    in all of the stretch and of the cycle is below that, NaN on overlap and where unknown [m];
    body, limit: names of the closest, empty without; posture: (n,) of the cycle then [rad].
    """

    start: float
    end: float
    state: State
    clearance: float
    at_least: float
    body: str = ""
    limit: str = ""
    posture: Array | None = None


@dataclass(frozen=True)
class Question:
    """eta: bodies grown by it [m]; step: length of a stretch; finest: no stretch is cut shorter;
    cap: how far is looked [m].
    """

    eta: float = 0.1
    step: float = 0.5
    finest: float = 0.03
    cap: float = 3.0

    def __post_init__(self) -> None:
        if not (0.0 < self.finest <= self.step and 0.0 <= self.eta < self.cap < math.inf):
            raise InputError(
                f"along a track: step {self.step} m, finest {self.finest} m, eta {self.eta} m, cap "
                f"{self.cap} m; allowed are 0 < finest <= step and 0 <= eta < cap."
            )


def placement(frames: Frames, station: float, T_site_root: Array) -> Placement:
    """Where a machine with root T_site_root (4, 4) stands on a track, from a station near it.

    Raises InputError where the track's place or height is not known there.
    """
    s, local = station, np.zeros(3)
    for _ in range(8):
        T = frames(np.array([s]))[0]
        if not np.isfinite(T).all():
            raise InputError(
                f"the track's place or height is not known at {s:.2f} m; allowed is a "
                "station where it is."
            )
        local = T[:3, :3].T @ (T_site_root[:3, 3] - T[:3, 3])
        if abs(local[0]) < 1e-6 or not np.isfinite(frames(np.array([s + local[0]]))).all():
            break
        s += float(local[0])
    ahead = T[:3, :3].T @ T_site_root[:3, 0]
    return Placement(s, float(local[1]), float(local[2]), math.atan2(ahead[1], ahead[0]))


def along_track(
    machine: Machine,
    cycle: Cycle,
    frames: Frames,
    place: Placement,
    bodies: SiteBodies,
    span: tuple[float, float],
    question: Question,
    known: Callable[[Array], BoolArray] | None = None,
) -> tuple[Stretch, ...]:
    """The verdicts from span[0] to span[1] [m], in order, without gaps.

    bodies: everything that must not be touched, without the track's own envelope; known: (k,) bool
    whether all limits near a root at (k, 3) are known. Raises InputError for a span without length.
    """
    if not (math.isfinite(span[0]) and span[0] < span[1] and math.isfinite(span[1])):
        raise InputError(
            f"stations {span[0]:g} to {span[1]:g} m are no stretch of track; allowed is a rising "
            "pair."
        )
    moved = swept(machine, cycle, place.T_track_root)
    count = max(1, math.ceil((span[1] - span[0]) / question.step - 1e-9))
    if count > _MOST:
        raise InputError(
            f"{span[1] - span[0]:g} m in steps of {question.step:g} m are {count} stretches; "
            f"allowed are {_MOST}."
        )
    edges = np.linspace(*span, count + 1)
    pending = np.stack([edges[:-1], edges[1:]], axis=1)
    done: list[Stretch] = []
    while len(pending):
        again = []
        for item in _judged(machine, cycle, moved, frames, place, bodies, pending, question, known):
            open_ = item.state in ("undecided", "unknown")
            if open_ and item.end - item.start > question.finest:
                middle = 0.5 * (item.start + item.end)
                again += [(item.start, middle), (middle, item.end)]
            else:
                done.append(item)
        pending = np.array(again).reshape(-1, 2)
    return tuple(sorted(done, key=lambda item: item.start))


def _judged(
    machine: Machine,
    cycle: Cycle,
    moved: Swept,
    frames: Frames,
    place: Placement,
    bodies: SiteBodies,
    pending: Array,
    question: Question,
    known: Callable[[Array], BoolArray] | None,
) -> list[Stretch]:
    s = pending[:, :1] + _SAMPLES * (pending[:, 1:] - pending[:, :1])
    T = frames(s.ravel()).reshape(*s.shape, 4, 4)
    sound: BoolArray = np.asarray(np.isfinite(T).all(axis=(1, 2, 3)))
    if known is not None:
        roots = (T @ place.T_track_root)[..., :3, 3]
        sound &= known(np.nan_to_num(roots).reshape(-1, 3)).reshape(s.shape).all(axis=1)
    half_way, off, turn = _ways(T)
    reach = float(moved.far.max())
    hint = np.full(3, -1, dtype=np.int64)
    found = []
    for k, (start, end) in enumerate(pending.tolist()):
        if not sound[k]:
            found.append(Stretch(start, end, "unknown", math.nan, math.nan))
            continue
        middle = T[k, 2]
        near = _near(bodies, middle[:3, 3], reach + question.cap + float(np.abs(half_way[k]).sum()))
        boxes = bodies.boxes.take(near).moved(transform.inverse(middle))
        if hint[0] >= 0:  # the box of the last stretch, among those of this one
            at = np.flatnonzero(near == hint[2])
            hint = np.array([*hint[:2], at[0]]) if len(at) else np.full(3, -1)
        nearest, least, where = along_kernels.stretch(
            *(moved.centers, moved.rotations, moved.halves, moved.corners, moved.ends),
            *(moved.middles, moved.radii, moved.bulge),
            *(boxes.centers, boxes.rotations, boxes.half_extents),
            *(half_way[k], off[k] + turn[k] * moved.far, question.cap, hint),
        )
        state: State = "undecided"
        if least > question.eta:
            state = "clear"
        elif nearest <= question.eta:
            astray = float(off[k] + turn[k] * moved.far[where[1]])
            if _farthest(moved, boxes, where, half_way[k]) + astray <= question.eta:
                state = "violates"
        if nearest <= 0.0:
            least = math.nan
        if where[0] < 0:
            hint = np.full(3, -1, dtype=np.int64)
            found.append(Stretch(start, end, state, math.inf, least))
            continue
        hint = np.array([where[0], where[1], near[where[2]]])
        found.append(
            Stretch(
                *(start, end, state, nearest, least, machine.body_names[where[1]]),
                *(bodies.full_names[hint[2]], cycle.postures[where[0]]),
            )
        )
    return found


def _farthest(moved: Swept, boxes: Boxes, where: IntArray, half_way: Array) -> float:
    """The greatest distance of one body in one posture from one box over a straight way [m]: at one
    of its ends, as the distance of convex bodies is convex.
    """
    j, i, b = where
    ends = Boxes(
        moved.centers[j, i] + np.array([[-1.0], [1.0]]) * half_way,
        np.repeat(moved.rotations[j, i][None], 2, axis=0),
        np.repeat(moved.halves[i][None], 2, axis=0),
    )
    return float(distances(ends, boxes.take(np.array([b, b])))[0].max())


def _ways(T: Array) -> tuple[Array, Array, Array]:
    """Of frames (k, 5, 4, 4): half the way from the first to the last in the middle's axes (k, 3);
    how far off it the origin may be (k,) [m]; by how much a point's distance from the origin times
    it may be moved by turning (k,).
    """
    p, R = T[..., :3, 3], T[..., :3, :3]
    half = 0.5 * (p[:, -1] - p[:, 0])
    share = 2.0 * _SAMPLES - 1.0
    stray = p - p[:, 2:3] - share[:, None] * half[:, None]
    off = np.linalg.norm(stray, axis=-1).max(axis=1)
    # The norm of a difference of rotations is 2 sqrt 2 sin(half the angle), a point's way 2 sin.
    turn = np.linalg.norm(R - R[:, 2:3], axis=(-2, -1)).max(axis=1) / math.sqrt(2.0)
    off = off + 0.5 * _bent(p)
    turn = turn + 0.5 * _bent(R.reshape(*R.shape[:2], 9))
    middle = np.swapaxes(R[:, 2], -1, -2)
    return (middle @ half[:, :, None])[..., 0], off, turn


def _bent(values: Array) -> Array:
    """(k,) the largest second difference of values (k, 5, x)."""
    second = values[:, 2:] - 2.0 * values[:, 1:-1] + values[:, :-2]
    return np.asarray(np.linalg.norm(second, axis=-1).max(axis=1))


def _near(bodies: SiteBodies, center: Array, radius: float) -> IntArray:
    """Indices of the boxes that may be within `radius` of center (3,) [m]."""
    boxes = bodies.boxes
    apart = np.linalg.norm(boxes.centers - center, axis=1)
    some = np.flatnonzero(apart <= radius + bodies.radii)
    local = np.einsum("nji,nj->ni", boxes.rotations[some], center - boxes.centers[some])
    outside = np.maximum(np.abs(local) - boxes.half_extents[some], 0.0)
    return np.asarray(some[np.linalg.norm(outside, axis=1) <= radius], dtype=np.int64)
