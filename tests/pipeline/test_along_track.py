"""A work cycle along a track: what is certified must hold between all samples, by coal."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from separating_axes import placed

from backend.errors import InputError
from backend.gauge.centreline import PointStations
from backend.gauge.features import Area, Overhead, Pole
from backend.gauge.rules import Rules, volumes_of
from backend.machine.load import load_machine
from backend.pipeline.along_cycle import TOLERANCE, Cycle, bulges, thinned
from backend.pipeline.along_track import Placement, Question, Stretch, along_track, placement
from backend.planning.rail_site import BALLAST_DEG, BALLAST_SECONDS
from backend.site.named_bodies import SiteBodies
from backend.site.travel import Way
from backend.spatial.boxes import Boxes, concatenated

RAIL = load_machine("rail6")
RADIUS, GRADIENT, SPACING, LENGTH = 300.0, 0.012, 1.596, 120.0
PLACE = Placement(60.0, 0.08, 0.02, 0.01)
RNG = np.random.default_rng(11)


class Arc:
    """A canted, climbing curve to the left, in closed form."""

    name, state, gauge, length = "T1", "existing", 1.524, LENGTH

    def at(self, s: np.ndarray) -> PointStations:
        a = s / RADIUS
        xy = RADIUS * np.sin(a), RADIUS * (1.0 - np.cos(a))
        return PointStations(
            np.stack([*xy, GRADIENT * s], axis=1),
            a,
            np.full(len(s), GRADIENT),
            cant_at(s),
            np.full(len(s), 1.0 / RADIUS),
        )


def cant_at(s: np.ndarray) -> np.ndarray:
    """A ramp of 1.5 mm a metre, from 20 m on."""
    return np.interp(s, [20.0, 90.0], [0.0, -0.105])


def pose(s: float, place: Placement) -> np.ndarray:
    """T_site_root, from the rails' own geometry: yaw, climb, then cant about the lower rail."""
    a = s / RADIUS
    slope = Rotation.from_euler("ZY", [a, -math.atan(GRADIENT)])
    tilt = math.asin(float(cant_at(np.array([s]))[0]) / SPACING)
    low = math.copysign(SPACING / 2.0, -tilt) if tilt else 0.0  # the lower rail, to the left
    turned = slope * Rotation.from_euler("X", tilt)
    origin = np.array([RADIUS * math.sin(a), RADIUS * (1.0 - math.cos(a)), GRADIENT * s])
    origin = origin + slope.apply([0.0, low, 0.0]) - turned.apply([0.0, low, 0.0])
    T = np.eye(4)
    T[:3, :3] = (turned * Rotation.from_euler("Z", place.yaw)).as_matrix()
    T[:3, 3] = origin + turned.apply([0.0, place.lateral, place.height])
    return T


def beside(s: float, lateral: float) -> np.ndarray:
    a = s / RADIUS
    r = RADIUS - lateral
    return np.array([r * math.sin(a), RADIUS - r * math.cos(a), GRADIENT * s])


WAY = Way("T1", Arc(), spacing=SPACING)
FENCE = np.array([beside(s, y)[:2] for s, y in ((90, -3.4), (104, -3.0), (104, -2.8), (90, -3.2))])
UP = np.array([0.0, 0.0, 7.4])
VOLUMES = volumes_of(
    [
        Pole("near", beside(30.0, -3.1) - [0.0, 0.0, 1.0], 0.2, 8.0),
        Pole("far", beside(64.0, 4.4) - [0.0, 0.0, 1.0], 0.2, 8.0),
        Overhead("wire", np.array([beside(70.0, -9.0), beside(78.0, 9.0)]) + UP),
        Area("fence", "keep_out", FENCE, 0.0, 4.0),
    ],
    Rules(),
)
BODIES = SiteBodies(
    concatenated(volume.boxes for volume in VOLUMES),
    tuple(name for volume in VOLUMES for name in volume.box_names),
    VOLUMES,
)


def recorded() -> np.ndarray:
    """Five postures a second of the ballast cycle, eased, with a tremble."""
    knots = np.concatenate([[0.0], np.cumsum(BALLAST_SECONDS)])
    t = np.arange(0.0, knots[-1], 0.2)
    step = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)
    u = (t - knots[step]) / np.diff(knots)[step]
    u = u * u * (3.0 - 2.0 * u)
    q = np.radians(BALLAST_DEG)
    smooth = q[step] + u[:, None] * (q[step + 1] - q[step])
    return np.asarray(smooth + np.random.default_rng(5).normal(0.0, 3e-4, smooth.shape))


