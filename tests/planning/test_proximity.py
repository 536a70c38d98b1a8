"""Close pairs against separating axes written for the tests, and gradients against differences."""

from __future__ import annotations

import numpy as np
import separating_axes
from gauge_runs import DRIVING, RAIL

from backend.machine.kinematics import link_poses
from backend.planning.act import sight
from backend.planning.careless import careless_drive
from backend.planning.proximity import Sight, gradients, near_points, posed, shortest
from backend.planning.records import State
from backend.planning.simulate import clearances
from backend.spatial.rotation import rz
from backend.spatial.transform import make


def scenes(count: int, first: int = 0):
    for seed in range(first, first + count):
        plan = careless_drive(RAIL, seed, 1.0)
        yield np.random.default_rng(seed), plan.limits, plan.q_start


def test_compiled_poses_are_those_of_kinematics():
    random = np.random.default_rng(0)
    T_site_root = make(rz(0.7), np.array([3.0, -2.0, 0.5]))
    for _ in range(20):
        q = random.uniform(-1.5, 1.5, 6)
        np.testing.assert_allclose(
            posed(RAIL, q, T_site_root), link_poses(RAIL, q, T_site_root), atol=1e-12
        )


def test_the_shortest_distance_is_the_independent_one():
    for _, limits, q in scenes(12):
        near = near_points(RAIL, posed(RAIL, q), limits, Sight.everywhere(RAIL, 50.0), True)
        want = separating_axes.clearance(RAIL, q, limits.boxes)
        # The oracle's gaps along axes are the distance of faces, and else a bound from below.
        assert shortest(near) >= want - 1e-9
        assert abs(shortest(near) - clearances(RAIL, limits, q[None])[0]) < 1e-12
        # Corners say nothing nearer than the closest points do.
        plain = near_points(RAIL, posed(RAIL, q), limits, Sight.everywhere(RAIL, 50.0))
        assert abs(shortest(plain) - shortest(near)) < 1e-12
        assert len(plain) < len(near)


def test_points_normals_and_distances_agree():
    for _, limits, q in scenes(6):
        near = near_points(RAIL, posed(RAIL, q), limits, Sight.everywhere(RAIL, 3.0), True)
        apart = near.distance > 1e-6
        back = near.obstacle_point + near.distance[:, None] * near.normal
        np.testing.assert_allclose(back[apart], near.point[apart], atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(near.normal, axis=1), 1.0, atol=1e-9)


def test_gradients_are_the_differences_of_the_distances():
    """Of every corner and closest pair that is the same feature a little later."""
    compared = 0
    for random, limits, q in scenes(8):
        T = posed(RAIL, q)
        step = 1e-6 * random.uniform(-1.0, 1.0, 6)
        sees = Sight.everywhere(RAIL, 2.0)
        here = near_points(RAIL, T, limits, sees, True)
        there = near_points(RAIL, posed(RAIL, q + step), limits, sees, True)
        if len(here) != len(there):
            continue
        want = there.distance - here.distance
        got = gradients(RAIL, T, here) @ step
        same = np.linalg.norm(there.normal - here.normal, axis=1) < 1e-4
        np.testing.assert_allclose(got[same], want[same], atol=1e-9)
        compared += int(same.sum())
    assert compared > 300


def test_overlapping_boxes_part_along_their_normal():
    parted = 0
    plans = [careless_drive(RAIL, seed, 1.0) for seed in range(10)]
    for seed in range(200):
        plan = plans[seed % 10]
        q = np.random.default_rng(seed).uniform(RAIL.lower.clip(-3), RAIL.upper.clip(max=3))
        near = near_points(
            RAIL, posed(RAIL, q), plan.limits, Sight.everywhere(RAIL, 0.01), own=False
        )
        for k in np.flatnonzero(near.distance < -1e-3):
            part = plan.limits.boxes.take(np.array([near.obstacle[k]]))
            moved = part.moved(make(np.eye(3), (near.distance[k] - 1e-6) * near.normal[k]))
            body = int(near.body[k])
            placed = separating_axes.placed(RAIL, q[None])
            own = placed.centers[0, body], placed.rotations[0, body], placed.halves[body]
            gap = separating_axes.box_gaps(
                *(v[None] for v in own), moved.centers, moved.rotations, moved.half_extents
            )
            assert gap[0] > -1e-9
            parted += 1
    assert parted > 20


def test_nothing_out_of_sight_could_bind():
    """Pairs beyond `sight` keep their dampers whatever the joints do in the next step."""
    for random, limits, q in scenes(5):
        T, dt = posed(RAIL, q), 0.02
        rates = random.uniform(-1.0, 1.0, 6) * RAIL.max_velocity
        sees = sight(RAIL, T, "constrained", DRIVING, State(rates), dt)
        every = near_points(RAIL, T, limits, Sight.everywhere(RAIL, 100.0), True)
        seen = near_points(RAIL, T, limits, sees, True)
        most = np.minimum(RAIL.max_velocity, np.abs(rates) + RAIL.max_acceleration * dt)
        closing = np.abs(gradients(RAIL, T, every)) @ most
        rate = float((RAIL.max_acceleration / RAIL.max_velocity).min())
        binds = closing > rate * (every.distance - 0.2)
        known = {
            (int(b), int(o), int(x))
            for b, o, x in zip(seen.body, seen.obstacle, seen.other, strict=True)
        }
        for k in np.flatnonzero(binds):
            assert (int(every.body[k]), int(every.obstacle[k]), int(every.other[k])) in known
