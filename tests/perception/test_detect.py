"""Stage by stage: what belongs to machines and ground goes, what is left becomes boxes."""

from __future__ import annotations

import numpy as np
import pytest

from backend.errors import InputError
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.perception.clusters import cluster
from backend.perception.detect import Settings, Stages, detect
from backend.perception.ground import find_ground
from backend.perception.kernels import inside
from backend.shell.sim.lidar import Lidar, Person, Scan, scan
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.rotation import rz

MINI = load_machine("mini")
POSTURE = 0.5 * (np.clip(MINI.lower, -1.0, 1.0) + np.clip(MINI.upper, -1.0, 1.0))
BODIES = body_boxes(MINI, link_poses(MINI, POSTURE))
SENSOR = np.eye(4)
SENSOR[:3, 3] = [-0.3, 0.0, 2.6]
PEOPLE = tuple(Person(np.array(place)) for place in [(5.0, 1.0), (4.0, -4.0), (-7.0, 3.0)])
CAR = Boxes(np.array([[9.0, -6.0, 0.8]]), rz(np.array([0.4])), np.array([[2.2, 0.9, 0.8]]))


def scene(people: tuple[Person, ...] = PEOPLE, tilt: float = 0.0) -> tuple[Scan, Stages]:
    bodies = Boxes(
        *(
            np.concatenate([getattr(BODIES, name), getattr(CAR, name)])
            for name in ("centers", "rotations", "half_extents")
        )
    )
    ground = np.array([np.sin(tilt), 0.0, np.cos(tilt)]), 0.0
    seen = scan(Lidar(), SENSOR, bodies, people, np.random.default_rng(0), ground)
    return seen, detect(seen.points, SENSOR[:3, 3], BODIES)


def test_people_and_a_vehicle_are_found_where_they_stand() -> None:
    _, found = scene()
    objects = found.objects
    assert len(objects.center) == len(PEOPLE) + 1
    for person in PEOPLE:
        off = np.linalg.norm(objects.center[:, :2] - person.place, axis=1)
        near = int(np.argmin(off))
        assert off[near] < 0.15
        assert objects.size[near, 2] == pytest.approx(person.height, abs=0.35)
        assert objects.size[near, 0] < 0.8
    car = int(np.argmax(objects.size[:, 0]))
    assert np.linalg.norm(objects.center[car, :2] - CAR.centers[0, :2]) < 0.8
    assert np.cos(2.0 * (objects.yaw[car] - 0.4)) > 0.98


def test_every_point_has_its_stage() -> None:
    seen, found = scene()
    people = seen.hit >= len(BODIES) + 1
    assert (found.cluster[people] >= 0).mean() > 0.95
    assert found.machine[(seen.hit >= 0) & (seen.hit < len(BODIES))].all()
    assert not found.machine[people].any()
    on_ground = (seen.hit == -1) & found.near
    assert (found.ground[on_ground] | found.machine[on_ground]).mean() > 0.99
    assert not (found.ground & found.machine).any()


@pytest.mark.parametrize("tilt", [-0.1, 0.0, 0.15])
def test_the_ground_is_found_on_a_slope(tilt: float) -> None:
    seen, found = scene(tilt=tilt)
    plane = found.plane
    assert plane is not None
    np.testing.assert_allclose(plane.normal, [np.sin(tilt), 0.0, np.cos(tilt)], atol=5e-3)
    assert abs(plane.heights(seen.points[seen.hit == -1])).mean() < 0.03


def test_ground_needs_points_and_is_no_wall() -> None:
    rng = np.random.default_rng(1)
    assert find_ground(rng.random((10, 3))) is None
    wall = np.stack([rng.random(500), np.zeros(500), 3.0 * rng.random(500)], axis=1)
    assert find_ground(wall) is None
    floor = np.concatenate([wall, np.stack([*rng.uniform(-5, 5, (2, 500)), np.zeros(500)], axis=1)])
    plane = find_ground(floor)
    assert plane is not None
    assert plane.normal[2] > 0.999


def test_the_same_points_give_the_same_ground() -> None:
    seen, _ = scene()
    one, two = find_ground(seen.points), find_ground(seen.points)
    assert one is not None
    assert two is not None
    np.testing.assert_array_equal(one.normal, two.normal)


def test_clusters_are_linked_along_the_ground() -> None:
    line = np.stack([np.arange(0.0, 3.0, 0.3), np.zeros(10), np.arange(10) * 1.0], axis=1)
    apart = line + np.array([0.0, 2.0, 0.0])
    found = cluster(np.concatenate([line, apart]), 0.4)
    assert len(set(found[:10])) == len(set(found[10:])) == 1
    assert found[0] != found[-1]
    assert len(cluster(np.zeros((0, 3)))) == 0


def test_inside_boxes_as_by_their_axes() -> None:
    rng = np.random.default_rng(2)
    boxes = Boxes(
        rng.uniform(-2, 2, (6, 3)), rz(rng.uniform(-3, 3, 6)), rng.uniform(0.2, 1.0, (6, 3))
    )
    points = rng.uniform(-3, 3, (2_000, 3))
    local = np.einsum("kxy,nkx->nky", boxes.rotations, points[:, None] - boxes.centers)
    expected = (np.abs(local) <= boxes.half_extents).all(axis=2).any(axis=1)
    found = inside(points, boxes.centers, boxes.rotations, boxes.half_extents)
    np.testing.assert_array_equal(found, expected)


def test_who_is_hidden_is_not_seen_and_behind_what_is_told() -> None:
    behind = Person(np.array([10.0, 2.0]))  # in the shadow of the first
    seen, _ = scene((PEOPLE[0], behind))
    first = len(BODIES) + 1
    hits = [
        int(((seen.hit == first + 2 * k) | (seen.hit == first + 2 * k + 1)).sum()) for k in (0, 1)
    ]
    assert hits[0] > 60
    alone, _ = scene((behind,))
    assert hits[1] < 0.7 * ((alone.hit == first) | (alone.hit == first + 1)).sum()


def test_nothing_and_nonsense() -> None:
    empty = detect(np.zeros((0, 3)), np.zeros(3), NO_BOXES)
    assert len(empty.objects.center) == 0
    bad = detect(np.full((100, 3), np.nan), np.zeros(3), NO_BOXES)
    assert not bad.near.any()
    seen, _ = scene()
    odd = np.concatenate([seen.points, [[3.0, 3.0, 1e300], [1e200, 0.0, 0.0], [0.0, 5.0, -np.inf]]])
    with np.errstate(over="raise", invalid="raise"):
        found = detect(odd, SENSOR[:3, 3], BODIES)
    assert found.plane is not None
    assert len(found.objects.center) == len(PEOPLE) + 1
    assert not found.near[-3:].any()
    with pytest.raises(InputError, match="needed is"):
        detect(np.zeros((5, 2)), np.zeros(3), NO_BOXES)
    with pytest.raises(InputError, match="link"):
        Settings(link=3.0)
