"""The exact joint images against separating axes on every pair of boxes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from exact_scenes import NAMES, coal_touches, judged, machine_named, scene
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from backend.cspace import exact, joint_image, planar_arm
from backend.cspace.rows_angles import ERROR, arc_cosine, bearing
from backend.cspace.rows_vector import FUSED
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray

SHAPE = (36, 20, 22, 70)


def cells(grid: exact.JointGrid, count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.stack([rng.integers(0, n, count) for n in grid.shape], axis=1)


def centers(grid: exact.JointGrid, index: np.ndarray) -> np.ndarray:
    return np.stack([grid.centers(k)[index[:, k]] for k in range(4)], axis=1)


@pytest.fixture(scope="module", params=NAMES)
def machine(request: pytest.FixtureRequest) -> Machine:
    return machine_named(request.param)


def test_image_is_what_separating_axes_say_at_every_centre(machine: Machine) -> None:
    for seed in (1, 2):
        obstacles = scene(machine, seed)
        image = joint_image.joint4(machine, {"partner": obstacles}, SHAPE)
        index = cells(image.grid, 4000, seed)
        against, itself = judged(machine, centers(image.grid, index), obstacles)
        np.testing.assert_array_equal(image.layer("partner")[tuple(index.T)], against)
        np.testing.assert_array_equal(image.layer("self")[tuple(index.T)], itself)
        assert 0.005 < against.mean() < 0.9


def test_image_agrees_with_coal(machine: Machine) -> None:
    obstacles = scene(machine, 3)
    image = joint_image.joint4(machine, {"site": obstacles}, SHAPE)
    index = cells(image.grid, 60, 3)
    touches = coal_touches(machine, centers(image.grid, index), obstacles)
    np.testing.assert_array_equal(image.layer("site")[tuple(index.T)], touches)


def test_present_swing_is_the_same_image_at_one_swing(machine: Machine) -> None:
    obstacles = scene(machine, 4)
    whole = joint_image.joint4(machine, {"partner": obstacles}, SHAPE)
    q = np.zeros(len(machine.joints))
    q[0] = whole.grid.centers(0)[5]
    slice_ = joint_image.joint3(machine, {"partner": obstacles}, q, SHAPE[1:])
    np.testing.assert_array_equal(slice_.colliding()[0], whole.colliding()[5])


def test_planar_arm_follows_forward_kinematics(machine: Machine) -> None:
    arm = planar_arm.planar_arm(machine)
    rng = np.random.default_rng(0)
    for q in rng.uniform(-1.5, 1.5, (20, 4)):
        placed = body_boxes(machine, link_poses(machine, q)).take(arm.bodies)
        psi = np.cumsum(arm.signs * q[1:4])
        pivot, at = arm.pivot.copy(), []
        for angle, link in zip(psi, (arm.boom, arm.stick, np.zeros(2)), strict=True):
            at.append(pivot.copy())
            c, s = np.cos(angle), np.sin(angle)
            pivot = pivot + np.array([c * link[0] - s * link[1], s * link[0] + c * link[1]])
        T = arm.T_arm_root(q[0])
        for b, group in enumerate(arm.groups):
            c, s = np.cos(psi[group]), np.sin(psi[group])
            rest = arm.boxes.centers[b]
            x, z = rest[[0, 2]] - arm.pivots[group]
            expected = [at[group][0] + c * x - s * z, rest[1], at[group][1] + s * x + c * z]
            actual = T[:3, :3] @ placed.centers[b] + T[:3, 3]
            np.testing.assert_allclose(actual, expected, atol=1e-9 * machine.max_reach)


def test_prisms_hold_their_boxes() -> None:
    """Around: every corner of the box; inside: every corner of the prism in the box."""
    machine = machine_named("askew")
    arm = planar_arm.planar_arm(machine)
    assert not arm.aligned.all()
    for i in range(len(arm.boxes)):
        box = arm.boxes.take(np.array([i]))
        outline, slab = planar_arm.outer_prism(arm.boxes, i)
        corners = box.corners()[0]
        assert slab[0] <= corners[:, 1].min()
        assert slab[1] >= corners[:, 1].max()
        edge = np.roll(outline, -1, axis=0) - outline
        for corner in corners[:, [0, 2]]:
            out = corner - outline
            assert (edge[:, 0] * out[:, 1] - edge[:, 1] * out[:, 0] >= -1e-12).all()
        inner, slab = planar_arm.inner_prism(arm.boxes, i)
        solid = np.array([[x, t, z] for x, z in inner for t in slab])
        local = np.abs((solid - box.centers[0]) @ box.rotations[0])
        assert (local <= box.half_extents[0] + 1e-12).all()


def test_a_base_that_touches_blocks_everything() -> None:
    machine = machine_named("mini")
    post = Boxes(np.array([[0.7, 0.5, 0.2]]), np.eye(3)[None], np.full((1, 3), 0.05))
    image = joint_image.joint4(machine, {"site": post}, (4, 4, 4, 9))
    assert image.layer("site").all()
    assert not joint_image.joint4(machine, {}, (4, 4, 4, 9)).bits.any() or "self" in image.layers


def test_upper_body_blocks_some_swings_whatever_the_arm_does() -> None:
    """A post that the counterweight, but not the arm's side, sweeps."""
    machine = machine_named("mini")
    post = Boxes(np.array([[-0.7, 0.0, 1.0]]), np.eye(3)[None], np.full((1, 3), 0.05))
    image = joint_image.joint4(machine, {"site": post}, (72, 5, 5, 9)).layer("site")
    every = image.all(axis=(1, 2, 3))
    assert every[36]
    assert not every[0]


