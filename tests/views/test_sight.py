"""What is hidden from the cab: against walking along each ray in small steps."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import toy_site as toy
import viser
from viewing import counted, handle

from backend.machine.model import Eye
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import rz
from cockpit.views import sight
from cockpit.views.inputs import SceneMachine
from cockpit.views.sight_nodes import SightNodes

EYE = np.array([0.4, 0.3, 2.2])
# The cab about the eye, a counterweight behind, a turned boom ahead to the right, a far low wall.
BODY = Boxes(
    np.array([[0.4, 0.3, 1.9], [-1.2, 0.0, 1.4], [2.0, -0.6, 1.9], [0.0, 6.0, 0.5]]),
    np.array([np.eye(3), np.eye(3), rz(0.3), np.eye(3)]),
    np.array([[0.5, 0.5, 0.8], [0.5, 1.2, 0.8], [1.6, 0.2, 0.5], [3.0, 0.2, 1.2]]),
)


def walked(eye: np.ndarray, ray: np.ndarray, boxes: Boxes) -> bool:
    """Whether any of 4000 points between the eye and the ray's end is in a box."""
    points = eye + np.linspace(0.0, 1.0, 4000)[:, None] * ray
    local = np.einsum("nij,nki->nkj", boxes.rotations, points - boxes.centers[:, None])
    return bool((np.abs(local) <= boxes.half_extents[:, None]).all(axis=2).any())


def test_a_ray_is_blocked_where_a_walk_along_it_meets_a_body() -> None:
    rng = np.random.default_rng(5)
    rays = rng.uniform([-9, -9, -2.5], [9, 9, 0.5], (300, 3))
    without_cab = BODY.take(np.array([1, 2, 3]))
    expected = [walked(EYE, ray, without_cab) for ray in rays]
    assert 30 < sum(expected) < 270
    # A ray that only grazes an edge may be told either way: none of these does.
    np.testing.assert_array_equal(sight.blocked(EYE, rays, BODY), expected)


def test_nothing_blocks_without_bodies_and_the_cab_does_not() -> None:
    rays = np.array([[4.0, 0.0, -1.0], [-3.0, 1.0, 0.0]])
    none = BODY.take(np.zeros(0, dtype=np.int64))
    assert not sight.blocked(EYE, rays, none).any()
    assert not sight.blocked(EYE, rays, BODY.take(np.array([0]))).any()


@pytest.mark.parametrize("azimuth", [0.0, 2.5, -3.0])
def test_behind_is_never_seen_and_turns_with_the_cab(azimuth: float) -> None:
    unseen = sight.hidden(EYE, azimuth, BODY.take(np.array([0])), 0.0)
    angles = sight.directions(azimuth)
    ahead = np.cos(angles - azimuth)
    np.testing.assert_array_equal(unseen.all(axis=1), ahead < np.cos(sight.SIDE) - 1e-12)
    assert not unseen[ahead > np.cos(sight.SIDE) + 1e-9].any()


def test_the_fan_covers_just_the_hidden_cells() -> None:
    unseen = sight.hidden(EYE, 0.4, BODY, 0.0)
    lines = sight.fan(EYE, 0.4, unseen).astype(float)
    bounds, angles = sight.edges(), sight.directions(0.4)
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
    step = (sight.FAR - sight.NEAR) / sight.RINGS
    assert length == pytest.approx(step * unseen.sum(), rel=1e-5)
    offset = lines.mean(axis=1)[:, :2] - EYE[:2]
    ray = np.rint((np.arctan2(offset[:, 1], offset[:, 0]) - 0.4) * 120 / (2 * np.pi)).astype(int)
    ring = np.searchsorted(bounds, np.linalg.norm(offset, axis=1) - step / 4) - 1
    assert unseen[ray % len(angles), ring].all()
    edge = sight.frame(EYE, 0.4, unseen)
    assert np.linalg.norm(edge[..., :2] - EYE[:2], axis=2).max() == pytest.approx(sight.FAR, 1e-5)
    assert len(edge) == 2 + (~unseen[:, -1]).sum()


def test_nodes_follow_the_machine_and_say_nothing_while_it_stands(
    server: viser.ViserServer,
) -> None:
    model = dataclasses.replace(toy.machine(), eye=Eye(1, np.array([0.3, 0.2, 1.2])))
    machines = {"left": SceneMachine("LEFT", model), "right": SceneMachine("RIGHT", toy.machine())}
    nodes = SightNodes(server.scene, machines)
    snapshot = toy.snapshot()
    assert not counted(server, lambda: nodes.update(snapshot.machines, False, 0.0, 0.0))
    nodes.update(snapshot.machines, True, 0.0, 1.0)
    blind = handle(server, "/sight/left/blind")
    assert blind.visible
    assert server.scene.get_handle_by_name("/sight/right/blind") is None
    assert not counted(server, lambda: nodes.update(snapshot.machines, True, 0.0, 2.0))
    before = blind.points.copy()
    nodes.update(toy.snapshot(swing=1.0).machines, True, 0.0, 3.0)
    assert not np.array_equal(before, blind.points)
    nodes.update(snapshot.machines, False, 0.0, 4.0)
    assert not blind.visible
