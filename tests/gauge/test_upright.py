"""Poles, areas, keep-in areas and ceilings."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely.geometry import Point, Polygon

from backend.errors import InputError
from backend.gauge.features import Area, Ceiling, KeepIn, Pole
from backend.gauge.rules import Rules, volumes_of
from backend.gauge.upright import keep_in_volume, pole_volume
from backend.gauge.volumes import LimitVolume
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray

ELL = np.array([(0, 0), (10, 0), (10, 4), (4, 4), (4, 9), (0, 9)], dtype=float)
RULES = Rules(building=1.0, excess=0.2)


def in_boxes(boxes: Boxes, points: Array) -> BoolArray:
    return LimitVolume("boxes", "building", boxes=boxes).contains(points)


def cloud(low: list[float], high: list[float], count: int = 4000) -> Array:
    return np.random.default_rng(5).uniform(low, high, (count, 3))


def test_a_pole_is_followed_within_the_tolerance() -> None:
    pole = Pole("pole", np.array([3.0, 4.0, 1.0]), radius=0.25, height=8.0)
    volume = pole_volume(pole, 0.05, 0.01)
    a = np.linspace(0.0, 2.0 * np.pi, 500)
    for radius, inside in ((0.2999, True), (0.3101, False)):
        ring = np.stack([3.0 + radius * np.cos(a), 4.0 + radius * np.sin(a), 0.0 * a + 5.0], axis=1)
        assert (volume.contains(ring) == inside).all()
    (box,) = volume.boxes.corners()
    assert in_boxes(volume.boxes, volume.hulls[0].vertices).all()
    assert box[:, 2].min() == 1.0
    assert box[:, 2].max() == 9.0
    assert np.abs(box[:, :2] - [3.0, 4.0]).max() <= 0.31


def test_an_area_with_clearance() -> None:
    (volume,) = volumes_of([Area("hall", "building", ELL, -1.0, 6.0)], RULES)
    points = cloud([-3, -3, -2], [13, 12, 7])
    polygon = Polygon(ELL)
    apart = np.array([polygon.distance(Point(p)) for p in points])
    tall = (points[:, 2] >= -1.0) & (points[:, 2] <= 6.0)
    inside = volume.contains(points)
    assert inside[tall & (apart <= 1.0)].all()
    assert not inside[tall & (apart > 1.021)].any()
    assert not inside[~tall].any()
    assert len(volume.boxes) == 2
    boxed = in_boxes(volume.boxes, points)
    assert boxed[inside].all()
    assert not boxed[apart > 1.0 + 0.2 + 0.45].any()


def test_a_rule_of_its_own_comes_first() -> None:
    road = Area("road", "road", ELL, 0.0, 4.0, clearance=0.0)
    (volume,) = volumes_of([road], Rules(road=2.0))
    assert sum(polygon.area for polygon in volume.plan) == pytest.approx(Polygon(ELL).area)


@pytest.mark.parametrize("ring", [ELL, ELL[[0, 1, 2, 5]]], ids=["ell", "convex"])
def test_a_keep_in_area_leaves_its_inside_free(ring: Array) -> None:
    area = KeepIn("yard", ring, bottom=-2.0, top=6.0)
    volume = keep_in_volume(area, 15.0, 0.2, 12)
    polygon = Polygon(ring)
    points = cloud([-14, -14, -16], [24, 23, 20], 8000)
    apart = np.array([polygon.distance(Point(p)) for p in points])
    depth = np.array([polygon.exterior.distance(Point(p)) for p in points])
    free = (apart == 0.0) & (points[:, 2] > -2.0) & (points[:, 2] < 6.0)
    around = (apart <= 15.0) & (points[:, 2] >= -17.0) & (points[:, 2] <= 21.0)
    inside, boxed = volume.contains(points), in_boxes(volume.boxes, points)
    assert inside[around & ~free].all()
    assert not inside[free & (depth > 1e-6)].any()
    assert boxed[around & ~free].all()
    if len(ring) == 4:
        assert not boxed[free & (depth > 1e-6)].any()
    assert not boxed[free & (depth > 0.2)].any()


def test_without_heights_a_keep_in_area_is_open_above_and_below() -> None:
    volume = keep_in_volume(KeepIn("yard", ELL), 15.0, 0.2, 12)
    column = np.stack([np.full(50, 2.0), np.full(50, 2.0), np.linspace(-14.0, 14.0, 50)], axis=1)
    assert not volume.contains(column).any()
    assert volume.contains(column - [3.0, 0.0, 0.0]).all()


def test_a_ceiling_is_everywhere_or_over_its_polygon() -> None:
    rules = Rules(radius=100.0, depth=20.0)
    everywhere, here = volumes_of([Ceiling("low", 4.5), Ceiling("hall", 3.0, ELL)], rules)
    points = np.array([[90.0, -90.0, 4.6], [0.0, 0.0, 4.4], [0.0, 0.0, 24.0]])
    np.testing.assert_array_equal(everywhere.contains(points), [True, False, True])
    points = np.array([[2.0, 2.0, 3.1], [2.0, 2.0, 2.9], [8.0, 8.0, 3.1]])
    np.testing.assert_array_equal(here.contains(points), [True, False, False])


def test_hulls_are_closed_and_face_outwards() -> None:
    (volume,) = volumes_of([Area("hall", "building", ELL, 0.0, 6.0)], Rules())
    total = 0.0
    for hull in volume.hulls:
        middle = hull.vertices.mean(axis=0)
        assert (hull.planes[:, :3] @ middle < hull.planes[:, 3]).all()
        edges = {(f[i], f[(i + 1) % len(f)]) for f in hull.faces for i in range(len(f))}
        assert all((b, a) in edges for a, b in edges)
        for face in hull.faces:
            ring = hull.vertices[list(face)]
            total += sum(
                np.linalg.det(np.stack([ring[0], ring[i], ring[i + 1]])) / 6.0
                for i in range(1, len(ring) - 1)
            )
    assert total == pytest.approx(Polygon(ELL).area * 6.0)


def test_plans_have_holes() -> None:
    (volume,) = volumes_of([KeepIn("yard", ELL)], Rules(depth=10.0))
    (plan,) = volume.plan
    assert len(plan.interiors) == 1
    assert shapely.symmetric_difference(Polygon(plan.interiors[0]), Polygon(ELL)).area < 1e-6


@pytest.mark.parametrize(
    ("feature", "words"),
    [
        (Area("hall", "building", ELL, 6.0, 6.0), "hall: top is 6.0; allowed is more than bottom"),
        (Area("hall", "road", ELL[[0, 2, 1, 5]], 0.0, 6.0), "hall: the polygon crosses itself"),
        (Area("hall", "road", ELL, 0.0, 6.0, clearance=-1.0), "hall: clearance is -1.0"),
        (KeepIn("yard", ELL, 3.0, 1.0), "yard: top is 1.0"),
        (Pole("pole", np.zeros(3), 0.0, 5.0), "pole: radius or height is not more than 0"),
    ],
)
def test_mistakes_name_the_feature(feature: Area | KeepIn | Pole, words: str) -> None:
    with pytest.raises(InputError) as caught:
        volumes_of([feature])
    assert str(caught.value).startswith(words)
    assert str(caught.value).endswith(".")


def test_a_name_is_used_once() -> None:
    pole = Pole("pole", np.zeros(3), 0.1, 5.0)
    with pytest.raises(InputError, match='called "pole"; allowed is one a name'):
        volumes_of([pole, pole])
    with pytest.raises(InputError, match=r"tolerance is 0\.0"):
        Rules(tolerance=0.0)
