"""What operators draw and switch is an input like others: recorded, and replayed bit by bit."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path

import pytest
from lived import Lived

from backend.documents.snapshot import snapshot_document
from backend.pipeline.records import AS_THE_SITE_SAYS, Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.shell.hub import Hub
from backend.shell.runner import TELL_AGAIN, Runner
from backend.shell.session.cycles import Topics, gauge_choice, portions
from backend.shell.session.evaluate import evaluate, merged
from backend.shell.session.feeder import Entry
from backend.shell.session.format import CYCLE, GAUGE, SCHEMAS, SNAPSHOT, Message, dumps, seconds
from backend.shell.session.keeper import Plan
from backend.shell.session.reader import open_session
from backend.shell.session.recorder import Recorder
from backend.shell.session.ring import Limits
from backend.shell.session.synthetic import Script, synthesize
from backend.shell.session.tracks import EvaluatedTrack, RecordedTrack
from backend.shell.session.writer import SessionWriter
from backend.site.gauge_choice import NO_CHOICE, Drawn, GaugeChoice
from backend.site.site import load_site
from cockpit.desk import load_models, make_config

WALL = Drawn("wall", "keep_out", ((-8.0, -8.0), (8.0, -8.0), (8.0, 8.0), (-8.0, 8.1)), -2.0, 1.5)
DRAWN = GaugeChoice((WALL,), (("wall", True),))
OFF = DRAWN.with_switch("wall", False)
FROM = {20: DRAWN, 70: DRAWN, 110: OFF, 150: NO_CHOICE}
"""Cycles whose inputs hold a choice; the second says the same again."""


@pytest.fixture(scope="module")
def chosen(tmp_path_factory: pytest.TempPathFactory) -> Lived:
    """A session with choices in it, written by the recorder, and what was concluded live."""
    site = load_site("demo")
    config = make_config(site, load_models(site), (), "DEMO")
    folder = tmp_path_factory.mktemp("gauge")
    synthesize(folder / "plain.mcap", site, config, Script(duration=4.0, begin=16.0))
    plain = open_session(folder / "plain.mcap")
    topics = Topics.of(site)
    recorder = Recorder(Plan(folder, plain.headers[0], Limits()), 0.2)
    entries: list[Entry] = []
    recorder._feeder.put = entries.extend  # type: ignore[method-assign, assignment]
    writer = SessionWriter(folder / "chosen.mcap", plain.headers[0])
    cycles = iter(portions(plain, topics))
    state, snapshots = initial(config), []
    for message in plain.messages():
        if message.topic == SNAPSHOT:
            continue
        if message.topic != CYCLE:
            writer.write(message)
            continue
        portion = next(cycles)
        inputs = replace(portion.inputs, gauge=FROM.get(len(snapshots)))
        state, snapshot = step(state, inputs, portion.now, config)
        snapshots.append(snapshot)
        recorder.after_cycle(inputs, snapshot)
        recorder.snapshot(json.dumps(snapshot_document(snapshot, config)), snapshot.time)
        for topic, _, at, data in entries:
            writer.write(Message(topic, at, data))
        entries.clear()
    writer.close()
    return Lived(folder / "chosen.mcap", site, config, topics, snapshots)


def text(snapshot: Snapshot, lived: Lived) -> str:
    return json.dumps(snapshot_document(snapshot, lived.config))


def stops(snapshot: Snapshot) -> bool:
    return any(c.name == "site" and c.level.name == "STOP" for c in snapshot.concerns)


def test_a_replay_with_choices_is_the_live_run_bit_by_bit(chosen: Lived) -> None:
    session = open_session(chosen.path)
    again = [snapshot for _, snapshot in evaluate(session, chosen.topics, chosen.config)]
    assert [text(s, chosen) for s in again] == [text(s, chosen) for s in chosen.snapshots]
    assert [s.gauge for s in again] == [s.gauge for s in chosen.snapshots]
    # The session is one in which the choice matters.
    assert [stops(again[k]) for k in (19, 20, 109, 110, 150)] == [False, True, True, False, False]
    kept = list(session.messages(topics=[GAUGE]))
    assert len(kept) == len(FROM)
    assert set(SCHEMAS[GAUGE]["required"]) == set(json.loads(kept[0].data)) == {"drawn", "switched"}


def test_without_the_choices_it_would_be_another_run(chosen: Lived, tmp_path: Path) -> None:
    session = open_session(chosen.path)
    writer = SessionWriter(tmp_path / "without.mcap", session.headers[0])
    for message in session.messages():
        if message.topic != GAUGE:
            writer.write(message)
    writer.close()
    bare = open_session(tmp_path / "without.mcap")
    found = [snapshot for _, snapshot in evaluate(bare, chosen.topics, chosen.config)]
    assert not any(stops(snapshot) for snapshot in found)
    assert all(snapshot.gauge is AS_THE_SITE_SAYS for snapshot in found)


@pytest.mark.parametrize("k", [60, 100, 130, 160])
def test_a_jump_finds_what_was_chosen_then(chosen: Lived, k: int) -> None:
    session = open_session(chosen.path)
    live = chosen.snapshots[k]
    at = session.begin + round((live.time - seconds(session.begin, session.offset)) * 1e9)
    for track in (
        RecordedTrack(session, chosen.config),
        EvaluatedTrack(session, chosen.topics, chosen.config),
    ):
        shown = track.seek(at + 1000)
        assert shown is not None
        assert shown.snapshot.time == live.time
        assert shown.snapshot.gauge.choice == live.gauge.choice
        assert stops(shown.snapshot) == stops(live)


def test_a_recorded_track_follows_the_choice(chosen: Lived) -> None:
    session = open_session(chosen.path)
    track = RecordedTrack(session, chosen.config)
    track.seek(session.begin - 1)
    found = []
    while (shown := track.step()) is not None:
        found.append(shown.snapshot.gauge.choice)
    assert found == [snapshot.gauge.choice for snapshot in chosen.snapshots]


def test_of_merged_inputs_the_last_choice_holds() -> None:
    assert merged([Inputs(gauge=DRAWN), Inputs(), Inputs(gauge=OFF), Inputs()]).gauge is OFF
    assert merged([Inputs(), Inputs()]).gauge is None


def test_what_is_no_choice_is_none() -> None:
    area = {"name": "a", "kind": "keep_out", "polygon": [[0, 0], [1, 0]], "bottom": 0, "top": 1}
    for broken in ({}, {"drawn": 3, "switched": {}}, {"drawn": [area], "switched": {}}, []):
        assert gauge_choice(dumps(broken)) is None  # type: ignore[arg-type]
    assert gauge_choice(b"?") is None


def test_the_fast_loop_tells_a_choice_when_it_changes_and_again(chosen: Lived) -> None:
    now, held = [0.0], [NO_CHOICE]
    runner = Runner(
        *(chosen.config, (), _Nothing(), Hub(), 50.0), clock=lambda: now[0], gauge=lambda: held[0]
    )
    told = []
    for cycle, choice in enumerate([NO_CHOICE] * 60 + [DRAWN] * 120 + [NO_CHOICE] * 100):
        now[0], held[0] = 0.02 * cycle, choice
        if (found := runner._chosen(now[0])) is not None:
            told.append((cycle, found))
    assert told[0] == (60, DRAWN)
    assert [choice for _, choice in told] == [DRAWN] * 3 + [NO_CHOICE]
    assert told[-1][0] == 180
    assert 0.02 * (told[1][0] - told[0][0]) == pytest.approx(TELL_AGAIN, abs=0.03)


class _Nothing:
    def take(self) -> Inputs:
        time.sleep(0.0)
        return Inputs()
