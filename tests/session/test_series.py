"""Time series, events and the diff of a session."""

from __future__ import annotations

import dataclasses
import json
import time
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from lived import Lived, without
from program import cockpit

from backend.documents.session import DiffDocument, SeriesDocument
from backend.errors import InputError
from backend.safety.partner import Limits
from backend.shell.app.wire import dumps
from backend.shell.session.cycles import document
from backend.shell.session.diff import diff
from backend.shell.session.events import Alarms, near_misses
from backend.shell.session.format import CYCLE, SNAPSHOT
from backend.shell.session.index import Index
from backend.shell.session.reader import open_session
from backend.shell.session.series import Row, SeriesBuilder, row_of_document, series_document


def test_minima_and_worst_levels_survive_fewer_points() -> None:
    rng = np.random.default_rng(0)
    builder, n = SeriesBuilder(), 5000
    clearance = rng.uniform(1.0, 5.0, n)
    clearance[1234] = 0.1
    clearance[2000:2050] = np.nan
    level = np.zeros(n)
    level[3333] = 2.0
    for k in range(n):
        values = {
            ("clearance", "a|b"): clearance[k],
            ("level", "a"): level[k],
            ("joint", "a", "x"): k,
        }
        builder.add(Row(k * 10**8, values))
    series = builder.series()
    found = series_document(series, 0, 0.0, 499.9, 100)
    SeriesDocument.model_validate(found)
    assert len(found["time"]) == 100
    assert min(v for v in found["clearance"]["a|b"] if v is not None) == pytest.approx(0.1)
    assert found["clearance"]["a|b"][40] is None
    assert found["levels"]["a"].count("STOP") == 1
    whole = series_document(series, 0, 123.0, 124.0, 100)
    assert len(whole["time"]) == 11
    assert whole["joints"]["a"]["x"] == list(range(1230, 1241))
    assert series_document(series, 0, 9000.0, 9001.0, 100)["time"] == []


def test_columns_that_come_late_or_end_early_keep_their_places() -> None:
    builder = SeriesBuilder()
    builder.add(Row(0, {("joint", "a", "x"): 1.0}))
    builder.add(Row(1, {("joint", "b", "x"): 2.0}))
    builder.add(Row(2, {("joint", "a", "x"): 3.0}))
    columns = builder.series().columns
    assert columns[("joint", "a", "x")].tolist()[::2] == [1.0, 3.0]
    assert np.isnan(columns[("joint", "a", "x")][1])
    assert np.isnan(columns[("joint", "b", "x")][[0, 2]]).all()


def test_each_level_of_an_alarm_is_an_event() -> None:
    alarms = Alarms()
    for at, level in ((1, None), (2, "SLOW"), (3, "SLOW"), (4, "STOP"), (5, None), (6, "SLOW")):
        alarms.at(at, [("left", "partner", level, f"{level} now")] if level else [])
    found = [(e.level, e.start, e.end) for e in alarms.close(9)]
    assert found == [("SLOW", 2, 4), ("STOP", 4, 5), ("SLOW", 6, 9)]


def test_near_misses_are_the_smallest_clearances() -> None:
    builder = SeriesBuilder()
    for k in range(100):
        distance = 0.5 - 0.4 * (k == 20) - 0.45 * (k == 21) + (k > 60) * 9 - 9.4 * (k == 90)
        builder.add(Row(k * 10**8, {("clearance", "a|b"): distance}))
    found = near_misses(builder.series(), 0.3)
    assert [e.start for e in found] == [21 * 10**8, 90 * 10**8]


def wait(index: Index, seconds: float = 120.0) -> None:
    deadline = time.monotonic() + seconds
    while index.state["state"] == "building":
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert index.state["state"] == "ready", index.problems()


@pytest.mark.parametrize("recorded", [True, False], ids=["as it was", "judged anew"])
def test_the_index_tells_what_happened(lived: Lived, tmp_path: Path, recorded: bool) -> None:
    path = lived.path if recorded else without(tmp_path / "a.mcap", lived, SNAPSHOT, CYCLE)
    session = open_session(path)
    index = Index(session, lived.topics, lived.config)
    try:
        index.start()
        wait(index)
        events = index.events()
        assert [e["start"] for e in events] == sorted(e["start"] for e in events)
        kinds = {(e["kind"], e["level"]) for e in events}
        assert {("alarm", "SLOW"), ("alarm", "STOP"), ("near miss", None), ("note", None)} <= kinds
        assert any(e["text"] == "half way" for e in events)
        closest = min(
            (s for s in lived.snapshots if s.pairs[0].distance == s.pairs[0].distance),
            key=lambda s: s.pairs[0].distance,
        )
        least = min(
            v
            for v in index.series(index.sources[0], 0.0, 99.0, 50)["clearance"]["left|right"]
            if v is not None
        )
        assert least == pytest.approx(closest.pairs[0].distance, abs=0.05)
        near = next(e for e in events if e["kind"] == "near miss")
        assert near["start"] == pytest.approx(closest.time - lived.snapshots[0].time, abs=0.3)
        assert index.event_times() == sorted(index.event_times())
    finally:
        index.close()


