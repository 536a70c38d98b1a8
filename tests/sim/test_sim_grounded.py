"""A simulated machine on real ground: as on the plane where it is one, and otherwise as it must."""

from __future__ import annotations

import math

import numpy as np
import pytest

from backend.errors import InputError
from backend.machine.kinematics import body_boxes, end_point, link_poses
from backend.machine.load import load_machine
from backend.shell.sim.dynamics import Demand, Hydraulics, SimState, limits_of, step
from backend.shell.sim.grounded import RELIEF, Grounded, ground_height
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array

MINI = load_machine("mini")
DT = 0.005
FOLDED = np.array([math.pi, 0.8, -1.9, -0.6])
STILL = np.zeros(4)
STANDS = np.zeros(2)


def box(low: tuple[float, float], high: tuple[float, float], height: float) -> Boxes:
    """On the plane z = 0, from corner to corner."""
    middle = 0.5 * (np.array(low) + np.array(high))
    half = 0.5 * (np.array(high) - np.array(low))
    return Boxes(
        np.array([[*middle, 0.5 * height]]), np.eye(3)[None], np.array([[*half, 0.5 * height]])
    )


def run(
    start: SimState,
    terrain: Boxes,
    demand: Demand,
    seconds: float,
    payload: float = 0.0,
) -> tuple[Grounded, list[SimState], SimState]:
    """On real ground, and what the drives came to, which is where a plane would have it."""
    ground = Grounded(MINI, payload, terrain, start, DT)
    limits, lags = limits_of(MINI), Hydraulics()
    driven, found = start, []
    for _ in range(round(seconds / DT)):
        driven = ground.relieved(step(driven, demand, limits, lags, DT))
        found.append(ground.step(driven))
    return ground, found, driven


