"""Cells of a joint volume as surfaces, and what is marked among them."""

from __future__ import annotations

import numpy as np
import pytest
import toy_site as toy
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from backend.cspace.cells import COLLIDING, FREE, PARTNER, SELF, SITE
from cockpit.views import palette
from cockpit.views.cameras import camera_pose
from cockpit.views.joint_frame import PLACE, SIDE, SIZE, box_lines, on_axis, place, ticks
from cockpit.views.joint_marks import full_box, plumb_lines, stop_bars
from cockpit.views.joint_space import TITLE, legend_place
from cockpit.views.surface import CAUSES, UNDECIDED, causes, surfaces

EDGES = np.array([[-1.0, 1.0], [-2.0, 1.0], [-1.0, 2.0]])
BYTES = st.sampled_from(
    [
        0,
        FREE,
        PARTNER,
        SITE | COLLIDING,
        SELF,
        PARTNER | SITE,
        SITE | SELF,
        8,
        COLLIDING,
        16 | 4,
        32,
    ]
)


def brute_force(cells: np.ndarray) -> dict[str, int]:
    """Sides of cells per name, one by one."""
    order = [("people", 8), ("partner", 1), ("tip-over", 16), ("site", 2), ("self", 4)]
    order.append(("other", 255 - FREE))

    def kind(index: tuple[int, ...]) -> str:
        value = int(cells[index])
        for name, bits in order:
            if value & bits:
                return name
        return "free" if value & FREE else UNDECIDED

    found = dict.fromkeys([*(name for name, _ in order), UNDECIDED], 0)
    for index in np.ndindex(*cells.shape):
        own = kind(index)
        if own == "free":
            continue
        for axis in range(3):
            for step in (-1, 1):
                beside = list(index)
                beside[axis] += step
                inside = 0 <= beside[axis] < cells.shape[axis]
                other = kind(tuple(beside)) if inside else "outside"
                if own == UNDECIDED:
                    found[own] += other == "free"
                else:
                    found[own] += other in ("free", UNDECIDED, "outside")
    return found


