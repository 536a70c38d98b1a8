"""The long search: boxes contain the mesh, come near the best, and can be put in a sidecar."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh
from program import cockpit

from backend.machine import long_fit as searching
from backend.machine.anneal_kernels import UNIT, outside, sticking_out
from backend.machine.fitting import excess
from backend.machine.fitting_field import distance_field, room
from backend.machine.load import load_machine
from backend.machine.long_fit import Link, Renewal, annealed, long_fit, spread
from backend.machine.polish import Set, polished
from backend.machine.sidecar import Sidecar
from backend.machine.stated import as_toml, left_out, tables_of
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import about_axis


def bars(*sizes_and_centers: tuple[tuple[float, ...], tuple[float, ...]]) -> np.ndarray:
    parts = []
    for size, center in sizes_and_centers:
        box = trimesh.creation.box(extents=size)
        parts.append(np.array(box.triangles) + np.array(center))
    return np.concatenate(parts)


L_SHAPE = bars(((2.0, 0.4, 0.4), (1.0, 0.0, 0.0)), ((0.4, 0.4, 1.6), (0.2, 0.0, 0.8)))


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(searching, "MOVES", 20_000)
    monkeypatch.setattr(searching, "RENEWALS", 4)


def test_how_far_points_are_outside() -> None:
    rng = np.random.default_rng(0)
    R = about_axis(np.array([0.0, 0.6, 0.8]), 0.7)
    c, h = np.array([0.1, -0.2, 0.3]), np.array([0.5, 0.2, 0.4])
    points = rng.normal(size=(200, 3))
    out = np.empty(200)
    outside(points, R, c, h, out)
    want = (np.abs((points - c) @ R) - h).max(axis=1)
    np.testing.assert_allclose(out, np.maximum(want, 0.0), atol=1e-12)
    away = Set(R[None], c[None], h[None]).away(points)
    np.testing.assert_allclose(away[0], want, atol=1e-12)


def test_only_what_is_beyond_the_tolerance_sticks_out() -> None:
    field = distance_field(L_SHAPE, margin=0.35)
    space, _ = room(field, 0.1)
    coarse = np.clip(np.rint((space.values - 0.1) / UNIT), -127, 127).astype(np.int8)
    foot, eye = np.array([1.0, 0.0, 0.0]), np.eye(3)

    def of(grow: float) -> float:
        h = np.array([1.0, 0.2, 0.2]) + grow
        return sticking_out(coarse, space.origin, space.step, 0.05, eye, foot, h, 1e9)

    assert of(0.0) == of(0.04) == 0.0
    assert 0.0 < of(0.12) < of(0.2)


def test_polishing_brings_shifted_boxes_back_over_the_mesh() -> None:
    link = Link.of(L_SHAPE)
    turn = about_axis(np.array([0.0, 0.0, 1.0]), 0.05)
    boxes = Set(
        np.stack([turn, np.eye(3)]),
        np.array([[1.02, 0.03, 0.02], [0.24, 0.0, 0.85]]),
        np.array([[1.1, 0.3, 0.3], [0.3, 0.25, 0.9]]),
    )
    space, _ = room(link.distance, 0.04)
    better = polished(boxes, link.points, space, 0.04, 30)
    assert better.away(link.points).min(axis=0).max() < 2e-3
    full = Boxes(better.c, better.R, better.h + 2e-3)
    assert excess(full, L_SHAPE) < 0.6 * excess(Boxes(boxes.c, boxes.R, boxes.h), L_SHAPE)


def test_boxes_that_are_near_enough_are_left_as_they_are_by_polishing() -> None:
    link = Link.of(L_SHAPE)
    space, _ = room(link.distance, 0.3)
    box = Set(np.eye(3)[None], np.array([[1.0, 0.0, 0.0]]), np.array([[1.0, 0.2, 0.2]]))
    some = link.points[link.points[:, 2] < 0.19]
    again = polished(box, some, space, 0.3, 3)
    assert again.away(some).max() < 1e-3
    far = Set(box.R, box.c, 0.3 * box.h)  # nothing of it is near what is forbidden
    assert polished(far, some, space, 0.3, 3).away(some).max() < far.away(some).max()


def test_annealing_finds_the_two_bars_from_anywhere() -> None:
    link = Link.of(L_SHAPE)
    boxes = annealed(link, spread(link, 2, np.random.default_rng(1)), 0.1, 1.2, 1)
    assert boxes.away(link.points).min(axis=0).max() < 0.02


def test_renewed_boxes_keep_within_what_is_aimed_at_and_leave_nothing_out() -> None:
    link = Link.of(L_SHAPE)
    turn = about_axis(np.array([0.0, 0.0, 1.0]), 0.05)
    boxes = Boxes(
        np.array([[1.02, 0.03, 0.02], [0.24, 0.0, 0.85]]),
        np.stack([turn, np.eye(3)]),
        np.array([[1.1, 0.4, 0.4], [0.3, 0.25, 1.1]]),
    )
    assert excess(boxes, L_SHAPE) > 0.3
    better = Renewal(link, boxes, 0.06, 1).improved()
    full = Boxes(better.c, better.R, better.h + 3e-3)
    assert left_out(full, L_SHAPE)[0] == 0.0
    assert excess(full, L_SHAPE) < 0.07


def test_a_long_fit_contains_everything_is_near_and_deterministic() -> None:
    boxes, value = long_fit(L_SHAPE, 2, 0.05, 2, 0)
    assert len(boxes) == 2
    assert left_out(boxes, L_SHAPE)[0] == 0.0
    assert value == excess(boxes, L_SHAPE) < 0.08
    again, _ = long_fit(L_SHAPE, 2, 0.05, 2, 0)
    np.testing.assert_array_equal(again.half_extents, boxes.half_extents)
    read = Sidecar.model_validate(tomllib.loads(as_toml({"l": tables_of(boxes)})))
    assert read.bodies.boxes["l"] == tables_of(boxes)  # nothing is lost in writing


def test_known_boxes_are_kept_unless_better_ones_are_found() -> None:
    good = Boxes(
        np.array([[1.0, 0.0, 0.0], [0.2, 0.0, 0.8]]),
        np.stack([np.eye(3)] * 2),
        np.array([[1.001, 0.201, 0.201], [0.201, 0.201, 0.801]]),
    )
    kept, value = long_fit(L_SHAPE, 2, 0.05, 3, 0, good)
    np.testing.assert_allclose(kept.half_extents, good.half_extents, atol=1e-9)
    assert value < 0.02
    small = Boxes(good.centers, good.rotations, 0.9 * good.half_extents)
    found, _ = long_fit(L_SHAPE, 2, 0.05, 1, 0, small)  # those leave some out: not a solution
    assert left_out(found, L_SHAPE)[0] == 0.0


@pytest.mark.parametrize("bad", [np.zeros((0, 3, 3)), np.zeros((4, 3)), np.full((1, 3, 3), np.nan)])
def test_unusable_triangles_are_refused(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match="triangles must"):
        long_fit(bad, 2, 0.1, 1, 0)


def test_what_the_command_prints_goes_into_the_sidecar(tiny, tmp_path: Path) -> None:
    trimesh.creation.box(extents=(0.5, 0.4, 0.3)).export(tmp_path / "b.stl")
    path = tiny(('<sphere radius="0.25"/>', '<mesh filename="b.stl"/>'))
    done = cockpit("fit", str(path), "--starts", "1")
    assert done.returncode == 0, done.stderr
    assert "# 0." in done.stdout
    path.with_suffix(".toml").write_text(done.stdout)
    machine = load_machine(str(path))
    count = sum(name.startswith("bucket/") for name in machine.body_names)
    assert count == len(tomllib.loads(done.stdout)["bodies"]["boxes"]["bucket"]) <= 12
    refused = cockpit("fit", str(path), "--link", "boom")
    assert refused.returncode == 2
    assert "bucket" in refused.stderr
