"""Boxes contain every triangle, keep near the mesh, and come out the same every time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.machine import fitting_kernels as kernels
from backend.machine.fitting import excess, fit_boxes, surface_points
from backend.machine.fitting_clip import clip, outside_box, sample, subdivided
from backend.machine.fitting_cover import cover
from backend.machine.fitting_field import distance_field, room
from backend.machine.fitting_pool import Pool
from backend.machine.fitting_search import covered, tightened
from backend.machine.meshes import mesh_triangles
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import about_axis


def uncovered(boxes: Boxes, triangles: np.ndarray) -> np.ndarray:
    """What is left of the triangles when every box is cut out of them."""
    rest = triangles
    for R, c, h in zip(boxes.rotations, boxes.centers, boxes.half_extents, strict=True):
        rest = outside_box(rest, R, R.T @ c - h, R.T @ c + h)
    return rest


def area(triangles: np.ndarray) -> float:
    a, b = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return float(np.linalg.norm(np.cross(a, b), axis=1).sum() / 2.0)


def solid(*sizes_and_centers: tuple[tuple[float, ...], tuple[float, ...]]) -> np.ndarray:
    parts = []
    for size, center in sizes_and_centers:
        box = trimesh.creation.box(extents=size)
        parts.append(np.array(box.triangles) + np.array(center))
    return np.concatenate(parts)


L_SHAPE = solid(((2.0, 0.4, 0.4), (1.0, 0.0, 0.0)), ((0.4, 0.4, 1.6), (0.2, 0.0, 0.8)))


@given(st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_both_sides_of_a_cut_have_the_whole_area(seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.normal(size=(20, 3, 3))
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    below, above = clip(triangles, normal, 0.1), clip(triangles, -normal, -0.1)
    assert (below @ normal).max(initial=-9.0) <= 0.1 + 1e-9
    assert (above @ normal).min(initial=9.0) >= 0.1 - 1e-9
    assert area(below) + area(above) == pytest.approx(area(triangles), rel=1e-9)


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_inside_and_outside_of_a_box_make_the_whole(seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.normal(size=(10, 3, 3))
    R = about_axis(np.array([0.0, 0.6, 0.8]), float(rng.uniform(0, 6)))
    outside = outside_box(triangles, R, np.full(3, -0.7), np.full(3, 0.9))
    weights = rng.dirichlet(np.ones(3), size=200)
    for t in triangles:
        p = weights @ t
        local = p @ R
        within = ((local > -0.7) & (local < 0.9)).all(axis=1)
        assert within.any() or area(outside) > 0.0
    assert area(outside) <= area(triangles) + 1e-9
    centres = outside.mean(axis=1) @ R
    strictly = ((centres > -0.7 + 1e-6) & (centres < 0.9 - 1e-6)).all(axis=1)
    assert not strictly.any()


def test_samples_leave_no_gap() -> None:
    triangles = np.array([[[0.0, 0, 0], [3.0, 0, 0], [0.2, 0.5, 0.1]]])
    points = sample(triangles, 0.05)
    weights = np.random.default_rng(0).dirichlet(np.ones(3), size=500)
    gaps = np.linalg.norm((weights @ triangles[0])[:, None] - points[None], axis=2).min(axis=1)
    assert gaps.max() < 0.05


def test_subdivision_keeps_the_surface() -> None:
    small = subdivided(L_SHAPE, 0.1)
    edges = np.linalg.norm(small - np.roll(small, 1, axis=1), axis=2)
    assert edges.max() <= 0.1
    assert area(small) == pytest.approx(area(L_SHAPE))


def test_a_cover_is_found_where_there_is_one() -> None:
    rng = np.random.default_rng(3)
    hidden = np.repeat(np.eye(6, dtype=bool), 20, axis=1)  # six sets that together are everything
    holds = np.concatenate([rng.random((300, 120)) < 0.3, hidden])[rng.permutation(306)]
    nothing = np.zeros(0, dtype=np.int64)
    rows, missing = cover(holds, np.ones(120), nothing, 6, 20_000, 0)
    assert missing == np.count_nonzero(~holds[rows].any(axis=0)) == 0
    rows, missing = cover(holds, np.ones(120), nothing, 2, 500, 0)
    assert missing == np.count_nonzero(~holds[rows].any(axis=0)) > 0


def test_the_field_is_the_distance_to_the_mesh() -> None:
    field = distance_field(L_SHAPE)
    # 0.1 m above the middle of the foot, and in its middle, 0.2 m from the faces
    for p, d in (((1.0, 0.0, 0.3), 0.1), ((1.0, 0.0, 0.0), 0.2)):
        value = kernels.value_at(field.values, field.origin, field.step, *p)
        assert value == pytest.approx(d, abs=0.015)


def test_a_box_may_fill_a_pocket_but_not_a_hollow_that_is_open() -> None:
    sides = solid(*(((0.02, 1.0, 1.0), (x, 0.0, 0.0)) for x in (-0.5, 0.5)))
    lids = np.concatenate([sides[:, :, order] for order in ((1, 0, 2), (1, 2, 0))])
    R, half = np.eye(3), np.full(3, 0.45)
    for triangles, allowed in ((np.concatenate([sides, lids]), True), (sides, False)):
        space, pockets = room(distance_field(triangles), 0.1)
        at = (space.values, space.origin, space.step, 0.1, 0.04)
        assert kernels.clear(*at, R, -half, half, -1) is allowed
        assert (len(pockets) > 0) is allowed


def test_candidates_exceed_the_mesh_by_the_tolerance_at_most() -> None:
    space, _ = room(distance_field(L_SHAPE), 0.1)
    points = np.ascontiguousarray(sample(L_SHAPE, 0.1))
    pool = Pool(L_SHAPE, points, space, 0.1, np.random.default_rng(0))
    bars_at = np.array([[1.0, 0.0, 0.0], [0.2, 0.0, 0.8]])
    bars = np.array([[[1.0, 0.2, 0.2]], [[0.2, 0.2, 0.8]]])
    for k in range(60):
        assert pool.offer(pool.axes(), points[[7 * k % len(points)]])
    for R, low, high in zip(pool.R, pool.low, pool.high, strict=True):
        box = Boxes((R @ (low + high) / 2)[None], R[None], (high - low)[None] / 2)
        surface = surface_points(box, 0.03)
        over = np.abs(surface - bars_at[:, None]) - bars  # (2, n, 3); in a bar where all < 0
        outside = np.linalg.norm(np.maximum(over, 0.0), axis=2).min(axis=0)
        assert outside.max() < 0.1 + 0.04


def test_tightened_boxes_hold_the_same_points() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, 1.0, (500, 3))
    R = np.stack([np.eye(3)] * 3)
    low = np.array([[-1.0, -1, -1], [0.4, -1, -1], [0.2, 0.2, 0.2]])
    high = np.array([[0.6, 2.0, 2], [2.0, 2, 2], [0.3, 0.3, 0.3]])
    small = tightened(points, R, low, high)
    assert len(small[0]) == 2  # the third had nothing of its own
    assert np.array_equal(covered(points, *small), covered(points, R, low, high))
    assert np.prod(small[2] - small[1], axis=1).sum() < 1.1


def test_an_l_shape_needs_two_boxes_and_is_contained() -> None:
    boxes = fit_boxes(L_SHAPE, max_boxes=2, max_excess=0.05)
    assert len(boxes) <= 2
    assert len(uncovered(boxes, L_SHAPE)) == 0
    assert excess(boxes, L_SHAPE) < 0.05


def test_excess_of_one_box_around_an_l_is_the_distance_to_its_empty_corner() -> None:
    boxes = Boxes(np.array([[1.0, 0.0, 0.7]]), np.eye(3)[None], np.array([[1.0, 0.2, 0.9]]))
    # The corner (2, 1.6) is 1.4 above the foot and 1.6 beside the post: the foot is nearer.
    assert excess(boxes, L_SHAPE) == pytest.approx(1.4, abs=0.02)


def test_points_inside_another_box_do_not_count() -> None:
    hollow = solid(((2.0, 2.0, 2.0), (0.0, 0.0, 0.0)))
    halves = Boxes(
        np.array([[-0.5, 0, 0], [0.5, 0, 0]]),
        np.stack([np.eye(3)] * 2),
        np.array([[0.5005, 1, 1], [0.5005, 1, 1]]),
    )
    assert excess(halves, hollow) < 0.02


def test_fitting_is_deterministic() -> None:
    a, b = (fit_boxes(L_SHAPE, max_boxes=4, max_excess=0.05) for _ in range(2))
    assert np.array_equal(a.centers, b.centers)
    assert np.array_equal(a.half_extents, b.half_extents)


def test_a_flat_sheet_and_one_triangle_are_contained() -> None:
    sheet = np.array([[[0.0, 0, 0], [1.0, 0, 0], [0.0, 1.0, 0]]])
    for triangles in (sheet, np.concatenate([sheet, sheet + 0.5])):
        assert len(uncovered(fit_boxes(triangles, 3), triangles)) == 0


@pytest.mark.parametrize("bad", [np.zeros((0, 3, 3)), np.zeros((4, 3)), np.full((1, 3, 3), np.nan)])
def test_unusable_triangles_are_refused(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match="triangles must"):
        fit_boxes(bad)


def test_every_corner_of_a_real_bucket_is_in_a_box(shared_data: Path) -> None:
    triangles = mesh_triangles(shared_data / "zx200" / "meshes" / "zx200-bucket.dae")
    boxes = fit_boxes(triangles)
    assert len(boxes) <= 12
    assert len(uncovered(boxes, triangles)) == 0
    assert excess(boxes, triangles) <= 0.15
