"""GET /metrics through the real web server: who may read it, and what stands there."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from backend.errors import InputError
from backend.pipeline.people_records import NOBODY, People
from backend.shell.app.app import Sources, create_app
from backend.shell.app.feed import Frames
from backend.shell.app.metrics import Metric, exposition, metrics_router, read_token
from backend.shell.app.server import WebServer, bind
from backend.shell.hub import Hub
from backend.shell.session.tracks import recorded
from cockpit.playback import see

TOKEN = "0123456789abcdef0123"
LINE = re.compile(r'([a-z_]+)\{((?:[a-z]+="(?:[^"\\]|\\.)*",?)*)\} (\S+)')


class Served:
    """A running app with a hub that the test fills."""

    def __init__(self, token: str) -> None:
        self.hub = Hub()
        self.recorder = {"state": "on", "text": "since noon"}
        self.failure = ""
        frames = Frames(self.hub, lambda snapshot: {"cycle": snapshot.cycle})
        timing = {"p50": 4.0, "p95": 6.0, "p99": 8.0, "rate": 50.0}
        backend = lambda: {"step": timing, "images": timing, "failure": self.failure}  # noqa: E731
        sources = Sources(
            site={"mode": "LIVE", "machines": {}},
            frames=frames,
            backend=backend,
            on_message=lambda _: None,
            what_if=lambda *_: {},
        )
        router = metrics_router(frames, backend, lambda: self.recorder, token)
        self.web = WebServer(create_app(sources, routers=(router,)), bind("127.0.0.1", 0))
        self.web.start()

    def get(self, authorization: str | None = f"Bearer {TOKEN}") -> httpx.Response:
        headers = {} if authorization is None else {"Authorization": authorization}
        url = f"http://127.0.0.1:{self.web.port}/metrics"
        return httpx.get(url, headers=headers, trust_env=False)

    def values(self) -> dict[tuple[str, frozenset[tuple[str, str]]], float]:
        found = {}
        for line in self.get().text.splitlines():
            if line.startswith("#"):
                continue
            match = LINE.fullmatch(line)
            assert match is not None, line
            labels = frozenset(re.findall(r'([a-z]+)="((?:[^"\\]|\\.)*)"', match[2]))
            found[match[1], labels] = float(match[3])
        return found


@pytest.fixture
def served() -> Iterator[Served]:
    made = Served(TOKEN)
    yield made
    made.web.stop()


@pytest.fixture(scope="module")
def snapshot(repository: Path) -> Any:
    seen = see(repository / "scenes" / "sessions" / "near-miss.mcap", None)
    return next(recorded(seen.session, seen.config))[1]


def key(name: str, **labels: str) -> tuple[str, frozenset[tuple[str, str]]]:
    return name, frozenset(labels.items())


@pytest.mark.parametrize(
    "authorization", [None, "", "Bearer", "Bearer x", f"Basic {TOKEN}", f"Bearer {TOKEN}0", TOKEN]
)
def test_only_the_token_opens_it(served: Served, authorization: str | None) -> None:
    answer = served.get(authorization)
    assert answer.status_code == 401
    assert answer.headers["www-authenticate"] == "Bearer"
    assert "cockpit_" not in answer.text


def test_without_a_token_there_is_nothing() -> None:
    made = Served("")
    try:
        for authorization in (None, "Bearer", f"Bearer {TOKEN}"):
            assert made.get(authorization).status_code == 404
    finally:
        made.web.stop()


def test_before_the_first_snapshot(served: Served) -> None:
    answer = served.get()
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    values = served.values()
    assert values[key("cockpit_snapshot_age_seconds")] == math.inf
    assert values[key("cockpit_clients")] == 0.0
    assert values[key("cockpit_loop_seconds", loop="step", quantile="0.99")] == 0.008
    assert values[key("cockpit_loop_rate_hertz", loop="images")] == 50.0
    assert values[key("cockpit_failure")] == 0.0
    served.failure = "images: gone"
    served.recorder = {"state": "trouble", "text": "disk full"}
    values = served.values()
    assert values[key("cockpit_failure")] == 1.0
    assert values[key("cockpit_recorder", state="trouble")] == 1.0
    assert values[key("cockpit_recorder", state="on")] == 0.0


def test_machines_streams_and_counters(served: Served, snapshot: Any) -> None:
    health = replace(
        snapshot.health, malformed={'left/"odd\\\n': 3}, foreign={"stranger": 2}, lost=7
    )
    served.hub.publish(replace(snapshot, health=health))
    values = served.values()
    for name, state in snapshot.machines.items():
        pose = state.pose
        assert values[key("cockpit_pose_validity", machine=name, validity=pose.validity.value)]
        assert sum(v for (n, at), v in values.items() if n == "cockpit_pose_validity") == len(
            snapshot.machines
        )
        for stream, status in pose.streams.items():
            where = {"machine": name, "stream": stream}
            assert values[key("cockpit_stream_age_seconds", **where)] == status.age
            assert values[key("cockpit_stream_received_total", **where)] == status.received
            assert values[key("cockpit_stream_rejected_total", **where)] == status.rejected
    assert values[key("cockpit_malformed_total", key='left/\\"odd\\\\\\n')] == 3.0
    assert values[key("cockpit_foreign_total", prefix="stranger")] == 2.0
    assert values[key("cockpit_lost_total")] == 7.0
    assert values[key("cockpit_alarms")] == len(snapshot.alarms)
    assert 0.0 <= values[key("cockpit_snapshot_age_seconds")] < 60.0


def test_every_name_is_explained_once_and_typed(served: Served, snapshot: Any) -> None:
    served.hub.publish(snapshot)
    lines = served.get().text.splitlines()
    names = [line.split("{")[0] for line in lines if not line.startswith("#")]
    helped = [line.split()[2] for line in lines if line.startswith("# HELP")]
    typed = {line.split()[2]: line.split()[3] for line in lines if line.startswith("# TYPE")}
    assert sorted(set(names)) == sorted(helped) == sorted(typed)
    for name, kind in typed.items():
        assert (kind == "counter") == name.endswith("_total")


def test_values_that_are_no_numbers() -> None:
    metric = Metric("x", "gauge", "Words.")
    for value in (math.nan, math.inf, -math.inf, True):
        metric.add(value)
    assert [line.split()[1] for line in exposition([metric]).splitlines()[2:]] == [
        *("NaN", "+Inf", "-Inf", "1.0")
    ]


def test_a_token_file_is_private_and_long_enough(tmp_path: Path) -> None:
    path = tmp_path / "token"
    with pytest.raises(InputError, match="cannot be read"):
        read_token(path)
    path.write_text(TOKEN + "\n")
    path.chmod(0o644)
    with pytest.raises(InputError, match="can be read by others"):
        read_token(path)
    path.chmod(0o600)
    assert read_token(path) == TOKEN
    for text in ("short", "with spaces in between them", "ä" * 20, ""):
        path.write_text(text)
        with pytest.raises(InputError, match="holds no token"):
            read_token(path)


def test_people_are_counted_where_somebody_watches(served: Served, snapshot: Any) -> None:
    served.hub.publish(snapshot)
    assert not [name for name, _ in served.values() if name.startswith("cockpit_people")]
    some = replace(NOBODY, id=np.arange(3), kind=("person", "object", "person"))
    for reason, known in (("", 1.0), ("no LiDAR data for 0.8 s", 0.0)):
        served.hub.publish(replace(snapshot, people=People(reason, 0.25, tracked=some)))
        values = served.values()
        assert values[key("cockpit_people_known")] == known
        assert values[key("cockpit_people_age_seconds")] == 0.25
        assert values[key("cockpit_people_tracks", kind="person")] == 2.0
        assert values[key("cockpit_people_tracks", kind="object")] == 1.0
        assert values[key("cockpit_people_lost")] == 0.0
