"""Overhead lines and pipes: what is too near is inside, little else is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from shapely.geometry import LineString, Point

from backend.errors import InputError
from backend.gauge.features import Buried, Overhead, OverheadRule
from backend.gauge.volumes import LimitVolume
from backend.gauge.wires import buried_volume, overhead_volume
from backend.spatial.types import Array

HERE = np.zeros(2)
RULE = OverheadRule()


def volume_of(points: Array, sag: float = 0.0, rule: OverheadRule = RULE) -> LimitVolume:
    return overhead_volume(Overhead("wire", points, sag=sag), rule, 0.01, HERE, 1e6)


def test_a_level_wire_is_a_box_by_hand() -> None:
    volume = volume_of(np.array([[0.0, 0.0, 6.0], [40.0, 0.0, 6.0]]))
    np.testing.assert_allclose(volume.boxes.centers, [[20.0, 0.0, 7.0]])
    np.testing.assert_allclose(volume.boxes.half_extents, [[23.0, 3.0, 2.0]])
    points = np.array([[20.0, 2.99, 5.01], [20.0, 3.01, 6.0], [20.0, 0.0, 4.99], [-2.99, 0, 6.0]])
    np.testing.assert_array_equal(volume.contains(points), [True, False, False, True])


BENT = np.array(
    [[0.0, 0.0, 6.0], [40.0, 0.0, 7.0], [70.0, 25.0, 5.5], [60.0, 60.0, 6.0], [75.0, 30.0, 6.0]]
)


def test_everything_beside_and_below_is_inside_at_turns_and_slopes() -> None:
    """The wire's points with 3 m around in plan, 1 m below and 3 m above the nearest of them."""
    rng = np.random.default_rng(3)
    volume = volume_of(BENT)
    k = rng.integers(len(BENT) - 1, size=4000)
    t = rng.uniform(size=(4000, 1))
    t[:800] = t[:800].round()  # many at the corners
    wire = BENT[k] + t * (BENT[k + 1] - BENT[k])
    angle, apart = rng.uniform(0.0, 2.0 * np.pi, 4000), 3.0 * np.sqrt(rng.uniform(size=4000))
    around = np.stack([apart * np.cos(angle), apart * np.sin(angle)], axis=1)
    # Beside the wire, across it; at corners, all around where nothing else of the wire is nearer.
    corner = np.isin(t[:, 0], (0.0, 1.0))
    side = (BENT[k + 1] - BENT[k])[:, :2]
    side = side / np.linalg.norm(side, axis=1, keepdims=True)
    across = np.stack([-side[:, 1], side[:, 0]], axis=1) * rng.uniform(-3.0, 3.0, (4000, 1))
    points = wire + np.column_stack(
        [np.where(corner[:, None], around, across), rng.uniform(-1.0, 3.0, 4000)]
    )
    apart = np.array([LineString(BENT[:, :2]).distance(Point(p)) for p in points[:, :2]])
    nearest = ~corner | (apart >= np.linalg.norm(around, axis=1) - 1e-9)
    assert nearest[corner].sum() > 200
    assert volume.contains(points[nearest]).all()


def test_in_plan_only_corners_exceed_the_sides() -> None:
    volume = volume_of(BENT[:3])
    (plan,) = volume.plan
    strip = LineString(BENT[:3, :2]).buffer(3.0, quad_segs=64)
    assert strip.difference(plan.buffer(2e-5)).area < 1e-9
    squares = LineString(BENT[:3, :2]).buffer(3.0, cap_style="square", join_style="mitre")
    assert plan.difference(squares.buffer(2e-5)).area < 1e-6


