"""A manoeuvre previewed in the scene: the whole machine, its base included, and what it does."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import toy_site as toy
import viser
from test_use_case_nodes import MODEL, update
from viewing import handle

from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_side import base_poses
from backend.machine import kinematics
from backend.shell.surmount_desk import Way
from cockpit.surmount_scene import SurmountScene, as_played, previewed
from cockpit.views.browser import Browser
from cockpit.views.use_case_nodes import Shown

ROOT = "/usecase/left"
TIMES = np.linspace(0.0, 4.0, 81)


def way() -> Way:
    """One metre ahead and 0.3 m up, leaning by 0.2 rad on the way."""
    u = TIMES / 4.0
    q = np.tile([0.0, 0.7, -1.1, -0.3], (81, 1))
    q[:, 0] = 0.5 * TIMES
    nothing = np.zeros(81)
    lean = 0.2 * np.sin(np.pi * u)
    base = np.column_stack([-2.6 + u, nothing + 1.0, 0.2 + 0.3 * u, nothing - 0.4, lean, nothing])
    T = base_poses(base)
    phases = [
        {"name": "reach", "start": 0.0, "end": 2.0},
        {"name": "sequence 1", "start": 2.0, "end": 4.0},
    ]
    document = SurmountDocument.model_validate(
        {
            "ok": True, "machine": "left", "duration": 4.0, "time": TIMES.tolist(),
            "joints": q.tolist(), "base": base.tolist(), "phases": phases,
            "end_point": kinematics.end_point(MODEL, q, T).tolist(),
        }
    )  # fmt: skip
    return Way(document, T)


@pytest.fixture
def window(server: viser.ViserServer) -> Browser:
    client = SimpleNamespace(scene=server.scene, atomic=server.atomic)
    return Browser(client, toy.site(), "left", "site", "exact")  # type: ignore[arg-type]


def test_the_ghosts_base_moves_and_it_says_what_it_does(
    server: viser.ViserServer, window: Browser
) -> None:
    made = way()
    for at, k, words in ((1.0, 20, "reach"), (3.0, 60, "sequence 1"), (4.0, 80, "sequence 1")):
        window.show_use_case(Shown(as_played(made), at=at, rate=0.0, since=5.0))
        update(window, 5.5)
        want = kinematics.link_poses(MODEL, np.array(made.document.joints)[k], made.base[k])
        for link in range(1, len(want)):
            np.testing.assert_allclose(
                handle(server, f"{ROOT}/{link}").position, want[link, :3, 3], atol=1e-9
            )
        assert handle(server, f"{ROOT}/words").text == f"OVER · preview · {words}"
    path = handle(server, f"{ROOT}/path").points
    np.testing.assert_allclose(path[0, 0], made.document.end_point[0], atol=1e-5)
    np.testing.assert_allclose(path[-1, 1], made.document.end_point[-1], atol=1e-5)


def test_a_base_that_has_driven_on_is_drawn_though_the_machine_stands_where_it_began(
    server: viser.ViserServer, window: Browser
) -> None:
    real = toy.snapshot().machines["left"].body
    assert real is not None
    first = way()
    moved = np.tile(real.link_poses[0], (81, 1, 1))
    moved[:, 0, 3] += np.linspace(0.0, 1.5, 81)
    made = as_played(Way(first.document, moved))
    window.show_use_case(Shown(made, at=0.0, rate=0.0, since=5.0))
    update(window, 5.5)
    assert not handle(server, f"{ROOT}/0").visible  # the machine itself is there
    window.show_use_case(Shown(made, at=4.0, rate=0.0, since=5.0))
    update(window, 5.6)
    assert handle(server, f"{ROOT}/0").visible


def test_plans_are_looked_up_in_both_places_and_kept() -> None:
    ways: dict[str, Any] = {"left-over-1": way()}
    scene = SurmountScene(SimpleNamespace(way=lambda machine, plan: ways.get(plan)))
    first = scene.played("left", "left-over-1")
    assert first is not None
    assert scene.played("left", "left-over-1") is first
    assert scene.played("left", "left-over-1.2") is None
    ways["left-over-1.2"] = way()
    assert scene.played("left", "left-over-1.2") is not first
    other = object()
    plans: Any = SimpleNamespace(played=lambda machine, plan: other if plan == "left-1" else None)
    find = previewed(plans, scene)
    assert find("left", "left-1") is other
    assert find("left", "left-over-1.2") is scene.played("left", "left-over-1.2")
    assert find("left", "left-9") is None
