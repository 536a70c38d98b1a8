"""Driving zones against direct checks of the boxes in space."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import collides_at

from backend.collision import box_distance
from backend.cspace import minkowski
from backend.cspace.driving import (
    SLOPE_TOLERANCE,
    DrivingZone,
    driving_zone,
    turning_zone,
    way_out,
)
from backend.cspace.driving_cover import cover
from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.spatial import rotation, transform
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated

NEAR = 1e-3
"""A disagreement farther than this from the zone's edge is an error [m]."""

OWN_Q = np.array([-0.3, 0.6, -1.2, 0.2])


@pytest.fixture(scope="module")
def mini() -> Machine:
    return load_machine("mini")


def placed(machine: Machine, q: np.ndarray, position: tuple[float, ...], *attitude: float) -> Boxes:
    T = transform.make(rotation.from_attitude(*attitude), np.array(position))
    return kinematics.body_boxes(machine, kinematics.link_poses(machine, q, T))


@pytest.fixture(scope="module")
def partner(mini: Machine) -> Boxes:
    return placed(mini, np.array([0.3, 0.5, -1.0, 0.2]), (2.0, 2.5, 0.1), 0.4, 0.05, 0.02)


def base(tilt: float = 0.0) -> np.ndarray:
    return transform.make(rotation.from_attitude(-0.7, tilt, -tilt / 2), np.zeros(3))


def touches(a: Boxes, b: Boxes, shift: np.ndarray) -> bool:
    """Whether b, moved by shift (2,), touches a: separating axes on all pairs near enough."""
    moved = b.centers + np.array([*shift, 0.0])
    reach = np.linalg.norm(a.half_extents, axis=1)[:, None] + np.linalg.norm(b.half_extents, axis=1)
    i, j = np.nonzero(np.linalg.norm(a.centers[:, None] - moved, axis=2) <= reach)
    if len(i) == 0:
        return False
    gaps = box_distance.separations(a.take(i), Boxes(moved, b.rotations, b.half_extents).take(j))
    return bool((gaps <= 0.0).any())


