"""`cockpit play` as a process: it says PLAYBACK, obeys the page, and can reach no machine."""

from __future__ import annotations

import json
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from live import Backend, frames, playback
from program import cockpit
from websockets.sync.client import connect

from backend.shell.app.wire import decode
from backend.shell.link.session import open_session as open_link
from backend.shell.link.session import with_port
from backend.shell.session.synthetic import Script, synthesize
from backend.site.site import load_site
from cockpit.desk import load_models, make_config

pytestmark = [pytest.mark.processes, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    site = load_site("demo")
    config = make_config(site, load_models(site), (), "DEMO")
    found = tmp_path_factory.mktemp("playback") / "near-miss.mcap"
    synthesize(found, site, config, Script(duration=9.0, begin=18.0))
    return found


@pytest.fixture(scope="module")
def playing(path: Path) -> Iterator[Backend]:
    with playback(path) as running:
        yield running


def order(backend: Backend, action: str, value: Any = None, /, **shown: Any) -> dict[str, Any]:
    """Gives an order on a page's websocket; the first snapshot whose playback says `shown`."""
    with backend.socket() as socket:
        socket.send(json.dumps({"type": "playback", "do": action, "value": value}))
        header: dict[str, Any] = {}
        for _, header in frames(socket, 90.0):
            if all(header["playback"][key] == wanted for key, wanted in shown.items()):
                return header
    raise AssertionError(f"{action} {value}: {header.get('playback')}")


def test_the_page_says_playback(playing: Backend) -> None:
    assert playing.get("/api/site")["mode"] == "PLAYBACK"
    with playing.socket() as socket:
        header = next(header for _, header in frames(socket, 20.0))
    assert header["mode"] == "PLAYBACK"
    assert header["playback"]["duration"] == pytest.approx(9.0, abs=0.2)
    assert header["playback"]["sources"] == ["recorded", "evaluated"]
    document = playing.get("/api/snapshot")
    jsonschema.validate(document, json.loads(cockpit("schema", "snapshot").stdout))
    assert playing.get("/api/health")["mode"] == "PLAYBACK"


def test_seek_pause_speed_and_source_are_obeyed(playing: Backend) -> None:
    order(playing, "pause", playing=False)
    snapshot = order(playing, "seek", 5.0, time=5.0)
    assert snapshot["playback"]["playing"] is False
    then = snapshot["machines"]["left"]["joints"]
    later = order(playing, "seek", 8.0, time=8.0)
    assert later["machines"]["left"]["joints"] != then
    judged = order(playing, "source", "evaluated", source="evaluated")
    assert judged["playback"]["time"] == 8.0
    again = order(playing, "seek", 5.0, time=5.0)["machines"]["left"]["joints"]
    assert again == pytest.approx(then, abs=0.1)
    order(playing, "speed", 4.0, speed=4.0)
    order(playing, "speed", 4000.0)
    order(playing, "loop", [1.0, 2.0], loop=[1.0, 2.0], speed=4.0)  # 4000 is not allowed
    order(playing, "loop", None, loop=None)
    order(playing, "speed", 1.0, speed=1.0)
    order(playing, "source", "recorded", source="recorded")


def test_the_session_and_its_series_are_what_their_schemas_say(playing: Backend) -> None:
    deadline = time.monotonic() + 120.0
    while (session := playing.get("/api/session"))["index"]["state"] == "building":
        assert time.monotonic() < deadline
        time.sleep(0.2)
    assert session["index"] == {"state": "ready", "progress": 1.0}
    jsonschema.validate(session, json.loads(cockpit("schema", "session").stdout))
    assert {"alarm", "near miss", "note"} <= {event["kind"] for event in session["events"]}
    assert session["problems"] == []
    series = playing.get("/api/session/series?start=2&end=6&points=20")
    jsonschema.validate(series, json.loads(cockpit("schema", "series").stdout))
    assert len(series["time"]) == 20
    assert series["clearance"]["left|right"][-1] > 0.0


def test_the_diff_runs_beside(playing: Backend) -> None:
    assert playing.get("/api/session/diff")["state"] == "none"
    request = urllib.request.Request(playing.url + "/api/session/diff", method="POST")
    with urllib.request.urlopen(request, timeout=10) as answer:
        assert answer.status == 202
    deadline = time.monotonic() + 500.0
    while (found := playing.get("/api/session/diff"))["state"] == "running":
        assert time.monotonic() < deadline
        time.sleep(0.3)
    jsonschema.validate(found, json.loads(cockpit("schema", "diff").stdout))
    assert found["state"] == "done", found
    assert found["result"]["distance"]["pairs"]["left|right"]["max_abs"] == 0.0


def test_next_event_is_two_actions_away(playing: Backend) -> None:
    order(playing, "pause", playing=False)
    events = [e for e in playing.get("/api/session")["events"] if e["kind"] != "action"]
    order(playing, "seek", 1.0, time=1.0)
    first = min(e["start"] for e in events if e["start"] > 1.06)
    with playing.socket() as socket:
        socket.send(json.dumps({"type": "playback", "do": "next"}))
        times = (header["playback"]["time"] for _, header in frames(socket, 90.0))
        assert next(t for t in times if t != 1.0) == pytest.approx(first, abs=1e-3)


def test_what_starts_after_the_page_comes_by_itself(playing: Backend) -> None:
    """The scene, and what judges postures."""
    refusals: list[tuple[int, bool]] = []

    def scene() -> bool:
        with urllib.request.urlopen(playing.url + "/view/", timeout=10) as answer:
            return bool(answer.status == 200)

    def judged() -> bool:
        question = json.dumps({"machine": "left", "joints": {}}).encode()
        headers = {"Content-Type": "application/json"}
        request = urllib.request.Request(playing.url + "/api/whatif", question, headers)
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                return "checked_by" in json.loads(answer.read())
        except urllib.error.HTTPError as error:
            refusals.append((error.code, b"still being loaded" in error.read()))
            return False

    for come in (scene, judged):
        deadline = time.monotonic() + 120.0
        while not come():
            assert time.monotonic() < deadline
            time.sleep(0.2)
    assert set(refusals) <= {(422, True)}
    assert playing.get("/api/health")["backend"]["failure"] == ""


def test_commands_reach_nobody(playing: Backend) -> None:
    """There is no link at all in this process, and whoever listens around it hears nothing."""
    maps = Path(f"/proc/{playing.process.pid}/maps").read_text()
    assert "zenoh" not in maps, "the library is not even loaded"
    heard: list[Any] = []
    endpoint = with_port("tcp/127.0.0.1:0")
    with open_link(listen=[endpoint], mode="router") as link:
        subscriber = link.declare_subscriber(
            "**", lambda sample: heard.append(str(sample.key_expr))
        )
        before = order(playing, "pause", playing=False)["playback"]
        with connect(playing.url.replace("http", "ws") + "/ws", max_size=None) as socket:
            for message in (
                {"type": "command", "machine": "left", "joints": {"swing": 1.0}},
                {"type": "cmd", "machine": "left", "velocity": [1.0], "name": ["swing"]},
                {"type": "marker", "text": "hello"},
                {"type": "stop"},
            ):
                socket.send(json.dumps(message))
            kinds = set()
            deadline = time.monotonic() + 2.0
            while time.monotonic() < deadline:
                frame = socket.recv(timeout=10.0)
                assert isinstance(frame, bytes)
                kinds.add(decode(frame)[0]["type"])
        assert kinds <= {"site", "snapshot", "sun", "exact", "zone", "regions"}, kinds
        after = playing.get("/api/snapshot")["playback"]
        assert after["time"] == before["time"]
        subscriber.undeclare()
    assert heard == []


def test_mistakes_are_one_sentence(path: Path, tmp_path: Path) -> None:
    for arguments, words in (
        (("play", str(tmp_path / "none.mcap")), "no such file"),
        (("play", str(path), "--site", "nowhere"), "no site called"),
        (("play", str(path), "--source", "dreamt"), "allowed are recorded, evaluated"),
    ):
        done = cockpit(*arguments, "--no-browser", "--port", "0")
        assert done.returncode == 2
        assert words in done.stderr
        assert done.stderr.count("\n") == 1