def at(q: Array, x: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> SimState:
    return SimState(q, STILL, np.array([x, 0.0, z]), yaw, 0.0, 0.0, STANDS)


def test_on_level_ground_it_goes_where_the_plane_has_it() -> None:
    swing, tracks = np.array([0.4, 0.1, 0.0, 0.0]), np.array([0.3, 0.3])
    _, found, driven = run(at(FOLDED, z=7.0, yaw=0.5), NO_BOXES, Demand(swing, tracks), 4.0)
    last = found[-1]
    np.testing.assert_allclose(last.q, driven.q, atol=np.radians(0.3))
    np.testing.assert_allclose(last.position[:2], driven.position[:2], atol=0.02)
    assert last.position[2] == pytest.approx(7.0, abs=0.005)
    np.testing.assert_allclose(last.travel, tracks, atol=0.02)
    assert max(abs(last.pitch), abs(last.roll)) < np.radians(0.2)


def test_tracks_of_different_speeds_turn_it_and_slip() -> None:
    tracks = np.array([0.0, 0.3])
    _, found, driven = run(at(FOLDED), NO_BOXES, Demand(STILL, tracks), 4.0)
    assert 0.25 * driven.yaw < found[-1].yaw < driven.yaw


def test_a_swing_beyond_a_turn_is_counted_on() -> None:
    swing = np.array([0.9, 0.0, 0.0, 0.0])
    _, found, driven = run(at(FOLDED), NO_BOXES, Demand(swing, STANDS), 6.0)
    assert driven.q[0] > math.pi + 4.0
    assert found[-1].q[0] == pytest.approx(driven.q[0], abs=0.02)


def test_the_bucket_pressed_on_the_ground_lifts_the_front() -> None:
    q = np.array([0.0, 0.6, -1.2, -0.6])
    down = np.array([0.0, -0.15, 0.0, 0.0])
    ground, found, _ = run(at(q), NO_BOXES, Demand(down, STANDS), 5.0)
    last = found[-1]
    assert np.degrees(last.pitch) == pytest.approx(19.7, abs=3.0)
    assert end_point(MINI, last.q, last.T_site_root)[2] == pytest.approx(0.0, abs=0.05)
    assert not ground.over
    # Everything else is above the ground, and the rear of the tracks on it.
    low = body_boxes(MINI, link_poses(MINI, last.q, last.T_site_root)).corners()[..., 2].min()
    assert -0.08 < low < 0.01


def test_a_drive_is_never_farther_ahead_than_it_can_push() -> None:
    """The bucket against a wall that does not move: the stick stalls, and comes back at once."""
    q = np.array([0.0, 0.2, -1.4, -0.2])
    reach = float(end_point(MINI, q)[0])
    wall = box((reach + 0.05, -3.0), (reach + 2.0, 3.0), 6.0)
    out = np.array([0.0, 0.0, 0.4, 0.0])
    ground, found, driven = run(at(q), wall, Demand(out, STANDS), 4.0)
    assert (np.abs(driven.q - found[-1].q) <= RELIEF + 1e-9).all()
    limits, lags = limits_of(MINI), Hydraulics()
    back = Demand(-out, STANDS)
    for _ in range(round(0.8 / DT)):
        driven = ground.relieved(step(driven, back, limits, lags, DT))
        last = ground.step(driven)
    assert last.q[2] < found[-1].q[2] - 0.08


@pytest.mark.parametrize(("height", "climbs"), [(0.1, True), (1.2, False)])
def test_tracks_climb_what_is_low_and_stop_at_what_is_high(height: float, climbs: bool) -> None:
    """Backwards: at the front is a blade."""
    ahead = Demand(STILL, np.array([-0.3, -0.3]))
    step_behind = box((-9.0, -3.0), (-1.5, 3.0), height)
    _, found, _ = run(at(np.array([0.0, *FOLDED[1:]])), step_behind, ahead, 11.0)
    last = found[-1]
    if climbs:
        assert last.position[0] < -2.6
        assert last.position[2] == pytest.approx(height, abs=0.01)
        assert max(abs(s.pitch) for s in found) > np.radians(2.0)
    else:
        assert last.position[0] == pytest.approx(-0.7, abs=0.15)
        assert last.position[2] < 0.4


def test_over_an_edge_it_falls() -> None:
    """It stands on a box from the beginning: the ground is at that box's foot."""
    ahead = Demand(STILL, np.array([0.3, 0.3]))
    ground, found, _ = run(at(FOLDED, z=2.0), box((-3.0, -3.0), (1.5, 3.0), 2.0), ahead, 9.0)
    assert found[0].position[2] == pytest.approx(2.0, abs=1e-3)
    assert min(s.position[2] for s in found) < 1.5
    assert max(abs(s.pitch) for s in found) > np.radians(30.0)
    del ground


def test_too_heavy_a_load_far_out_turns_it_over() -> None:
    q = np.array([0.5 * math.pi, 0.35, -0.5, 0.0])
    _, found, _ = run(at(q), NO_BOXES, Demand(STILL, STANDS), 3.0, payload=900.0)
    assert max(abs(s.roll) for s in found) > np.radians(5.0)
    _, found, _ = run(at(q), NO_BOXES, Demand(STILL, STANDS), 3.0)
    assert max(abs(s.roll) for s in found) < np.radians(0.5)


def test_where_the_ground_is() -> None:
    low, high = box((0.0, -1.0), (2.0, 1.0), 0.5), box((5.0, -1.0), (7.0, 1.0), 1.0)
    both = Boxes(*(np.concatenate([getattr(b, f) for b in (low, high)]) for f in FIELDS))
    assert ground_height(np.array([1.0, 0.0, 0.5]), both) == 0.0
    assert ground_height(np.array([3.0, 0.0, 0.5]), both) == 0.5
    assert ground_height(np.array([6.0, 0.0, 1.02]), both) == 0.0
    assert ground_height(np.array([6.0, 0.0, 0.3]), both) == 0.3


FIELDS = ("centers", "rotations", "half_extents")


def test_without_masses_there_is_no_such_machine() -> None:
    rail = load_machine("rail6")
    q = np.clip(np.zeros(len(rail.joints)), rail.lower, rail.upper)
    start = SimState(q, q, np.zeros(3), 0.0, 0.0, 0.0, STANDS)
    with pytest.raises(InputError):
        Grounded(rail, 0.0, NO_BOXES, start, DT)
