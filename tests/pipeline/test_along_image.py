"""Strips along tracks of a running backend: who gets one, of what, and as which frame."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from test_step import Q, config, run

from backend.gauge.centreline import LineThroughPoints
from backend.gauge.features import Pole
from backend.gauge.rules import Rules, volumes_of
from backend.pipeline.along import AHEAD, AlongImage, along_image, own_way
from backend.pipeline.config import Config
from backend.pipeline.images import SunParameters
from backend.pipeline.records import Snapshot
from backend.shell.app.image_frames import frame_of
from backend.shell.kinds import ALONG, Recipe, Wishes, make_images
from backend.shell.recent import ASKED, PERIOD, SPAN, Recent
from backend.site.named_bodies import SiteBodies
from backend.site.travel import Way
from backend.spatial.boxes import concatenated

__all__ = ["config"]

POLES = volumes_of([Pole("mast", np.array([20.0, 0.5, -1.0]), 0.2, 8.0)], Rules())
BODIES = SiteBodies(concatenated(v.boxes for v in POLES), POLES[0].box_names, POLES)


def way(name: str, y: float) -> Way:
    ends = np.array([[-100.0, y, 0.0], [100.0, y, 0.0]])
    return Way(name, LineThroughPoints(name, ends), radius=500.0)


WAYS = (way("T2", 4.5), way("T1", 0.2), way("T0", -1.2))


@pytest.fixture(scope="module")
def gauged(config: Config) -> Config:
    return replace(config, site=BODIES)


@pytest.fixture(scope="module")
def snapshot(gauged: Config) -> Snapshot:
    return run(gauged, 0.4, b_position=(40.0, 2.5))[-1]


def test_a_machine_is_on_the_nearest_track_along_its_heading(
    gauged: Config, snapshot: Snapshot
) -> None:
    found = own_way(snapshot, WAYS, "a")
    assert found is not None
    assert found.name == "T1"
    assert own_way(snapshot, WAYS[:1], "a") is None  # 4.5 m off
    assert own_way(snapshot, WAYS[1:], "b") is None
    across = Way("X", LineThroughPoints("X", np.array([[0.0, -9.0, 0.0], [0.0, 9.0, 0.0]])))
    assert own_way(snapshot, (across,), "a") is None


def test_the_strip_tells_where_a_mast_would_be_hit(gauged: Config, snapshot: Snapshot) -> None:
    image = along_image(snapshot, gauged, "a", WAYS[1], np.array([Q["a"]] * 5), 20.0)
    assert image.place is not None
    assert image.place.station == pytest.approx(100.0, abs=0.05)
    assert image.place.lateral == pytest.approx(-0.2, abs=0.05)
    assert image.stretches[0].start == pytest.approx(image.place.station - AHEAD)
    assert image.postures in (1, 2)
    bad = [item for item in image.stretches if item.state != "clear"]
    assert {item.limit for item in bad} == {"gauge:mast/0"}
    # The mast stands 20 m ahead, in the way of the arm first and of the tracks at last.
    assert 110.0 < bad[0].start < 120.0 < bad[-1].end < 125.0


def test_an_unknown_pose_gives_a_reason_and_no_strip(gauged: Config, snapshot: Snapshot) -> None:
    lost = run(gauged, 0.4, b_position=(40.0, 2.5), silent=("a",))[-1]
    assert own_way(lost, WAYS, "a") is None
    machines = {**snapshot.machines}
    machines["a"] = replace(machines["a"], pose=replace(lost.machines["a"].pose))
    image = along_image(
        replace(snapshot, machines=machines), gauged, "a", WAYS[1], np.array([Q["a"]]), 20.0
    )
    assert image.stretches == ()
    assert image.reason


def test_only_what_is_looked_at_is_made_and_sent(gauged: Config, snapshot: Snapshot) -> None:
    recipe = Recipe(gauged, SunParameters(5, 5, 0.1), (ALONG,), ways=WAYS)
    assert make_images(recipe, snapshot, Wishes({})) == []
    wishes = Wishes({}, {"a": (Q["a"],), "b": (Q["b"],), "nobody": (Q["a"],)})
    made = make_images(recipe, snapshot, wishes)
    assert [(one.kind, one.image.key) for one in made] == [("along", "a")]
    image = made[0].image
    assert isinstance(image, AlongImage)
    frame = frame_of(ALONG, image, {})
    assert frame is not None
    assert b'"track":"T1"' in frame.replace(b" ", b"")
    assert b"mast" in frame
    assert b"NaN" not in frame[: frame.index(b"}]")]


def test_postures_are_kept_for_a_while_and_given_to_who_asks(snapshot: Snapshot) -> None:
    recent = Recent()
    for k in range(600):
        recent.keep(replace(snapshot, time=0.05 * k))
    assert recent.wanted() == {}
    recent.ask("a")
    (postures,) = recent.wanted().values()
    assert len(postures) == pytest.approx(SPAN / PERIOD, abs=2)
    np.testing.assert_allclose(postures[0], Q["a"], atol=0.05)
    recent.keep(replace(snapshot, time=30.0 + ASKED + 0.1))
    assert recent.wanted() == {}
    assert math.isfinite(ASKED)
