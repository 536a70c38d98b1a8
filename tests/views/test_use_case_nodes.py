"""A use case as it plays in the scene: where it stands, when, what it says, and that it goes."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import toy_site as toy
import viser
from viewing import handle

from backend.machine import kinematics
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.safety.partner import Limits
from backend.shell.hub import Hub
from backend.site.site import load_site
from backend.spatial import rotation, transform
from cockpit.desk import Desk
from cockpit.views import palette
from cockpit.views.browser import Browser
from cockpit.views.server import start
from cockpit.views.use_case_nodes import ASKED, Played, Shown

MODEL = toy.machine()
ROOT = "/usecase/left"
T = transform.make(rotation.rz(0.3), np.array([-2.6, 1.0, 0.0]))
COUNT = 50


def played() -> Played:
    """Ten times a second, the swing at 1 rad/s; overlapping from 4 s on."""
    times = 0.1 * np.arange(COUNT)
    q = np.tile([0.0, 0.7, -1.1, -0.3], (COUNT, 1))
    q[:, 0] = times
    points = np.zeros((COUNT, 2, 3))
    points[:, 0, 0], points[:, 1, 0] = 1.0, 3.0
    pair = (times > 2.0).astype(np.int64)
    pairs = ("stick to pole", "boom to own tracks")
    tool = np.stack([times, 0.0 * times, 1.0 + 0.0 * times], axis=1)
    rest = (2.0 - 0.5 * times, pair, pairs, points, tool, 2.0 * tool)
    return Played("left", T, "potential field", times, q, *rest)


@pytest.fixture
def window(server: viser.ViserServer) -> Browser:
    client = SimpleNamespace(scene=server.scene, atomic=server.atomic)
    return Browser(client, toy.site(), "left", "site", "exact")  # type: ignore[arg-type]


def update(window: Browser, now: float, snapshot: Snapshot | None = None) -> None:
    window.update(snapshot or toy.snapshot(), toy.Source(), 0.0, now, 0.0)


def test_it_stands_where_the_run_says_at_that_moment(
    server: viser.ViserServer, window: Browser
) -> None:
    run = played()
    window.show_use_case(Shown(run, at=1.0, rate=2.0, since=100.0))
    update(window, 100.5)  # 2 s of the run
    want = kinematics.link_poses(MODEL, run.q[20], T)
    for k in range(1, len(want)):
        node = handle(server, f"{ROOT}/{k}")
        assert node.visible
        np.testing.assert_allclose(node.position, want[k, :3, 3], atol=1e-9)
    assert handle(server, f"{ROOT}/0").visible  # the real one stands elsewhere
    assert handle(server, f"{ROOT}/words").text == "USE CASE · simulated · potential field"
    line = handle(server, f"{ROOT}/pair/line")
    ends = np.array([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]) @ T[:3, :3].T + T[:3, 3]
    np.testing.assert_allclose(line.points[0], ends, atol=1e-5)
    assert tuple(line.colors[0, 0]) == palette.line(palette.TEXT)  # never a level's colour
    assert handle(server, f"{ROOT}/pair/words").text == "stick to pole 1.00 m"
    assert handle(server, f"{ROOT}/2/0").color == palette.GHOST
    for name, times in (("path", 1.0), ("meant", 2.0)):
        drawn = handle(server, f"{ROOT}/{name}").points
        first = T[:3, :3] @ (times * np.array([0.0, 0.0, 1.0])) + T[:3, 3]
        last = T[:3, :3] @ (times * np.array([4.5, 0.0, 1.0])) + T[:3, 3]
        np.testing.assert_allclose(drawn[0, 0], first, atol=1e-5)
        np.testing.assert_allclose(drawn[-1, 1], last, atol=1e-5)
        np.testing.assert_array_equal(drawn[1:, 0], drawn[:-1, 1])
    update(window, 102.0)  # its end; it stays there
    assert handle(server, f"{ROOT}/pair/words").text == "boom to own tracks -0.45 m"
    assert handle(server, f"{ROOT}/2/0").color == palette.GHOST_HIT


def test_where_the_real_base_stands_it_is_not_drawn_twice(
    server: viser.ViserServer, window: Browser
) -> None:
    snapshot = toy.snapshot()
    body = toy.place(MODEL, (-2.58, 1.01, 0.0), 0.3, (0.0, 0.9, -1.5, -0.6))
    machines = {**snapshot.machines, "left": toy.state("left", body)}
    window.show_use_case(Shown(played(), 0.0, 1.0, 0.0))
    update(window, 0.0, dataclasses.replace(snapshot, machines=machines))
    assert not handle(server, f"{ROOT}/0").visible
    assert handle(server, f"{ROOT}/1").visible


def test_it_goes_when_nobody_asks_for_it(server: viser.ViserServer, window: Browser) -> None:
    window.show_use_case(Shown(played(), 0.0, 0.0, 10.0))
    update(window, 10.0 + 0.9 * ASKED)
    assert handle(server, ROOT).visible
    update(window, 10.0 + 1.1 * ASKED)
    for name in (ROOT, *(f"{ROOT}/{end}" for end in ("pair/line", "pair/words", "path", "meant"))):
        assert not handle(server, name).visible
    window.show_use_case(Shown(played(), 0.0, 0.0, 20.0))
    update(window, 20.0)
    assert handle(server, ROOT).visible
    window.show_use_case(None)
    update(window, 20.1)
    assert not handle(server, ROOT).visible


def test_the_view_takes_runs_of_machines_that_it_has() -> None:
    source = toy.Source()
    source.put(toy.snapshot())
    view = start(toy.site(), source)
    try:
        with pytest.raises(ValueError, match="left, right"):
            view.set_use_case(dataclasses.replace(played(), machine="middle"))
        view.set_use_case(played(), 1.0, 1.0)
        view.set_use_case(None, page="nobody")
    finally:
        view.stop()


class View:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.told: list[tuple[Any, float, float, str | None]] = []

    def set_use_case(self, run: Any, at: float, rate: float, page: str | None) -> None:
        self.told.append((run, at, rate, page))


def test_a_page_asks_by_names_and_nothing_is_recorded() -> None:
    view, recorded, run = View(), [], played()
    config = Config(
        *(load_site("demo").frame, {"left": MODEL}, {"left": "LEFT"}, ("left",)),
        *(Limits(0.8, 0.2), 0.1, "LIVE"),
    )
    desk = Desk(
        *(config, Hub(), lambda: view, lambda *what: recorded.append(what)),  # type: ignore[arg-type, return-value]
        played=lambda name, method: run if (name, method) == ("pole", "none") else None,
    )
    ask = {"type": "use_case", "page": "p1", "name": "pole", "method": "none"}
    desk.on_message({**ask, "at": 1.5, "rate": 1})
    desk.on_message({**ask, "method": "scaling", "at": 1.5, "rate": 1})  # not worked out
    desk.on_message({"type": "use_case", "page": "p1", "name": None})
    for at in (None, "2", float("nan"), [1]):
        desk.on_message({**ask, "at": at})
    assert view.told == [(run, 1.5, 1.0, "p1"), (None, 1.5, 1.0, "p1"), (None, 0.0, 0.0, "p1")]
    assert not recorded
