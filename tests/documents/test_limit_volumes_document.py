"""The working gauge in the site document."""

from __future__ import annotations

import json

import numpy as np

from backend.documents.limit_volumes import volumes_document
from backend.gauge.features import Ceiling, KeepIn
from backend.gauge.rules import Rules, volumes_of
from backend.site.named_bodies import SiteBodies

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [0.0, 8.0]])


def test_an_entry_holds_the_plan_and_the_pieces() -> None:
    volumes = volumes_of([KeepIn("yard", SQUARE), Ceiling("low", 4.0)], Rules(depth=5.0))
    entries = volumes_document(SiteBodies(volumes=volumes, idle={"low": "is switched off"}))
    yard, low = json.loads(json.dumps(entries, allow_nan=False))
    assert (yard["name"], yard["kind"], yard["idle"]) == ("yard", "keep_in", "")
    assert low["idle"] == "is switched off"
    (plan,) = yard["plan"]
    assert np.abs(np.array(plan["exterior"])).max() == 15.0
    (hole,) = plan["holes"]
    assert {tuple(point) for point in hole} == {tuple(point) for point in SQUARE}
    assert len(yard["boxes"]) == len(yard["hulls"]) == 4
    assert np.array(yard["hulls"][0]["vertices"]).shape == (8, 3)
    assert len(yard["hulls"][0]["faces"]) == 6
    assert low["hulls"] == []
    assert low["boxes"][0]["half_extents"] == [500.0, 500.0, 2.5]
    assert volumes_document(SiteBodies()) == []
