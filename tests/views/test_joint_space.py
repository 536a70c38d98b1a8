"""The joint-space view on a real server: made once, sent again only when it changed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import toy_site as toy
import viser
from viewing import counted, handle

from backend.cspace.cells import FREE, PARTNER, SITE
from cockpit.views import palette
from cockpit.views.browser import Browser
from cockpit.views.joint_frame import PLACE, place
from cockpit.views.joint_space import BODY, JointSpace, title
from cockpit.views.server import start

CELLS = "/joints/cells"


def volume(partner: int = 4) -> np.ndarray:
    cells = np.full((8, 8, 8), FREE, dtype=np.uint8)
    cells[:partner] = PARTNER
    cells[:, :, 0] = SITE
    cells[partner] &= ~np.uint8(FREE)
    return cells


def triangles(server: viser.ViserServer, name: str) -> int:
    node = handle(server, f"{CELLS}/{name}")
    return len(node.faces) if node.visible else 0


def test_nodes_are_made_once_and_then_changed(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    space.update(toy.own_image(volume(4), 0.0), 0.1, 0.1, looked_at=True)
    assert handle(server, "/joints").visible
    np.testing.assert_allclose(handle(server, "/joints").position, PLACE)
    assert triangles(server, "partner") > 0
    assert triangles(server, "site") > 0
    assert triangles(server, "undecided") > 0
    assert triangles(server, "self") == triangles(server, "other") == 0
    assert handle(server, f"{CELLS}/partner").color == palette.PARTNER
    assert handle(server, f"{CELLS}/site").color == palette.SITE
    assert not handle(server, f"{CELLS}/legend/self").visible
    assert handle(server, "/joints/title").text == "LEFT at swing 29° · 0.1 s"

    vertices = handle(server, f"{CELLS}/partner").vertices.copy()
    later = toy.own_image(volume(5), 0.4)
    sent = counted(server, lambda: space.update(later, 0.5, 0.5, looked_at=True))
    assert set(sent) == {"SceneNodeUpdateMessage"}
    assert not np.array_equal(handle(server, f"{CELLS}/partner").vertices, vertices)


def test_the_same_cells_are_not_sent_again(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    cells = volume()
    image = toy.own_image(cells, 0.0)
    space.update(image, 0.1, 0.0, looked_at=True)
    assert not counted(server, lambda: space.update(image, 0.11, 0.04, looked_at=True))
    again = toy.own_image(cells.copy(), 0.1)
    assert not counted(server, lambda: space.update(again, 0.2, 0.3, looked_at=True))
    moved = toy.own_image(cells.copy(), 0.2, q=(0.5, 0.1, -0.5, 0.5))
    sent = counted(server, lambda: space.update(moved, 0.3, 0.6, looked_at=True))
    assert sent["SetPositionMessage"] == 1
    assert sent["SceneNodeUpdateMessage"] == 3  # lines to the walls, bars, box
    here = place(moved.q[1:4], moved.volume_edges)
    np.testing.assert_allclose(handle(server, f"{CELLS}/star").position, here)


def test_surfaces_are_sent_at_most_five_times_a_second(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    changes, before = 0, None
    for step in range(26):  # one second of a view at 25 Hz, each time with another image
        now = 0.04 * step
        space.update(toy.own_image(volume(3 + step % 2), now), now, now, looked_at=True)
        vertices = handle(server, f"{CELLS}/partner").vertices
        changes += before is None or not np.array_equal(before, vertices)
        before = vertices.copy()
    assert 3 <= changes <= 6


def test_the_last_image_is_shown_even_if_it_came_too_soon(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    space.update(toy.own_image(volume(2), 0.0), 0.0, 0.0, looked_at=True)
    last = toy.own_image(volume(6), 0.1)
    space.update(last, 0.1, 0.1, looked_at=True)
    few = triangles(server, "partner")
    space.update(last, 0.3, 0.3, looked_at=True)
    assert triangles(server, "partner") > few


def test_nothing_is_sent_while_nobody_looks(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    space.update(toy.own_image(volume(), 0.0), 0.0, 0.0, looked_at=True)
    space.update(None, 0.1, 0.1, looked_at=False)
    assert not handle(server, "/joints").visible
    image = toy.own_image(volume(6), 1.0)
    assert not counted(server, lambda: space.update(image, 1.0, 1.0, looked_at=False))
    space.update(image, 1.1, 1.1, looked_at=True)
    assert handle(server, "/joints").visible


def test_an_old_image_is_grey_and_says_so(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    image = toy.own_image(volume(), 0.0)
    space.update(image, 0.9, 0.9, looked_at=True)
    partner, star = (handle(server, f"{CELLS}/{name}") for name in ("partner", "star"))
    assert (partner.color, partner.opacity) == (palette.PARTNER, BODY)
    space.update(image, 1.4, 1.4, looked_at=True)
    assert handle(server, "/joints/title").text == "LEFT at swing 29° · STALE 1.4 s"
    assert partner.color == star.color == palette.STALE
    assert not handle(server, f"{CELLS}/legend").visible
    bars = handle(server, f"{CELLS}/now")
    assert tuple(bars.colors[0, 0]) == palette.line(palette.STALE)

    space.update(toy.own_image(volume(), 1.5), 1.6, 1.6, looked_at=True)
    assert handle(server, "/joints/title").text == "LEFT at swing 29° · 0.1 s"
    assert partner.color == palette.PARTNER
    assert handle(server, f"{CELLS}/legend").visible
    assert tuple(bars.colors[0, 0]) != palette.line(palette.STALE)


def test_without_an_image_it_says_so(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    space.update(None, 0.0, 0.0, looked_at=True)
    assert "no joint image" in handle(server, "/joints/title").text
    assert not handle(server, CELLS).visible


def test_the_axes_carry_their_names_and_limits(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    space.update(toy.own_image(volume(), 0.0), 0.0, 0.0, looked_at=True)
    for joint in ("boom", "stick", "bucket"):
        assert handle(server, f"{CELLS}/frame/{joint}/name").text == f"{joint} °"
    assert handle(server, f"{CELLS}/frame/boom/30").text == "30"
    assert server.scene.get_handle_by_name(f"{CELLS}/frame/boom/90") is None


@pytest.mark.parametrize(
    ("age", "old", "words"),
    [
        (0.24, False, "LEFT at swing 30° · 0.2 s"),
        (1.44, True, "LEFT at swing 30° · STALE 1.4 s"),
        (float("nan"), True, "LEFT at swing 30° · STALE"),
        (-0.02, False, "LEFT at swing 30° · 0.0 s"),
    ],
)
def test_titles(age: float, old: bool, words: str) -> None:
    assert title("LEFT", 30.2, age, old) == words


def browser(server: viser.ViserServer, camera: str) -> Browser:
    client = SimpleNamespace(scene=server.scene, atomic=server.atomic)
    return Browser(client, toy.site(), "left", camera, "exact")  # type: ignore[arg-type]


def test_a_browser_makes_it_at_the_first_look(server: viser.ViserServer) -> None:
    source, snapshot = toy.Source(), toy.snapshot(time=10.0)
    source.images[("exact", "left")] = toy.own_image(volume(), 9.9)
    window = browser(server, "site")
    window.update(snapshot, source, 0.0, 0.0, 0.0)
    assert server.scene.get_handle_by_name("/joints") is None
    window.camera = "joints"
    window.update(snapshot, source, 0.0, 0.1, 0.0)
    assert handle(server, "/joints").visible
    window.camera = "plan"
    window.update(snapshot, source, 0.0, 0.2, 0.0)
    assert not handle(server, "/joints").visible


def test_another_own_machine_starts_from_nothing(server: viser.ViserServer) -> None:
    source, snapshot = toy.Source(), toy.snapshot(time=10.0)
    source.images[("exact", "left")] = toy.own_image(volume(), 9.9)
    window = browser(server, "joints")
    window.update(snapshot, source, 0.0, 0.0, 0.0)
    window.own = "right"
    assert server.scene.get_handle_by_name("/joints") is None
    window.update(snapshot, source, 0.0, 0.1, 0.0)
    assert handle(server, "/joints/title").text == "RIGHT · no joint image yet"
    window.own = "left"
    window.update(snapshot, source, 0.0, 0.2, 0.0)
    assert handle(server, f"{CELLS}/partner").visible


def test_windows_that_come_later_look_there_too() -> None:
    source = toy.Source()
    source.put(toy.snapshot())
    view = start(toy.site(), source)
    try:
        view.set_camera("joints")
        look_at = np.array(view._server.initial_camera.look_at)
        np.testing.assert_allclose(look_at[:2], np.array(PLACE)[:2] + 2.0)
        assert look_at[2] < -1000.0
    finally:
        view.stop()


def test_the_swing_is_within_half_a_turn(server: viser.ViserServer) -> None:
    space = JointSpace(server.scene, "LEFT")
    image = toy.own_image(volume(), 0.0, q=(2 * np.pi - 0.5, 0.0, -0.5, 0.5))
    space.update(image, 0.1, 0.1, looked_at=True)
    assert handle(server, "/joints/title").text == "LEFT at swing -29° · 0.1 s"
