"""Few boxes instead of many: nothing is left out, and what is near stays as it is."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.closest import all_pairs
from backend.collision.cover import cover
from backend.collision.scene import scene
from backend.spatial import rotation
from backend.spatial.boxes import NO_BOXES, Boxes


def boxes(rng: np.random.Generator, n: int, spread: float) -> Boxes:
    return Boxes(
        rng.uniform(-spread, spread, (n, 3)),
        rotation.from_quaternion(rng.normal(size=(n, 4))),
        rng.uniform(0.01, 0.5, (n, 3)),
    )


def corners_within(box: Boxes, corners: np.ndarray) -> np.ndarray:
    """(n,) whether all corners (n, 8, 3) are inside of the one box."""
    local = np.abs((corners - box.centers[0]) @ box.rotations[0]) - box.half_extents[0]
    return (local <= 1e-9).all(axis=(1, 2))


@pytest.mark.parametrize("seed", range(6))
def test_all_within_reach_is_covered_and_near_boxes_are_as_they_are(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 1500))
    spread = 25.0 if seed % 2 else 10.0
    many, around = boxes(rng, n, spread), boxes(rng, 5, 2.0)
    names = tuple(f"site:{k}" for k in range(n))
    reach, near = 9.0, 1.0
    few, called = cover(scene(many, names), around, reach, near)
    assert len(few) == len(called)
    distance = all_pairs(around, many).distance.reshape(5, n).min(axis=0)
    corners = many.corners()
    covered = np.zeros(n, dtype=bool)
    for k in range(len(few)):
        inside = corners_within(few.take(np.array([k])), corners)
        covered |= inside
        if "more" in called[k]:
            gap = all_pairs(around, few.take(np.array([k]))).distance.min()
            assert gap > near
            assert inside.sum() >= 1 + int(called[k].split(" + ")[1].split()[0])
        else:
            assert inside[int(called[k].removeprefix("site:"))]
    assert covered[distance <= reach].all()
    assert {f"site:{k}" for k in np.flatnonzero(distance <= near)} <= set(called)
    if n > 500 and spread == 10.0:
        assert len(few) < 0.5 * (distance <= reach).sum()


def test_nothing_within_reach() -> None:
    rng = np.random.default_rng(0)
    far = Boxes(np.array([[50.0, 0.0, 0.0]]), np.eye(3)[None], np.ones((1, 3)))
    assert len(cover(scene(far, ("far",)), boxes(rng, 3, 1.0), 10.0, 1.0)[0]) == 0
    assert cover(scene(), boxes(rng, 3, 1.0), 10.0, 1.0) == (NO_BOXES, ())
