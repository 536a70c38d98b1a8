"""A session played: the cursor, and what every view sees at it."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lived import Lived, without

from backend.documents.snapshot import snapshot_document
from backend.errors import InputError
from backend.pipeline.records import Snapshot
from backend.shell.hub import Hub
from backend.shell.session.cycles import Topics, document
from backend.shell.session.format import CYCLE, SNAPSHOT, seconds
from backend.shell.session.player import Player
from backend.shell.session.reader import Session, open_session
from backend.shell.session.tracks import EvaluatedTrack, RecordedTrack

SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def session(lived: Lived) -> Session:
    return open_session(lived.path)


def as_judged(snapshot: Snapshot, lived: Lived) -> dict[str, Any]:
    """Without what the player itself counts, and without counters since the start."""
    found = snapshot_document(snapshot, lived.config)
    for gone in ("cycle", "mode", "health", "images"):
        del found[gone]
    for machine in found["machines"].values():
        del machine["received"], machine["rejected"]
    return found


class Playing:
    """A running player and all that it published."""

    def __init__(self, session: Session, lived: Lived, source: str, **options: Any) -> None:
        self.hub = Hub()
        self.seen: list[Snapshot] = []
        self.hub.listen(lambda: self.seen.append(self.hub.latest()))  # type: ignore[arg-type]
        self.player = Player(
            session, lived.topics, lived.config, self.hub, source=source, **options
        )
        self.player.start()
        self.wait(lambda: bool(self.seen))

    def wait(self, condition: Callable[[], bool], timeout: float = 60.0) -> None:
        deadline = time.monotonic() + timeout
        while not condition():
            assert not self.player.failure, self.player.failure
            assert time.monotonic() < deadline, self.player.status()
            time.sleep(0.01)

    def order(self, action: str, value: Any = None) -> dict[str, Any]:
        """Gives an order and waits until it is obeyed and shown."""
        before = len(self.seen)
        self.player.do(action, value)
        self.wait(lambda: not self.player._orders and len(self.seen) > before)
        # One more publication: the order may have been taken from the queue just now.
        after = len(self.seen)
        self.wait(lambda: len(self.seen) > after)
        return self.player.status()

    @property
    def now(self) -> Snapshot:
        return self.seen[-1]


@pytest.fixture(params=["recorded", "evaluated"])
def playing(request: pytest.FixtureRequest, session: Session, lived: Lived) -> Iterator[Playing]:
    running = Playing(session, lived, request.param)
    yield running
    running.player.stop()


def test_stepping_all_cycles_is_bit_by_bit_the_live_run(session: Session, lived: Lived) -> None:
    track = EvaluatedTrack(session, lived.topics, lived.config)
    assert track.seek(session.begin - 1) is None
    for expected in lived.snapshots[:150]:
        shown = track.step()
        assert shown is not None
        assert json.dumps(snapshot_document(shown.snapshot, lived.config)) == json.dumps(
            snapshot_document(expected, lived.config)
        )


def test_after_a_seek_poses_and_levels_are_what_they_were(session: Session, lived: Lived) -> None:
    track = EvaluatedTrack(session, lived.topics, lived.config)
    rng = np.random.default_rng(0)
    for target in rng.integers(session.begin + SECOND, session.end, 12):
        shown = track.seek(int(target))
        assert shown is not None
        local = seconds(int(target), session.offset)
        expected = [s for s in lived.snapshots if s.time <= local][-1]
        assert shown.snapshot.time == expected.time
        again, once = as_judged(shown.snapshot, lived), as_judged(expected, lived)
        assert json.dumps(again["machines"]) == json.dumps(once["machines"])
        for key in ("state_time", "pairs", "margins", "concerns"):
            assert json.dumps(again[key]) == json.dumps(once[key])
        # Not every cycle before is judged: an alarm about to go may have gone.
        active = [a for a in expected.alarms if a.active]
        found = {a.key for a in shown.snapshot.alarms if a.active}
        assert {a.key for a in active if expected.time - a.last < 0.8} <= found
        assert found <= {a.key for a in active}


def test_a_machine_that_fell_silent_stays_where_it_was_seen(lived: Lived, tmp_path: Path) -> None:
    """Long after its last message, a machine is still drawn where it was: STALE, not unknown."""
    source = open_session(lived.path)
    silent = source.begin + 3 * SECOND
    from backend.shell.session.writer import SessionWriter

    writer = SessionWriter(tmp_path / "a.mcap", source.headers[0])
    for message in source.messages():
        if not (message.topic.startswith("/right/") and message.time > silent):
            writer.write(message)
    writer.close()
    session = open_session(tmp_path / "a.mcap")
    shown = EvaluatedTrack(session, lived.topics, lived.config).seek(silent + 6 * SECOND)
    assert shown is not None
    state = shown.snapshot.machines["right"]
    assert state.pose.validity.value == "STALE"
    assert state.body is not None
    then = [s for s in lived.snapshots if s.time <= seconds(silent, session.offset)][-1]
    assert state.pose.joints == pytest.approx(then.machines["right"].pose.joints, abs=0.05)


def test_as_it_was_is_the_recorded_document(session: Session, lived: Lived) -> None:
    recorded = [(m.time, document(m.data)) for m in session.messages(topics=[SNAPSHOT])]
    track = RecordedTrack(session, lived.config)
    shown = track.seek(session.begin + 4 * SECOND)
    assert shown is not None
    expected = [d for t, d in recorded if t <= session.begin + 4 * SECOND][-1]
    assert json.dumps(shown.document) == json.dumps(expected)
    following = track.step()
    assert following is not None
    assert following.document is not None
    assert following.document["cycle"] == expected["cycle"] + 5


def test_paused_it_shows_the_same_again_and_again(playing: Playing) -> None:
    first = playing.now
    playing.wait(lambda: len(playing.seen) >= 4)
    last = playing.now
    assert last.cycle > first.cycle
    assert [s.cycle for s in playing.seen] == sorted({s.cycle for s in playing.seen})
    assert last.time == first.time
    ages = [
        [s.machines[n].pose.streams["joints"].age for n in ("left", "right")] for s in (first, last)
    ]
    assert ages[0] == ages[1]
    assert last.mode == "PLAYBACK"
    assert playing.player.status()["playing"] is False


def test_it_plays_in_real_time_and_stops_at_the_end(playing: Playing, session: Session) -> None:
    playing.order("seek", 2.0)
    start = time.monotonic()
    playing.player.do("play")
    playing.wait(lambda: playing.player.status()["time"] > 3.0)
    assert time.monotonic() - start > 0.9, "no faster than it was"
    playing.order("seek", (session.end - session.begin) / 1e9 - 0.3)
    playing.wait(lambda: not playing.player.status()["playing"])
    assert playing.player.status()["time"] == pytest.approx((session.end - session.begin) / 1e9)


def test_what_a_busy_computer_left_out_is_made_up_for(
    playing: Playing, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    playing.order("speed", 0.5)  # slow, so that any lag left would be seen before the end
    advance, held = playing.player._track.advance, {"turns": 0}

    def late(time_: int, merge: bool, deadline: float) -> tuple[Any, int]:
        if held["turns"] < 5:
            held["turns"] += 1
            time.sleep(0.1)
            return None, playing.player._cursor
        return advance(time_, merge, deadline)

    monkeypatch.setattr(playing.player._track, "advance", late)
    begun, start = playing.player.status()["time"], time.monotonic()
    playing.player.do("play")

    def lag() -> float:
        due = 0.5 * (time.monotonic() - start)
        return due - (playing.player.status()["time"] - begun)

    playing.wait(lambda: held["turns"] == 5)
    assert lag() > 0.2
    playing.wait(lambda: lag() < 0.1, timeout=5.0)


def test_at_real_time_every_cycle_is_judged(session: Session, lived: Lived) -> None:
    playing = Playing(session, lived, "evaluated")
    try:
        playing.player.do("play")
        playing.wait(lambda: playing.player.status()["time"] > 2.0)
        playing.order("pause")
        by_time = {s.time: s for s in lived.snapshots}
        assert len({s.time for s in playing.seen}) > 20
        for snapshot in playing.seen[::7]:
            assert json.dumps(as_judged(snapshot, lived)) == json.dumps(
                as_judged(by_time[snapshot.time], lived)
            )
    finally:
        playing.player.stop()


def test_step_and_back_by_a_cycle(playing: Playing, lived: Lived) -> None:
    cycles = 5 if playing.player.status()["source"] == "recorded" else 1
    playing.order("seek", 5.0)
    index = [s.time for s in lived.snapshots].index(playing.now.time)
    playing.order("step")
    assert playing.now.time == lived.snapshots[index + cycles].time
    playing.order("step")
    assert playing.now.time == lived.snapshots[index + 2 * cycles].time
    playing.order("back")
    assert playing.now.time == lived.snapshots[index + cycles].time
    for _ in range(3):
        playing.order("back")
    assert playing.now.time == lived.snapshots[index - 2 * cycles].time
    assert playing.player.status()["time"] == pytest.approx(
        5.0 - 0.02 * (5.0 * 50 % cycles) - 0.04 * cycles, abs=0.13
    )


def test_fast_playback_loses_no_sample(session: Session, lived: Lived) -> None:
    playing = Playing(session, lived, "evaluated")
    try:
        playing.order("speed", 8.0)
        playing.order("play")
        playing.wait(lambda: not playing.player.status()["playing"])
        last, expected = playing.now, lived.snapshots[-1]
        assert last.time == expected.time
        for name, state in last.machines.items():
            then = expected.machines[name].pose
            assert state.pose.joints == pytest.approx(then.joints, abs=1e-3)
            received = {k: s.received for k, s in state.pose.streams.items()}
            assert received == {k: s.received for k, s in then.streams.items()}
    finally:
        playing.player.stop()


def test_a_section_is_repeated(playing: Playing) -> None:
    playing.order("loop", [2.0, 2.5])
    playing.order("speed", 4.0)
    playing.player.do("play")
    times: list[float] = []

    def watched() -> bool:
        times.append(playing.player.status()["time"])
        return sum(b < a for a, b in pairwise(times)) >= 3

    playing.wait(watched)
    inside = times[times.index(min(t for t in times if t >= 2.0)) :]
    assert all(1.9 <= t <= 2.51 for t in inside[5:])
    assert playing.order("loop", None)["loop"] is None


def test_sources_are_switched_where_the_cursor_is(session: Session, lived: Lived) -> None:
    playing = Playing(session, lived, "recorded")
    try:
        playing.order("seek", 6.0)
        assert playing.player.recorded(playing.now.cycle) is not None
        recorded = playing.now
        assert playing.order("source", "evaluated")["source"] == "evaluated"
        assert playing.player.recorded(playing.now.cycle) is None
        assert abs(playing.now.time - recorded.time) < 0.11
        assert playing.player.status()["time"] == 6.0
    finally:
        playing.player.stop()


def test_next_and_previous_event(session: Session, lived: Lived) -> None:
    events = [session.begin + t * SECOND for t in (2, 4, 9)]
    playing = Playing(session, lived, "recorded", events=lambda: events)
    try:
        assert [playing.order("next")["time"] for _ in range(4)] == [2.0, 4.0, 9.0, 9.0]
        assert [playing.order("previous")["time"] for _ in range(3)] == pytest.approx(
            [4, 2, 0], abs=0.05
        )
    finally:
        playing.player.stop()


def test_seeks_far_outside_end_at_the_ends(playing: Playing, session: Session) -> None:
    duration = (session.end - session.begin) / 1e9
    assert playing.order("seek", 1e12)["time"] == pytest.approx(duration)
    assert playing.order("seek", -5.0)["time"] == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize(
    ("action", "value"),
    [
        ("fly", None),
        (None, None),
        ("seek", "soon"),
        ("seek", math.nan),
        ("seek", True),
        ("speed", 0.0),
        ("speed", 51.0),
        ("loop", [1.0]),
        ("loop", [1.0, 1.01]),
        ("loop", "all"),
        ("source", "imagined"),
    ],
)
def test_what_it_cannot_do_is_one_sentence(
    session: Session, lived: Lived, action: Any, value: Any
) -> None:
    player = Player(session, lived.topics, lived.config, Hub())
    with pytest.raises(InputError, match="allowed"):
        player.do(action, value)


def test_what_is_missing_is_said(session: Session, lived: Lived, tmp_path: Path) -> None:
    bare = open_session(without(tmp_path / "a.mcap", lived, SNAPSHOT, CYCLE))
    assert Player(bare, lived.topics, lived.config, Hub()).sources == ("evaluated",)
    with pytest.raises(InputError, match="allowed here are evaluated"):
        Player(bare, lived.topics, lived.config, Hub(), source="recorded")
    nobody = Topics({"third": "third"})
    with pytest.raises(InputError, match="nothing can be played"):
        Player(bare, nobody, lived.config, Hub())
