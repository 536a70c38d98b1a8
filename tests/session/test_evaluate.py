"""A recorded session judged again: bit by bit as live; and shown as it was."""

from __future__ import annotations

import dataclasses
import json
from itertools import pairwise
from pathlib import Path

import pytest
from lived import Lived, without

from backend.documents.snapshot import snapshot_document
from backend.pipeline.records import Snapshot
from backend.safety.record import Level
from backend.shell.app.wire import dumps
from backend.shell.session.cycles import PERIOD, document, portions, problems
from backend.shell.session.evaluate import evaluate, merged
from backend.shell.session.format import CYCLE, SNAPSHOT, Message
from backend.shell.session.reader import open_session
from backend.shell.session.recorded_snapshot import NotASnapshot, recorded_snapshot
from backend.shell.session.writer import SessionWriter


def text(snapshot: Snapshot, lived: Lived) -> str:
    """All of a snapshot, NaN and infinity told apart."""
    return json.dumps(snapshot_document(snapshot, lived.config))


def test_a_replay_is_bit_by_bit_what_the_live_run_concluded(lived: Lived) -> None:
    session = open_session(lived.path)
    replayed = [s for _, s in evaluate(session, lived.topics, lived.config)]
    assert len(replayed) == len(lived.snapshots) > 500
    for again, once in zip(replayed, lived.snapshots, strict=True):
        assert text(again, lived) == text(once, lived)
    levels = {c.level for s in replayed for c in s.concerns}
    assert {Level.SLOW, Level.STOP, Level.UNKNOWN} <= levels, "the session should have a near miss"


def test_two_replays_are_the_same(lived: Lived) -> None:
    session = open_session(lived.path)
    end = session.begin + 3 * 10**9
    once, again = (
        [text(s, lived) for _, s in evaluate(session, lived.topics, lived.config, end=end)]
        for _ in range(2)
    )
    assert once == again


def test_what_is_put_aside_is_not_lost(lived: Lived) -> None:
    session = open_session(lived.path)
    every = [s for _, s in evaluate(session, lived.topics, lived.config, every=5)]
    assert len(every) == len(lived.snapshots) // 5
    for few, all_ in zip(every, lived.snapshots[4::5], strict=True):
        for name, state in few.machines.items():
            assert (state.pose.joints == all_.machines[name].pose.joints).all()
            counted = {k: s.received for k, s in state.pose.streams.items()}
            assert counted == {k: s.received for k, s in all_.machines[name].pose.streams.items()}


def test_merged_inputs_hold_everything_in_order(lived: Lived) -> None:
    several = [p.inputs for p in portions(open_session(lived.path), lived.topics)][100:110]
    several[3] = dataclasses.replace(several[3], malformed=(("left/x", 2),), lost=3)
    one = merged(several)
    assert one.samples == tuple(s for inputs in several for s in inputs.samples)
    assert one.malformed == (("left/x", 2),)
    assert one.lost == 3


def test_without_cycles_portions_are_of_one_period(lived: Lived, tmp_path: Path) -> None:
    session = open_session(without(tmp_path / "a.mcap", lived, CYCLE, SNAPSHOT))
    found = list(portions(session, lived.topics))
    times = [p.time for p in found]
    assert {b - a for a, b in pairwise(times)} == {PERIOD}
    assert abs(len(found) - len(lived.snapshots)) <= 3
    with_cycles = list(portions(open_session(lived.path), lived.topics))
    count = sum(len(p.inputs.samples) for p in with_cycles)
    assert abs(sum(len(p.inputs.samples) for p in found) - count) <= 60  # the last cycle's rest
    # From anywhere, the grid is the same.
    middle = session.begin + 5 * 10**9 + 7
    later = list(portions(session, lived.topics, start=middle))
    assert [p.time for p in later] == [t for t in times if t >= middle]
    last = [s for _, s in evaluate(session, lived.topics, lived.config)][-1]
    for name, state in last.machines.items():
        then = lived.snapshots[-1].machines[name].pose
        assert state.pose.validity == then.validity
        assert state.pose.joints == pytest.approx(then.joints, abs=0.03)


def test_malformed_messages_are_counted_as_live(lived: Lived, tmp_path: Path) -> None:
    session = open_session(lived.path)
    header = session.headers[0]
    for name, topics in (("with.mcap", ()), ("without.mcap", (CYCLE,))):
        writer = SessionWriter(tmp_path / name, header)
        for k, message in enumerate(session.messages()):
            if message.topic in topics:
                continue
            if message.topic == "/left/joint_states" and k % 50 == 0:
                message = Message(message.topic, message.time, b"\x00\x01\x02")
            writer.write(message)
        writer.close()
    recorded = [p.inputs for p in portions(open_session(tmp_path / "with.mcap"), lived.topics)]
    assert merged(recorded).malformed == ()  # the cycles' own messages would count them
    periods = [p.inputs for p in portions(open_session(tmp_path / "without.mcap"), lived.topics)]
    counts = merged(periods).malformed
    assert {key for key, _ in counts} == {"left/joint_states"}
    assert sum(n for _, n in counts) > 10


def test_documents_become_the_snapshots_that_they_were(lived: Lived) -> None:
    session = open_session(lived.path)
    compared = 0
    for message in session.messages(topics=[SNAPSHOT]):
        recorded = document(message.data)
        snapshot = recorded_snapshot(recorded, lived.config)
        # An alarm that lingers keeps its line, and no evidence.
        lingering = {
            (a["machine"], a["name"])
            for a in recorded["alarms"]
            if not any(
                (c["machine"], c["name"], c["level"]) == (a["machine"], a["name"], a["level"])
                for c in recorded["concerns"]
            )
        }
        again = snapshot_document(snapshot, lived.config)
        for one, other in zip(again["alarms"], recorded["alarms"], strict=True):
            if (other["machine"], other["name"]) in lingering:
                assert one["line"] == other["line"]
                one["detail"] = other["detail"]
        assert dumps(again) == dumps(recorded)
        compared += 1
    assert compared > 100
    assert set(snapshot.machines) == {"left", "right"}
    assert all(state.body is not None for state in snapshot.machines.values())


def test_null_in_a_document_means_what_it_meant(lived: Lived) -> None:
    """The API and other hosts write null where a value does not exist."""
    for snapshot in lived.snapshots[:1] + lived.snapshots[200::100]:
        recorded = json.loads(dumps(snapshot_document(snapshot, lived.config)))
        again = recorded_snapshot(recorded, lived.config)
        for name, state in snapshot.machines.items():
            ages = {k: s.age for k, s in state.pose.streams.items()}
            assert {k: s.age for k, s in again.machines[name].pose.streams.items()} == ages
        assert dumps(snapshot_document(again, lived.config)) == dumps(recorded)


def test_what_is_no_snapshot_is_said(lived: Lived) -> None:
    for broken in ({}, {"time": 1.0}, {"time": "x", "state_time": 0, "machines": []}):
        with pytest.raises(NotASnapshot):
            recorded_snapshot(broken, lived.config)


def test_problems_name_strangers_and_what_is_missing(lived: Lived, tmp_path: Path) -> None:
    session = open_session(without(tmp_path / "a.mcap", lived, "/left/gnss/fix"))
    assert problems(open_session(lived.path), lived.topics) == ()
    assert any("left: no positions" in text for text in problems(session, lived.topics))
    other = dataclasses.replace(lived.topics, machines={"left": "left"})
    assert any("/right/joint_states" in text for text in problems(session, other))
    nobody = dataclasses.replace(lived.topics, machines={"third": "third"})
    assert any("third: nothing was recorded" in text for text in problems(session, nobody))
