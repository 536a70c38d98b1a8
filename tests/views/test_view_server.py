"""The scene on a real server: what is sent, what is not, and that it shuts its doors."""

from __future__ import annotations

import dataclasses
import socket
import time
from collections.abc import Iterator

import numpy as np
import pytest
import toy_site as toy
import viser
from viewing import counted, handle, until
from viser import _messages

from backend.fusion.pose import Validity
from backend.gauge.volumes import LimitVolume
from backend.pipeline.records import GaugeInForce
from backend.safety.record import Level
from backend.site.gauge_choice import Drawn, GaugeChoice
from backend.site.named_bodies import SiteBodies
from backend.spatial.boxes import Boxes
from cockpit.views import palette
from cockpit.views.scene import Scene
from cockpit.views.server import View, open_server, start
from cockpit.views.zone import OwnNodes


def test_only_the_loopback_and_no_tunnel(server: viser.ViserServer) -> None:
    assert server.get_host() == "127.0.0.1"
    assert server.get_port() > 0
    handlers = server._websock_server._incoming_handlers
    assert _messages.ShareUrlRequest not in handlers
    assert _messages.ShareUrlDisconnect not in handlers
    with pytest.raises(PermissionError):
        server.request_share_url()


def test_a_second_server_gets_a_port_of_its_own(server: viser.ViserServer) -> None:
    other = open_server()
    assert other.get_port() != server.get_port()
    other.stop()


def test_links_stand_where_the_snapshot_says(server: viser.ViserServer) -> None:
    scene = Scene(server.scene, toy.site())
    snapshot = toy.snapshot(swing=0.3)
    scene.update(snapshot, 0.0)
    for name in ("left", "right"):
        poses = snapshot.machines[name].body.link_poses
        for k, pose in enumerate(poses):
            node = handle(server, f"/machines/{name}/{k}")
            np.testing.assert_allclose(node.position, pose[:3, 3], atol=1e-9)
            R = viser.transforms.SO3(node.wxyz).as_matrix()
            np.testing.assert_allclose(R, pose[:3, :3], atol=1e-9)


def test_nothing_is_sent_for_what_did_not_change(server: viser.ViserServer) -> None:
    scene = Scene(server.scene, toy.site())
    scene.update(toy.snapshot(1), 0.0)
    again = counted(server, lambda: scene.update(toy.snapshot(2), 0.1))
    assert not again
    swung = counted(server, lambda: scene.update(toy.snapshot(3, swing=0.01), 0.2))
    # Four links of one machine turn, three of them also move; no mesh is ever sent again.
    assert swung["SetOrientationMessage"] == 4
    assert swung["SetPositionMessage"] <= 3 + 2 + 1
    assert not [kind for kind in swung if kind.endswith(("MeshMessage", "FrameMessage"))]


def test_a_stale_machine_turns_grey_and_comes_back(server: viser.ViserServer) -> None:
    scene = Scene(server.scene, toy.site())
    scene.update(toy.snapshot(1), 0.0)
    mesh = handle(server, "/machines/right/1/0")
    color = mesh.color
    label = handle(server, "/machines/right/name")
    distance = handle(server, "/nearest/left right/distance")
    line = handle(server, "/nearest/left right/line")
    assert (mesh.opacity, label.text) == (None, "RIGHT")

    scene.update(toy.snapshot(2, validity=Validity.STALE), 0.1)
    assert mesh.color == palette.STALE
    assert mesh.opacity == 0.5
    assert label.text == "RIGHT · STALE 0.6 s"
    assert distance.text == "? clearance unknown"
    assert not line.visible
    assert handle(server, "/machines/left/1/0").opacity is None

    scene.update(toy.snapshot(3), 0.2)
    assert (mesh.color, mesh.opacity, label.text) == (color, None, "RIGHT")
    assert line.visible


def test_without_snapshots_nothing_counts_as_known(server: viser.ViserServer) -> None:
    scene = Scene(server.scene, toy.site())
    scene.update(toy.snapshot(1), 0.0)
    scene.update(toy.snapshot(1), 0.9, lost=0.9)
    assert handle(server, "/machines/left/name").text == "LEFT · STALE 0.9 s"
    assert handle(server, "/nearest/left right/distance").text == "? clearance unknown"


