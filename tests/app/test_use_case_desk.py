"""Use cases are offered where their limits are, worked out aside one at a time, and fetched."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import httpx
import jsonschema
import numpy as np
import pytest
from fastapi import FastAPI

from backend.documents.use_case import UseCaseDocument
from backend.documents.use_case_state import UseCaseStateDocument
from backend.errors import InputError
from backend.planning import rail_site
from backend.shell.app.server import WebServer, bind
from backend.shell.app.use_case_api import use_case_router
from backend.shell.use_case_desk import UseCaseDesk
from backend.shell.use_case_offers import Offer, covered, offers
from backend.site.bodies import site_bodies
from backend.site.site import load_site
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

POLE = (Offer("pole", "rail", np.eye(4)),)


@pytest.mark.parametrize(
    ("site", "names"), [("pole", ["pole"]), ("ballast", ["ballast"]), ("demo", []), ("people", [])]
)
def test_a_site_offers_what_it_is_the_scene_of(site: str, names: list[str]) -> None:
    loaded = load_site(site)
    found = offers(loaded, site_bodies(loaded))
    assert [offer.name for offer in found] == names
    for offer in found:
        assert offer.machine == "rail"
        np.testing.assert_allclose(offer.T_site_root, np.eye(4), atol=1e-6)


def test_limits_elsewhere_are_not_the_same() -> None:
    limits = rail_site.ballast_limits().boxes
    T = transform.make(rotation.rz(0.7), np.array([20.0, -3.0, 1.0]))
    there = limits.moved(T)
    assert covered(limits, T, there)
    assert not covered(limits, np.eye(4), there)
    assert not covered(limits, T, there.take(np.array([0, 1])))
    short = Boxes(there.centers, there.rotations, there.half_extents - [0.0, 0.2, 0.0])
    assert not covered(limits, T, short)
    ends = Boxes(there.centers, there.rotations, there.half_extents - [8.0, 0.0, 0.0])
    assert covered(limits, T, ends)  # 12 m each way are enough


@pytest.fixture(scope="module")
def told() -> list[tuple[str, str]]:
    return []


@pytest.fixture(scope="module")
def desk(told: list[tuple[str, str]]) -> Iterator[UseCaseDesk]:
    made = UseCaseDesk(POLE, {"rail": "RAIL"}, lambda what, who, _: told.append((what, who)))
    yield made
    made.close()


@pytest.fixture(scope="module")
def url(desk: UseCaseDesk) -> Iterator[str]:
    app = FastAPI()
    app.include_router(use_case_router(desk))
    web = WebServer(app, bind("127.0.0.1", 0))
    web.start()
    yield f"http://127.0.0.1:{web.port}/api/use-case"
    web.stop()


def state(url: str) -> dict[str, Any]:
    found: dict[str, Any] = httpx.get(url, trust_env=False).json()
    jsonschema.validate(found, UseCaseStateDocument.model_json_schema())
    return found


def finished(url: str) -> dict[str, Any]:
    deadline = time.monotonic() + 60.0
    while (now := state(url))["running"] is not None:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return now


def test_one_is_worked_out_aside_and_fetched(
    url: str, desk: UseCaseDesk, told: list[tuple[str, str]]
) -> None:
    first = state(url)
    (offered,) = first["offered"]
    assert (offered["name"], offered["label"]) == ("pole", "RAIL")
    assert [m["name"] for m in first["methods"]] == ["none", "scaling", "potential", "constrained"]
    assert first["done"] == []
    assert httpx.get(f"{url}/pole/scaling", trust_env=False).status_code == 404
    asked = {"name": "pole", "method": "scaling"}
    answer = httpx.post(url, json=asked, trust_env=False).json()
    assert (answer["running"]["name"], answer["running"]["method"]) == ("pole", "scaling")
    other = httpx.post(url, json={**asked, "method": "potential"}, trust_env=False)
    assert other.status_code == 409
    assert "pole by scaling is being worked out; allowed is one at a time" in other.json()["detail"]
    assert finished(url)["done"] == [asked]
    document = httpx.get(f"{url}/pole/scaling", trust_env=False).json()
    jsonschema.validate(document, UseCaseDocument.model_json_schema())
    run = desk.run("pole", "scaling")
    assert run is not None
    assert document["runs"][0]["distance"] == pytest.approx(run.nearest.distance, abs=1e-4)
    again = httpx.post(url, json=asked, trust_env=False).json()  # known already
    assert again["running"] is None
    assert told == [("use case start", "")]


def test_it_can_be_stopped_and_started_anew(url: str) -> None:
    asked = {"name": "pole", "method": "constrained"}
    httpx.post(url, json=asked, trust_env=False)
    assert httpx.delete(url, trust_env=False).status_code == 200
    stopped = finished(url)
    assert stopped["trouble"] == "stopped"
    assert asked not in stopped["done"]
    httpx.post(url, json=asked, trust_env=False)
    assert asked in finished(url)["done"]
    assert httpx.delete(url, trust_env=False).json()["trouble"] == ""


@pytest.mark.parametrize(
    ("asked", "status", "said"),
    [
        ({"name": "ballast", "method": "none"}, 409, '"ballast" is not of this site; allowed are'),
        ({"name": "pole", "method": "magic"}, 409, '"magic" is not known; allowed are none'),
        ({"name": "pole"}, 422, "method"),
    ],
)
def test_what_cannot_be_is_refused(url: str, asked: Any, status: int, said: str) -> None:
    answer = httpx.post(url, json=asked, trust_env=False)
    assert answer.status_code == status
    assert said in answer.text.replace('\\"', '"')


def test_elsewhere_nothing_is_offered_and_it_says_why() -> None:
    nothing = UseCaseDesk((), {}, lambda *_: None)
    document = nothing.document()
    jsonschema.validate(document, UseCaseStateDocument.model_json_schema())
    assert document["offered"] == []
    with pytest.raises(InputError, match="allowed are the sites pole and ballast"):
        nothing.start("pole", "none", "")
    assert "no use case is offered here" in document["why"]
    nothing.close()