def test_own_layer_can_be_kept() -> None:
    machine = machine_named("mini")
    first = joint_image.joint4(machine, {}, (8, 8, 8, 9))
    again = joint_image.joint4(machine, {"p": scene(machine, 1)}, (8, 8, 8, 9), own=first.bits)
    np.testing.assert_array_equal(again.layers["self"], first.layers["self"])


def test_a_bent_plane_is_refused() -> None:
    machine = machine_named("mini")
    links = list(machine.links)
    links[3] = replace(links[3], axis=np.array([0.1, -0.995, 0.0]))
    with pytest.raises(ValueError, match="not parallel"):
        planar_arm.planar_arm(replace(machine, links=tuple(links)))


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_inflation_must_be_a_length(value: float) -> None:
    with pytest.raises(ValueError, match="inflation"):
        exact.arm_model(machine_named("mini"), inflation=value)


@settings(max_examples=200, deadline=None)
@given(st.floats(0.0, 1.0), st.floats(-9.0, 9.0, width=32), st.floats(-9.0, 9.0, width=32))
def test_quick_angles_are_as_good_as_they_say(left: float, x: float, z: float) -> None:
    arc = arc_cosine(np.float32(left))
    assert abs(arc - 2.0 * np.arcsin(np.sqrt(0.5 * left))) < 0.3 * ERROR
    off = bearing(np.float32(x), np.float32(z)) - np.arctan2(z, x + 0.0)
    assert abs((off + np.pi) % (2.0 * np.pi) - np.pi) < 0.3 * ERROR


@njit(fastmath=FUSED)  # type: ignore[untyped-decorator]
def fused(left: AnyArray, x: AnyArray, z: AnyArray) -> tuple[AnyArray, AnyArray]:
    arcs, bearings = np.empty_like(left), np.empty_like(x)
    for k in range(len(left)):
        arcs[k] = arc_cosine(left[k])
        bearings[k] = bearing(x[k], z[k])
    return arcs, bearings


def test_quick_angles_are_as_good_where_products_and_sums_are_fused() -> None:
    rng = np.random.default_rng(5)
    n = 1_000_000
    left = np.concatenate([rng.uniform(0.0, 1.0, n), 10.0 ** rng.uniform(-30.0, 0.0, n)])
    x, z = rng.uniform(-9.0, 9.0, (2, 2 * n)) * 10.0 ** rng.integers(-4, 1, (2, 2 * n))
    left, x, z = (values.astype(np.float32) for values in (left, x, z))
    arcs, bearings = fused(left, x, z)
    assert np.abs(arcs - 2.0 * np.arcsin(np.sqrt(0.5 * left.astype(float)))).max() < 0.3 * ERROR
    off = bearings - np.arctan2(z.astype(float), x.astype(float))
    assert np.abs((off + np.pi) % (2.0 * np.pi) - np.pi).max() < 0.3 * ERROR