@given(arrays(np.uint8, (4, 3, 5), elements=BYTES))
def test_faces_are_those_of_brute_force(cells: np.ndarray) -> None:
    meshes = surfaces(cells, np.array([4.0, 3.0, 5.0]))
    assert {name: len(faces) // 2 for name, (_, faces) in meshes.items()} == brute_force(cells)
    for vertices, faces in meshes.values():
        assert vertices.dtype == np.float32
        assert len(np.unique(faces)) == len(vertices)  # none that no face uses
        assert len(np.unique(vertices, axis=0)) == len(vertices)


@given(arrays(np.uint8, (4, 3, 5), elements=BYTES))
def test_the_meshes_of_all_causes_close_and_hold_the_colliding_cells(cells: np.ndarray) -> None:
    meshes = [m for name, m in surfaces(cells, np.array([4.0, 3.0, 5.0])).items() if name in CAUSES]
    corners = np.concatenate([vertices[faces] for vertices, faces in meshes]).astype(float)
    # Every directed edge is met by as many the other way: closed, and facing one way.
    starts = corners[:, [0, 1, 2]].reshape(-1, 3)
    ends = corners[:, [1, 2, 0]].reshape(-1, 3)
    there = np.concatenate([starts, ends], axis=1)
    back = np.concatenate([ends, starts], axis=1)
    assert sorted(map(tuple, there)) == sorted(map(tuple, back))
    a, b, c = np.moveaxis(corners, 1, 0)
    inside = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert inside == pytest.approx((causes(cells) >= 0).sum())


def test_a_block_of_cells_is_a_box() -> None:
    cells = np.full((6, 6, 6), FREE, dtype=np.uint8)
    cells[1:4, 2:5, 0:2] = PARTNER | COLLIDING
    vertices, faces = surfaces(cells, np.full(3, 6.0))["partner"]
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(18.0)
    np.testing.assert_allclose(mesh.bounds, [[1, 2, 0], [4, 5, 2]])


def test_the_first_cause_gives_the_colour() -> None:
    cells = np.array(
        [PARTNER | SITE | SELF, SITE | SELF, SELF, 8 | SELF, 16, 32, COLLIDING, 0, FREE]
    )
    names = list(CAUSES)
    found = [names[k] if k >= 0 else None for k in causes(cells.astype(np.uint8))]
    assert found == [
        *("partner", "site", "self", "people", "tip-over", "other", "other"),
        None,
        None,
    ]


def test_a_volume_of_the_usual_size_is_drawn_quickly() -> None:
    a, b, c = np.meshgrid(*[np.linspace(-1, 1, 32)] * 3, indexing="ij")
    away = np.sqrt(a**2 + b**2 + c**2)
    cells = np.where(away < 0.7, PARTNER, np.where(away > 0.8, FREE, 0)).astype(np.uint8)
    meshes = surfaces(cells, SIZE)
    sent = sum(v.nbytes + f.nbytes for v, f in meshes.values())
    assert sent < 500_000  # bytes before compression, at most five times a second
    assert len(meshes["self"][1]) == 0


def test_ticks_are_round_and_few() -> None:
    assert ticks(np.deg2rad([-50.0, 80.0])) == [-30, 0, 30, 60]
    assert ticks(np.deg2rad([-10.0, 12.0])) == [-10, -5, 0, 5, 10]
    for low, high in ((-50, 80), (-150, -25), (-125, 50), (-180, 180), (-8, 9)):
        found = ticks(np.deg2rad([low, high]))
        assert 2 <= len(found) <= 7
        assert all(low - 1e-3 <= value <= high + 1e-3 for value in found)


def test_places_in_the_box() -> None:
    np.testing.assert_allclose(place(EDGES[:, 0], EDGES), np.zeros(3))
    np.testing.assert_allclose(place(EDGES[:, 1], EDGES), SIZE)
    np.testing.assert_allclose(place(EDGES.mean(axis=1), EDGES), SIZE / 2)
    assert box_lines().shape == (12, 2, 3)
    assert np.linalg.norm(np.diff(box_lines(), axis=1), axis=2) == pytest.approx(SIDE)
    assert len({tuple(line.ravel()) for line in box_lines()}) == 12


def test_stopping_bars_reach_where_the_joint_stops() -> None:
    q, free = np.array([0.0, -0.5, 0.5]), np.full((8, 8, 8), FREE, dtype=np.uint8)
    points, colors = stop_bars(free, EDGES, q, np.array([0.4, -0.3, 0.0]))
    assert len(points) == len(colors) == 2 * 3  # a bar and two strokes each, none for the bucket
    np.testing.assert_allclose(points[0, 1], place(np.array([0.4, -0.5, 0.5]), EDGES), rtol=1e-6)
    np.testing.assert_allclose(points[3, 1], place(np.array([0.0, -0.8, 0.5]), EDGES), rtol=1e-6)
    assert {tuple(c) for c in colors.reshape(-1, 3)} == {palette.line(palette.TEXT)}


@pytest.mark.parametrize(
    ("stop", "byte", "red"),
    [(0.4, FREE, False), (0.4, 0, True), (0.4, PARTNER, True), (1.4, FREE, True), (-0.4, 0, False)],
)
def test_a_bar_is_red_where_it_does_not_end_in_what_is_free(
    stop: float, byte: int, red: bool
) -> None:
    cells = np.full((8, 8, 8), FREE, dtype=np.uint8)
    cells[5] = byte  # boom 0.25 to 0.5
    q = np.array([0.1, -0.5, 0.5])
    points, colors = stop_bars(cells, EDGES, q, np.array([stop, 0.0, 0.0]))
    assert (tuple(colors[0, 0]) == palette.line(palette.BLOCKED)) is red
    assert points[..., 0].max() <= SIDE + 1e-5  # never drawn beyond the limit
    _, stale = stop_bars(cells, EDGES, q, np.array([stop, 0.0, 0.0]), stale=True)
    assert tuple(stale[0, 0]) == palette.line(palette.STALE)


def test_the_box_of_full_speed_is_around_the_star() -> None:
    q, full = np.array([0.0, -0.5, 1.9]), np.array([0.2, 0.3, 0.4])
    dashes = full_box(EDGES, q, full)
    low, high = dashes.min(axis=(0, 1)), dashes.max(axis=(0, 1))
    np.testing.assert_allclose(low, place(q - full, EDGES), rtol=1e-5)
    np.testing.assert_allclose(high, place(np.array([0.2, -0.2, 2.0]), EDGES), rtol=1e-5)
    here = place(q, EDGES)
    lines = plumb_lines(here)
    np.testing.assert_allclose(lines[:, 0], np.tile(here, (3, 1)), rtol=1e-5)
    assert [lines[0, 1, 0], lines[1, 1, 1], lines[2, 1, 2]] == [0.0, SIDE, 0.0]


@pytest.mark.parametrize("aspect", [0.7, 1.0, 1128 / 640, 2.4])
def test_the_joints_camera_shows_the_box_with_its_names(aspect: float) -> None:
    pose = camera_pose("joints", toy.site(), None, "left", aspect)
    corners = box_lines().reshape(-1, 3)
    names = [on_axis(axis, 0.5, 1.05) for axis in range(3)]
    marks = [on_axis(axis, share, 0.26) for axis in range(3) for share in (0, 1)]
    words = np.array([*names, *marks, TITLE, *(legend_place(row) for row in range(5))])
    points = np.concatenate([corners, words]) + PLACE - pose.position
    ahead = pose.look_at - pose.position
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    depth = points @ ahead
    scale = depth * np.tan(pose.fov / 2)
    across, up = points @ right / scale / aspect, points @ np.cross(right, ahead) / scale
    assert (depth > 0).all()
    assert np.abs(across).max() < 1.0
    assert np.abs(up).max() < 1.0
    assert max(np.abs(across).max(), np.abs(up).max()) > 0.6  # and fills the picture
