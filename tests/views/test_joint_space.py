"""The joint-space view, the ghost and the exact zones: geometry, and nodes on a real server."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
import toy_site as toy
import trimesh
import viser

from backend.cspace.cells import COLLIDING, FREE, PARTNER, SELF, SITE
from backend.cspace.driving import Exit
from backend.machine.kinematics import link_poses
from backend.pipeline.zones import ZoneImage
from cockpit.views import palette
from cockpit.views.cameras import camera_pose
from cockpit.views.cell_surface import exposed_faces, layer_masks
from cockpit.views.ghost import GhostNodes
from cockpit.views.joint_space import ORIGIN, SIZE, JointSpaceNodes
from cockpit.views.server import open_server
from cockpit.views.shapes import filled_area, outline
from cockpit.views.zone import ZoneNodes


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    made = open_server()
    yield made
    made.stop()


def exact_image(state_time: float = 10.0, seed: int = 0) -> SimpleNamespace:
    rng = np.random.default_rng(seed)
    cells = rng.choice(np.array([FREE, PARTNER | COLLIDING, SITE, SELF, 0], np.uint8), (6, 5, 4))
    return SimpleNamespace(
        state_time=state_time,
        q=np.array([0.5, 0.1, -1.0, 0.2]),
        volume=cells,
        volume_edges=np.array([[-0.5, 1.0], [-2.0, -0.5], [-1.0, 1.0]]),
        stopping=np.array([[0.0, 0.3], [0.1, 0.2], [-0.1, 0.2], [0.0, 0.2]]),
    )


def test_exposed_faces_close_the_solid_and_face_outwards() -> None:
    solid = np.zeros((6, 7, 5), dtype=bool)
    solid[1:4, 2:6, 1:4] = True
    solid[2, 3, 2] = False  # a hole inside
    mesh = trimesh.Trimesh(*exposed_faces(solid, solid))
    mesh.merge_vertices()
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(solid.sum())


def test_faces_are_counted_as_by_hand() -> None:
    rng = np.random.default_rng(1)
    shown = rng.uniform(size=(5, 4, 6)) < 0.3
    solid = shown | (rng.uniform(size=shown.shape) < 0.3)
    count = 0
    for cell in np.argwhere(shown):
        for axis in range(3):
            for side in (-1, 1):
                there = cell.copy()
                there[axis] += side
                inside = ((there >= 0) & (there < shown.shape)).all()
                count += not (inside and solid[tuple(there)])
    vertices, faces = exposed_faces(shown, solid)
    assert (len(vertices), len(faces)) == (4 * count, 2 * count)


def test_a_cell_that_hits_several_is_drawn_as_the_first() -> None:
    cells = np.array([PARTNER | SELF, SITE | SELF, SELF, FREE], dtype=np.uint8)
    masks = layer_masks(cells, (PARTNER, SITE, SELF))
    assert [mask.tolist() for mask in masks] == [
        [True, False, False, False],
        [False, True, False, False],
        [False, False, True, False],
    ]


def node(server: viser.ViserServer, name: str) -> viser.SceneNodeHandle:
    found = server.scene.get_handle_by_name(name)
    assert found is not None, name
    return found


def test_the_view_shows_the_image_only_to_who_looks(server: viser.ViserServer) -> None:
    nodes = JointSpaceNodes(server.scene, "LEFT")
    image = exact_image()
    nodes.update(image, 10.1, shown=False)
    assert not node(server, "/joints").visible
    nodes.update(image, 10.2, shown=True)
    assert node(server, "/joints").visible
    for bit, color in ((PARTNER, palette.PARTNER), (SITE, palette.SITE), (SELF, palette.SELF)):
        mesh = node(server, f"/joints/layer{bit}")
        assert mesh.visible
        assert mesh.color == color
        vertices, _ = exposed_faces((image.volume & bit) != 0, (image.volume & 7) != 0)
        assert len(mesh.vertices) == len(vertices)
        assert mesh.vertices.max() <= SIZE
    star = np.array(node(server, "/joints/star").position)
    np.testing.assert_allclose(star, SIZE * np.array([0.6 / 1.5, 1.0 / 1.5, 1.2 / 2.0]))
    assert node(server, "/joints/title").text == "LEFT at swing 29° · slice 0.2 s old"
    now = node(server, "/joints/stop-now").points
    np.testing.assert_allclose(now[0, 1] - now[0, 0], [0.1 * SIZE / 1.5, 0, 0], atol=1e-6)


def test_the_view_says_stale(server: viser.ViserServer) -> None:
    nodes = JointSpaceNodes(server.scene, "LEFT")
    nodes.update(None, 10.0, shown=True)
    assert "no image" in node(server, "/joints/title").text
    nodes.update(exact_image(), 10.1, shown=True)
    nodes.update(exact_image(seed=0), 12.0, shown=True)
    assert "STALE 2.0 s" in node(server, "/joints/title").text
    assert node(server, f"/joints/layer{PARTNER}").color == palette.STALE
    nodes.update(exact_image(12.4, seed=0), 12.5, shown=True)
    assert node(server, f"/joints/layer{PARTNER}").color == palette.PARTNER


def test_the_camera_looks_at_the_box() -> None:
    pose = camera_pose("joints", toy.site(), toy.snapshot(), "left")
    middle = np.array(ORIGIN) + SIZE / 2
    assert np.linalg.norm(pose.look_at - middle) < 0.1 * SIZE
    assert np.linalg.norm(pose.position - middle) > SIZE


def test_a_ghost_stands_on_the_machines_base(server: viser.ViserServer) -> None:
    site, snapshot = toy.site(), toy.snapshot(swing=0.2)
    ghost = GhostNodes(server.scene, "left", site.machines["left"])
    state = snapshot.machines["left"]
    ghost.update(state)
    assert not node(server, "/ghost").visible
    ghost.joints = np.array([0.4, 0.3, -0.8, 0.1])
    ghost.update(state)
    assert node(server, "/ghost").visible
    assert node(server, "/ghost/name").text == "WHAT IF · LEFT"
    expected = link_poses(site.machines["left"].model, ghost.joints, state.body.link_poses[0])
    np.testing.assert_allclose(node(server, "/ghost/3").position, expected[3, :3, 3], atol=1e-9)
    assert node(server, "/ghost/1/0").opacity < 0.5
    ghost.remove()
    assert server.scene.get_handle_by_name("/ghost") is None


def test_exact_zones_keep_their_holes_and_tell_variants_apart(server: viser.ViserServer) -> None:
    square = shapely.box(0, 0, 6, 6).difference(shapely.box(2, 2, 3, 3))
    vertices, faces = filled_area(square)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(35.0)
    solid, dashed = outline(square), outline(square, 0.2)
    assert np.linalg.norm(solid[:, 1] - solid[:, 0], axis=1).sum() == pytest.approx(28.0)
    assert np.linalg.norm(dashed[:, 1] - dashed[:, 0], axis=1).sum() == pytest.approx(14.0, rel=0.1)
    variants = {"as_is": square, "any_swing": square.buffer(1), "any_posture": square.buffer(2)}
    exits = {name: Exit(1.0, np.array([1.0, 0.0]), 0.0) for name in variants}
    image = ZoneImage("left", "right", 5.0, np.zeros(2), 0.1, variants, exits)
    nodes = ZoneNodes(server.scene, "/zone")
    nodes.update(image, 5.5, 0.0)
    for name in ("fill", "edge", "any_swing", "any_posture"):
        assert node(server, f"/zone/{name}").visible
    nodes.update(image, 8.0, 0.0)
    assert not node(server, "/zone/fill").visible
    nodes.update(None, 8.0, 0.0)
    assert not node(server, "/zone").visible
