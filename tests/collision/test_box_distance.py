"""The exact box distance against coal, python-fcl and its own symmetries."""

from __future__ import annotations

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.collision import box_distance
from backend.collision.closest import RECHECK, all_pairs, closest_pairs, fcl_box, fcl_distance
from backend.spatial import rotation
from backend.spatial.boxes import Boxes


def random_boxes(rng: np.random.Generator, n: int, spread: float = 2.0) -> Boxes:
    q = rng.normal(size=(n, 4))
    return Boxes(
        rng.uniform(-spread, spread, (n, 3)),
        rotation.from_quaternion(q),
        rng.uniform(0.05, 0.8, (n, 3)),
    )


def coal_distance(a: Boxes, b: Boxes, k: int) -> float:
    def placed(boxes: Boxes) -> tuple[coal.Box, coal.Transform3s]:
        return coal.Box(*(2 * boxes.half_extents[k])), coal.Transform3s(
            np.array(boxes.rotations[k]), np.array(boxes.centers[k])
        )

    shape_a, T_a = placed(a)
    shape_b, T_b = placed(b)
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-9
    return float(coal.distance(shape_a, T_a, shape_b, T_b, request, coal.DistanceResult()))


def test_agrees_with_coal_on_random_pairs() -> None:
    rng = np.random.default_rng(1)
    a, b = random_boxes(rng, 3000), random_boxes(rng, 3000)
    ours, points = box_distance.distances(a, b)
    theirs = np.array([coal_distance(a, b, k) for k in range(len(a))])
    apart = ours > 0
    assert 0.2 < apart.mean() < 0.95
    np.testing.assert_allclose(ours[apart], theirs[apart], atol=1e-6)
    assert (theirs[~apart] <= 1e-6).all()
    lengths = np.linalg.norm(points[:, 0] - points[:, 1], axis=1)
    np.testing.assert_allclose(lengths[apart], ours[apart], atol=1e-12)


def enumerated(a: Boxes, b: Boxes, k: int) -> float:
    """Every corner against the other box, every edge against every edge; for separated boxes."""
    best = np.inf
    corners = a.corners()[k], b.corners()[k]
    for one, points in ((b, corners[0]), (a, corners[1])):
        local = np.abs((points - one.centers[k]) @ one.rotations[k]) - one.half_extents[k]
        best = min(best, np.linalg.norm(np.maximum(local, 0.0), axis=1).min())
    edges = [(i, i | 1 << bit) for bit in range(3) for i in range(8) if not i >> bit & 1]
    first, last = np.array(edges).T
    p, u = (v[:, None] for v in (corners[0][first], corners[0][last] - corners[0][first]))
    q, v = corners[1][first][None], (corners[1][last] - corners[1][first])[None]
    s = np.zeros((12, 12, 1))
    uu, vv, uv = (np.sum(x * y, axis=2, keepdims=True) for x, y in ((u, u), (v, v), (u, v)))
    w = p - q
    det = uu * vv - uv * uv
    uw, vw = np.sum(u * w, axis=2, keepdims=True), np.sum(v * w, axis=2, keepdims=True)
    apart = det > 1e-12 * uu * vv
    s = np.where(apart, (uv * vw - vv * uw) / np.where(apart, det, 1.0), 0.0).clip(0.0, 1.0)
    t = ((uv * s + vw) / vv).clip(0.0, 1.0)
    s = ((uv * t - uw) / uu).clip(0.0, 1.0)
    return float(min(best, np.linalg.norm(w + s * u - t * v, axis=2).min()))


