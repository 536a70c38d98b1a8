"""All that a machine passes is inside the boxes that others keep away from."""

from __future__ import annotations

import numpy as np
import pytest

from backend.collision.closest import closest_pairs
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.planning.trajectory.announced import STEP, moved, passed, postures
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

T = transform.make(rotation.from_attitude(0.4, 0.05, -0.1), np.array([3.0, -2.0, 1.0]))


@pytest.mark.parametrize("model", ["mini", "ex13"])
def test_bodies_between_the_postures_are_inside(model: str) -> None:
    machine, random = load_machine(model), np.random.default_rng(5)
    corners = np.array([[0.0, 0.5, -1.2, -0.4], [0.9, 0.7, -1.0, -0.4], [1.5, 0.2, -1.6, 0.1]])
    taken, seen = passed(machine, corners, T), moved(machine, corners)
    assert 0 < seen.sum() < len(seen)  # the tracks stand
    for _ in range(60):
        k, s = int(random.integers(0, 2)), random.uniform()
        q = corners[k] + s * (corners[k + 1] - corners[k])
        bodies = body_boxes(machine, link_poses(machine, q, T)).take(seen)
        for body in range(len(bodies)):
            points = bodies.take(np.array([body])).corners().reshape(-1, 3)
            inside = [_holds(taken, p) for p in points]
            assert all(inside), (q, body)


def test_postures_are_no_farther_apart_than_a_step_and_not_more_than_needed() -> None:
    machine = load_machine("mini")
    fine = np.linspace([0.0, 0.5, -1.2, -0.4], [1.5, 0.7, -1.0, 0.2], 400)
    found = postures(machine, fine)
    np.testing.assert_array_equal(found[[0, -1]], fine[[0, -1]])
    ways = (np.abs(np.diff(found, axis=0)) @ machine.stretched_levers.T).max(axis=1)
    assert ways.max() <= STEP + 1e-9
    assert len(found) < 2.2 * ways.sum() / STEP
    assert len(passed(machine, fine[:0], T)) == 0


def test_nothing_of_a_machine_that_stands() -> None:
    machine = load_machine("mini")
    still = np.tile([0.0, 0.5, -1.2, -0.4], (3, 1))
    assert len(passed(machine, still, T)) == 0


def _holds(boxes: Boxes, point: np.ndarray) -> bool:
    tiny = Boxes(point[None], np.eye(3)[None], np.full((1, 3), 1e-9))
    return bool(closest_pairs(boxes, tiny).distance[0] <= 0.0)
