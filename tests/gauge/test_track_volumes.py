"""Tracks: pieces contain the exact envelope, exceed it by no more than the tolerance, are few."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from envelopes import Envelope
from shapely.geometry import Polygon
from track_curves import Curve, circle, clothoid, constant, straight

from backend.errors import InputError
from backend.gauge.centreline import Centreline, InFrame, PointStations
from backend.gauge.features import Track, TrackRule
from backend.gauge.tracks import stretches, track_volume
from backend.gauge.volumes import LimitVolume
from backend.spatial.types import Array

HERE = np.zeros(2)
TOLERANCE = 0.010

# Corners of a kinematic envelope's kind, and one with a waist, which is not convex.
CONVEX = np.array(
    [
        [-1.5, 0.1],
        [1.5, 0.1],
        [1.7, 1.2],
        [1.7, 3.2],
        [0.5, 4.3],
        [0.0, 4.4],
        [-0.5, 4.3],
        [-1.7, 3.2],
        [-1.7, 1.2],
    ]
)
WAIST = np.array(
    [
        [-1.2, 0.1],
        [1.2, 0.1],
        [1.2, 1.1],
        [1.845, 1.3],
        [1.845, 3.2],
        [0.5, 4.3],
        [-0.5, 4.3],
        [-1.845, 3.2],
        [-1.845, 1.3],
        [-1.2, 1.1],
    ]
)

CURVES = [
    Curve("level", 60.0, straight(2.0)),
    Curve("left", 60.0, circle(300.0), cant=constant(0.10)),
    Curve("right", 60.0, circle(-150.0), cant=constant(-0.15)),
    Curve("transition", 60.0, clothoid(math.sqrt(250.0 * 60.0)), cant=lambda s: 0.15 * s / 60.0),
    Curve("both_ways", 60.0, clothoid(150.0), cant=lambda s: 0.1 * (s / 60.0 - 0.5)),
    Curve(
        "crest",
        60.0,
        straight(-1.0),
        height=lambda s: 0.03 * s - s**2 / 1000.0,
        gradient=lambda s: 0.03 - s / 500.0,
    ),
    Curve("steep_ramp", 20.0, circle(-400.0), cant=lambda s: 0.01 * s - 0.05),
    Curve(
        "all_at_once",
        60.0,
        clothoid(120.0),
        height=lambda s: s**2 / 2000.0,
        gradient=lambda s: s / 1000.0,
        cant=lambda s: 0.12 * s / 60.0,
    ),
]

RULES = {
    "box": TrackRule(),
    "from_rail": TrackRule(from_rail=2.5, bottom=-1.0),
    "convex": TrackRule(profile=CONVEX, widening=36.0),
    "waist": TrackRule(profile=WAIST, pivot="centre"),
}


class Lifted(InFrame):
    """A line that tells how far cant lifts its middle."""

    def __init__(self, line: Centreline, lift: float) -> None:
        super().__init__(line, np.zeros(3))
        self.lift = lift

    def at(self, s: Array) -> PointStations:
        return replace(super().at(s), lift=np.full(len(s), self.lift))


def volume_of(line: Centreline, rule: TrackRule, tolerance: float = TOLERANCE) -> LimitVolume:
    return track_volume(Track(line), rule, tolerance, HERE, 1e6)


def envelope_of(line: Curve, rule: TrackRule) -> Envelope:
    if rule.profile is not None:
        return Envelope(line, Polygon(rule.profile), rule)
    half = rule.half_width
    if rule.from_rail is not None:
        # An upright cross-section: horizontal distances stay what they are under cant.
        half = line.gauge / 2.0 + rule.rail_head + rule.from_rail
        rule = TrackRule(pivot=None)
        bottom, top = -1.0, 5.3
    else:
        bottom, top = rule.bottom, rule.top
    ring = [(-half, bottom), (half, bottom), (half, top), (-half, top)]
    return Envelope(line, Polygon(ring), rule)


def surface(volume: LimitVolume, rng: np.random.Generator, count: int) -> Array:
    """Corners of the pieces, which are farthest out, and random points of their faces."""
    if volume.hulls:
        corners = [hull.vertices for hull in volume.hulls]
        faces = [hull.vertices[list(face)] for hull in volume.hulls for face in hull.faces]
    else:
        corners = list(volume.boxes.corners())
        faces = [box[[i, j, k]] for box in corners for i, j, k in ((0, 1, 2), (4, 5, 6), (0, 1, 4))]
    found = list(np.concatenate(corners))
    for _ in range(count):
        face = faces[rng.integers(len(faces))]
        found.append(rng.dirichlet(np.ones(len(face))) @ face)
    return np.array(found)


@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("line", CURVES, ids=lambda line: line.name)
def test_the_envelope_is_inside_and_little_else(line: Curve, rule: str) -> None:
    rng = np.random.default_rng(1)
    volume = volume_of(line, RULES[rule])
    envelope = envelope_of(line, RULES[rule])
    inside = envelope.points(40, rng)
    assert volume.contains(inside).all()
    outer = surface(volume, rng, 60)
    outer = outer[rng.permutation(len(outer))[:70]]
    assert max(envelope.distance(point) for point in outer) <= TOLERANCE + 1e-6


@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("line", CURVES[1:4], ids=lambda line: line.name)
def test_boxes_contain_the_pieces(line: Curve, rule: str) -> None:
    volume = volume_of(line, RULES[rule])
    assert bool(volume.hulls) == (RULES[rule].profile is not None)
    for hull, k in zip(volume.hulls, range(len(volume.boxes)), strict=False):
        local = (hull.vertices - volume.boxes.centers[k]) @ volume.boxes.rotations[k]
        assert (np.abs(local) <= volume.boxes.half_extents[k] + 1e-9).all()
    if volume.hulls:
        assert len(volume.hulls) == len(volume.boxes)


@pytest.mark.parametrize("radius", [-100.0, 300.0, 2000.0])
@pytest.mark.parametrize("tolerance", [0.003, 0.010, 0.050])
def test_a_circle_takes_as_few_pieces_as_any_convex_ones(radius: float, tolerance: float) -> None:
    """In plan: boxes' radii exceed the ring's by the tolerance, and the count is next to least."""
    w, R = 1.845, abs(radius)
    line = Curve("circle", 150.0, circle(radius))
    volume = volume_of(line, TrackRule(), tolerance)
    center = np.array([0.0, radius])
    corners = volume.boxes.corners()[..., :2].reshape(-1, 2)
    apart = np.linalg.norm(corners - center, axis=1)
    assert apart.max() <= R + w + tolerance + 1e-9
    # The inner sides come nearest to the centre at the foot of its perpendicular.
    for c, R_box, half in zip(
        volume.boxes.centers, volume.boxes.rotations, volume.boxes.half_extents, strict=True
    ):
        local = R_box.T @ (np.array([*center, c[2]]) - c)
        assert abs(local[1]) - half[1] >= R - w - tolerance - 1e-9
    turn = 150.0 / R
    # A convex piece cannot hold more of the inner edge than a chord that leaves it by tolerance.
    least = turn / (2.0 * math.acos(1.0 - tolerance / (R - w)))
    # One between a chord inside and a tangent outside is limited by the tangent's ends.
    tangent = turn / (2.0 * math.acos((R + w) / (R + w + tolerance)))
    # Square ends cost two short pieces and the overlaps, of half width times turn.
    sag = math.sqrt(8.0 * R * tolerance)
    assert least <= len(volume.boxes) <= tangent * (1.03 + 4.0 * w / R) + 2.0 + 1.0
    assert len(volume.boxes) <= 150.0 / sag * (1.04 + 5.0 * w / R) + 3.0


def test_hulls_of_a_circle_are_as_few() -> None:
    volume = volume_of(Curve("circle", 400.0, circle(300.0)), TrackRule(profile=CONVEX))
    tangent = (400.0 / 300.0) / (2.0 * math.acos(301.7 / 301.71))
    assert tangent <= len(volume.hulls) <= 1.03 * tangent + 1.0


def test_a_clothoid_takes_what_its_curvature_asks_for() -> None:
    volume = volume_of(Curve("clothoid", 150.0, clothoid(math.sqrt(300.0 * 150.0))), TrackRule())
    s = np.linspace(0.0, 150.0, 1001)
    sagitta = np.trapezoid(np.sqrt(s / (300.0 * 150.0) / (8.0 * TOLERANCE)), s)
    assert 0.95 * sagitta <= len(volume.boxes) <= 1.06 * sagitta + 3.0


def test_a_crest_takes_what_its_curvature_asks_for() -> None:
    crest = Curve(
        "crest", 400.0, straight(), lambda s: -(s**2) / 6000.0, lambda s: -np.asarray(s) / 3000.0
    )
    ideal = 400.0 / math.sqrt(8.0 * 3000.0 * TOLERANCE)
    assert 0.95 * ideal <= len(volume_of(crest, TrackRule()).boxes) <= 1.06 * ideal + 3.0


def test_a_straight_track_is_one_box() -> None:
    volume = volume_of(Curve("straight", 300.0, straight(0.5)), TrackRule(bottom=0.2, top=5.0))
    assert len(volume.boxes) == 1
    np.testing.assert_allclose(volume.boxes.half_extents, [[150.0, 1.845, 2.4]], atol=1e-6)
    np.testing.assert_allclose(
        volume.boxes.centers, [[150.0 * math.cos(0.5), 150.0 * math.sin(0.5), 2.6]], atol=1e-6
    )


def test_cant_lifts_the_left_rail_about_the_right_one() -> None:
    """By hand: 0.15 m over 1.5 m is a slope of 0.1 across; the low rail stays where it was."""
    line = Curve("canted", 10.0, straight(), cant=constant(0.15), gauge=1.435)
    low = TrackRule(half_width=0.75, bottom=0.0, top=1e-3, rail_head=0.065)
    corners = volume_of(line, low).boxes.corners()[0]
    y, z = corners[:, 1], corners[:, 2]
    right, left = y < 0.0, y > 0.0
    assert z[right].min() == pytest.approx(0.0, abs=1e-6)
    assert z[left].min() == pytest.approx(0.15, abs=1e-6)
    assert y[right].min() == pytest.approx(-0.75 - 1e-4, abs=1e-5)
    middle = TrackRule(half_width=0.75, bottom=0.0, top=1e-3, rail_head=0.065, pivot="centre")
    z = volume_of(line, middle).boxes.corners()[0][:, 2]
    assert z.min() == pytest.approx(-0.075, abs=1e-5)
    assert z.max() == pytest.approx(0.075 + 1e-3, abs=1e-5)
    told = InFrame(line, np.zeros(3))
    for lift, low_z in ((0.075, 0.0), (0.0, -0.075), (-0.075, -0.15)):
        turned = Lifted(told, lift)
        assert volume_of(turned, low).boxes.corners()[0][:, 2].min() == pytest.approx(
            low_z, abs=1e-4
        )
    upright = TrackRule(half_width=0.75, bottom=0.0, top=1e-3, pivot=None)
    assert volume_of(line, upright).boxes.half_extents[0, 2] == pytest.approx(5e-4, abs=1e-6)


def test_from_the_nearest_rail_counts_from_its_outer_side() -> None:
    line = Curve("finnish", 10.0, straight(), gauge=1.524, cant=constant(0.1))
    half = volume_of(line, RULES["from_rail"]).boxes.half_extents[0]
    assert half[1] == pytest.approx(0.762 + 0.072 + 2.5, abs=1e-6)
    assert half[2] == pytest.approx(3.15, abs=1e-6)


def test_widening_goes_with_the_curvature() -> None:
    line = Curve("circle", 4.0, circle(360.0))
    volume = volume_of(line, TrackRule(widening=36.0))
    assert volume.boxes.half_extents[0, 1] == pytest.approx(1.845 + 0.1, abs=TOLERANCE)
    assert volume.boxes.half_extents[0, 1] > 1.845 + 0.1


def test_only_the_part_that_matters_is_kept() -> None:
    line = Curve("long", 2000.0, straight())
    found = stretches(line, np.array([1000.0, 30.0]), 50.0)
    assert len(found) == 1
    (low, high) = found[0]
    assert 945.0 <= low <= 960.0
    assert 1040.0 <= high <= 1055.0
    assert stretches(line, np.array([1000.0, 100.0]), 50.0) == []
    ring = Curve("ring", 2.0 * math.pi * 100.0, circle(100.0))
    ends = stretches(ring, np.array([0.0, 0.0]), 60.0)
    assert len(ends) == 2
    assert ends[0][0] == 0.0
    assert ends[1][1] == pytest.approx(ring.length)


def test_a_stretch_that_is_not_known_is_a_gap_and_no_height_is_refused() -> None:
    def plan(s: Array) -> tuple[Array, Array, Array, Array]:
        nothing = np.zeros(len(s))
        return np.where((s > 31.234) & (s < 47.891), np.nan, s), nothing, nothing, nothing

    line = Curve("gap", 90.0, plan)
    assert np.abs(np.array(stretches(line, HERE, 1e3)) - [[0, 31.234], [47.891, 90]]).max() < 2e-3
    assert len(volume_of(line, TrackRule()).boxes) == 2
    flat = Curve("flat", 50.0, straight(), lambda s: np.full(len(s), np.nan))
    with pytest.raises(InputError, match=r"flat: .* height is not known everywhere .*\.$"):
        volume_of(flat, TrackRule())
    known = track_volume(Track(InFrame(flat, np.zeros(3), 2.0)), TrackRule(), TOLERANCE, HERE, 1e3)
    assert known.boxes.corners()[0, :, 2].min() == pytest.approx(2.0, abs=1e-6)


def test_a_curve_ends_at_a_stretch_that_is_not_known() -> None:
    def plan(s: Array) -> tuple[Array, Array, Array, Array]:
        x, y, heading, curvature = circle(200.0)(s)
        return np.where(s > 30.0, np.nan, x), y, heading, curvature

    volume = volume_of(Curve("cut", 60.0, plan), TrackRule())
    whole = Curve("whole", 30.0, circle(200.0))
    envelope = envelope_of(whole, TrackRule())
    assert volume.contains(envelope.points(40, np.random.default_rng(7)), 2e-3).all()
    corners = volume.boxes.corners().reshape(-1, 3)
    assert max(envelope.distance(point) for point in corners) <= TOLERANCE + 2e-3


def test_lines_of_another_frame() -> None:
    line = CURVES[-1]
    moved = InFrame(line, np.array([-3.0, 4.0, 1.0]))
    there = track_volume(Track(moved), TrackRule(), TOLERANCE, HERE, 1e3)
    here = volume_of(line, TrackRule())
    np.testing.assert_allclose(
        there.boxes.centers, here.boxes.centers + np.array([3.0, -4.0, -1.0])
    )


def two_straights(turn: float) -> Curve:
    """Twice 20 m with a corner between."""

    def plan(s: Array) -> tuple[Array, Array, Array, Array]:
        after = np.maximum(s - 20.0, 0.0)
        x = np.minimum(s, 20.0) + after * math.cos(turn)
        heading = np.where(s > 20.0, turn, 0.0)
        return x, after * math.sin(turn), heading, np.zeros(len(s))

    return Curve("corner", 40.0, plan)


def test_a_small_corner_is_followed_and_a_sharp_one_refused() -> None:
    line = two_straights(0.002)
    volume = volume_of(line, TrackRule())
    inside = envelope_of(line, TrackRule()).points(100, np.random.default_rng(2))
    assert volume.contains(inside).all()
    with pytest.raises(InputError, match=r"corner: .* too sharply near 20\.00 m .* smooth line\.$"):
        volume_of(two_straights(0.1), TrackRule())


@pytest.mark.parametrize(
    ("line", "rule", "words"),
    [
        (Curve("tight", 5.0, circle(3.0)), TrackRule(), "tight: the radius is 3.0 m at 0.0 m"),
        (CURVES[0], TrackRule(top=-1.0), "from 0.0 to -1.0 m above the rails"),
        (CURVES[0], TrackRule(profile=WAIST[[0, 5, 1, 6]]), "level: the track's envelope: the pol"),
    ],
)
def test_what_makes_no_envelope_is_refused(line: Curve, rule: TrackRule, words: str) -> None:
    with pytest.raises(InputError) as caught:
        volume_of(line, rule)
    assert words in str(caught.value)
    assert str(caught.value).endswith(".")
