"""The gauge as operators draw and switch it, in cycles: what holds for which machine, and when."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
from test_step import config, inputs, run

from backend.cspace.cells import SITE as SITE_BIT
from backend.documents.snapshot import snapshot_document
from backend.gauge.centreline import LineThroughPoints
from backend.gauge.features import Track
from backend.gauge.rules import volumes_of
from backend.pipeline.config import Config
from backend.pipeline.exact import Cells, own_image
from backend.pipeline.records import AS_THE_SITE_SAYS, GaugeInForce, Snapshot
from backend.pipeline.step import State, initial, step
from backend.pipeline.whatif import what_if
from backend.pipeline.working_gauge import site_of
from backend.safety.record import Level
from backend.site.gauge_choice import NO_CHOICE, Drawn, GaugeChoice
from backend.site.named_bodies import SiteBodies

__all__ = ["config", "inputs"]

AHEAD = Drawn("ahead", "keep_out", ((3.0, -1.0), (9.0, -1.0), (9.0, 1.0), (3.0, 1.0)), -1.0, 4.0)
DRAWN = GaugeChoice((AHEAD,))
Q = {"a": (0.35, 0.5, -1.0, 0.5), "b": (0.0, 0.5, -1.0, 0.5)}
# Machine a stands on T1, b beyond its end and along it.
(TRACK,) = volumes_of(
    [Track(LineThroughPoints("T1", np.array([[-30.0, 0.0, 0.0], [5.0, 0.0, 0.0]]), 0.0, 1.435))]
)
RAILS = SiteBodies(TRACK.boxes, TRACK.box_names, (TRACK,))


def levels(snapshot: Snapshot) -> dict[str, Level]:
    return {c.machine: c.level for c in snapshot.concerns if c.name == "site"}


def hit(snapshot: Snapshot, own: str = "a") -> set[str]:
    found = {freedom.hits for both in snapshot.margins[own].joints for freedom in both}
    return {name for name in found if name is not None and name.startswith("gauge:")}


def after(state: State, config: Config, first: int, cycles: int, **more: object) -> list[Snapshot]:
    """Snapshots of cycles that follow each other; a choice goes into the first."""
    found = []
    for k in range(cycles):
        now = 100.0 + 0.02 * (first + k)
        told = inputs(config, now, b_position=(12.0, 0.3), q=Q)
        if k == 0:
            told = replace(told, **more)  # type: ignore[arg-type]
        state, snapshot = step(state, told, now, config)
        found.append(snapshot)
    return found


def placed(config: Config) -> State:
    state = initial(config)
    for k in range(20):
        now = 100.0 + 0.02 * k
        state, _ = step(state, inputs(config, now, b_position=(12.0, 0.3), q=Q), now, config)
    return state


def test_what_is_drawn_holds_from_that_cycle_on_and_goes_again(config: Config) -> None:
    state = placed(config)
    before, *_ = after(state, config, 20, 1)
    assert before.gauge is AS_THE_SITE_SAYS
    assert levels(before) == {}
    drawn = after(state, config, 20, 3, gauge=DRAWN)
    for snapshot in drawn:
        assert levels(snapshot)["a"] is Level.STOP  # its arm is over the area
        assert hit(snapshot) == {"gauge:ahead/0"}
        assert snapshot.gauge is drawn[0].gauge
    far = replace(AHEAD, polygon=tuple((x, y + 60.0) for x, y in AHEAD.polygon))
    moved = after(state, config, 20, 2, gauge=GaugeChoice((far,)))[-1]
    assert levels(moved) == {"a": Level.CLEAR, "b": Level.CLEAR}
    off = after(state, config, 20, 2, gauge=DRAWN.with_switch("ahead", False))[-1]
    assert levels(off) == {}
    gone = after(state, config, 20, 1, gauge=NO_CHOICE)[-1]
    assert (
        snapshot_document(gone, config)["margins"] == snapshot_document(before, config)["margins"]
    )


def test_images_and_questions_see_what_is_drawn(config: Config) -> None:
    snapshot = after(placed(config), config, 20, 1, gauge=DRAWN)[-1]
    cells = Cells(slice=8, bar=24, volume=6, reach=(8, 6))

    def at_site(shown: Snapshot) -> bool:
        bars = own_image(shown, config, "a", cells).bars
        return any(bool((bar.cells & SITE_BIT).any()) for bar in bars)

    assert at_site(snapshot)
    assert not at_site(replace(snapshot, gauge=AS_THE_SITE_SAYS))
    q = np.array(Q["a"])
    assert "gauge:ahead/0" in {touch.other for touch in what_if(snapshot, config, "a", q).hits}
    # As it comes to a process that makes images: equal, and so the same bodies every time.
    once, again = (pickle.loads(pickle.dumps(snapshot)).gauge for _ in range(2))
    assert once.choice is not again.choice
    assert site_of("a", once, config) is site_of("a", again, config)


def test_a_machine_does_not_heed_the_track_it_stands_on(config: Config) -> None:
    railed = replace(config, site=RAILS)
    snapshots = run(railed, 0.4, b_position=(8.0, 0.0), q=Q)
    last = snapshots[-1]
    assert last.gauge.own_tracks == {"a": ("T1",)}
    assert snapshots[-2].gauge is last.gauge
    assert hit(last) == set()
    assert levels(last) == {"b": Level.STOP}  # its arm is over the rails' end
    assert "gauge:T1/0" in hit(last, "b")
    assert site_of("b", last.gauge, railed) is RAILS
    assert site_of("a", last.gauge, railed) is site_of("a", snapshots[-2].gauge, railed)
    document = snapshot_document(last, railed)["gauge"]
    assert document == {"choice": NO_CHOICE.digest, "own_tracks": {"a": ["T1"]}}


def test_a_track_that_is_switched_on_holds_for_who_stands_on_it(config: Config) -> None:
    railed = replace(config, site=RAILS)
    state = placed(railed)
    assert state.gauge == GaugeInForce(NO_CHOICE, {"a": ("T1",)})
    on = after(state, railed, 20, 1, gauge=NO_CHOICE.with_switch("T1", True))[-1]
    assert on.gauge.own_tracks == {}
    assert levels(on)["a"] is Level.STOP


def test_nothing_is_left_out_for_a_machine_that_is_not_known_well(config: Config) -> None:
    railed = replace(config, site=RAILS)
    state = placed(railed)
    now = 100.0 + 0.02 * 20 + 1.0
    silent = inputs(railed, now, b_position=(12.0, 0.3), silent=("a",), q=Q)
    _, snapshot = step(state, silent, now, railed)
    assert snapshot.gauge.own_tracks == {}
    assert levels(snapshot)["a"] is Level.UNKNOWN
    assert site_of("a", snapshot.gauge, railed) is RAILS


def test_a_cycle_depends_on_its_arguments_alone(config: Config) -> None:
    """The same bits from an equal choice of other objects, whatever was computed before."""
    state = placed(replace(config, site=RAILS))
    copied = pickle.loads(pickle.dumps(DRAWN))
    texts = []
    for chosen in (DRAWN, copied):
        fresh = replace(config, site=SiteBodies(TRACK.boxes, TRACK.box_names, (TRACK,)))
        found = after(state, fresh, 20, 2, gauge=chosen)
        texts.append(json.dumps([snapshot_document(snapshot, fresh) for snapshot in found]))
    assert texts[0] == texts[1]
