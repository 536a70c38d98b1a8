"""The alarm log: on disk line by line, never in the way, and it says when it cannot write."""

from __future__ import annotations

import json
import time
from pathlib import Path

import jsonschema
import numpy as np

from backend.documents.alarms import EpisodeDocument
from backend.pipeline.records import Health, Snapshot
from backend.safety.alarms import Alarm
from backend.safety.record import Concern, Evidence, Level
from backend.shell.alarm_log import AlarmLog


def snapshot(level: Level, distance: float, now: float) -> Snapshot:
    evidence = Evidence("left:bucket/0", "right:boom/1", distance, np.zeros((2, 3)), float("inf"))
    found = Concern("partner", "left", level, "", np.ones((4, 2)), np.ones(2), evidence, now)
    alarms = (Alarm(found, now, now, True),) if level > Level.CLEAR else ()
    return Snapshot(
        time=now,
        state_time=now,
        cycle=1,
        mode="LIVE",
        machines={},
        pairs=(),
        margins={},
        concerns=(found,),
        alarms=alarms,
        health=Health({}, {}, 0, {}),
    )


def written(path: Path, lines: int) -> list[dict[str, object]]:
    end = time.monotonic() + 10.0
    while time.monotonic() < end:
        if path.exists() and len(text := path.read_text().splitlines()) >= lines:
            return [json.loads(line) for line in text]
        time.sleep(0.01)
    raise AssertionError("nothing was written")


def test_what_ended_is_a_line_on_disk_and_what_lasts_is_told(tmp_path: Path) -> None:
    path = tmp_path / "site" / "alarms.jsonl"
    log = AlarmLog(path, {"left": "LEFT", "right": "RIGHT"}, lambda: 10.0, lambda: 1000.0)
    log.start()
    log.after_cycle(snapshot(Level.STOP, 0.1, 10.0))
    log.silence("partner", "left", "ann")
    (lasting,) = log.document()
    assert lasting["end"] is None
    assert lasting["begin"] == 1000.0
    log.after_cycle(snapshot(Level.CLEAR, 1.0, 12.0))
    (line,) = written(path, 1)
    jsonschema.validate(line, EpisodeDocument.model_json_schema())
    assert line["line"] == "STOP · LEFT bucket ↔ RIGHT boom · 0.10 m"
    assert line["end"] == 1002.0
    assert line["silenced_by"] == "ann"
    assert line["time_to_contact"] is None
    # What still lasts at the end is written, too.
    log.after_cycle(snapshot(Level.SLOW, 0.5, 13.0))
    log.close()
    assert [one["end"] for one in written(path, 2)] == [1002.0, None]


def test_a_disk_that_cannot_be_written_to_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    log = AlarmLog(tmp_path / "file" / "alarms.jsonl", {})
    log.start()
    log.after_cycle(snapshot(Level.SLOW, 0.5, 1.0))
    log.after_cycle(snapshot(Level.CLEAR, 1.0, 2.0))
    end = time.monotonic() + 10.0
    while not log.notices():
        assert time.monotonic() < end
        time.sleep(0.01)
    assert "alarms are not written" in log.notices()[0].line
    assert len(log.document()) == 1
    log.close()
