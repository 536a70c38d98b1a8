"""Cross-sections, and their widening as a Minkowski sum with a level segment."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry import Polygon

from backend.gauge.section import rectangle, sections

RINGS = [
    [(-1.0, 0.0), (1.0, 0.0), (1.0, 3.0), (-1.0, 3.0)],
    [(-1.0, 0.0), (1.0, 0.0), (0.2, 4.0)],
    [(0.0, 0.0), (2.0, 1.0), (1.5, 3.0), (-0.5, 3.5), (-1.0, 1.0)],
    [(0.5, 0.0), (1.0, 0.0), (1.0, 3.0), (0.5, 2.0)],
]


@pytest.mark.parametrize("ring", RINGS)
@given(by=st.floats(0.0, 2.0))
def test_widened_is_the_minkowski_sum(ring: list[tuple[float, float]], by: float) -> None:
    (section,) = sections(np.array(ring), "here")
    (wide,) = section.widened(np.array([by]))
    both = [affinity.translate(Polygon(ring), way * by) for way in (-1, 1)]
    expected = shapely.union_all(both).convex_hull
    # Corners may coincide when there is no widening.
    assert shapely.MultiPoint(wide).convex_hull.symmetric_difference(expected).area < 1e-9


@pytest.mark.parametrize("ring", RINGS)
def test_normals_support_their_sides(ring: list[tuple[float, float]]) -> None:
    (section,) = sections(np.array(ring), "here")
    points = section.widened(np.array([0.3]))[0]
    reach = points @ section.normals.T
    for k in range(len(points)):
        on_side = [reach[k, k], reach[(k + 1) % len(points), k]]
        np.testing.assert_allclose(on_side, reach[:, k].max(), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(section.normals, axis=1), 1.0)


def test_only_an_upright_rectangle_is_one() -> None:
    assert rectangle(1.845, 0.0, 5.3)[0].is_rectangle
    assert sections(np.array(RINGS[0]), "here")[0].is_rectangle
    assert not sections(np.array(RINGS[2]), "here")[0].is_rectangle
    turned = np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
    assert not sections(turned, "here")[0].is_rectangle
