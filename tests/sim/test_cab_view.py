"""The drawn cab view: what is ahead covers the pixels that projection says, nothing else does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from backend.machine.load import load_machine
from backend.shell.sim.cab import (
    PAINTS,
    STEEL,
    Seen,
    Surroundings,
    cab_view,
    camera_pose,
    eye_in_upper,
)
from backend.shell.sim.view import HAZE, Lens, draw, looking
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.rotation import from_attitude, rz
from backend.spatial.transform import inverse, make

LENS = Lens(120, 80, math.radians(70.0))
EAST, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
EYE = np.array([3.0, -2.0, 1.6])
RED = np.array([[255, 0, 0]])
MINI = load_machine("mini")


def box(center: np.ndarray, half: float | np.ndarray = 0.5, yaw: float = 0.0) -> Boxes:
    return Boxes(np.array([center]), rz(yaw)[None], np.broadcast_to(half, (1, 3)).astype(float))


def covered(T: np.ndarray, boxes: Boxes) -> np.ndarray:
    """(height, width) whether the ray through each pixel's centre meets the first box: the slab
    test in the box's own frame, by rays and not by projection."""
    u, v = np.meshgrid(np.arange(LENS.width) + 0.5, np.arange(LENS.height) + 0.5)
    rays = np.stack([u - LENS.width / 2, v - LENS.height / 2, np.full_like(u, LENS.focal)], -1)
    R = boxes.rotations[0]
    o = R.T @ (T[:3, 3] - boxes.centers[0])
    d = rays @ T[:3, :3].T @ R
    with np.errstate(divide="ignore"):
        a, b = (-boxes.half_extents[0] - o) / d, (boxes.half_extents[0] - o) / d
    near, far = np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)
    return np.asarray((near < far) & (near > 0.0))


def red(image: np.ndarray) -> np.ndarray:
    return np.asarray(image[..., 0].astype(int) > image[..., 1].astype(int) + 20)


@pytest.mark.parametrize("seed", range(12))
def test_a_box_ahead_covers_the_pixels_that_rays_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    T = looking(EYE, EAST, UP, rng.uniform(-0.5, 0.1))
    ahead = EYE + np.array([rng.uniform(3.0, 8.0), rng.uniform(-3.0, 3.0), 0.0])
    boxes = box(ahead + rng.uniform(-0.8, 1.0) * UP, rng.uniform(0.2, 0.7, 3), rng.uniform(-3, 3))
    image = draw(LENS, T, boxes, RED)
    expected = covered(T, boxes)
    assert expected.sum() > 20
    assert (red(image) != expected).sum() <= 2  # a ray exactly through an edge may fall either way


def test_what_is_behind_or_around_the_eye_is_not_drawn() -> None:
    T = looking(EYE, EAST, UP, 0.0)
    empty = draw(LENS, T, NO_BOXES, np.zeros((0, 3)))
    for boxes in (box(EYE - 4.0 * EAST), box(EYE - 0.6 * EAST), box(EYE), box(EYE + 9.0 * UP)):
        np.testing.assert_array_equal(draw(LENS, T, boxes, RED), empty)


def test_a_box_that_reaches_past_the_eye_is_cut_off_and_not_turned_inside_out() -> None:
    T = looking(EYE, EAST, UP, 0.0)
    beam = box(EYE + np.array([2.0, 0.0, -0.6]), np.array([6.0, 0.117, 0.1]))
    np.testing.assert_array_equal(red(draw(LENS, T, beam, RED))[44:], covered(T, beam)[44:])


