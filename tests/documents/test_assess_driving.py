"""The driving zones that `cockpit assess` prints, held against coal."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import shapely
from oracles import coal_closest
from program import cockpit

STATE: dict[str, Any] = {
    "machines": {
        "left": {
            "model": "mini",
            "position": [308611.05, 4129957.348, 0.2],
            "yaw": 0.3,
            "pitch": 0.05,
            "roll": -0.1,
            "joints": {"swing": 0.1, "boom": 0.5, "stick": -1.0, "bucket": 0.5},
        },
        "right": {
            "model": "mini",
            "position": [308614.0, 4129958.0, 0.0],
            "yaw": 2.0,
            "joints": {"swing": 0.0, "boom": 0.5, "stick": -1.0, "bucket": 0.5},
        },
    },
}
VARIANTS = ("as_is", "any_swing", "any_posture", "turning")


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return assess(STATE, tmp_path_factory.mktemp("state"))


def assess(state: dict[str, Any], folder: Path) -> dict[str, Any]:
    path = folder / "state.json"
    path.write_text(json.dumps(state))
    done = cockpit("assess", "--state", str(path))
    assert done.returncode == 0, done.stderr
    judged: dict[str, Any] = json.loads(done.stdout)
    return judged


def polygon(documents: list[dict[str, Any]]) -> shapely.Geometry:
    return shapely.union_all([shapely.Polygon(d["exterior"], d["holes"]) for d in documents])


def test_zones_are_as_the_schema_says(result: dict[str, Any]) -> None:
    jsonschema.validate(result, json.loads(cockpit("schema", "assess").stdout))
    assert set(result["driving_zone"]) == {"left<-right", "right<-left"}
    for zone in result["driving_zone"].values():
        assert set(zone["signed_distance"]) == set(zone["exit"]) == set(VARIANTS)


def test_signed_distance_belongs_to_the_printed_polygons(result: dict[str, Any]) -> None:
    for pair, zone in result["driving_zone"].items():
        here = shapely.Point(STATE["machines"][pair.split("<-")[0]]["position"][:2])
        for name in VARIANTS:
            drawn = polygon(zone[name])
            edge = shapely.distance(drawn.boundary, here)
            signed = -edge if shapely.covers(drawn, here) else edge
            assert zone["signed_distance"][name] == pytest.approx(signed, abs=1e-6)


def test_as_is_agrees_with_coal_at_random_positions(result: dict[str, Any]) -> None:
    zone = polygon(result["driving_zone"]["left<-right"]["as_is"])
    low, high = np.array(zone.bounds).reshape(2, 2)
    own, partner = (result["machines"][name]["bodies"] for name in ("left", "right"))
    start = np.array(STATE["machines"]["left"]["position"][:2])
    hits = 0
    for place in np.random.default_rng(1).uniform(low, high, (60, 2)):
        moved = copy.deepcopy(own)
        for body in moved:
            body["center"] = [*(np.array(body["center"][:2]) + place - start), body["center"][2]]
        if abs(shapely.distance(zone.boundary, shapely.Point(place))) > 1e-6:
            hit = coal_closest(moved, partner) <= 0.0
            assert hit == shapely.contains_xy(zone, *place)
            hits += hit
    assert 5 < hits < 55


def test_a_machine_without_a_partner_has_no_zone(tmp_path: Path) -> None:
    alone = {"machines": {"left": STATE["machines"]["left"]}}
    assert assess(alone, tmp_path)["driving_zone"] == {}


def test_nothing_in_reach_in_height_gives_no_polygons(tmp_path: Path) -> None:
    above = copy.deepcopy(STATE)
    above["machines"]["right"]["position"][2] += 50.0
    zone = assess(above, tmp_path)["driving_zone"]["left<-right"]
    for name in VARIANTS:
        assert zone[name] == []
        assert zone["signed_distance"][name] is None
