"""Rows of an approach against finite differences, and against true distances after a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backend.collision.closest import closest_pairs
from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.safety.approach import Approach, Motion, approach, joined
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, step
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

MINI, EX13 = load_machine("mini"), load_machine("ex13")
KEEP = 0.3
STILL = np.zeros(4)


def motion(machine: Machine, q, T, rates=STILL, velocity=(0.0, 0.0, 0.0), yaw_rate=0.0) -> Motion:
    return Motion(
        kinematics.link_poses(machine, q, T), T, np.asarray(rates), np.array(velocity), yaw_rate
    )


def bodies(machine: Machine, q, T) -> Boxes:
    return kinematics.body_boxes(machine, kinematics.link_poses(machine, q, T))


def scene(seed: int, own: Machine, other: Machine):
    """(q, T) of both, within reach of each other and apart."""
    rng = np.random.default_rng(seed)

    def posture(machine: Machine):
        low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
        high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
        return rng.uniform(low, high)

    while True:
        apart = rng.uniform(0.5, 0.9) * (own.max_reach + other.max_reach)
        a = posture(own), transform.make(rotation.rz(rng.uniform(-3, 3)), np.zeros(3))
        direction = rng.uniform(-3, 3)
        there = apart * np.array([np.cos(direction), np.sin(direction), 0.0])
        b = posture(other), transform.make(rotation.rz(rng.uniform(-3, 3)), there)
        if closest_pairs(bodies(own, *a), bodies(other, *b)).distance[0] > KEEP:
            return a, b


def moved(machine: Machine, q, T, s):
    """(q, T) after joints and tracks moved by s (m,), tracks at constant speeds."""
    n = len(q)
    left, right = s[n:]
    state = SimState(q, np.zeros(n), T[:3, 3], float(np.arctan2(T[1, 0], T[0, 0])), 0, 0, s[n:])
    # One second at the speeds s: the simulated machine's own track kinematics, in fine steps.
    limits = replace(limits_of(machine), travel_speed=1e3, travel_acceleration=1e9)
    for _ in range(50):
        state = step(
            state, Demand(np.zeros(n), np.array([left, right])), limits, Hydraulics(), 0.02
        )
    return q + s[:n], state.T_site_root


def rows_of(own: Machine, other: Machine, a, b, **kw) -> Approach:
    return approach(own, motion(own, *a), other, motion(other, *b, **kw), "b", KEEP, 0.1, 0.7)


@pytest.mark.parametrize("seed", range(4))
def test_slope_and_bend_are_derivatives(seed: int) -> None:
    a, b = scene(seed, MINI, EX13)
    part = rows_of(MINI, EX13, a, b)
    rng = np.random.default_rng(seed)
    assert len(part.room) > 10
    h = 1e-3
    for _ in range(5):
        d = rng.normal(size=6)
        rooms = [corner_rooms(part, a, b, s * d) for s in (-h, 0.0, h)]
        first = (rooms[2] - rooms[0]) / (2 * h)
        second = (rooms[2] - 2 * rooms[1] + rooms[0]) / h**2
        np.testing.assert_allclose(rooms[1], part.room, atol=1e-9)
        np.testing.assert_allclose(first, part.slope @ d, atol=5e-5)
        expected = np.einsum("k,rkl,l->r", d, part.bend, d)
        np.testing.assert_allclose(second, expected, atol=2e-3)


def corner_rooms(part: Approach, a, b, s) -> np.ndarray:
    """(r,) the rooms of the same corners and planes after the own machine moved by s."""
    from backend.safety.hulls import hulls

    q, T = moved(MINI, *a, s)
    mine, its = hulls(MINI), hulls(EX13)
    now = Boxes(*mine.placed(kinematics.link_poses(MINI, *a)))
    then = Boxes(*mine.placed(kinematics.link_poses(MINI, q, T)))
    there = Boxes(*its.placed(kinematics.link_poses(EX13, *b)))
    corners, after, its_corners = now.corners(), then.corners(), there.corners()
    rooms = np.empty(len(part.room))
    for r, (i, j) in enumerate(part.index):
        n, top = plane(now.take(np.array([i])), there.take(np.array([j])), its_corners[j])
        found = corners[i] @ n - top - KEEP
        which = int(np.argmin(np.abs(found - part.room[r])))
        assert abs(found[which] - part.room[r]) < 1e-6
        same = np.flatnonzero(np.abs(found - part.room[r]) < 1e-6)
        if len(same) > 1:  # corners at one height: the row's own moves as its slope says
            which = same[int(r_rank(part, r, same, corners[i], n, a))]
        rooms[r] = after[i, which] @ n - top - KEEP
    return rooms


def r_rank(part: Approach, r: int, same, corners, n, a) -> int:
    """Which of several corners at one height a row is about, by its slopes."""
    axes = MINI.joint_links
    T = kinematics.link_poses(MINI, *a)[axes]
    z = np.einsum("kij,kj->ki", T[:, :3, :3], MINI.joint_axes)
    up = np.array([0.0, 0.0, 1.0])
    turns = [n @ np.cross(up, corners[c] - a[1][:3, 3]) for c in same]
    wanted = (part.slope[r, 5] - part.slope[r, 4]) * MINI.tracks.gauge / 2.0
    swings = [n @ np.cross(z[0], corners[c] - T[0, :3, 3]) for c in same]
    booms = [n @ np.cross(z[1], corners[c] - T[1, :3, 3]) for c in same]
    miss = [
        abs(t - wanted)
        + (abs(s - part.slope[r, 0]) if part.slope[r, 0] else 0.0)
        + (abs(m - part.slope[r, 1]) if part.slope[r, 1] else 0.0)
        for t, s, m in zip(turns, swings, booms, strict=True)
    ]
    return int(np.argmin(miss))


def plane(one: Boxes, two: Boxes, corners) -> tuple[np.ndarray, float]:
    from backend.collision.plane_kernels import separating_plane
    from backend.safety.approach_kernels import NEAR

    n = np.empty(3)
    boxes = [x for b in (one, two) for x in (b.centers[0], b.rotations[0], b.half_extents[0])]
    gap = separating_plane(*boxes, 0.0, n)
    if gap < NEAR:
        separating_plane(*boxes, NEAR, n)
    return n, float((corners @ n).max())


@pytest.mark.parametrize("models", [(MINI, MINI), (MINI, EX13), (EX13, MINI)])
def test_nothing_comes_nearer_than_the_rows_say(models: tuple[Machine, Machine]) -> None:
    """Motions that use at most the room of every row leave the true distance at `KEEP`."""
    own, other = models
    rng = np.random.default_rng(5)
    tight = 0
    for seed in range(30):
        a, b = scene(seed + 100, own, other)
        part = rows_of(own, other, a, b)
        for _ in range(4):
            s = rng.uniform(-1, 1, 6) * np.array([1.2, 0.6, 0.8, 0.8, 0.8, 0.8])
            steps = np.linspace(0.0, 1.0, 41)
            left = np.array([_left(part, t * s) for t in steps])
            until = int(np.argmax(left < 0.0)) if (left < 0.0).any() else len(steps)
            for t in steps[: until : max(until // 4, 1)]:
                here = bodies(own, *moved(own, *a, t * s))
                gap = closest_pairs(here, bodies(other, *b)).distance[0]
                assert gap > KEEP - 0.02, (seed, t)
            tight += until < len(steps)
    assert tight > 3


def _left(part: Approach, s) -> float:
    if not len(part.room):
        return 1.0
    used = part.slope @ s + 0.5 * np.einsum("k,rkl,l->r", s, part.bend, s)
    return float((part.room + used).min())


def test_the_nearest_row_is_the_distance() -> None:
    for seed in range(10):
        a, b = scene(seed + 50, MINI, MINI)
        part = rows_of(MINI, MINI, a, b)
        gap = closest_pairs(bodies(MINI, *a), bodies(MINI, *b)).distance[0]
        if gap < 0.9 and len(part.room):
            assert part.room.min() == pytest.approx(gap - KEEP, abs=1e-6)


def test_closing_is_the_partners_motion_towards_a_body() -> None:
    """Driven straight at the machine, every row closes with the driving speed at most."""
    a = np.array([0.0, 0.3, -1.2, -0.4]), np.eye(4)
    b = a[0], transform.make(rotation.rz(np.pi), np.array([8.5, 0.0, 0.0]))
    calm = rows_of(MINI, MINI, a, b)
    coming = rows_of(MINI, MINI, a, b, velocity=(-0.5, 0.0, 0.0))
    leaving = rows_of(MINI, MINI, a, b, velocity=(0.5, 0.0, 0.0))
    assert calm.closing.max() == 0.0
    assert coming.closing.max() == pytest.approx(0.5, abs=1e-6)
    assert leaving.closing.max() == pytest.approx(0.0, abs=1e-6)
    swinging = rows_of(MINI, MINI, a, b, rates=(0.9, 0.0, 0.0, 0.0))
    assert swinging.closing.max() > 0.4
    turning = rows_of(MINI, MINI, a, b, yaw_rate=0.9)
    assert turning.closing.max() > 0.5


def test_own_motion_is_kept_with_the_tracks() -> None:
    T = transform.make(rotation.rz(0.7), np.zeros(3))
    ahead = 0.3 * T[:3, 0]
    own = motion(MINI, np.zeros(4), T, (0.1, 0.2, 0.3, 0.4), ahead, 0.2)
    np.testing.assert_allclose(own.tracks(MINI), [0.3 - 0.1, 0.3 + 0.1])


def test_far_machines_have_no_rows_and_several_partners_join() -> None:
    q = np.array([0.0, 0.3, -1.2, -0.4])
    parts = [
        rows_of(MINI, MINI, (q, np.eye(4)), (q, transform.make(np.eye(3), np.array([x, 0, 0]))))
        for x in (100.0, 7.0, -7.0)
    ]
    assert len(parts[0].room) == 0
    both = joined(parts)
    assert len(both.room) == sum(len(p.room) for p in parts)
    r = len(parts[1].room)
    assert both.others[both.index[r, 1]] == parts[2].others[parts[2].index[0, 1]]
    np.testing.assert_array_equal(both.bend[r:], parts[2].bend)


def test_every_body_is_in_the_hull_of_its_link() -> None:
    from backend.safety.hulls import hulls

    for machine in (MINI, EX13):
        found = hulls(machine)
        n = len(machine.body_names)
        boxes = Boxes(*found.placed(kinematics.link_poses(machine, np.zeros(4))))
        assert len(set(found.group[:n])) == len(boxes) - n
        for body in range(n):
            hull = found.group[body]
            local = (boxes.corners()[body] - boxes.centers[hull]) @ boxes.rotations[hull]
            assert (np.abs(local) <= boxes.half_extents[hull] + 1e-9).all()
