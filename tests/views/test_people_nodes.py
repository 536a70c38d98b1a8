"""People in the scene: where they are drawn, what they are called, and that they go."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import toy_site as toy
import viser
from viewing import counted, handle

from backend.pipeline.people_records import NOBODY, People
from backend.safety.swing_risk import Risk
from backend.tracking.records import Status
from cockpit.views import palette, people_shapes
from cockpit.views.people import PeopleNodes, lost_text, track_text
from cockpit.views.people_records import SeenLost, SeenPeople, SeenSensor, SeenTrack
from cockpit.views.scene import Scene

PERSON = SeenTrack(
    *(7, True, Status.CONFIRMED, np.array([3.0, 1.0, 0.9]), 0.4, np.array([0.5, 0.6, 1.8])),
    ahead=np.array([1.8, 1.2]),
    cov=np.array([[0.09, 0.02], [0.02, 0.04]]),
)
OBJECT = dataclasses.replace(PERSON, id=9, person=False, position=np.array([-4.0, 2.0, 0.5]))


def people(*tracks: SeenTrack, **more: object) -> SeenPeople:
    given: dict = {"lost": (), "sensors": (), "age": 0.1, **more}
    return SeenPeople(tracks, **given)


def boxed(status: Status) -> np.ndarray:
    """Lines (k, 2, 3) of PERSON's box, the second of two."""
    positions = np.array([[0.0, 0.0, 0.0], PERSON.position])
    sizes = np.array([[1.0, 1.0, 1.0], PERSON.size])
    return people_shapes.box_lines(positions, np.array([0.0, 0.4]), sizes, status)[1]


def ways(cov: np.ndarray, z: float) -> np.ndarray:
    """Lines (k, 2, 3) of PERSON's foretold place, the second of two."""
    ahead, two = np.array([[9.0, 9.0], PERSON.ahead]), np.array([PERSON.position, PERSON.position])
    return people_shapes.foretold(two, ahead, np.array([np.eye(2), cov]), z)[1]


def names(server: viser.ViserServer) -> set[str]:
    """Of what is drawn; a frame that only holds others has no handle worth counting."""
    known = server.scene._handle_from_node_name
    return {
        n for n, h in known.items() if n.startswith("/people/") and type(h) is not viser.FrameHandle
    }


def test_a_box_stands_upright_where_the_track_is() -> None:
    lines = boxed(Status.CONFIRMED)
    corners = np.unique(lines.reshape(-1, 3).round(4), axis=0)
    assert len(corners) == 8
    np.testing.assert_allclose(corners.mean(axis=0), PERSON.position, atol=1e-3)
    np.testing.assert_allclose(np.sort(corners[:, 2]), np.repeat([0.0, 1.8], 4), atol=1e-4)
    lengths = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
    np.testing.assert_allclose(np.sort(lengths), np.repeat([0.5, 0.6, 1.8], 4), atol=1e-5)
    way = lines[np.argmin(np.abs(lengths - 0.5))]
    along = (way[1] - way[0])[:2]
    assert math.atan2(along[1], along[0]) % math.pi == pytest.approx(0.4, abs=1e-4)


@pytest.mark.parametrize(("status", "share"), [(Status.COASTING, 0.6), (Status.TENTATIVE, 0.4)])
def test_who_is_not_sure_is_drawn_in_parts(status: Status, share: float) -> None:
    lines = boxed(status)
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()
    assert length == pytest.approx(share * 4 * (0.5 + 0.6 + 1.8), rel=1e-4)


