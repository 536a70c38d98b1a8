"""Stages of detection in the scene: what is sent, that each shows alone, and that it goes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
import toy_site as toy
import viser
from viewing import counted, handle

from backend.perception.detect import Objects
from backend.perception.ground import Plane
from backend.perception.stages import GROUND, NAMES, OBJECT, StagedScan
from cockpit.views import stage_shapes
from cockpit.views.browser import Browser
from cockpit.views.server import STAGES_ASKED, View, start
from cockpit.views.stage_nodes import SHOWN, StageNodes

ALL = frozenset(SHOWN)
LEVEL = Plane(np.array([0.0, 0.0, 1.0]), 0.4, 0.9)
CENTERS = np.array([[105.0, 201.0, 1.3], [96.0, 203.0, 1.3]])


def stages(time: float = 0.0, shift: float = 0.0, plane: Plane | None = LEVEL) -> StagedScan:
    """Two objects of 30 points each, 400 on the ground and 50 of a machine; nothing is left."""
    rng = np.random.default_rng(4)
    ground = np.column_stack([rng.uniform([90, 190], [110, 210], (400, 2)), np.full(400, 0.4)])
    machine = rng.uniform([99, 199, 0.5], [101, 201, 2.0], (50, 3))
    centers = CENTERS + np.array([shift, 0.0, 0.0])
    objects = [rng.uniform(c - 0.25, c + 0.25, (30, 3)) for c in centers]
    points = np.concatenate([ground, machine, *objects]).astype(np.float32)
    return StagedScan(
        time,
        points,
        np.repeat([GROUND, 1, OBJECT], [400, 50, 60]).astype(np.uint8),
        np.repeat([-1, 0, 1], [450, 30, 30]),
        (7_000, 900, 21_000, 60, 0),
        plane,
        Objects(centers, np.zeros(2), np.full((2, 3), 0.5), np.full(2, 30)),
    )


def site_points(server: viser.ViserServer, name: str) -> np.ndarray:
    root = handle(server, "/stages").position
    points: np.ndarray = handle(server, f"/stages/{name}").points.astype(float)
    return points + root


def test_each_stage_is_where_its_points_are_and_has_looks_of_its_own(
    server: viser.ViserServer,
) -> None:
    nodes, scan = StageNodes(server.scene), stages()
    nodes.update(scan, ALL)
    for code, name in enumerate(NAMES):
        node = handle(server, f"/stages/{name}")
        wanted = scan.points[scan.stage == code]
        assert node.visible == bool(len(wanted)), name
        if len(wanted):
            np.testing.assert_allclose(site_points(server, name), wanted, atol=0.01)
    looks = [handle(server, f"/stages/{name}") for name in NAMES]
    assert len({(n.point_shape, n.point_size) for n in looks}) == len(NAMES)
    colors = handle(server, "/stages/object").colors
    assert len(np.unique(colors[:30], axis=0)) == len(np.unique(colors[30:], axis=0)) == 1
    assert not np.array_equal(colors[0], colors[-1])
    boxes = handle(server, "/stages/boxes")
    assert len(boxes.points) == 24
    middle = boxes.points.reshape(2, -1, 3).mean(axis=1) + handle(server, "/stages").position
    np.testing.assert_allclose(middle, CENTERS, atol=0.01)


def test_one_stage_alone_and_nothing_else(server: viser.ViserServer) -> None:
    nodes, scan = StageNodes(server.scene), stages()
    for name in SHOWN:
        nodes.update(scan, frozenset([name]))
        seen = {n for n in SHOWN if handle(server, f"/stages/{n}").visible}
        assert seen <= {name}
        assert bool(seen) == (name not in ("outside", "left")), name


def test_only_what_is_shown_and_new_is_sent(server: viser.ViserServer) -> None:
    nodes, scan = StageNodes(server.scene), stages()
    nodes.update(scan, ALL)
    assert not counted(server, lambda: nodes.update(scan, ALL))
    later = stages(0.5, shift=0.1)
    sent = counted(server, lambda: nodes.update(later, frozenset(["object"])))
    moved = counted(server, lambda: nodes.update(stages(1.0, 0.2), frozenset(["object"])))
    assert sum(moved.values()) == 1  # points of objects: nobody's colour changed
    assert sum(sent.values()) <= 8
    gone = counted(server, lambda: nodes.update(None, ALL))
    assert sum(gone.values()) == 1
    assert not handle(server, "/stages").visible
    assert not counted(server, lambda: nodes.update(None, ALL))
    nodes.update(later, ALL)
    assert handle(server, "/stages").visible


def test_no_ground_was_found_and_no_object(server: viser.ViserServer) -> None:
    nodes = StageNodes(server.scene)
    none = Objects(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros(0, np.int64))
    nodes.update(stages(), ALL)
    empty = dataclasses.replace(
        stages(), points=np.zeros((0, 3), np.float32), stage=np.zeros(0, np.uint8),
        cluster=np.zeros(0, np.int64), plane=None, objects=none,
    )  # fmt: skip
    nodes.update(empty, ALL)
    for name in SHOWN:
        assert not handle(server, f"/stages/{name}").visible, name


def test_the_patch_lies_on_a_tilted_ground() -> None:
    normal = np.array([0.1, -0.05, 1.0])
    plane = Plane(normal / np.linalg.norm(normal), 1.7, 0.8)
    rng = np.random.default_rng(1)
    flat = rng.uniform([-9, -4], [7, 11], (200, 2))
    lines = stage_shapes.patch(plane, np.column_stack([flat, np.zeros(200)])).astype(float)
    np.testing.assert_allclose(plane.heights(lines.reshape(-1, 3)), stage_shapes.RAISED, atol=1e-3)
    low, high = lines[..., :2].reshape(-1, 2).min(axis=0), lines[..., :2].reshape(-1, 2).max(axis=0)
    assert (low <= flat.min(axis=0)).all()
    assert (high >= flat.max(axis=0)).all()
    assert (high - low < flat.max(axis=0) - flat.min(axis=0) + 4.0).all()
    far = np.concatenate([flat, [[5_000.0, 0.0]]])
    assert len(stage_shapes.patch(plane, np.column_stack([far, np.zeros(201)]))) < 80
    assert len(stage_shapes.patch(plane, np.zeros((0, 3)))) == 0


def test_a_cluster_keeps_its_colour_while_others_come_and_go() -> None:
    none = np.zeros((0, 3)), np.zeros(0, np.int64)
    first = stage_shapes.hues(CENTERS, *none)
    assert list(first) == [0, 1]
    more = np.array([[50.0, 50.0, 1.0], *(CENTERS[::-1] + np.array([0.3, 0.0, 0.0]))])
    second = stage_shapes.hues(more, CENTERS, first)
    assert list(second) == [2, 1, 0]
    assert list(stage_shapes.hues(CENTERS[1:], more, second)) == [1]
    assert list(stage_shapes.hues(*(np.zeros((0, 3)), more, second))) == []
    crowd = np.column_stack([5.0 * np.arange(23), np.zeros((23, 2))])
    assert np.bincount(stage_shapes.hues(crowd, *none)).tolist() == [3, 3, 3, *[2] * 7]


def test_colours_differ_and_are_no_level_s() -> None:
    colors = stage_shapes.cluster_colors().astype(int)
    apart = np.abs(colors[:, None] - colors[None]).sum(axis=2) + 999 * np.eye(len(colors))
    assert apart.min() > 25
    red_or_amber = (colors[:, 0] > colors[:, 2] + 40) & (colors[:, 0] > colors[:, 1])
    assert not red_or_amber.any()


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def view() -> Iterator[tuple[View, toy.Source, Clock, list[float]]]:
    """A view whose clock stands, with what it asked of detection."""
    source, clock, asked = toy.Source(), Clock(), []

    def newest() -> StagedScan:
        asked.append(clock.now)
        return SCAN

    made = start(toy.site(), source, clock=clock, stages=newest)
    yield made, source, clock, asked
    made.stop()


SCAN = stages()


def window(view: View, server: viser.ViserServer, number: int) -> Browser:
    """A browser that takes its nodes to a scene of its own."""
    client = SimpleNamespace(client_id=number, scene=server.scene, atomic=server.atomic)
    made = Browser(client, toy.site(), "left", "site", "exact")  # type: ignore[arg-type]
    view._browsers[number] = made
    return made


def test_detection_is_asked_only_while_a_window_looks(
    view: tuple[View, toy.Source, Clock, list[float]],
    server: viser.ViserServer,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made, _, _, asked = view
    browser = window(made, server, 1)
    monkeypatch.setattr(made, "_of", lambda page: list(made._browsers.values()))
    snapshot = toy.snapshot()
    made._draw_own(snapshot, 0.0, 0.0)
    assert not asked
    assert server.scene.get_handle_by_name("/stages") is None
    made.set_stages(["ground", "object"])
    made._draw_own(snapshot, 0.0, 0.0)
    assert len(asked) == 1
    assert handle(server, "/stages/ground").visible
    assert not handle(server, "/stages/machine").visible
    made.set_stages([])
    made._draw_own(snapshot, 0.0, 0.0)
    assert len(asked) == 1
    assert not handle(server, "/stages").visible
    made.set_stages(["ground"])
    made._draw_own(snapshot, STAGES_ASKED - 0.1, 0.0)
    assert handle(server, "/stages").visible
    count = len(asked)
    made._draw_own(snapshot, STAGES_ASKED + 0.1, 0.0)  # nobody asked again: looked away, or gone
    assert len(asked) == count
    assert not handle(server, "/stages").visible
    made.set_stages(["ground"])
    del made._browsers[browser.client.client_id]  # the window closes
    made._draw_own(snapshot, 0.0, 0.0)
    assert len(asked) == count
    with pytest.raises(ValueError, match="there are outside, machine, ground, object, left"):
        made.set_stages(["sky"])


def test_old_stages_go_out_of_sight(server: viser.ViserServer) -> None:
    client = SimpleNamespace(client_id=1, scene=server.scene, atomic=server.atomic)
    browser = Browser(client, toy.site(), "left", "site", "exact")  # type: ignore[arg-type]
    assert browser.show_stages(ALL, 5.0)
    assert not browser.show_stages(ALL, 6.0)
    browser.update_stages(SCAN, 0.0)
    assert handle(server, "/stages").visible
    browser.update_stages(None, 0.1)
    assert not handle(server, "/stages").visible
