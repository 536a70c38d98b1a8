"""Outlines in plan against shapely's convex hull."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.machine.outline import part_outlines
from backend.machine.outline_kernel import convex_hull


def hull(points: np.ndarray) -> np.ndarray:
    return convex_hull(points, np.lexsort((points[:, 1], points[:, 0])))


@pytest.mark.parametrize("n", [3, 8, 64])
def test_hull_agrees_with_shapely(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(200):
        points = rng.normal(size=(n, 2)).round(1)
        ours = hull(points)
        theirs = shapely.convex_hull(shapely.multipoints(points))
        if theirs.area == 0.0:
            continue
        polygon = shapely.Polygon(ours)
        assert polygon.area == pytest.approx(theirs.area, abs=1e-9)
        assert polygon.exterior.is_ccw
        assert polygon.symmetric_difference(theirs).area < 1e-9


def test_points_on_a_line_give_its_ends() -> None:
    line = np.stack([np.linspace(0, 1, 7), np.linspace(2, 4, 7)], axis=1)
    np.testing.assert_allclose(hull(line), [[0, 2], [1, 4]])


def test_outlines_hold_every_corner() -> None:
    machine = load_machine("mini")
    poses = kinematics.link_poses(machine, np.array([0.4, 0.5, -1.0, 0.2]))
    corners = kinematics.body_boxes(machine, poses).corners()[..., :2]
    for part, outline in part_outlines(machine, poses).items():
        area = shapely.Polygon(outline).buffer(1e-9)
        mine = corners[machine.body_parts == part].reshape(-1, 2)
        assert shapely.contains_xy(area, mine).all()