def test_the_ring_holds_ninety_five_of_a_hundred_places() -> None:
    lines = ways(PERSON.cov, 0.02)
    np.testing.assert_allclose(lines[0], [[3.0, 1.0, 0.02], [1.8, 1.2, 0.02]], atol=1e-6)
    offset = lines[1:, 0, :2] - PERSON.ahead
    squared = np.einsum("ki,ij,kj->k", offset, np.linalg.inv(PERSON.cov), offset)
    np.testing.assert_allclose(squared, 5.991, rtol=1e-3)
    rng = np.random.default_rng(2)
    drawn = rng.multivariate_normal(PERSON.ahead, PERSON.cov, 20_000) - PERSON.ahead
    inside = np.einsum("ki,ij,kj->k", drawn, np.linalg.inv(PERSON.cov), drawn) < squared.mean()
    assert inside.mean() == pytest.approx(0.95, abs=0.006)
    vague = ways(np.full((2, 2), np.nan), 0.0)[1:, :, :2]
    np.testing.assert_allclose(vague, np.broadcast_to(PERSON.ahead, vague.shape), atol=1e-6)


def test_levels_differ_in_shape_and_colour(server: viser.ViserServer) -> None:
    nodes = PeopleNodes(server.scene)
    near = dataclasses.replace(PERSON, risk=Risk.EMERGENCY, distance=1.1)
    nodes.update(people(near, OBJECT), 0.0, 0.0, 0.0, 0.0)
    marks = handle(server, "/people/levels")
    assert len(marks.points) == 8
    colors = handle(server, "/people/boxes").colors.reshape(-1, 3)
    inks = {tuple(color) for color in colors}
    assert inks == {palette.line(palette.PEOPLE), palette.line(palette.LEVEL[2])}
    nodes.update(people(dataclasses.replace(near, risk=Risk.WARNING)), 0.0, 0.0, 0.01, 0.0)
    assert len(marks.points) == 3
    nodes.update(people(PERSON), 0.0, 0.0, 0.02, 0.0)
    assert not marks.visible


@pytest.mark.parametrize(
    ("changes", "known", "text"),
    [
        ({}, True, "P7"),
        ({"person": False}, True, "O7"),
        ({"status": Status.COASTING}, True, "P7?"),
        ({"risk": Risk.WARNING, "distance": 2.14}, True, "▲ WARNING · P7 · 2.1 m"),
        ({"risk": Risk.EMERGENCY, "distance": -0.1}, True, "EMERGENCY · P7 · 0.0 m"),
        ({"risk": Risk.EMERGENCY}, True, "EMERGENCY · P7"),
        ({"risk": Risk.EMERGENCY, "distance": 1.0}, False, "? P7"),
    ],
)
def test_what_is_said(changes: dict, known: bool, text: str) -> None:
    assert track_text(dataclasses.replace(PERSON, **changes), known) == text


def test_who_is_lost_stays_as_last_seen_here(server: viser.ViserServer) -> None:
    nodes = PeopleNodes(server.scene)
    gone = SeenLost(3, np.array([5.0, 5.0, 0.9]), 12.3)
    assert lost_text(gone) == "P3 last seen here, 12 s ago"
    nodes.update(people(lost=(gone,)), 0.0, 0.2, 0.0, 0.0)
    mark = handle(server, "/people/lost")
    assert mark.visible
    np.testing.assert_allclose(mark.points[..., :2].reshape(-1, 2).mean(axis=0), [5, 5], atol=0.05)
    assert mark.points[..., 2] == pytest.approx(0.22)
    assert handle(server, "/people/lost/3").text == "P3 last seen here, 12 s ago"
    nodes.update(people(), 0.0, 0.2, 1.0, 0.0)
    assert not mark.visible
    assert server.scene.get_handle_by_name("/people/lost/3") is None


def test_a_tail_is_where_they_were_and_does_not_jump(server: viser.ViserServer) -> None:
    nodes = PeopleNodes(server.scene)
    for k in range(50):
        at = dataclasses.replace(PERSON, position=np.array([0.1 * k, 0.0, 0.9]))
        nodes.update(people(at), 0.1 * k, 0.0, 0.1 * k, 0.0)
    tail = handle(server, "/people/tails")
    assert tail.points[..., 0].min() == pytest.approx(4.9 - 3.0, abs=0.11)
    assert tail.points[..., 0].max() == pytest.approx(4.9, abs=1e-5)
    nodes.update(people(PERSON), 1.0, 0.0, 5.1, 0.0)  # a recording went back
    assert not tail.visible
    far = dataclasses.replace(PERSON, position=np.array([40.0, 0.0, 0.9]))
    nodes.update(people(far), 1.2, 0.0, 5.3, 0.0)
    assert not tail.visible