def test_leaving_out_edges_that_are_turned_away_loses_nothing() -> None:
    """All features of thick, thin and parallel boxes, near and far."""
    rng = np.random.default_rng(12)
    n, count = 700, 0
    boxes = []
    for _ in range(2):
        half = 10.0 ** rng.uniform(-3.0, 0.5, (n, 3))
        turns = rotation.from_quaternion(rng.normal(size=(n, 4)))
        turns[: n // 3] = rotation.rz(0.3)
        boxes.append(Boxes(rng.uniform(-2.5, 2.5, (n, 3)), turns, half))
    ours, _ = box_distance.distances(*boxes)
    for k in np.flatnonzero(ours > 0.0):
        assert ours[k] == pytest.approx(enumerated(*boxes, k), abs=1e-12)
        count += 1
    assert count > 250


def test_closest_points_lie_on_their_boxes() -> None:
    rng = np.random.default_rng(2)
    a, b = random_boxes(rng, 500), random_boxes(rng, 500)
    ours, points = box_distance.distances(a, b)
    for side, boxes in enumerate((a, b)):
        local = np.einsum("kji,kj->ki", boxes.rotations, points[:, side] - boxes.centers)
        outside = np.abs(local) - boxes.half_extents
        assert outside[ours > 0].max() < 1e-9


@given(
    gap=st.floats(1e-4, 3.0),
    yaw=st.floats(-3, 3),
    pitch=st.floats(-1.5, 1.5),
    roll=st.floats(-3, 3),
    slide=st.floats(-0.4, 0.4),
)
@settings(max_examples=200, deadline=None)
def test_parallel_faces_at_a_known_gap(
    gap: float, yaw: float, pitch: float, roll: float, slide: float
) -> None:
    R = rotation.from_attitude(yaw, pitch, roll)
    a = Boxes(np.zeros((1, 3)), R[None], np.array([[0.5, 0.4, 0.3]]))
    b = Boxes((R @ [0.5 + 0.2 + gap, slide, slide])[None], R[None], np.array([[0.2, 0.1, 0.6]]))
    assert box_distance.distances(a, b)[0][0] == pytest.approx(gap, abs=1e-12)
    assert box_distance.distances(b, a)[0][0] == pytest.approx(gap, abs=1e-12)


def test_rigid_motion_changes_nothing_and_growing_is_never_safer() -> None:
    rng = np.random.default_rng(3)
    a, b = random_boxes(rng, 300), random_boxes(rng, 300)
    before, _ = box_distance.distances(a, b)
    R, p = rotation.from_attitude(0.7, 0.2, -0.4), np.array([308611.0, 4129957.0, 12.0])
    moved = [Boxes(x.centers @ R.T + p, R @ x.rotations, x.half_extents) for x in (a, b)]
    after, _ = box_distance.distances(*moved)
    np.testing.assert_allclose(after, before, atol=2e-8)
    grown, _ = box_distance.distances(a.inflated(0.05), b)
    assert (grown <= before + 1e-12).all()


def test_closest_pairs_is_the_minimum_over_all_pairs() -> None:
    rng = np.random.default_rng(4)
    for _ in range(60):
        a, b = random_boxes(rng, 8), random_boxes(rng, 9)
        b = Boxes(b.centers + rng.uniform(1, 6, 3), b.rotations, b.half_extents)
        every = all_pairs(a, b)
        found = closest_pairs(a, b, within=1.0)
        smallest = every.distance.min()
        if smallest > 0:
            assert found.distance[0] == pytest.approx(smallest, abs=1e-12)
        else:
            assert found.distance[0] < 0
        near = {tuple(p) for p in every.index[(every.distance <= 1.0)]}
        assert near <= {tuple(p) for p in found.index}
        assert (np.diff(found.distance) >= 0).all()


def test_thin_wall_that_misleads_fcl_is_decided_by_the_exact_solver() -> None:
    rng = np.random.default_rng(5)
    wall = Boxes(np.zeros((1, 3)), np.eye(3)[None], np.array([[10.0, 10.0, 0.005]]))
    worst = 0.0
    for _ in range(3000):
        box = random_boxes(rng, 1, spread=4.0)
        exact, _ = box_distance.distances(wall, box)
        if exact[0] <= 0:
            continue
        proposed = fcl_distance(
            fcl_box(wall.centers[0], wall.rotations[0], wall.half_extents[0]),
            fcl_box(box.centers[0], box.rotations[0], box.half_extents[0]),
        )
        worst = max(worst, proposed - exact[0])
        assert closest_pairs(wall, box).distance[0] == pytest.approx(exact[0], abs=1e-12)
    assert worst < RECHECK, "the recheck band must cover what python-fcl gets wrong"


def test_empty_sets_have_no_pairs() -> None:
    empty = Boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
    one = Boxes(np.zeros((1, 3)), np.eye(3)[None], np.ones((1, 3)))
    assert len(closest_pairs(empty, one).distance) == 0


def test_unequal_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="equally many"):
        box_distance.distances(
            random_boxes(np.random.default_rng(0), 2), random_boxes(np.random.default_rng(0), 3)
        )