def test_levels_show_at_once_and_digits_twice_a_second(server: viser.ViserServer) -> None:
    scene = Scene(server.scene, toy.site())
    line_name, text_name = (f"/nearest/left right/{kind}" for kind in ("line", "distance"))

    def text(cycle: int, distance: float, now: float) -> str:
        scene.update(toy.snapshot(cycle, distance=distance), now)
        return handle(server, text_name).text

    assert text(1, 1.50, 0.0) == "1.50 m"
    assert text(2, 1.45, 0.2) == "1.50 m"
    assert text(3, 0.79, 0.3) == "▲ SLOW · 0.79 m"
    assert text(4, 0.15, 0.32) == "STOP · 0.15 m"
    sent = palette.line(palette.LEVEL[Level.STOP])
    assert tuple(handle(server, line_name).colors[0, 0]) == sent
    assert text(5, 0.12, 0.90) == "STOP · 0.12 m"


def test_a_machine_that_never_reported_is_not_drawn(server: viser.ViserServer) -> None:
    scene = Scene(server.scene, toy.site())
    snapshot = toy.snapshot(500)
    missing = {**snapshot.machines, "right": toy.state("right", None, Validity.UNKNOWN)}
    scene.update(dataclasses.replace(snapshot, machines=missing, pairs=()), 0.0)
    assert handle(server, "/machines/left").visible
    assert not handle(server, "/machines/right").visible
    assert server.scene.get_handle_by_name("/ground/grid") is not None


def test_reach_circles_and_end_point(server: viser.ViserServer) -> None:
    site, snapshot = toy.site(), toy.snapshot()
    Scene(server.scene, site).update(snapshot, 0.0)
    body = snapshot.machines["left"].body
    assert handle(server, "/machines/left/now").scale == pytest.approx(body.reach)
    assert handle(server, "/machines/left/max").scale == site.machines["left"].model.max_reach
    np.testing.assert_allclose(handle(server, "/machines/left/tip").position, body.end_point)


def test_obstacles_are_drawn(server: viser.ViserServer) -> None:
    wall = Boxes(np.array([[0, 5, 1.0]]), np.eye(3)[None], np.array([[2, 0.2, 1.0]]))
    Scene(server.scene, toy.site(obstacles=wall)).update(toy.snapshot(), 0.0)
    np.testing.assert_allclose(
        handle(server, "/obstacles").vertices, wall.corners()[0].astype(np.float32)
    )


def test_the_working_gauge_is_drawn_fainter(server: viser.ViserServer) -> None:
    track = Boxes(np.array([[0, 8, 2.0]]), np.eye(3)[None], np.array([[20, 1.8, 2.0]]))
    bodies = SiteBodies(
        track, ("gauge:T1/0",), (LimitVolume("T1", "track", boxes=track), LimitVolume("no", "pole"))
    )
    site = dataclasses.replace(toy.site(obstacles=track), bodies=bodies)
    scene, snapshot = Scene(server.scene, site), toy.snapshot()
    scene.update(snapshot, 0.0)
    corners = track.corners()[0].astype(np.float32)
    np.testing.assert_allclose(handle(server, "/gauge").vertices, corners)
    assert handle(server, "/gauge").opacity < handle(server, "/obstacles").opacity
    pit = Drawn("pit", "keep_out", ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)), -2.0, 1.0)
    for choice, lowest, farthest in (
        (GaugeChoice((pit,)), -2.0, 20.0),
        (GaugeChoice((pit,), (("T1", False),)), -2.0, 4.0),
    ):
        gauge = GaugeInForce(choice)
        scene.update(dataclasses.replace(snapshot, gauge=gauge), 0.0)
        shown = handle(server, "/gauge").vertices
        assert shown.min(axis=0)[2] == pytest.approx(lowest)
        assert shown.max(axis=0)[0] == pytest.approx(farthest)


def test_zones_are_drawn_only_when_new_and_greyed_when_old(server: viser.ViserServer) -> None:
    source = toy.Source()
    own = OwnNodes(server.scene, "left", 1.0)
    snapshot = toy.snapshot(time=10.0)
    own.update(snapshot, source, 0.0, 0.0)
    assert server.scene.get_handle_by_name("/own/zone/right") is None

    source.images[("sun", "left<-right")] = toy.Zone(toy.ring_zone(), state_time=9.9)
    own.update(snapshot, source, 0.0, 0.0)
    fill, edge = (handle(server, f"/own/zone/right/{part}") for part in ("fill", "edge"))
    corners = fill.vertices[fill.faces].astype(float)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2].sum() / 2
    x, y = toy.ring_zone().T
    assert area == pytest.approx(abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2, 1e-5)
    assert tuple(edge.colors[0, 0]) == palette.line(palette.PARTNER)
    assert not counted(server, lambda: own.update(snapshot, source, 0.0, 0.0))

    own.update(snapshot, source, 0.0, lost=1.2)
    assert not fill.visible
    assert tuple(edge.colors[0, 0]) == palette.line(palette.STALE)

    source.images[("sun", "left<-right")] = toy.Zone(np.zeros((0, 2)), state_time=10.0)
    own.update(snapshot, source, 0.0, 0.0)
    assert not handle(server, "/own/zone/right").visible


