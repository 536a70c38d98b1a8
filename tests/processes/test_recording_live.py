"""Recording of the real processes over Zenoh: what is in it, and what a kill does to it."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from live import Backend, all_valid, frames, serve, simulated
from mcap.reader import make_reader
from program import cockpit
from rosbags.highlevel import AnyReader

from backend.shell.session.format import SCHEMAS

pytestmark = [pytest.mark.processes, pytest.mark.timeout(400)]
SITE = "demo"
MACHINES = ("left", "right")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Backend, Path]]:
    """A running backend with both machines, and its folder of recordings."""
    folder = tmp_path_factory.mktemp("recordings")
    with (
        serve(SITE, "--record", str(folder)) as station,
        simulated(SITE, station.endpoint, *MACHINES),
    ):
        station.wait_for(all_valid, timeout=150.0)
        yield station, folder


def post(station: Backend, path: str, document: dict[str, Any]) -> tuple[int, str]:
    request = urllib.request.Request(
        station.url + path,
        data=json.dumps(document).encode(),
        headers={"Content-Type": "application/json"},
    )
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def writer_of(folder: Path) -> int:
    """Process that has a part of a recording open."""
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        for process in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                for entry in (process / "fd").iterdir():
                    with contextlib.suppress(OSError):
                        target = os.readlink(entry)
                        if target.startswith(str(folder)) and target.endswith(".mcap"):
                            return int(process.name)
        time.sleep(0.05)
    raise AssertionError(f"nobody writes in {folder}")


def parts(folder: Path) -> list[Path]:
    return sorted((folder / SITE).glob("2*/part-*.mcap"))


def records(path: Path) -> Iterator[tuple[str, Any]]:
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            yield channel.topic, message


def rate(seen: list[dict[str, Any]]) -> float:
    """Cycles per second, by the backend's own clock."""
    return (seen[-1]["cycle"] - seen[0]["cycle"]) / (seen[-1]["time"] - seen[0]["time"])


def test_the_api_tells_marks_and_pins(recording: tuple[Backend, Path]) -> None:
    station, folder = recording
    writer_of(folder)
    state = station.get("/api/recording")
    jsonschema.validate(state, json.loads(cockpit("schema", "recording").stdout))
    assert state["state"] == "on"
    assert state["folder"] == str(folder / SITE)
    assert state["parts"] >= 1
    snapshot = station.get("/api/snapshot")
    jsonschema.validate(snapshot, json.loads(cockpit("schema", "snapshot").stdout))
    assert snapshot["recording"]["state"] == "on"
    assert snapshot["notices"] == []
    with station.socket() as page:
        page.send(json.dumps({"type": "marker", "text": "by the page"}))
        page.send(json.dumps({"type": "camera", "name": "plan", "page": "p1"}))
        next(frames(page, 5.0))
    assert post(station, "/api/recording/marker", {"text": "by the API"})[0] == 204
    assert post(station, "/api/recording/marker", {"text": ""})[0] == 422
    status, text = post(station, "/api/recording/pin", {"name": "kept", "minutes": 5})
    assert (status, json.loads(text)) == (200, {"folder": str(folder / SITE / "pinned" / "kept")})
    assert post(station, "/api/recording/pin", {"name": "kept", "minutes": 5})[0] == 422
    assert post(station, "/api/recording/pin", {"name": "../x", "minutes": 5})[0] == 422
    kept = folder / SITE / "pinned" / "kept"
    found: dict[str, list[Any]] = {}
    for path in sorted(kept.glob("*.mcap")):
        for topic, message in records(path):
            found.setdefault(topic, []).append(message.data)
    for topic in set(found) & set(SCHEMAS):
        validator = jsonschema.Draft202012Validator(SCHEMAS[topic])
        for data in found[topic][::20]:
            validator.validate(json.loads(data))
    texts = [json.loads(data)["text"] for data in found["/cockpit/marker"]]
    assert {"by the page", "by the API", "kept"} <= set(texts)
    assert "camera" in [json.loads(data)["action"] for data in found["/cockpit/action"]]
    assert {
        *("/cockpit/cycle", "/cockpit/clock", "/cockpit/snapshot", "/cockpit/alarm"),
        *(f"/{m}/{key}" for m in MACHINES for key in ("joint_states", "gnss/heading", "status")),
    } <= set(found)
    document = json.loads(found["/cockpit/snapshot"][-1])
    jsonschema.validate(document, json.loads(cockpit("schema", "snapshot").stdout))
    with AnyReader([kept]) as bag:  # as a bag of ROS 2
        connections = [c for c in bag.connections if c.topic == "/left/joint_states"]
        _, _, data = next(bag.messages(connections))
        assert len(bag.deserialize(data, connections[0].msgtype).position) == 4


def test_killing_the_writing_process_stops_nothing_and_loses_nothing(
    recording: tuple[Backend, Path],
) -> None:
    station, folder = recording
    for _ in range(3):
        pid = writer_of(folder)
        with station.socket() as page:
            before = [f for _, f in frames(page, 2.0)]
            os.kill(pid, signal.SIGKILL)
            killed = time.monotonic()
            told, after = None, []
            for at, frame in frames(page, 2.0):
                after.append(frame)
                if told is None and frame["notices"]:
                    told = at - killed
                    (notice,) = frame["notices"]
                    assert notice["key"] == "recording"
                    assert "ended and was started again" in notice["line"]
                    assert frame["recording"]["state"] == "trouble"
        assert told is not None
        assert told < 1.0
        # Cycles go on as before, on a computer that now also starts a process.
        assert rate(after) > 0.5 * rate(before)
        assert writer_of(folder) != pid
        station.wait_for(lambda s: s["notices"] == [], timeout=60.0)
    status, text = post(station, "/api/recording/pin", {"name": "all", "minutes": 60})
    assert status == 200, text
    cycles = []
    for path in sorted((folder / SITE / "pinned" / "all").glob("*.mcap")):
        cycles += [json.loads(m.data)["cycle"] for t, m in records(path) if t == "/cockpit/cycle"]
    assert cycles == list(range(cycles[0], cycles[0] + len(cycles)))
    assert cycles[-1] >= after[-1]["cycle"]


def test_killing_the_backend_leaves_whole_files(tmp_path: Path) -> None:
    with serve(SITE, "--record", str(tmp_path)) as station:
        pid = writer_of(tmp_path)
        station.wait_for(lambda s: s["cycle"] > 50)
        last = station.get("/api/snapshot")["cycle"]
        station.process.kill()
        deadline = time.monotonic() + 15.0
        while Path(f"/proc/{pid}").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
    cycles = [
        json.loads(m.data)["cycle"]
        for path in parts(tmp_path)
        for topic, m in records(path)
        if topic == "/cockpit/cycle"
    ]
    assert cycles == list(range(len(cycles)))
    assert cycles[-1] >= last - 10  # what was in the queue for a tenth of a second


def test_nothing_is_recorded_when_told_so(tmp_path: Path) -> None:
    arguments = ("--record", str(tmp_path), "--no-record")
    with serve(SITE, *arguments) as station:
        station.wait_for(lambda s: s["cycle"] > 5)
        state = station.get("/api/recording")
        assert (state["state"], state["folder"]) == ("off", None)
        assert "--no-record" in state["text"]
        status, text = post(station, "/api/recording/marker", {"text": "x"})
        assert status == 422
        assert "nothing is recorded" in text
    assert list(tmp_path.iterdir()) == []