def disagreements(
    zone: shapely.Geometry, points: np.ndarray, hit: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Distances from the edge of the unsafe and of the needlessly blocked points [m]."""
    inside = shapely.intersects_xy(zone, points)
    edge = shapely.distance(zone.boundary, shapely.points(points))
    return edge[hit & ~inside], edge[~hit & inside]


def spread(zone: shapely.Geometry, rng: np.random.Generator, n: int) -> np.ndarray:
    """Points over the zone's bounds, and as many close to its edge."""
    low, high = np.array(zone.bounds).reshape(2, 2)
    anywhere = rng.uniform(low - 0.2, high + 0.2, (n, 2))
    along = rng.uniform(0.0, zone.boundary.length, n)
    edge = shapely.get_coordinates(shapely.line_interpolate_point(zone.boundary, along))
    return np.concatenate([anywhere, edge + rng.normal(scale=0.01, size=(n, 2))])


@pytest.mark.parametrize("tilt", [0.0, 0.06])
def test_as_is_agrees_with_separating_axes(mini: Machine, partner: Boxes, tilt: float) -> None:
    rng = np.random.default_rng(1)
    zone = driving_zone(mini, OWN_Q, base(tilt), partner).as_is
    own = kinematics.body_boxes(mini, kinematics.link_poses(mini, OWN_Q, base(tilt)))
    points = spread(zone, rng, 400)
    hit = np.array([touches(partner, own, p) for p in points])
    assert 0.1 < hit.mean() < 0.9
    unsafe, blocked = disagreements(zone, points, hit)
    assert unsafe.max(initial=0.0) < 1e-9
    assert blocked.max(initial=0.0) < 1e-9


def test_partner_above_does_not_block_the_ground_below(mini: Machine, partner: Boxes) -> None:
    raised = Boxes(
        partner.centers + np.array([0.0, 0.0, 30.0]), partner.rotations, partner.half_extents
    )
    zone = driving_zone(mini, OWN_Q, base(), raised)
    assert zone.as_is.is_empty
    assert zone.any_swing.is_empty
    assert zone.any_posture.is_empty
    assert zone.signed_distances["any_posture"] == float("inf")


def swung(own: Boxes, T: np.ndarray, mini: Machine, count: int) -> list[Boxes]:
    """The upper bodies at `count` swing angles."""
    axis = T @ mini.arm.T_root_swing
    upper = own.take(np.array([mini.part_of_body(b) != "tracks" for b in range(len(own))]))
    out = []
    for angle in np.linspace(0.0, 2.0 * np.pi, count, endpoint=False):
        turn = axis @ transform.make(rotation.rz(angle), np.zeros(3)) @ transform.inverse(axis)
        R = turn[:3, :3]
        out.append(
            Boxes(transform.apply(turn, upper.centers), R @ upper.rotations, upper.half_extents)
        )
    return out


def assert_swung(
    zone: shapely.Geometry,
    points: np.ndarray,
    hit: np.ndarray,
    bodies: Boxes,
    own: Boxes,
    T: np.ndarray,
    mini: Machine,
) -> None:
    """No collision outside the zone; inside, but for its last millimetre, a collision everywhere.

    A corner passes between two of the coarse angles: where they find nothing, 4000 angles decide
    (0.3 mm apart in radius at most).
    """
    inside = shapely.intersects_xy(zone, points)
    edge = shapely.distance(zone.boundary, shapely.points(points))
    assert not (hit & ~inside).any()
    doubtful = np.flatnonzero(inside & ~hit & (edge > NEAR))
    fine = swung(own, T, mini, 4000) if len(doubtful) else []
    for k in doubtful:
        assert any(touches(bodies, b, points[k]) for b in fine), (points[k], edge[k])


@pytest.mark.parametrize("tilt", [0.0, 0.06])
def test_any_swing_holds_every_collision_found_by_swinging(
    mini: Machine, partner: Boxes, tilt: float
) -> None:
    rng = np.random.default_rng(2)
    T = base(tilt)
    zone = driving_zone(mini, OWN_Q, T, partner).any_swing
    own = kinematics.body_boxes(mini, kinematics.link_poses(mini, OWN_Q, T))
    points = spread(zone, rng, 30)
    postures = [own, *swung(own, T, mini, 240)]
    hit = np.array([any(touches(partner, b, p) for b in postures) for p in points])
    assert 0.1 < hit.mean() < 0.9
    assert_swung(zone, points, hit, partner, own, T, mini)


def test_a_pole_under_the_raised_arm_leaves_a_hole(mini: Machine) -> None:
    """A lamp over the machine's house, inside the circle of its raised arm."""
    raised = np.array([0.0, 1.2, -0.5, 0.0])
    lamp = Boxes(np.array([[3.0, 1.0, 3.2]]), np.eye(3)[None], np.array([[0.05, 0.05, 0.05]]))
    zone = driving_zone(mini, raised, base(), lamp).any_swing
    assert shapely.get_num_interior_rings(shapely.get_parts(zone)).sum() == 1
    own = kinematics.body_boxes(mini, kinematics.link_poses(mini, raised, base()))
    points = spread(zone, np.random.default_rng(3), 60)
    postures = [own, *swung(own, base(), mini, 240)]
    hit = np.array([any(touches(lamp, b, p) for b in postures) for p in points])
    assert_swung(zone, points, hit, lamp, own, base(), mini)


@pytest.mark.parametrize("tilt", [0.0, 0.06])
def test_any_posture_holds_random_postures(mini: Machine, partner: Boxes, tilt: float) -> None:
    rng = np.random.default_rng(4)
    T = base(tilt)
    zone = driving_zone(mini, OWN_Q, T, partner)
    low = np.where(np.isfinite(mini.lower), mini.lower, -np.pi)
    high = np.where(np.isfinite(mini.upper), mini.upper, np.pi)
    found = 0
    for q in rng.uniform(low, high, (250, 4)):
        own = kinematics.body_boxes(mini, kinematics.link_poses(mini, q, T))
        for p in spread(zone.any_posture, rng, 2):
            if touches(partner, own, p):
                found += 1
                assert shapely.intersects_xy(zone.any_posture, *p)
    assert found > 30
    assert zone.as_is.difference(zone.any_swing).area < 1e-9
    assert zone.any_swing.difference(zone.any_posture).area < 1e-2


@pytest.mark.parametrize("turn", [(0.0, 2.0 * np.pi), (-0.2, 0.5)])
def test_turning_holds_every_heading(
    mini: Machine, partner: Boxes, turn: tuple[float, float]
) -> None:
    rng = np.random.default_rng(5)
    zone = turning_zone(mini, OWN_Q, base(0.06), partner, turn)
    points = spread(zone, rng, 20)
    found = 0
    for angle in np.linspace(*turn, 60):
        T = transform.make(rotation.rz(angle), np.zeros(3)) @ base(0.06)
        own = kinematics.body_boxes(mini, kinematics.link_poses(mini, OWN_Q, T))
        hit = np.array([touches(partner, own, p) for p in points])
        found += int(hit.sum())
        assert shapely.intersects_xy(zone, points[hit]).all()
    assert found > 20


def test_growing_is_never_safer_and_position_only_shifts(mini: Machine, partner: Boxes) -> None:
    before = driving_zone(mini, OWN_Q, base(), partner)
    grown = driving_zone(mini, OWN_Q, base(), partner, eta=0.1)
    for name, distance in before.signed_distances.items():
        assert grown.signed_distances[name] <= distance - 0.05
        assert getattr(before, name).difference(getattr(grown, name)).area < 1e-9
    far = np.array([308611.0, 4129957.0, 12.0])
    T = base()
    T[:3, 3] += far
    moved = Boxes(partner.centers + far, partner.rotations, partner.half_extents)
    after = driving_zone(mini, OWN_Q, T, moved)
    for name, distance in before.signed_distances.items():
        assert after.signed_distances[name] == pytest.approx(distance, abs=1e-6)
        back = shapely.transform(getattr(after, name), lambda p: p - far[:2])
        assert back.symmetric_difference(getattr(before, name)).area < 1e-5


def check_exit(zone: DrivingZone, name: str) -> None:
    way = zone.exits[name]
    geometry = getattr(zone, name)
    assert np.linalg.norm(way.direction) == pytest.approx(1.0)
    out = way.direction * (way.length + 1e-6)
    assert not shapely.contains_xy(geometry, *out)
    if way.length > 0.0:
        assert shapely.contains_xy(geometry, *(way.direction * (way.length - 1e-6)))


def test_shortest_way_out_leads_out(mini: Machine, partner: Boxes) -> None:
    zone = driving_zone(mini, OWN_Q, base(), partner)
    assert zone.signed_distances["as_is"] > 0.0 > zone.signed_distances["any_swing"]
    for name in ("as_is", "any_swing", "any_posture"):
        check_exit(zone, name)


@given(x=st.floats(-2.0, 6.0), y=st.floats(-2.0, 6.0))
@settings(max_examples=60, deadline=None)
def test_way_out_of_a_ring(x: float, y: float) -> None:
    """A ring about (2, 2) with radii 1 and 2: the edge is where the radius says."""
    disk = shapely.Point(2.0, 2.0)
    zone = disk.buffer(2.0, 256).difference(disk.buffer(1.0, 256))
    r = np.hypot(x - 2.0, y - 2.0)
    expected = max(r - 2.0, 1.0 - r)
    way = way_out(zone, np.array([x, y]))
    assert way.signed_distance == pytest.approx(expected, abs=1e-4)
    assert way.length == pytest.approx(max(-expected, 0.0), abs=1e-4)


@given(
    seed=st.integers(0, 10_000),
    half=st.tuples(*[st.floats(0.01, 1.0)] * 6),
)
@settings(max_examples=40, deadline=None)
def test_slice_of_two_boxes(seed: int, half: tuple[float, ...]) -> None:
    rng = np.random.default_rng(seed)
    R = rotation.from_quaternion(rng.normal(size=(2, 4)))
    centers = rng.uniform(-0.5, 0.5, (2, 3))
    sizes = np.array(half).reshape(2, 3)
    a, b = (Boxes(centers[k, None], R[k, None], sizes[k, None]) for k in (0, 1))
    zone = cover(minkowski.slice_pieces(a, b))
    points = rng.uniform(-3.0, 3.0, (60, 2))
    hit = np.array([touches(a, b, p) for p in points])
    if zone.is_empty:
        assert not hit.any()
        return
    unsafe, blocked = disagreements(zone, points, hit)
    assert unsafe.max(initial=0.0) < 1e-9
    assert blocked.max(initial=0.0) < 1e-9


@pytest.mark.parametrize("eta", [-0.1, float("nan"), float("inf")])
def test_bad_inflation_is_refused(mini: Machine, partner: Boxes, eta: float) -> None:
    with pytest.raises(ValueError, match="eta"):
        driving_zone(mini, OWN_Q, base(), partner, eta)


def test_as_is_agrees_with_an_independent_judge(mini: Machine, partner: Boxes) -> None:
    """A small sample of tests/campaigns/test_driving_campaign.py."""
    zone = driving_zone(mini, OWN_Q, base(0.15), partner).as_is
    points = spread(zone, np.random.default_rng(6), 1500)
    own = kinematics.body_boxes(mini, kinematics.link_poses(mini, OWN_Q, base(0.15)))
    unsafe, blocked = disagreements(zone, points, collides_at(partner, own, points))
    assert len(unsafe) == 0
    assert blocked.max(initial=0.0) < NEAR


def test_a_pole_under_the_raised_arm_leaves_a_hole_on_a_slope(mini: Machine) -> None:
    raised = np.array([0.0, 1.2, -0.5, 0.0])
    lamp = Boxes(np.array([[3.0, 1.0, 3.2]]), np.eye(3)[None], np.array([[0.05, 0.05, 0.05]]))
    zone = driving_zone(mini, raised, base(0.06), lamp).any_swing
    assert shapely.get_num_interior_rings(shapely.get_parts(zone)).sum() == 1
    points = spread(zone, np.random.default_rng(7), 400)
    hit = np.zeros(len(points), dtype=bool)
    for angle in np.linspace(-np.pi, np.pi, 720):
        q = np.append(angle, raised[1:])
        own = kinematics.body_boxes(mini, kinematics.link_poses(mini, q, base(0.06)))
        hit |= collides_at(lamp, own, points)
    unsafe, blocked = disagreements(zone, points, hit)
    assert len(unsafe) == 0
    assert blocked.max(initial=0.0) < SLOPE_TOLERANCE


def test_no_boxes_have_no_zone_and_boxes_out_of_view_do_not_count(
    mini: Machine, partner: Boxes
) -> None:
    assert driving_zone(mini, OWN_Q, base(), NO_BOXES).any_posture.is_empty
    rng = np.random.default_rng(8)
    far = Boxes(
        rng.uniform(60.0, 90.0, (300, 3)) * [1, 1, 0],
        np.tile(np.eye(3), (300, 1, 1)),
        np.full((300, 3), 0.5),
    )
    alone = driving_zone(mini, OWN_Q, base(), partner)
    among = driving_zone(mini, OWN_Q, base(), concatenated([partner, far]), view=30.0)
    assert among.signed_distances == alone.signed_distances
    assert among.any_posture.equals(alone.any_posture)