def test_a_sagging_wire_is_followed_from_below_and_above() -> None:
    a, b, sag = np.array([0.0, 0.0, 8.0]), np.array([60.0, 0.0, 9.0]), 1.2
    volume = volume_of(np.array([a, b]), sag)
    # And one past each end, where the wire's slope does not go on.
    assert len(volume.hulls) == math.ceil(math.sqrt(sag / 0.01)) + 2
    x = np.linspace(0.0, 60.0, 301)
    z = 8.0 + x / 60.0 - 4.0 * sag * (x / 60.0) * (1.0 - x / 60.0)
    for offset, inside in ((-1.0, True), (3.0, True), (-1.012, False), (3.012, False)):
        points = np.stack([x, np.full(301, 2.9), z + offset], axis=1)
        assert (volume.contains(points, 1e-6) == inside).all(), offset


@pytest.mark.parametrize("sag", [0.5, 3.0, 8.0, 16.0])
def test_a_catenary_is_inside(sag: float) -> None:
    """The true curve of a hanging wire, with the same sag in the middle of a level span."""
    span = 80.0
    u = brentq(lambda u: span * (math.cosh(u) - 1.0) / (2.0 * u) - sag, 1e-3, 2.0)
    a = span / (2.0 * u)
    x = np.linspace(0.0, span, 400)
    z = 10.0 - sag + a * (np.cosh((x - span / 2.0) / a) - 1.0)
    volume = volume_of(np.array([[0.0, 0.0, 10.0], [span, 0.0, 10.0]]), sag)
    for offset in (-1.0, 3.0):
        assert volume.contains(np.stack([x, np.zeros(400), z + offset], axis=1)).all()


def test_spans_far_away_are_left_out() -> None:
    far = np.array([[0.0, 0.0, 6.0], [50.0, 0.0, 6.0], [100.0, 0.0, 6.0], [150.0, 0.0, 6.0]])
    volume = overhead_volume(Overhead("wire", far), RULE, 0.01, np.array([75.0, 10.0]), 8.0)
    assert len(volume.hulls) == 1
    assert volume.contains(np.array([[75.0, 0.0, 6.0]])).all()


def test_a_pipe_is_inside_with_all_that_is_near() -> None:
    rng = np.random.default_rng(4)
    points = np.array([[0.0, 0.0, -1.0], [8.0, 1.0, -1.5], [9.0, 6.0, -1.5], [9.0, 6.0, -4.0]])
    volume = buried_volume(Buried("pipe", points, 0.3), 0.5, HERE, 1e6)
    assert len(volume.boxes) == 3
    k, t = rng.integers(3, size=3000), rng.uniform(size=(3000, 1))
    away = rng.normal(size=(3000, 3))
    away *= 0.65 * rng.uniform(size=(3000, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    near = points[k] + t * (points[k + 1] - points[k]) + away
    assert volume.contains(near).all()
    corners = volume.boxes.corners()
    for corner, a, b in zip(corners, points[:-1], points[1:], strict=True):
        t = np.clip((corner - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)[:, None]
        assert (
            np.linalg.norm(corner - a - t * (b - a), axis=1).max() <= 0.65 * math.sqrt(3.0) + 1e-9
        )


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0.0, 0.0, 1.0]], "two or more points"),
        ([[0.0, 0.0, 1.0], [0.0, 0.0, 5.0]], "right above another"),
        ([[0.0, 0.0, np.nan], [0.0, 1.0, 5.0]], "three numbers"),
    ],
)
def test_what_is_no_wire_is_refused(points: list[list[float]], words: str) -> None:
    with pytest.raises(InputError, match=f"^wire: .*{words}.*\\.$"):
        volume_of(np.array(points))


def test_negative_distances_and_empty_pipes_are_refused() -> None:
    span = np.array([[0.0, 0.0, 6.0], [40.0, 0.0, 6.0]])
    with pytest.raises(InputError, match="wire: a distance or the sag is below 0"):
        volume_of(span, rule=OverheadRule(below=-1.0))
    with pytest.raises(InputError, match="pipe: diameter and clearance leave nothing"):
        buried_volume(Buried("pipe", span, 0.2), -0.1, HERE, 1e6)
    with pytest.raises(InputError, match="pipe: has the same point twice"):
        buried_volume(Buried("pipe", span[[0, 0]], 0.2), 0.1, HERE, 1e6)