def test_the_nearer_box_hides_the_farther_one_in_any_order() -> None:
    T = looking(EYE, EAST, UP, 0.0)
    near, far = EYE + 3.0 * EAST, EYE + 6.0 * EAST
    colors = np.array([[255, 0, 0], [0, 0, 255]])
    pictures = []
    for order in ([0, 1], [1, 0]):
        centers = np.array([near, far])[order]
        boxes = Boxes(centers, np.array([np.eye(3)] * 2), np.full((2, 3), 0.5))
        pictures.append(draw(LENS, T, boxes, colors[order]))
    np.testing.assert_array_equal(*pictures)
    assert red(pictures[0])[LENS.height // 2, LENS.width // 2]
    assert not (pictures[0][..., 2].astype(int) > pictures[0][..., 0].astype(int) + 60).any()


def test_the_ground_hides_what_is_below_it_and_ends_at_the_horizon() -> None:
    T = looking(EYE, EAST, UP, 0.0)
    empty = draw(LENS, T, NO_BOXES, np.zeros((0, 3)))
    buried = box(EYE + np.array([4.0, 0.0, -EYE[2] - 0.6]))
    np.testing.assert_array_equal(draw(LENS, T, buried, RED), empty)
    # At the horizon both fade into the haze; ground is brown, sky is blue.
    rows = empty.astype(int).mean(axis=1)
    assert np.abs(rows[LENS.height // 2] - HAZE).max() < 12
    assert (rows[-20:, 0] > rows[-20:, 2]).all()
    assert (rows[:20, 2] > rows[:20, 0]).all()


def test_squares_of_the_ground_are_metres() -> None:
    """Straight down, from as high as the picture is wide: known pixels a metre apart."""
    lens = Lens(100, 100, 2.0 * math.atan(0.5))
    T = looking(np.array([1000.0, 2000.0, 10.0]), EAST, UP, -math.pi / 2)
    image = draw(lens, T, NO_BOXES, np.zeros((0, 3))).astype(int)[..., 0]
    changes = np.flatnonzero(np.diff(image[45]))
    np.testing.assert_array_equal(np.diff(changes), 10)


def test_the_eye_is_in_the_cab_and_looks_along_the_arm() -> None:
    q = np.radians([40.0, 30.0, -60.0, -60.0])
    base = make(from_attitude(0.3, 0.0, 0.0), np.array([5.0, 6.0, 0.0]))
    T = camera_pose(MINI, q, base)
    ahead = T[:2, 2] / np.linalg.norm(T[:2, 2])
    np.testing.assert_allclose(
        ahead, [math.cos(math.radians(40) + 0.3), math.sin(math.radians(40) + 0.3)]
    )
    assert T[2, 2] < 0.0  # downwards
    assert abs(T[2, 0]) < 1e-12  # and level
    assert 1.2 < T[2, 3] < 2.2
    p = inverse(base) @ T[:, 3]
    assert np.hypot(p[0], p[1]) < 0.6


@pytest.mark.parametrize("name", ["mini", "ex13"])
def test_without_a_stated_eye_it_is_under_the_cab_s_roof(name: str) -> None:
    machine = replace(load_machine(name), eye=None)
    link, position = eye_in_upper(machine)
    assert machine.links[link].part == "upper"
    inside = [
        b
        for b, owner in enumerate(machine.body_links)
        if owner == link
        and (
            np.abs(machine.bodies.rotations[b].T @ (position - machine.bodies.centers[b]))
            < machine.bodies.half_extents[b]
        ).all()
    ]
    assert inside
    assert position[1] > 0.0  # both sit on the left


def test_the_own_arm_and_the_partner_are_seen_where_they_are() -> None:
    q = np.radians([-50.0, 40.0, -60.0, -60.0])
    left = Seen(MINI, q, make(np.eye(3), np.array([4.0, 4.0, 0.0])))
    right = Seen(MINI, q, make(rz(math.pi), np.array([9.5, -0.5, 0.0])), paint=1)
    alone = cab_view(left, [], Surroundings()).astype(int)
    both = cab_view(left, [right], Surroundings()).astype(int)
    changed = (alone != both).any(axis=-1)
    T_camera_site = inverse(camera_pose(MINI, q, left.T_site_root))
    x, y, z = (T_camera_site @ np.append(right.T_site_root[:3, 3] + 0.8 * UP, 1.0))[:3]
    lens = Lens()
    u, v = lens.width / 2 + lens.focal * x / z, lens.height / 2 + lens.focal * y / z
    assert changed[int(v), int(u)]
    columns = np.flatnonzero(changed.any(axis=0))
    assert columns.min() < u < columns.max()
    assert changed.mean() < 0.15
    # The cab is on the left of the arm: the arm is in the right half, in the machine's paint.
    paint = np.abs(
        alone / np.linalg.norm(alone, axis=-1, keepdims=True)
        - PAINTS[0] / np.linalg.norm(PAINTS[0])
    )
    assert (paint.max(axis=-1) < 0.06)[:, 240:].sum() > 3000
    assert not np.array_equal(STEEL, PAINTS[0])


def test_what_stands_on_the_site_is_seen() -> None:
    q = np.radians([0.0, 40.0, -60.0, -60.0])
    own = Seen(MINI, q, np.eye(4))
    wall = box(np.array([8.0, 1.5, 1.0]), np.array([0.2, 1.0, 1.0]))
    assert (cab_view(own, [], Surroundings(wall)) != cab_view(own, [], Surroundings())).any()


def test_people_and_vehicles_are_seen_as_boxes_of_their_own() -> None:
    q = np.radians([0.0, 40.0, -60.0, -60.0])
    own = Seen(MINI, q, np.eye(4))
    at = np.array([7.0, 2.0, 0.9])
    person = box(at, np.array([0.22, 0.22, 0.875]))
    alone = cab_view(own, [], Surroundings()).astype(int)
    x, y, z = (inverse(camera_pose(MINI, q, np.eye(4))) @ np.append(at, 1.0))[:3]
    lens = Lens()
    u, v = int(lens.width / 2 + lens.focal * x / z), int(lens.height / 2 + lens.focal * y / z)
    colors = []
    for around in (
        Surroundings(people=person),
        Surroundings(vehicles=person),
        Surroundings(person),
    ):
        picture = cab_view(own, [], around).astype(int)
        changed = (picture != alone).any(axis=-1)
        assert changed[v, u]
        assert 20 < changed.sum() < 3000
        colors.append(tuple(picture[v, u]))
    assert len(set(colors)) == 3
