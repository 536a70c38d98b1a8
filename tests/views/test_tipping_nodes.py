"""A machine that turns over an edge is red, and its name says so."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import toy_site as toy
import viser
from viewing import handle

from backend.pipeline.records import Snapshot
from backend.stability.records import Stability
from cockpit.views import palette
from cockpit.views.scene import Scene


def leaning(share: float, reason: str = "") -> Snapshot:
    found = dataclasses.replace(Stability(reason), share=share, zmp=np.zeros(2))
    return dataclasses.replace(toy.snapshot(), stability={"left": found})


@pytest.mark.parametrize(
    ("share", "reason", "red"), [(0.3, "", False), (-0.01, "", True), (-1.0, "no masses", False)]
)
def test_it_is_red_where_an_edge_bears_everything(
    server: viser.ViserServer, share: float, reason: str, red: bool
) -> None:
    scene = Scene(server.scene, toy.site())
    scene.update(toy.snapshot(), 1.0)
    plain = handle(server, "/machines/left/2/0").color
    scene.update(leaning(share, reason), 2.0)
    shown = handle(server, "/machines/left/2/0").color
    assert tuple(shown) == (tuple(palette.LEVEL[toy.Level.STOP]) if red else tuple(plain))
    assert ("TIPS OVER" in handle(server, "/machines/left/name").text) == red
    scene.update(toy.snapshot(), 3.0)
    assert tuple(handle(server, "/machines/left/2/0").color) == tuple(plain)
    assert handle(server, "/machines/left/name").text == "LEFT"
    scene.update(leaning(share, reason), 4.0, lost=2.0)
    assert tuple(handle(server, "/machines/left/2/0").color) == palette.STALE