def test_a_series_says_what_the_snapshots_say(lived: Lived) -> None:
    session = open_session(lived.path)
    builder = SeriesBuilder()
    documents = [(m.time, document(m.data)) for m in session.messages(topics=[SNAPSHOT])]
    for at, one in documents:
        builder.add(row_of_document(at, one))
    found = series_document(builder.series(), session.begin, 0.0, 99.0, 10_000)
    assert len(found["time"]) == len(documents)
    last = documents[-1][1]
    assert found["joints"]["left"]["swing"][-1] == pytest.approx(
        last["machines"]["left"]["joints"]["swing"], abs=1e-4
    )
    assert found["levels"]["left"][-1] == last["concerns"][0]["level"]
    assert found["ages"]["right"]["joints"][-1] == pytest.approx(
        last["machines"]["right"]["ages"]["joints"], abs=1e-4
    )


def test_a_session_judged_by_the_same_program_does_not_differ(lived: Lived) -> None:
    result = diff(open_session(lived.path), lived.topics, lived.config)
    pair = result.distance.pairs["left|right"]
    assert result.compared == len(lived.snapshots) // 5
    assert pair.max_abs == 0.0
    assert pair.known_once == 0
    assert result.levels.agree == 1.0
    assert result.levels.differences == []
    assert all(w.recorded == w.evaluated is not None for w in result.first_warnings)
    assert {w.level for w in result.first_warnings} >= {"SLOW", "STOP", "UNKNOWN"}


def test_other_limits_show_as_differences(lived: Lived) -> None:
    wider = dataclasses.replace(lived.config, limits=Limits(1.5, 0.5))
    result = diff(open_session(lived.path), lived.topics, wider)
    assert result.distance.pairs["left|right"].max_abs == 0.0
    assert result.levels.agree < 1.0
    assert all(d.evaluated in ("SLOW", "STOP") for d in result.levels.differences)
    slow = {
        w.machine: (w.recorded, w.evaluated) for w in result.first_warnings if w.level == "SLOW"
    }
    for recorded, evaluated in slow.values():
        assert recorded is not None
        assert evaluated is not None
        assert evaluated < recorded


def test_a_diff_needs_both(lived: Lived, tmp_path: Path) -> None:
    bare = open_session(without(tmp_path / "a.mcap", lived, SNAPSHOT))
    with pytest.raises(InputError, match="needs recorded snapshots and poses"):
        diff(bare, lived.topics, lived.config)


def test_the_command_prints_the_document(lived: Lived, tmp_path: Path) -> None:
    done = cockpit("diff", str(lived.path), "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    jsonschema.validate(found, json.loads(cockpit("schema", "diff").stdout))
    assert DiffDocument.model_validate(found).state == "done"
    words = cockpit("diff", str(lived.path)).stdout
    assert "left and right: distances differ by at most 0.0 mm" in words
    missing = cockpit("diff", str(tmp_path / "none.mcap"))
    assert missing.returncode == 2
    assert "no such file" in missing.stderr
    bare = cockpit("diff", str(without(tmp_path / "a.mcap", lived, SNAPSHOT)))
    assert (bare.returncode, bare.stdout) == (2, "")


def test_a_failed_index_is_a_problem_and_no_crash(lived: Lived, tmp_path: Path) -> None:
    path = without(tmp_path / "a.mcap", lived)
    index = Index(open_session(path), lived.topics, lived.config)
    path.unlink()
    try:
        index.start()
        deadline = time.monotonic() + 60.0
        while index.state["state"] == "building":
            assert time.monotonic() < deadline
            time.sleep(0.05)
        assert index.state["state"] == "failed"
        assert any("no such file" in text for text in index.problems())
        assert dumps(index.events()) == "[]"
    finally:
        index.close()