@pytest.mark.parametrize(
    ("more", "lost"), [({"reason": "no scan"}, 0.0), ({"age": 0.7}, 0.0), ({"age": math.nan}, 0.0),
                       ({}, 0.8)],
)  # fmt: skip
def test_without_data_nobody_counts_as_seen(
    server: viser.ViserServer, more: dict, lost: float
) -> None:
    nodes = PeopleNodes(server.scene)
    sensors = (SeenSensor(np.array([0.0, 0.0, 2.0]), 0.1),)
    nodes.update(people(PERSON, sensors=sensors), 0.0, 0.0, 0.0, 0.0)
    assert handle(server, "/people/fill").visible
    nodes.update(people(PERSON, sensors=sensors, **more), 0.0, 0.0, 1.0, lost)
    assert not handle(server, "/people/fill").visible
    assert not handle(server, "/people/ahead").visible
    boxes = handle(server, "/people/boxes")
    assert {tuple(c) for c in boxes.colors.reshape(-1, 3)} == {palette.line(palette.STALE)}
    assert handle(server, "/people/track/7").text == "? P7"


def test_nodes_are_made_once_and_all_go(server: viser.ViserServer) -> None:
    nodes = PeopleNodes(server.scene)
    nodes.update(None, 0.0, 0.0, 0.0, 0.0)
    assert not names(server)
    nodes.update(people(PERSON, OBJECT), 0.0, 0.0, 0.0, 0.0)
    made = names(server)
    moved = dataclasses.replace(PERSON, position=PERSON.position + np.array([0.1, 0.0, 0.0]))
    sent = counted(server, lambda: nodes.update(people(moved, OBJECT), 0.1, 0.0, 0.1, 0.0))
    assert sum(sent.values()) <= 9  # boxes, fill, ahead, a label's place, and a tail that appears
    assert names(server) == made
    still = people(moved, OBJECT)
    nodes.update(still, 0.2, 0.0, 0.2, 0.0)
    assert not counted(server, lambda: nodes.update(still, 0.22, 0.0, 0.22, 0.0))
    nodes.update(people(OBJECT), 0.3, 0.0, 0.3, 0.0)
    assert server.scene.get_handle_by_name("/people/track/7") is None
    nodes.update(None, 0.4, 0.0, 0.4, 0.0)
    assert not names(server)
    nodes.update(people(PERSON), 0.5, 0.0, 0.5, 0.0)
    assert handle(server, "/people/track/7").text == "P7"


def test_the_scene_shows_them_with_the_machines(server: viser.ViserServer) -> None:
    scene = Scene(server.scene, toy.site())
    scene.update(toy.snapshot(), 0.0)
    assert not names(server)
    tracked = dataclasses.replace(
        NOBODY,
        id=np.array([7]),
        kind=("person",),
        status=np.array([Status.CONFIRMED]),
        position=np.array([[3.0, 2.0, 0.9]]),
        velocity=np.zeros((1, 2)),
        yaw=np.zeros(1),
        size=np.array([[0.5, 0.5, 1.7]]),
        sigma=np.array([0.1]),
        unseen=np.zeros(1),
        ahead=np.array([[3.0, 2.0]]),
        ahead_cov=0.1 * np.eye(2)[None],
    )
    told = dataclasses.replace(toy.snapshot(), people=People("", 0.1, tracked=tracked))
    scene.update(told, 0.1)
    assert handle(server, "/people/boxes").visible
    assert handle(server, "/people/track/7").text == "P7"
