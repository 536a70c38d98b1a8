"""Certificates: what they say of a cell holds for every configuration in it."""

from __future__ import annotations

import numpy as np
import pytest
from exact_scenes import NAMES, coal_touches, judged, machine_named, scene
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.cspace import joint_image
from backend.cspace.exact import JointGrid
from backend.cspace.planar_slices import POINTS, inner_slice, outer_slice
from backend.machine.model import Machine
from backend.spatial import rotation
from backend.spatial.boxes import Boxes

SHAPE = (72, 36, 36, 40)
COUNT = 20_000


def draw(grid: JointGrid, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random configurations and their cells; a third on the cells' edges and corners."""
    rng = np.random.default_rng(seed)
    index = np.stack([rng.integers(0, n, count) for n in grid.shape], axis=1)
    share = rng.uniform(0.0, 1.0, (count, 4))
    share[: count // 3] = rng.choice([0.0, 0.5, 1.0], (count // 3, 4))
    return index, grid.lower + (index + share) * grid.steps


@pytest.fixture(scope="module", params=NAMES)
def machine(request: pytest.FixtureRequest) -> Machine:
    return machine_named(request.param)


def test_no_certificate_is_wrong(machine: Machine) -> None:
    obstacles = scene(machine, 11)
    eta = 0.004 * machine.max_reach
    image = joint_image.certified4(machine, {"partner": obstacles}, eta, SHAPE)
    index, q = draw(image.grid, COUNT, 11)
    free = image.certified_free()[tuple(index.T)]
    colliding = image.certified_colliding()[tuple(index.T)]
    assert not (free & colliding).any()
    touched = np.logical_or(*judged(machine, q, obstacles))
    assert not (free & touched).any()
    assert not (colliding & ~touched).any()
    grown, _ = judged(machine, q[free][:4000], obstacles, eta)
    assert not grown.any()
    assert free.mean() > 0.05
    assert colliding.mean() > 0.005


def test_coal_finds_no_wrong_certificate(machine: Machine) -> None:
    obstacles = scene(machine, 12)
    image = joint_image.certified4(machine, {"partner": obstacles}, 0.0, SHAPE)
    index, q = draw(image.grid, COUNT, 12)
    free = image.certified_free()[tuple(index.T)]
    by_partner = joint_image.unpacked(image.blocked["partner"], SHAPE[3])[tuple(index.T)]
    # The free cells beside the blocked ones are where a wrong certificate would be.
    near = np.flatnonzero(free)[:60]
    assert not coal_touches(machine, q[near], obstacles).any()
    sure = np.flatnonzero(by_partner)[:60]
    assert coal_touches(machine, q[sure], obstacles).all()


def test_certificates_bracket_the_exact_image() -> None:
    machine = machine_named("mini")
    obstacles = scene(machine, 13)
    exact = joint_image.joint4(machine, {"p": obstacles}, SHAPE).colliding()
    image = joint_image.certified4(machine, {"p": obstacles}, 0.0, SHAPE)
    assert not (image.certified_free() & exact).any()
    assert not (image.certified_colliding() & ~exact).any()
    finer = joint_image.certified4(machine, {"p": obstacles}, 0.0, (144, 36, 36, 40))
    assert finer.undecided < image.undecided
    grown = joint_image.certified4(machine, {"p": obstacles}, 0.1, SHAPE)
    assert not (grown.certified_free() & ~image.certified_free()).any()


def test_present_swing_is_taken_as_exact() -> None:
    machine = machine_named("mini")
    obstacles = scene(machine, 14)
    q = np.array([0.4, 0.0, -1.0, 0.0])
    image = joint_image.certified3(machine, {"p": obstacles}, 0.0, q, (30, 30, 30))
    index, configurations = draw(image.grid, 3000, 14)
    touched = np.logical_or(*judged(machine, configurations, obstacles))
    assert not (image.certified_free()[tuple(index.T)] & touched).any()
    assert not (image.certified_colliding()[tuple(index.T)] & ~touched).any()


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(*[st.floats(-2.0, 4.0)] * 3),
    st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    st.tuples(*[st.floats(0.01, 1.5)] * 3),
    st.floats(-0.4, 0.3),
    st.floats(0.01, 0.5),
    st.floats(0.002, 0.15),
)
def test_slices_of_a_cell_bracket_the_slices_of_its_swings(
    center: tuple[float, float, float],
    attitude: tuple[float, float, float],
    half: tuple[float, float, float],
    low: float,
    width: float,
    spread: float,
) -> None:
    R = rotation.from_attitude(*attitude)
    box = Boxes(np.array([center]), R[None], np.array([half]))
    corners = box.corners()[0]
    points, work = np.empty((POINTS, 3)), np.empty((2, 12, 3))

    def polygon(kind: str, at: np.ndarray, front: bool = True) -> np.ndarray:
        x, z = np.empty(POINTS), np.empty(POINTS)
        if kind == "inner":
            n = inner_slice(at, low, low + width, spread, points, work, x, z)
        else:
            s = spread if kind == "outer" else 0.0
            n = outer_slice(at, low, low + width, s, front, points, work, x, z)
        return np.stack([x[:n], z[:n]], axis=1)

    around = [polygon("outer", corners, front) for front in (True, False)]
    inside = polygon("inner", corners)
    for d in np.linspace(-spread, spread, 7):
        c, s = np.cos(d), np.sin(d)
        turned = corners @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        slice_ = polygon("slice", turned)
        for p in slice_:
            if abs(p[0]) > 1e-6:  # beside the axis it may belong to either part
                assert any(_within(q, p) for q in around)
        for p in inside:
            assert _within(slice_, p)


def _within(polygon: np.ndarray, p: np.ndarray) -> bool:
    """Whether p is in the convex polygon, to 1e-9 m."""
    if len(polygon) < 3:
        return bool(len(polygon) and np.linalg.norm(polygon - p, axis=1).min() < 1e-6)
    edge = np.roll(polygon, -1, axis=0) - polygon
    out = p - polygon
    length = np.linalg.norm(edge, axis=1)
    return bool((edge[:, 0] * out[:, 1] - edge[:, 1] * out[:, 0] >= -1e-9 * (1 + length)).all())
