"""/api/stages counts what detection makes of points; a page's message shows it in its window."""

from __future__ import annotations

import math
from typing import Any

import httpx
import jsonschema
import numpy as np
import pytest
from fastapi import FastAPI

from backend.documents.stages import StagesDocument
from backend.machine.load import load_machine
from backend.perception.detect import Objects
from backend.perception.ground import Plane
from backend.perception.stages import StagedScan
from backend.pipeline.config import Config
from backend.safety.partner import Limits
from backend.shell.app.server import WebServer, bind
from backend.shell.app.stages import stages_router
from backend.shell.hub import Hub
from backend.shell.stages_look import Look
from backend.site.site import load_site
from cockpit.desk import Desk

TILTED = Plane(np.array([math.sin(0.1), 0.0, math.cos(0.1)]), 0.4, 0.9)
SCAN = StagedScan(
    5.0,
    np.zeros((3, 3), np.float32),
    np.array([2, 3, 3], np.uint8),
    np.array([-1, 0, 0]),
    (12_034, 4_100, 13_000, 978, 0),
    TILTED,
    Objects(np.zeros((2, 3)), np.zeros(2), np.ones((2, 3)), np.array([900, 78])),
)


def told(look: Look) -> dict[str, Any]:
    """What the route says."""
    app = FastAPI()
    app.include_router(stages_router(lambda: look))
    web = WebServer(app, bind("127.0.0.1", 0))
    web.start()
    try:
        answer = httpx.get(f"http://127.0.0.1:{web.port}/api/stages", trust_env=False)
    finally:
        web.stop()
    assert answer.status_code == 200
    found: dict[str, Any] = answer.json()
    jsonschema.validate(found, StagesDocument.model_json_schema())
    return found


def test_points_are_counted_by_stage() -> None:
    found = told(Look(SCAN, 0.25))
    assert found["counts"] == {
        "outside": 12_034, "machine": 4_100, "ground": 13_000, "object": 978, "left": 0
    }  # fmt: skip
    assert (found["points"], found["drawn"], found["objects"]) == (30_112, 3, 2)
    assert found["slope"] == pytest.approx(0.1)
    assert (found["reason"], found["age"]) == ("", 0.25)


@pytest.mark.parametrize(
    ("look", "age"),
    [(Look(None, reason="waiting for a scan"), None), (Look(None, 1.4, "no scan for 1.4 s"), 1.4)],
)
def test_without_a_new_scan_there_are_no_numbers(look: Look, age: float | None) -> None:
    found = told(look)
    assert (found.pop("reason"), found.pop("age")) == (look.reason, age)
    assert set(found.values()) == {None}


class View:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.told: list[tuple[list[str], str | None]] = []

    def set_stages(self, shown: list[str], page: str | None = None) -> None:
        if "sky" in shown:
            raise ValueError("no stage")
        self.told.append((shown, page))


def test_a_page_switches_its_own_window_and_nothing_is_recorded() -> None:
    view, recorded = View(), []
    machine = load_machine("mini")
    config = Config(
        *(load_site("demo").frame, {"left": machine}, {"left": "LEFT"}, ("left",)),
        *(Limits(0.8, 0.2), 0.1, "LIVE"),
    )
    desk = Desk(config, Hub(), lambda: view, lambda *what: recorded.append(what))  # type: ignore[arg-type, return-value]
    desk.on_message({"type": "stages", "page": "p1", "shown": ["ground"]})
    desk.on_message({"type": "stages", "page": "p1", "shown": []})
    for shown in (None, "ground", [1], ["sky"], {"ground": 1}):
        desk.on_message({"type": "stages", "page": "p1", "shown": shown})
    desk.on_message({"type": "stages", "page": 3, "shown": ["ground"]})
    assert view.told == [(["ground"], "p1"), ([], "p1")]
    assert not recorded
