"""Who may draw and switch the working gauge, what is answered, and what is written down of it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from gatehouse import House, house

from backend.documents.gauge_choice import GaugeChoiceFile, GaugeStateDocument
from backend.gauge.features import Pole
from backend.gauge.rules import volumes_of
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.safety.partner import Limits
from backend.shell.app.gauge_api import gauge_router
from backend.shell.gauge_desk import GaugeDesk
from backend.shell.hub import Hub
from backend.shell.session.played_gauge import PlayedGauge
from backend.site.named_bodies import SiteBodies
from backend.site.site import load_site

SQUARE = [[2.0, 2.0], [6.0, 2.0], [6.0, 5.0], [2.0, 5.0]]
PIT = {"kind": "keep_out", "polygon": SQUARE, "bottom": -2.0, "top": 3}
AREA = {"name": "Pit 3", **PIT}


def make_config() -> Config:
    machine = load_machine("mini")
    volumes = volumes_of([Pole("mast", np.array([9.0, 9.0, 0.0]), 0.2, 8.0)])
    boxes, names = volumes[0].boxes, volumes[0].box_names
    return Config(
        frame=load_site("sun2020-simulation").frame,
        machines={"left": machine, "right": machine},
        labels={"left": "LEFT", "right": "RIGHT"},
        own=("left", "right"),
        limits=Limits(0.8, 0.2),
        eta=0.1,
        mode="LIVE",
        site=SiteBodies(boxes, names, volumes),
    )


@dataclass
class Yard:
    """A running app with a gauge, its file, and what it told of changes."""

    house: House
    desk: GaugeDesk
    path: Path
    told: list[tuple[str, str, dict[str, Any]]]


@pytest.fixture(scope="module")
def yard(users_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Yard]:
    folder = tmp_path_factory.mktemp("yard")
    told: list[tuple[str, str, dict[str, Any]]] = []
    path = folder / "gauge" / "yard.json"
    desk = GaugeDesk(make_config(), Hub(), path, lambda *what: told.append(what))
    with house(folder, users_file, routers=(gauge_router(desk),)) as running:
        yield Yard(running, desk, path, told)


def volumes(answer: httpx.Response) -> dict[str, dict[str, Any]]:
    assert answer.status_code == 200, answer.text
    GaugeStateDocument.model_validate_json(answer.text)
    return {volume["name"]: volume for volume in answer.json()["volumes"]}


def changes() -> list[tuple[str, str, dict[str, Any]]]:
    return [
        ("POST", "/api/gauge/drawn", AREA),
        ("PUT", "/api/gauge/drawn/Pit 3", PIT),
        ("PUT", "/api/gauge/switch", {"name": "mast", "on": False}),
        ("DELETE", "/api/gauge/drawn/Pit 3", {}),
    ]


def test_viewers_look_and_strangers_do_not(yard: Yard) -> None:
    nobody, viewer = yard.house.client(), yard.house.client("vera")
    foreign = yard.house.client("otto", Origin="https://elsewhere.example")
    assert nobody.get("/api/gauge").status_code == 401
    assert list(volumes(viewer.get("/api/gauge"))) == ["mast"]
    for method, path, body in changes():
        assert nobody.request(method, path, json=body).status_code == 401
        refused = viewer.request(method, path, json=body)
        assert refused.status_code == 403
        assert "needs the role operator" in refused.json()["detail"]
        assert foreign.request(method, path, json=body).status_code == 403
    assert yard.told == []
    assert not yard.path.exists()


@pytest.mark.parametrize("who", ["otto", "susi"])
def test_an_operator_draws_switches_and_erases(yard: Yard, who: str) -> None:
    client = yard.house.client(who)
    yard.told.clear()
    before = client.get("/api/gauge").json()
    found = volumes(client.post("/api/gauge/drawn", json=AREA))
    assert found["Pit 3"]["in_force"]
    assert (found["Pit 3"]["kind"], found["Pit 3"]["state"]) == ("keep_out", "drawn")
    assert found["Pit 3"]["drawn"]
    assert not found["mast"]["drawn"]
    (plan,) = found["Pit 3"]["plan"]
    assert {tuple(corner) for corner in plan["exterior"]} == {tuple(c) for c in SQUARE}
    kept = GaugeChoiceFile.model_validate_json(yard.path.read_bytes())
    east, north, up = make_config().frame.origin
    assert kept.drawn[0].polygon[1] == pytest.approx((east + 6.0, north + 2.0))
    assert kept.drawn[0].bottom == pytest.approx(up - 2.0)
    moved = client.put("/api/gauge/drawn/Pit 3", json={**PIT, "top": 1.0}).json()
    assert [area["top"] for area in moved["drawn"]] == [1.0]
    found = volumes(client.put("/api/gauge/switch", json={"name": "mast", "on": False}))
    assert (found["mast"]["in_force"], found["mast"]["why"]) == (False, "is switched off")
    assert found["mast"]["switched"] is False
    found = volumes(client.put("/api/gauge/switch", json={"name": "mast", "on": None}))
    assert found["mast"]["in_force"]
    after = client.delete("/api/gauge/drawn/Pit 3")
    assert after.json() == before
    assert [(what, by) for what, by, _ in yard.told] == [
        (f"gauge {what}", who) for what in ("draw", "draw", "switch", "switch", "erase")
    ]
    json.dumps([details for *_, details in yard.told])


@pytest.mark.parametrize(
    ("method", "path", "body", "said"),
    [
        ("POST", "/drawn", {**AREA, "polygon": SQUARE[:2]}, "has 2 corners; allowed are 3 to 40"),
        (
            "POST",
            "/drawn",
            {**AREA, "polygon": [SQUARE[k] for k in (0, 2, 1, 3)]},
            "crosses itself",
        ),
        ("POST", "/drawn", {**AREA, "name": "mast"}, '"mast" is taken'),
        ("POST", "/drawn", {**AREA, "top": -2.0}, "allowed is more than bottom"),
        ("PUT", "/drawn/mast", PIT, '"mast" is taken'),
        ("PUT", "/drawn/a:b", PIT, "is no name of an area"),
        ("DELETE", "/drawn/Pit 4", {}, 'no area "Pit 4" is drawn; there are none yet'),
        ("PUT", "/switch", {"name": "T9", "on": True}, 'no limit volume "T9"; there are mast'),
    ],
)
def test_what_is_not_possible_is_said_and_changes_nothing(
    yard: Yard, method: str, path: str, body: dict[str, Any], said: str
) -> None:
    client = yard.house.client("otto")
    before = yard.desk.choice()
    answer = client.request(method, f"/api/gauge{path}", json=body)
    assert answer.status_code == 422
    assert said in answer.json()["detail"]
    assert yard.desk.choice() is before


@pytest.mark.parametrize(
    "body",
    [{}, {**AREA, "kind": "gate"}, {**AREA, "more": 1}, {**AREA, "polygon": [[1, 2, 3]] * 3}],
)
def test_what_is_no_area_is_refused(yard: Yard, body: dict[str, Any]) -> None:
    before = yard.desk.choice()
    assert yard.house.client("otto").post("/api/gauge/drawn", json=body).status_code == 422
    assert yard.desk.choice() is before


def test_a_name_is_drawn_once_and_drawn_anew_only_on_purpose(yard: Yard) -> None:
    client = yard.house.client("otto")
    volumes(client.post("/api/gauge/drawn", json=AREA))
    again = client.post("/api/gauge/drawn", json=AREA)
    assert again.status_code == 422
    assert '"Pit 3" is taken' in again.json()["detail"]
    volumes(client.delete("/api/gauge/drawn/Pit 3"))


def test_in_playback_it_can_only_be_looked_at(users_file: Path, tmp_path: Path) -> None:
    played = PlayedGauge(make_config(), Hub())
    with house(tmp_path, users_file, routers=(gauge_router(played),)) as running:
        client = running.client("susi")
        assert not client.get("/api/gauge").json()["editable"]
        for method, path, body in changes():
            answer = client.request(method, path, json=body)
            assert answer.status_code == 409
            assert "a recorded session is played" in answer.json()["detail"]
