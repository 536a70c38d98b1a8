"""A plan previewed in the scene: where the machine stood for it, along its joints, no pair."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import toy_site as toy
import viser
from test_use_case_nodes import MODEL, View, played, update
from viewing import handle

from backend.documents.plan_document import PlanDocument
from backend.machine import kinematics
from backend.pipeline.config import Config
from backend.safety.partner import Limits
from backend.shell.hub import Hub
from backend.site.site import load_site
from backend.spatial import rotation, transform
from cockpit.desk import Desk
from cockpit.plan_scene import PlanScene, as_played
from cockpit.views.browser import Browser
from cockpit.views.use_case_nodes import Shown

ROOT = "/usecase/left"
T = transform.make(rotation.rz(-0.4), np.array([-2.6, 1.0, 0.2]))
TIMES = np.linspace(0.0, 2.0, 41)


def document() -> PlanDocument:
    q = np.tile([0.0, 0.7, -1.1, -0.3], (41, 1))
    q[:, 0] = 0.5 * TIMES
    return PlanDocument(
        ok=True, machine="left", method="toppra", duration=2.0, time=TIMES.tolist(),
        joints=q.tolist(), end_point=kinematics.end_point(MODEL, q, T).tolist(),
    )  # fmt: skip


@pytest.fixture
def window(server: viser.ViserServer) -> Browser:
    client = SimpleNamespace(scene=server.scene, atomic=server.atomic)
    return Browser(client, toy.site(), "left", "site", "exact")  # type: ignore[arg-type]


def test_the_ghost_stands_along_the_plan_and_the_path_is_the_end_points(
    server: viser.ViserServer, window: Browser
) -> None:
    made = document()
    window.show_use_case(Shown(as_played(made, T), at=1.0, rate=0.0, since=5.0))
    update(window, 5.5)
    want = kinematics.link_poses(MODEL, np.array(made.joints)[20], T)
    for k in range(1, len(want)):
        np.testing.assert_allclose(
            handle(server, f"{ROOT}/{k}").position, want[k, :3, 3], atol=1e-9
        )
    assert handle(server, f"{ROOT}/words").text == "PLAN · preview · 2.0 s"
    path = handle(server, f"{ROOT}/path").points
    np.testing.assert_allclose(path[0, 0], made.end_point[0], atol=1e-5)
    np.testing.assert_allclose(path[-1, 1], made.end_point[-1], atol=1e-5)
    for name in ("pair/line", "pair/words", "meant"):
        assert not handle(server, f"{ROOT}/{name}").visible


def test_the_pair_of_a_use_case_does_not_stay(server: viser.ViserServer, window: Browser) -> None:
    window.show_use_case(Shown(played(), 1.0, 0.0, 0.0))
    update(window, 0.0)
    assert handle(server, f"{ROOT}/pair/words").visible
    window.show_use_case(Shown(as_played(document(), T), 1.0, 0.0, 0.0))
    update(window, 0.1)
    for name in ("pair/line", "pair/words", "meant"):
        assert not handle(server, f"{ROOT}/{name}").visible
    assert handle(server, f"{ROOT}/path").visible


def test_a_page_asks_by_machine_and_plan() -> None:
    view, run = View(), as_played(document(), T)
    config = Config(
        *(load_site("demo").frame, {"left": MODEL}, {"left": "LEFT"}, ("left",)),
        *(Limits(0.8, 0.2), 0.1, "LIVE"),
    )
    desk = Desk(
        *(config, Hub(), lambda: view),  # type: ignore[arg-type, return-value]
        previewed=lambda machine, plan: run if (machine, plan) == ("left", "left-1") else None,
    )
    ask = {"type": "plan", "page": "p1", "machine": "left", "plan": "left-1"}
    desk.on_message({**ask, "at": 0.5, "rate": 1})
    desk.on_message({**ask, "plan": "left-2", "at": 0.5, "rate": 1})
    desk.on_message({**ask, "plan": None})
    assert view.told == [(run, 0.5, 1.0, "p1"), (None, 0.5, 1.0, "p1"), (None, 0.0, 0.0, "p1")]


def test_what_was_made_of_a_plan_is_kept_until_there_is_another() -> None:
    ways: dict[str, Any] = {"left-1": (document(), T)}
    desk = SimpleNamespace(way=lambda machine, plan: ways.get(plan))
    scene = PlanScene(desk)  # type: ignore[arg-type]
    first = scene.played("left", "left-1")
    assert first is not None
    assert scene.played("left", "left-1") is first
    assert scene.played("left", "left-2") is None
    ways["left-2"] = (document(), T)
    assert scene.played("left", "left-2") is not first
