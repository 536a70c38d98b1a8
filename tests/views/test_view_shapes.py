"""Points, triangles, words and camera poses, without a server."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import shapely
import toy_site as toy
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from backend.fusion.pose import Validity
from backend.safety.record import Level
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import rz
from cockpit.views import palette
from cockpit.views.cameras import camera_names, camera_pose, extent
from cockpit.views.ground import grid_labels, grid_origin, ground_height
from cockpit.views.labels import distance_text, name_text, oldest, pair_level
from cockpit.views.lettering import STROKES, width, written
from cockpit.views.shapes import box_mesh, circle, feature_edges, filled, link_meshes, polyline

ASPECT = 1128 / 640


@given(
    st.lists(st.floats(0.3, 4.0), min_size=3, max_size=40), st.floats(-50, 50), st.floats(-50, 50)
)
def test_filled_covers_the_polygon_facing_up(radii: list[float], x: float, y: float) -> None:
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    polygon = np.column_stack([np.cos(angles), np.sin(angles)]) * np.array(radii)[:, None] + [x, y]
    vertices, faces = filled(polygon)
    a, b, c = np.moveaxis(vertices[faces].astype(float), 1, 0)
    normals = np.cross(b - a, c - a)
    assert (normals[:, 2] > -1e-4).all()
    assert normals[:, 2].sum() / 2 == pytest.approx(shapely.Polygon(polygon).area, rel=1e-3)


@pytest.mark.parametrize(
    "polygon", [np.zeros((0, 2)), np.zeros((3, 2)), np.full((4, 2), np.nan), np.eye(2)]
)
def test_no_area_gives_no_triangles(polygon: np.ndarray) -> None:
    _, faces = filled(polygon)
    assert len(faces) == 0


def test_a_polygon_that_crosses_itself_is_still_filled() -> None:
    bow = np.array([[0, 0], [2, 2], [2, 0], [0, 2.0]])
    vertices, faces = filled(bow)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(2.0)


def test_boxes_are_closed_and_face_outwards() -> None:
    R = rz(np.array([0.0, 0.7]))
    boxes = Boxes(np.array([[0, 0, 0], [5, 0, 1.0]]), R, np.array([[1, 2, 3], [0.5, 0.5, 0.5]]))
    mesh = trimesh.Trimesh(*box_mesh(boxes), process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(48.0 + 1.0, rel=1e-6)
    assert len(feature_edges(*box_mesh(boxes))) == 24


def test_edges_that_are_flat_or_short_are_left_out() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=3)
    faces = sphere.faces.astype(np.uint32)
    assert len(feature_edges(sphere.vertices.astype(np.float32), faces)) == 0
    small = Boxes(np.zeros((1, 3)), np.eye(3)[None], np.full((1, 3), 0.01))
    assert len(feature_edges(*box_mesh(small))) == 0


def test_a_link_without_visuals_is_drawn_as_its_bodies() -> None:
    with_visuals, bare = toy.machine(), toy.machine(visuals=False)
    (vertices, _, color), *rest = link_meshes(bare, 1)
    assert color is None
    assert not rest
    drawn = np.concatenate([v for v, _, _ in link_meshes(with_visuals, 1)])
    np.testing.assert_allclose(np.sort(vertices, axis=0), np.sort(drawn, axis=0), atol=1e-6)


def test_visuals_of_one_colour_become_one_mesh() -> None:
    meshes = link_meshes(toy.machine(), 1)
    assert sorted(color for _, _, color in meshes) == sorted({toy.YELLOW, toy.GLASS})
    assert sum(len(faces) for _, faces, _ in meshes) == 4 * 12


def test_circles_and_outlines() -> None:
    assert np.linalg.norm(circle(), axis=2) == pytest.approx(1.0)
    assert len(circle(96, dashed=True)) == 48
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    assert len(polyline(square, closed=True)) == 4
    assert len(polyline(square, closed=False)) == 3
    np.testing.assert_array_equal(polyline(square, closed=True)[-1, 1, :2], square[0])


def test_letters_stay_in_their_width_and_differ() -> None:
    text = "4129950N"
    strokes = written(text, (10.0, 20.0), 0.8)
    assert strokes[..., 0].min() >= 10.0
    assert strokes[..., 0].max() <= 10.0 + width(text, 0.8) + 1e-5
    assert (strokes[..., 1].min(), strokes[..., 1].max()) == pytest.approx((20.0, 20.8))
    drawn = {letter: written(letter, (0, 0), 1.0).tobytes() for letter in STROKES}
    assert len(set(drawn.values())) == len(STROKES)


@given(st.floats(1e5, 9e5), st.floats(0, 9e6), st.floats(-200, 200), st.floats(-200, 200))
def test_grid_lines_are_at_round_coordinates(e: float, n: float, x: float, y: float) -> None:
    corner = grid_origin((e, n, 0.0), (x, y), 10.0)
    for origin, value, near in ((e, corner[0], x), (n, corner[1], y)):
        assert math.isclose((origin + value) / 10.0, round((origin + value) / 10.0), abs_tol=1e-6)
        assert abs(value - near) <= 5.0 + 1e-6


def test_labels_keep_clear_of_the_workspaces() -> None:
    strokes = grid_labels((308603.5, 4129952.0, 0.0), (-3.5, -2.0), (-7.0, -4.0), 15.0, 5.0)
    inside = (strokes[..., 0] > -7.0) & (strokes[..., 1] > -4.0)
    assert not inside.any()
    assert strokes.dtype == np.float32
    assert np.abs(strokes).max() < 40.0  # small coordinates only, never UTM


def test_the_ground_ignores_noise_and_follows_a_step() -> None:
    assert ground_height([0.02, 0.4], 0.0) == 0.0
    assert ground_height([23.4, 24.0], 0.0) == 23.4
    assert ground_height([], 1.5) == 1.5


def test_lines_show_in_the_colour_asked_for() -> None:
    for color in (palette.PARTNER, palette.TEXT, palette.EDGE):
        sent = np.array(palette.line(color)) / 255.0
        shown = np.where(sent > 0.0031308, 1.055 * sent ** (1 / 2.4) - 0.055, 12.92 * sent)
        np.testing.assert_allclose(255 * shown, color, atol=7)


def test_tints_keep_dark_parts_dark_and_tell_machines_apart() -> None:
    luminance = [0.3, 0.59, 0.11]
    first, second = (palette.tint(toy.YELLOW, t) for t in palette.TINTS[:2])
    assert np.dot(palette.tint(toy.DARK, palette.TINTS[0]), luminance) < 110
    assert np.abs(np.subtract(first, second)).max() > 40
    saturation = [(max(c) - min(c)) / max(c) for c in (first, second)]
    assert max(saturation) < 0.45  # never taken for amber or red


@pytest.mark.parametrize(
    ("distance", "level", "words"),
    [
        (3.4, Level.CLEAR, "3.40 m"),
        (0.78, Level.SLOW, "▲ SLOW · 0.78 m"),
        (0.2, Level.STOP, "STOP · 0.20 m"),
        (-0.05, Level.STOP, "STOP · 0.00 m"),
        (float("nan"), Level.UNKNOWN, "? clearance unknown"),
        (5.0, Level.UNKNOWN, "? clearance unknown"),
        (float("nan"), Level.CLEAR, "? clearance unknown"),
    ],
)
def test_distance_words(distance: float, level: Level, words: str) -> None:
    assert distance_text(distance, level, exact=True) == words


def test_a_lower_bound_says_so() -> None:
    assert distance_text(12.34, Level.CLEAR, exact=False) == "over 12.3 m"


@given(st.floats(0.0, 3.0))
def test_level_of_a_pair_is_never_below_the_distance(distance: float) -> None:
    snapshot = toy.snapshot(distance=distance)
    level = pair_level(snapshot, snapshot.pairs[0], 0.8, 0.2)
    expected = Level.STOP if distance <= 0.2 else Level.SLOW if distance < 0.8 else Level.CLEAR
    assert level is expected
    for verdict in Level:
        judged = dataclasses.replace(snapshot, concerns=(toy.concern(verdict),))
        assert pair_level(judged, judged.pairs[0], 0.8, 0.2) == max(level, verdict)


def test_concerns_of_other_pairs_do_not_count() -> None:
    snapshot = toy.snapshot(distance=2.0)
    other = dataclasses.replace(snapshot, concerns=(toy.concern(Level.STOP, other="third:boom/0"),))
    assert pair_level(other, other.pairs[0], 0.8, 0.2) is Level.CLEAR


def test_names_say_what_is_wrong() -> None:
    assert name_text("LEFT", Validity.VALID, 0.1) == "LEFT"
    assert name_text("LEFT", Validity.STALE, 0.64) == "LEFT · STALE 0.6 s"
    assert name_text("LEFT", Validity.UNKNOWN, math.inf) == "LEFT · UNKNOWN"
    assert oldest(toy.state("left", None, age=0.3).pose) == 0.3
    assert oldest(dataclasses.replace(toy.state("left", None).pose, streams={})) == math.inf


def seen(pose: object, points: np.ndarray) -> np.ndarray:
    """Normalised picture coordinates (n, 2) of points (n, 3): within -1..1 is in the picture."""
    ahead = pose.look_at - pose.position
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    rel = points - pose.position
    depth = rel @ ahead
    assert (depth > 0).all()
    scale = depth * np.tan(pose.fov / 2)
    return np.column_stack([rel @ right / scale / ASPECT, rel @ up / scale])


@pytest.mark.parametrize("camera", ["site", "plan", "behind left", "behind RIGHT", "follow"])
def test_cameras_show_the_machines(camera: str) -> None:
    site, snapshot = toy.site(), toy.snapshot()
    pose = camera_pose(camera, site, snapshot, "left")
    shown = ["left", "right"] if camera in ("site", "plan") else ["left"]
    if "RIGHT" in camera:
        shown = ["right"]
    for name in shown:
        corners = snapshot.machines[name].body.boxes.corners().reshape(-1, 3)
        assert np.abs(seen(pose, corners)).max() < 1.0
    assert pose.position[2] > 2.0


def test_north_is_up_in_the_plan() -> None:
    pose = camera_pose("plan", toy.site(), toy.snapshot(), "left")
    center, across, along = extent(toy.site(), toy.snapshot())
    offsets = np.array([[0, 0, 0], [0, along, 0], [across, 0, 0]])
    north = seen(pose, center + offsets)
    assert north[1, 1] > 0.5
    assert abs(north[1, 0]) < 1e-6
    assert 0.3 < north[2, 0] < 1.0


def test_a_narrow_picture_still_shows_all_machines() -> None:
    snapshot = toy.snapshot()
    for camera in ("site", "plan"):
        pose = camera_pose(camera, toy.site(), snapshot, "left", aspect=0.75)
        for state in snapshot.machines.values():
            corners = state.body.boxes.corners().reshape(-1, 3)
            assert np.abs(seen(pose, corners)[:, 0]).max() * ASPECT / 0.75 < 1.0


def test_behind_a_machine_looks_along_its_arm() -> None:
    snapshot = toy.snapshot(swing=0.5)
    body = snapshot.machines["left"].body
    pose = camera_pose("behind left", toy.site(), snapshot, "right")
    arm = np.array([np.cos(body.azimuth), np.sin(body.azimuth)])
    assert (pose.position[:2] - body.swing_center[:2]) @ arm < 0
    assert (pose.look_at[:2] - body.swing_center[:2]) @ arm > 0


def test_an_unknown_camera_names_those_there_are() -> None:
    for wrong in ("moon", "behind nobody", ""):
        with pytest.raises(ValueError, match="behind left"):
            camera_pose(wrong, toy.site(), toy.snapshot(), "left")
    for name in camera_names(toy.site()):
        camera_pose(name, toy.site(), None, "left")
