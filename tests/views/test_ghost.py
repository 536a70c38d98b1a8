"""The ghost of a posture: where it stands, what it says, and that it goes."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import toy_site as toy
import viser
from viewing import counted, handle

from backend.pipeline.records import Body3D, Snapshot
from cockpit.views import palette
from cockpit.views.browser import Browser
from cockpit.views.ghost import checked_joints
from cockpit.views.inputs import GHOST_FACES, SceneMachine
from cockpit.views.server import start

JOINTS = {"swing": 0.4, "boom": 0.7, "stick": -1.1, "bucket": -0.3}
Q = tuple(JOINTS.values())
GHOST = "/whatif/left"


@pytest.fixture
def window(server: viser.ViserServer) -> Browser:
    client = SimpleNamespace(scene=server.scene, atomic=server.atomic)
    return Browser(client, toy.site(), "left", "site", "exact")  # type: ignore[arg-type]


def update(window: Browser, snapshot: Snapshot) -> None:
    window.update(snapshot, toy.Source(), 0.0, 0.0, 0.0)


def moved(snapshot: Snapshot, body: Body3D | None) -> Snapshot:
    machines = {**snapshot.machines, "left": toy.state("left", body)}
    return dataclasses.replace(snapshot, machines=machines)


def assert_stands(server: viser.ViserServer, body: Body3D) -> None:
    for k in range(1, len(body.link_poses)):
        node = handle(server, f"{GHOST}/{k}")
        assert node.visible
        np.testing.assert_allclose(node.position, body.link_poses[k, :3, 3], atol=1e-9)
        R = viser.transforms.SO3(node.wxyz).as_matrix()
        np.testing.assert_allclose(R, body.link_poses[k, :3, :3], atol=1e-9)


def test_it_stands_on_the_present_base_and_follows_it(
    server: viser.ViserServer, window: Browser
) -> None:
    snapshot, model = toy.snapshot(), toy.machine()
    window.show_ghost("left", JOINTS, None)
    update(window, snapshot)
    assert handle(server, GHOST).visible
    assert_stands(server, toy.place(model, (-2.6, 0.0, 0.0), 0.0, Q))
    assert not handle(server, f"{GHOST}/0").visible  # the tracks are where the real ones are

    driven = toy.place(model, (-1.0, 0.5, 0.2), 0.6, (0.0, 0.9, -1.5, -0.6))
    update(window, moved(snapshot, driven))
    assert_stands(server, toy.place(model, (-1.0, 0.5, 0.2), 0.6, Q))


def test_it_is_never_taken_for_the_machine(server: viser.ViserServer, window: Browser) -> None:
    window.show_ghost("left", JOINTS, None)
    update(window, toy.snapshot())
    label = handle(server, f"{GHOST}/words")
    assert label.text == "WHAT IF"
    body = toy.place(toy.machine(), (-2.6, 0.0, 0.0), 0.0, Q)
    assert label.position[2] > body.boxes.corners()[5:, :, 2].max()
    for k in range(1, 5):
        mesh = handle(server, f"{GHOST}/{k}/0")
        assert mesh.color == palette.GHOST
        assert 0.2 < mesh.opacity < 0.6
        assert tuple(handle(server, f"{GHOST}/{k}/edges").colors[0, 0]) == palette.line(
            palette.TEXT
        )


@pytest.mark.parametrize(
    ("colliding", "words", "color"),
    [
        (None, "WHAT IF", palette.GHOST),
        (False, "WHAT IF · free", palette.GHOST),
        (True, "WHAT IF · CONTACT", palette.GHOST_HIT),
    ],
)
def test_a_verdict_colours_it_and_is_taken_back(
    server: viser.ViserServer,
    window: Browser,
    colliding: bool | None,
    words: str,
    color: palette.Rgb,
) -> None:
    window.show_ghost("left", JOINTS, not colliding)
    window.show_ghost("left", JOINTS, colliding)
    update(window, toy.snapshot())
    assert handle(server, f"{GHOST}/words").text == words
    assert handle(server, f"{GHOST}/2/0").color == color


def test_it_is_made_once_and_moved_with_few_messages(
    server: viser.ViserServer, window: Browser
) -> None:
    snapshot = toy.snapshot()
    window.show_ghost("left", JOINTS, None)
    update(window, snapshot)

    def hover() -> None:
        window.show_ghost("left", {**JOINTS, "boom": 0.5}, None)
        update(window, snapshot)

    sent = counted(server, hover)
    assert set(sent) <= {"SetPositionMessage", "SetOrientationMessage"}
    assert sum(sent.values()) <= 3 * 2 + 1
    assert not counted(server, lambda: update(window, snapshot))


def test_it_goes_and_comes_back(server: viser.ViserServer, window: Browser) -> None:
    snapshot = toy.snapshot()
    window.show_ghost(None, None, None)  # nothing to hide yet
    window.show_ghost("left", JOINTS, None)
    update(window, snapshot)
    window.show_ghost(None, None, None)
    assert not handle(server, GHOST).visible
    update(window, snapshot)
    assert not handle(server, GHOST).visible
    window.show_ghost("left", JOINTS, True)
    update(window, snapshot)
    assert handle(server, GHOST).visible


def test_there_is_one_ghost_at_a_time(server: viser.ViserServer, window: Browser) -> None:
    snapshot = toy.snapshot()
    window.show_ghost("left", JOINTS, None)
    update(window, snapshot)
    window.show_ghost("right", JOINTS, None)
    update(window, snapshot)
    assert not handle(server, GHOST).visible
    assert handle(server, "/whatif/right").visible


def test_a_machine_without_a_place_has_no_ghost(server: viser.ViserServer, window: Browser) -> None:
    window.show_ghost("left", JOINTS, None)
    update(window, moved(toy.snapshot(), None))
    assert not handle(server, GHOST).visible
    update(window, toy.snapshot())
    assert handle(server, GHOST).visible


@pytest.mark.parametrize(
    "joints",
    [
        None,
        {"swing": 0.1, "elbow": 0.2},
        {"boom": float("nan")},
        {"boom": float("inf")},
        {"boom": True},
        {"boom": "0.3"},
        {"boom": None},
    ],
)
def test_joints_that_make_no_posture(joints: object) -> None:
    with pytest.raises(ValueError):
        checked_joints(toy.machine(), joints)  # type: ignore[arg-type]


def test_choices_of_the_view() -> None:
    source = toy.Source()
    source.put(toy.snapshot())
    view = start(toy.site(), source)
    try:
        with pytest.raises(ValueError, match="left, right"):
            view.set_ghost("middle", JOINTS)
        with pytest.raises(ValueError, match="swing, boom"):
            view.set_ghost("left", {"elbow": 1.0})
        with pytest.raises(ValueError, match="exact, sun"):
            view.set_zone_kind("moon")
        view.set_ghost("left", JOINTS, "nobody", True)
        view.set_ghost(None, None, "nobody")
        view.set_ghost(None)
        view.set_zone_kind("sun")
        view.set_camera("joints")
    finally:
        view.stop()


def test_a_detailed_machine_has_a_plain_ghost() -> None:
    plain = toy.machine()
    visual = plain.links[2].visuals[0]
    many = np.tile(visual.faces, (GHOST_FACES // len(visual.faces) + 1, 1))
    heavy = dataclasses.replace(visual, faces=many)
    links = [*plain.links]
    links[2] = dataclasses.replace(links[2], visuals=(heavy,))
    entry = SceneMachine("LEFT", dataclasses.replace(plain, links=tuple(links)))
    assert sum(len(f) for link in entry.looks for _, f, _ in link.meshes) > GHOST_FACES
    ghost = sum(len(f) for link in entry.ghost_looks for _, f, _ in link.meshes)
    assert ghost == 12 * len(plain.bodies)