def coal_clearance(q: np.ndarray, T: np.ndarray, boxes: Boxes) -> float:
    """Smallest distance over the postures q (k, n), by coal on every pair near enough [m]."""
    own = placed(RAIL, q)
    request, best = coal.DistanceRequest(), math.inf
    others = [
        (coal.Box(*(2.0 * h)), coal.Transform3s(np.array(R), np.array(c)))
        for c, R, h in zip(boxes.centers, boxes.rotations, boxes.half_extents, strict=True)
    ]
    shapes = [coal.Box(*(2.0 * h)) for h in own.halves]
    size = np.linalg.norm(own.halves, axis=1)
    for c in range(len(q)):
        centers = own.centers[c] @ T[:3, :3].T + T[:3, 3]
        for i, shape in enumerate(shapes):
            at = coal.Transform3s(T[:3, :3] @ own.rotations[c, i], centers[i])
            for b, (box, where) in enumerate(others):
                local = np.abs(boxes.rotations[b].T @ (centers[i] - boxes.centers[b]))
                out = np.linalg.norm(np.maximum(local - boxes.half_extents[b], 0.0))
                if out - size[i] < min(best, 3.0):
                    result = coal.DistanceResult()
                    best = min(best, coal.distance(shape, at, box, where, request, result))
    return float(best)


def between(q: np.ndarray, count: int) -> np.ndarray:
    """Random postures on the straight ways between recorded ones that follow each other."""
    k = RNG.integers(0, len(q) - 1, count)
    return np.asarray(q[k] + RNG.random((count, 1)) * (q[k + 1] - q[k]))


@pytest.fixture(scope="module")
def strip() -> tuple[Stretch, ...]:
    cycle = thinned(RAIL, recorded())
    return along_track(RAIL, cycle, WAY.frames, PLACE, BODIES, (0.0, LENGTH), Question())


def test_the_strip_has_no_gaps_and_every_kind_of_verdict(strip: tuple[Stretch, ...]) -> None:
    edges = [(item.start, item.end) for item in strip]
    assert (edges[0][0], edges[-1][1]) == (0.0, LENGTH)
    assert all(a[1] == b[0] for a, b in pairwise(edges))
    length = {
        state: sum(i.end - i.start for i in strip if i.state == state)
        for state in ("clear", "violates", "undecided", "unknown")
    }
    assert length["clear"] > 30.0
    assert length["violates"] > 10.0
    assert length["undecided"] < 0.5
    assert length["unknown"] == 0.0
    limits = {item.limit.split("/")[0] for item in strip if item.state == "violates"}
    assert {"gauge:near", "gauge:fence"} <= limits


def test_clear_is_clear_between_all_samples(strip: tuple[Stretch, ...]) -> None:
    q = recorded()
    clear = [item for item in strip if item.state == "clear" and item.at_least < 2.0]
    assert len(clear) > 20
    for item in RNG.choice(np.array(clear, dtype=object), 24, replace=False):
        s = float(RNG.uniform(item.start, item.end))
        least = coal_clearance(between(q, 25), pose(s, PLACE), BODIES.boxes)
        assert least > 0.1
        assert least >= item.at_least - 1e-6


def test_at_the_worst_posture_the_bound_is_close_and_coal_agrees(
    strip: tuple[Stretch, ...],
) -> None:
    near = [i for i in strip if i.posture is not None and 0.0 < i.clearance < 2.0]
    for item in RNG.choice(np.array(near, dtype=object), 20, replace=False):
        middle = 0.5 * (item.start + item.end)
        found = coal_clearance(item.posture[None], pose(middle, PLACE), BODIES.boxes)
        assert found == pytest.approx(item.clearance, abs=1e-4)
        assert item.at_least <= item.clearance + 1e-12
        assert item.clearance - item.at_least < 0.5 * (item.end - item.start) + 0.12


def test_what_violates_does_so_at_every_station(strip: tuple[Stretch, ...]) -> None:
    found = [item for item in strip if item.state == "violates"]
    for item in RNG.choice(np.array(found, dtype=object), 20, replace=False):
        s = float(RNG.uniform(item.start, item.end))
        assert item.posture is not None
        assert coal_clearance(item.posture[None], pose(s, PLACE), BODIES.boxes) <= 0.1 + 1e-6