def test_far_machines_have_no_zone(server: viser.ViserServer) -> None:
    source = toy.Source()
    source.images[("sun", "left<-right")] = toy.Zone(toy.ring_zone())
    own = OwnNodes(server.scene, "left", 1.0)
    snapshot = toy.snapshot()
    own.update(snapshot, source, 0.0, 0.0)
    assert handle(server, "/own/zone/right").visible
    far = dataclasses.replace(snapshot, pairs=(dataclasses.replace(snapshot.pairs[0], near=False),))
    own.update(far, source, 0.0, 0.0)
    assert not handle(server, "/own/zone/right").visible


def test_without_a_zone_the_own_machine_keeps_its_cross(server: viser.ViserServer) -> None:
    own = OwnNodes(server.scene, "right", 1.0)
    snapshot = toy.snapshot()
    own.update(snapshot, toy.Source(), 0.0, 0.0)
    base = snapshot.machines["right"].body.swing_center
    np.testing.assert_allclose(handle(server, "/own/base").position[:2], base[:2])


def test_changing_the_own_machine_leaves_no_zone_behind(server: viser.ViserServer) -> None:
    source = toy.Source()
    source.images[("sun", "left<-right")] = toy.Zone(toy.ring_zone())
    own = OwnNodes(server.scene, "left", 1.0)
    own.update(toy.snapshot(), source, 0.0, 0.0)
    own.remove()
    for name in ("/own", "/own/base", "/own/zone/right", "/own/zone/right/fill"):
        assert server.scene.get_handle_by_name(name) is None
    OwnNodes(server.scene, "right", 1.0).update(toy.snapshot(), source, 0.0, 0.0)
    assert server.scene.get_handle_by_name("/own/zone/right") is None


@pytest.fixture
def running() -> Iterator[tuple[View, toy.Source]]:
    source = toy.Source()
    source.put(toy.snapshot(1))
    view = start(toy.site(), source)
    yield view, source
    view.stop()


def test_the_thread_takes_the_newest_snapshot(running: tuple[View, toy.Source]) -> None:
    view, source = running
    name = "/machines/left/1"
    assert until(lambda: view._server.scene.get_handle_by_name("/ground/grid") is not None)
    for cycle in range(2, 40):
        source.put(toy.snapshot(cycle, swing=0.01 * cycle))
        time.sleep(0.005)
    wanted = toy.snapshot(39, swing=0.39).machines["left"].body.link_poses[1, :3, :3]

    def arrived() -> bool:
        R = viser.transforms.SO3(handle(view._server, name).wxyz).as_matrix()
        return np.allclose(R, wanted, atol=1e-6)

    assert until(arrived)


def test_silence_turns_everything_grey(running: tuple[View, toy.Source]) -> None:
    view, _ = running
    node = "/machines/left/name"
    assert until(lambda: "STALE" in handle(view._server, node).text, 4.0)


def test_a_rewound_recording_is_followed(running: tuple[View, toy.Source]) -> None:
    view, source = running
    source.put(toy.snapshot(900))
    time.sleep(0.7)
    source.put(toy.snapshot(3, swing=0.7))
    wanted = toy.snapshot(3, swing=0.7).machines["left"].body.link_poses[1]

    def there() -> bool:
        R = viser.transforms.SO3(handle(view._server, "/machines/left/1").wxyz).as_matrix()
        return np.allclose(R, wanted[:3, :3], atol=1e-6)

    assert until(there)


def test_wrong_choices_name_the_right_ones(running: tuple[View, toy.Source]) -> None:
    view, _ = running
    with pytest.raises(ValueError, match="left, right"):
        view.set_own("middle")
    with pytest.raises(ValueError, match="behind left"):
        view.set_camera("middle")
    view.set_own("right")
    view.set_camera("plan")


def test_stopping_frees_the_port() -> None:
    source = toy.Source()
    view = start(toy.site(), source)
    port = view.port
    view.stop()
    with socket.socket() as again:
        again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        again.bind(("127.0.0.1", port))
