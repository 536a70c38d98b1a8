"""Boxes chosen anew: none sticks out, and together they leave fewer points out than before."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.ndimage import map_coordinates

from backend.machine.anneal_kernels import UNIT, sticking_out
from backend.machine.column_kernels import drawn_in, worth_inside, worthiest
from backend.machine.columns import EDGE, Chosen, Room
from backend.machine.fitting_field import room
from backend.machine.long_fit import Link
from backend.machine.polish import Set
from backend.spatial.rotation import about_axis

TOLERANCE = 0.1
BARS = (((2.0, 0.4, 0.4), (1.0, 0.0, 0.0)), ((0.4, 0.4, 1.6), (0.2, 0.0, 0.8)))


@pytest.fixture(scope="module")
def link() -> Link:
    """Two bars in the shape of an L."""
    boxes = [trimesh.creation.box(extents=size) for size, _ in BARS]
    centers = [np.array(center) for _, center in BARS]
    parts = [np.array(b.triangles) + c for b, c in zip(boxes, centers, strict=True)]
    return Link.of(np.concatenate(parts))


@pytest.fixture(scope="module")
def space(link: Link) -> Room:
    return Room.of(room(link.distance, TOLERANCE)[0], TOLERANCE)


def out_of(space: Room, box: tuple[np.ndarray, np.ndarray, np.ndarray]) -> float:
    return sticking_out(space.field, space.origin, space.step, 0.04, *box, 1e9)


def told(space: Room, point: np.ndarray) -> float:
    """What the room says at a point between its nodes [m above the tolerance]."""
    index = ((point - space.origin) / space.step)[:, None]
    return UNIT * map_coordinates(space.field.astype(float), index, order=1)[0]


def small(*points: tuple[float, float, float]) -> Set:
    n = len(points)
    return Set(np.stack([np.eye(3)] * n), np.array(points), np.full((n, 3), 0.05))


def test_worth_is_summed_over_the_points_inside() -> None:
    rng = np.random.default_rng(0)
    R = about_axis(np.array([0.0, 0.6, 0.8]), 0.7)
    c, h = np.array([0.1, -0.2, 0.3]), np.array([0.5, 0.9, 0.4])
    points, worth = rng.normal(size=(300, 3)), rng.uniform(size=300)
    inside = (np.abs((points - c) @ R) <= h).all(axis=1)
    assert 10 < np.count_nonzero(inside) < 290
    assert worth_inside(points, worth, R, c, h) == pytest.approx(worth[inside].sum())


def test_a_box_that_sticks_out_is_drawn_in(link: Link, space: Room) -> None:
    box = np.eye(3), np.array([1.0, 0.0, 0.05]), np.array([1.1, 0.35, 0.45])
    assert out_of(space, box) > 0.0
    worth = np.ones(len(link.points))
    holds = drawn_in(link.points, worth, space.field, space.origin, space.step, 0.04, *box)
    assert out_of(space, box) == 0.0
    assert holds == worth_inside(link.points, worth, *box) > 0.4 * len(link.points)


def test_what_the_grid_does_not_tell_is_forbidden(link: Link) -> None:
    space = Room.of(room(link.distance, TOLERANCE)[0], TOLERANCE)
    points = np.array([[1.013, 0.007, 0.29], [0.2, 0.287, 1.1]])
    before = space.field.copy()
    assert max(told(space, p) for p in points) < 0.0  # a cm within the tolerance
    assert space.forbid(points, np.array([0.01, 0.004]))
    assert [told(space, p) for p in points] >= [0.01 - 1e-9, 0.004 - 1e-9]
    assert np.count_nonzero(space.field != before) <= 16
    assert (space.field >= before).all()
    assert not space.forbid(points, np.array([0.005, 0.004]))  # that much is known
    beyond_the_grid = space.origin[None] - 1.0
    space.forbid(beyond_the_grid, np.array([1.0]))
    box = np.eye(3), np.array([1.0, 0.0, 0.1]), np.array([0.5, 0.2, 0.19])
    assert out_of(space, box) > 0.0  # its upper side goes through the first point


def test_the_worthiest_box_holds_the_bar_that_is_worth_most(link: Link, space: Room) -> None:
    long = (np.abs(link.points - [1.0, 0.0, 0.0]) <= [1.001, 0.201, 0.201]).all(axis=1)
    worth = np.where(long, 2.0, 0.0) / np.count_nonzero(long)
    start = np.eye(3), np.array([0.2, 0.2, 1.0]), np.full(3, 0.02)  # on the other bar
    holds, *box = worthiest(
        link.points, worth, space.field, space.origin, space.step, 0.04, start, 8_000, 4
    )
    assert holds > 1.98
    assert out_of(space, (box[0], box[1], box[2])) == 0.0


def test_two_boxes_come_to_hold_the_two_bars(link: Link, space: Room) -> None:
    chosen = Chosen(link.points[::3], space, small((0.0, 0.2, 1.0), (0.1, 0.2, 1.4)), 1)
    before = np.count_nonzero(chosen.left_out())
    told: list[int] = []
    left = chosen.improve(8, told.append)
    assert left == np.count_nonzero(chosen.left_out()) == told[-1] < 0.01 * before
    assert told == sorted(told, reverse=True)
    assert all(out_of(space, box) == 0.0 for box in chosen.boxes)
    assert chosen.as_set().away(link.points).min(axis=0).max() < 0.05


def test_the_same_seed_makes_the_same_choice(link: Link, space: Room) -> None:
    def choice() -> Set:
        chosen = Chosen(link.points[::6], space, small((0.0, 0.2, 1.0), (1.4, 0.2, 0.0)), 5)
        chosen.improve(1)
        return chosen.as_set()

    one, other = choice(), choice()
    np.testing.assert_array_equal(one.R, other.R)
    np.testing.assert_array_equal(one.h, other.h)


def test_what_one_box_cannot_hold_stays_left_out_and_is_told(link: Link, space: Room) -> None:
    points = link.points[::6]
    chosen = Chosen(points, space, small((1.0, 0.2, 0.0)), 2)
    left = chosen.improve(1)
    assert left == np.count_nonzero(chosen.left_out()) > 0.2 * len(points)
    assert out_of(space, chosen.boxes[0]) == 0.0


def test_boxes_that_stick_out_are_drawn_in_before_anything_else(link: Link, space: Room) -> None:
    wide = Set(np.eye(3)[None], np.array([[1.0, 0.0, 0.0]]), np.array([[1.4, 0.5, 0.5]]))
    chosen = Chosen(link.points, space, wide, 3)
    assert out_of(space, chosen.boxes[0]) == 0.0
    assert 0 < np.count_nonzero(chosen.left_out()) < len(link.points)


def test_points_looked_at_later_count(link: Link, space: Room) -> None:
    long = link.points[(np.abs(link.points - [1.0, 0.0, 0.0]) <= [1.0, 0.2, 0.2]).all(axis=1)]
    around = Set(np.eye(3)[None], np.array([[1.0, 0.0, 0.0]]), np.array([[1.02, 0.22, 0.22]]))
    chosen = Chosen(long, space, around, 4)
    assert not chosen.left_out().any()
    assert chosen.improve(3) == 0  # nothing to do
    chosen.look_at(np.array([[0.2, 0.2, 1.5], [0.2, 0.0, 0.22 + 0.5 * EDGE]]))
    assert chosen.left_out().tolist() == [False] * len(long) + [True, False]