def test_thinning_keeps_every_recorded_body_near_the_hull_of_two_kept_ones() -> None:
    q = recorded()
    cycle = thinned(RAIL, q)
    assert len(cycle.postures) < 0.9 * len(q)
    ends = cycle.ends
    turns = cycle.postures[ends[:, 1]] - cycle.postures[ends[:, 0]]
    bulge = bulges(RAIL, turns)
    assert (bulge.max(axis=1) + cycle.slack <= 2.0 * TOLERANCE + 1e-12).all()
    # The bodies of random recorded motion, against the segments' chords, corner by corner.
    own, kept = placed(RAIL, between(q, 60)), placed(RAIL, cycle.postures)
    for c in range(60):
        off = np.inf
        for k, (a, b) in enumerate(ends):
            p0, p1, p = kept.centers[a], kept.centers[b], own.centers[c]
            way = p1 - p0
            u = np.clip(((p - p0) * way).sum(1) / np.maximum((way * way).sum(1), 1e-12), 0.0, 1.0)
            out = np.linalg.norm(p - (p0 + u[:, None] * way), axis=1)
            off = min(off, float((out - bulge[k] - cycle.slack[k]).max()))
        assert off <= 1e-9


def test_the_bulge_bounds_every_corner_between_two_postures() -> None:
    low, high = np.maximum(RAIL.lower, -3.0), np.minimum(RAIL.upper, 3.0)
    for _ in range(30):
        first = RNG.uniform(low, high)
        last = np.clip(first + RNG.normal(0.0, 0.2, len(first)), low, high)
        u = np.linspace(0.0, 1.0, 41)
        bodies = placed(RAIL, first + u[:, None] * (last - first))
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = bodies.centers[:, :, None] + np.einsum(
            "cbij,bkj->cbki", bodies.rotations, signs * bodies.halves[:, None]
        )
        chord = corners[0] + u[:, None, None, None] * (corners[-1] - corners[0])
        out = np.linalg.norm(corners - chord, axis=-1).max(axis=(0, 2))
        assert (out <= bulges(RAIL, (last - first)[None])[0] + 1e-9).all()


def test_where_the_machine_stands_is_found_from_its_pose() -> None:
    stands = Placement(71.3, -0.2, 0.05, math.pi - 0.02)
    T = pose(71.3, stands)
    station, off = WAY.nearest(T[:3, 3])
    assert station == pytest.approx(71.3, abs=0.05)
    assert off == pytest.approx(0.2, abs=0.05)
    found = placement(WAY.frames, station, T)
    assert found.station == pytest.approx(71.3, abs=1e-5)
    assert (found.lateral, found.height) == pytest.approx((-0.2, 0.05), abs=1e-6)
    assert math.cos(found.yaw - stands.yaw) == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(WAY.frames(np.array([71.3]))[0] @ found.T_track_root, T, atol=1e-6)


def test_unknown_heights_and_limits_out_of_reach_are_never_clear() -> None:
    def gap(s: np.ndarray) -> np.ndarray:
        T = WAY.frames(s)
        T[(s > 40.2) & (s < 42.0)] = np.nan
        return T

    still = Cycle(recorded()[:1], np.zeros(0))
    question = Question()
    found = along_track(RAIL, still, gap, PLACE, BODIES, (36.0, 46.0), question)
    unknown = [item for item in found if item.state == "unknown"]
    assert unknown[0].start == pytest.approx(40.2, abs=0.13)
    assert unknown[-1].end == pytest.approx(42.0, abs=0.13)
    assert all(math.isnan(item.at_least) for item in unknown)
    known = replace(WAY, radius=60.0).known(10.0)
    found = along_track(RAIL, still, WAY.frames, PLACE, BODIES, (36.0, 60.0), question, known)
    assert {item.state for item in found if item.start > 51.0} == {"unknown"}
    assert "unknown" not in {item.state for item in found if item.end < 49.0}
    with pytest.raises(InputError, match="not known at 41"):
        placement(gap, 41.0, pose(41.0, PLACE))


def test_nothing_near_is_clear_beyond_the_cap() -> None:
    still = Cycle(recorded()[:1], np.zeros(0))
    none = SiteBodies()
    (item,) = along_track(RAIL, still, WAY.frames, PLACE, none, (1.0, 1.4), Question())
    assert (item.state, item.clearance, item.at_least) == ("clear", math.inf, 3.0)


@pytest.mark.parametrize(
    ("postures", "message"),
    [(np.zeros((2, 3)), "allowed are one or more"), (np.full((2, 6), np.nan), "not finite")],
)
def test_a_cycle_of_another_machine_is_refused(postures: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        thinned(RAIL, postures)


def test_impossible_questions_are_refused() -> None:
    still = Cycle(recorded()[:1], np.zeros(0))
    with pytest.raises(InputError, match="0 < finest <= step"):
        Question(step=0.01)
    with pytest.raises(InputError, match="rising pair"):
        along_track(RAIL, still, WAY.frames, PLACE, BODIES, (5.0, 5.0), Question())
    with pytest.raises(InputError, match="allowed are 20000"):
        along_track(RAIL, still, WAY.frames, PLACE, BODIES, (0.0, 1e6), Question())
