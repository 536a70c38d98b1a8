"""A manoeuvre over a step through the real processes: accepted, followed on real ground, let go,
stopped, without data; and afterwards a session that plays back.
"""

from __future__ import annotations

import json
import math
import signal
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live import Backend, all_valid, serve, simulated
from operators import Operator
from wiretap import Wiretap

from backend.documents.snapshot import snapshot_document
from backend.shell.app.wire import dumps
from backend.shell.session.cycles import Topics
from backend.shell.session.evaluate import evaluate
from backend.shell.session.format import SNAPSHOT
from backend.shell.session.reader import open_session
from backend.shell.session.recorded_snapshot import recorded_snapshot
from backend.site.site import load_site
from cockpit.desk import load_models, make_config

pytestmark = [pytest.mark.processes, pytest.mark.timeout(900)]
LONG = 400.0  # [s] for what takes 70 s on a computer of its own
HEIGHT = 0.25
SITE = f"""
name = "step"
title = "A mini before a step"

[frame]
epsg = 32652
origin = [308600.0, 4129950.0, 0.0]
geoid_offset = 0.0
heading_reference = "grid"

[safety]
eta = 0.10
slow_below = 0.8
stop_below = 0.2

[sim]
joint_period = 0.01
position_period = 0.05
heading_period = 0.05
position_noise = 0.01
heading_noise_deg = 0.05
joint_noise_deg = 0.02
radio_period = 0.020
latency = 0.050

[[machine]]
name = "left"
label = "LEFT"
model = "mini"
payload = 0.0

[machine.start]
position = [308605.0, 4129955.0, 0.0]
yaw_deg = 0.0
joints_deg = {{ swing = 0.0, boom = 40.107, stick = -91.673, bucket = -34.377 }}

[machine.sim]
program = "hold"
ground = "contact"
seed = 1

[[obstacle]]
name = "step"
center = [308610.84, 4129955.0, {0.5 * HEIGHT}]
half_extents = [4.0, 4.0, {0.5 * HEIGHT}]
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Backend]:
    folder = tmp_path_factory.mktemp("step")
    (folder / "step.toml").write_text(SITE)
    with serve(str(folder / "step.toml"), "--record", str(folder / "recorded")) as running:
        running.folder = folder  # type: ignore[attr-defined]
        yield running


@pytest.fixture
def machine(station: Backend) -> Iterator[Any]:
    """Switched on anew, before the step."""
    with simulated(str(station.folder / "step.toml"), station.endpoint, "left") as processes:  # type: ignore[attr-defined]
        station.wait_for(lambda s: all_valid(s) and abs(s["machines"]["left"]["pitch"]) < 0.02)
        yield processes["left"]


@pytest.fixture
def climber(station: Backend, machine: Any) -> Iterator[Climber]:
    with Wiretap(station.endpoint, "left") as tap:
        opened = Climber(station, tap)
        yield opened
        opened.close()


class Climber(Operator):
    """An operator who takes LEFT over the step."""

    def __init__(self, station: Backend, tap: Wiretap) -> None:
        super().__init__(station)
        self.station, self.tap = station, tap

    def post(self, path: str, document: dict[str, Any]) -> None:
        request = urllib.request.Request(
            self.station.url + path,
            data=json.dumps(document).encode(),
            headers={"Content-Type": "application/json"},
        )
        with urllib.request.urlopen(request, timeout=20) as answer:
            assert answer.status == 200

    def offer(self) -> dict[str, Any]:
        return dict(self.snapshot.get("surmounts", {}).get("left", {}))

    def follow(self) -> dict[str, Any]:
        return dict(self.seat.get("follow", {}).get("left", {}))

    def ended(self) -> bool:
        return bool(self.follow().get("ended"))

    def lines(self) -> list[str]:
        return [alarm["line"] for alarm in self.snapshot["alarms"] if alarm["active"]]

    def phase(self) -> str:
        found = self.snapshot.get("surmounting", {}).get("left", {})
        return str(found.get("phase", ""))

    def accept(self) -> None:
        """Asks for a manoeuvre until one is on offer, and accepts it."""
        self.take("left")
        if self.state("left") == "Stop":  # of the test before: it is the machine's
            self.say("reset")
            self.wait(lambda: self.state("left") == "Idle")
        before, until = self.offer().get("plan"), time.monotonic() + LONG
        while self.offer().get("plan") == before or self.offer()["state"] != "offered":
            assert time.monotonic() < until, self.offer()
            if self.offer().get("state") != "planning":
                self.post("/api/surmount", {"machine": "left", "obstacle": "step"})
            time.sleep(2.0)
        self.say("follow", do="accept", machine="left", plan=self.offer()["plan"])
        self.wait(lambda: bool(self.follow()) and not self.ended())

    def hold(self, until: Callable[[], bool]) -> None:
        """The dead-man, pressed anew whenever a busy computer paused it."""
        end = time.monotonic() + LONG
        while not until():
            assert time.monotonic() < end, (self.follow(), self.offer(), self.lines())
            assert not self.ended() or until(), (self.follow(), self.lines())
            if self.state("left") not in ("Enabled", "Active") or self.shut("left"):
                self.enable("left")
            time.sleep(0.02)

    def stands(self, seconds: float = 1.5) -> None:
        """Joints, tracks and base, for that long."""
        self.wait(lambda: self.tap.speed() < 0.01, LONG)
        time.sleep(0.5)
        before = self.tap.truths[-1]
        time.sleep(seconds)
        after = self.tap.truths[-1]
        np.testing.assert_allclose(after.position, before.position, atol=0.004)
        np.testing.assert_allclose(after.base, before.base, atol=0.01)
        assert abs(after.pitch - before.pitch) < math.radians(0.3)
        assert abs(after.travel_left) + abs(after.travel_right) < 0.01

    def pitch(self) -> float:
        return float(self.tap.truths[-1].pitch)


def test_it_climbs_let_go_stands_and_the_session_plays_back(
    station: Backend, climber: Climber
) -> None:
    climber.accept()
    assert abs(climber.tap.truths[-1].base[2]) < 0.01
    climber.hold(lambda: climber.phase() == "sequence 1" and climber.pitch() > math.radians(4.0))
    # Half way up it is let go: everything stands where it is, leaning, until the next press.
    climber.move(enable=False)
    climber.stands()
    assert climber.pitch() > math.radians(4.0)
    assert not climber.ended()
    assert any(line.startswith("SLOW · LEFT on step · margin") for line in climber.lines())
    seen: set[str] = set()
    levels: set[tuple[str, str]] = set()

    def over() -> bool:
        snapshot = climber.snapshot
        if "surmounting" in snapshot:  # afterwards it stands on an ordinary obstacle
            seen.add(snapshot["surmounting"]["left"]["phase"])
            levels.update((c["name"], c["level"]) for c in snapshot["concerns"])
        return climber.ended()

    climber.hold(over)
    assert climber.follow()["arrived"], (climber.follow(), climber.lines())
    climber.move(enable=False)
    assert {"sequence 1", "turn", "sequence 2-1", "sequence 2-2", "stow"} <= seen
    assert ("site", "STOP") not in levels
    assert ("surmounting", "STOP") not in levels
    climber.stands()
    truth = climber.tap.truths[-1]
    assert truth.base[2] == pytest.approx(HEIGHT, abs=0.01)
    assert abs(truth.pitch) < math.radians(0.5)
    pose = climber.snapshot["machines"]["left"]
    assert pose["position"][2] == pytest.approx(HEIGHT, abs=0.04)
    assert "surmounting" not in climber.snapshot
    assert climber.snapshot["backend"]["failure"] == ""
    _plays_back(station)


def test_stop_ends_it_half_way_and_nothing_moves(climber: Climber) -> None:
    climber.accept()
    climber.hold(lambda: climber.phase() == "sequence 1" and climber.pitch() > math.radians(5.0))
    climber.say("stop")
    climber.wait(climber.ended, 5.0)
    assert climber.follow()["ended"] == "Stop"
    climber.stands()
    assert climber.pitch() > math.radians(4.0)
    # The step is an ordinary obstacle again, and the dead-man moves nothing.
    climber.wait(lambda: "surmounting" not in climber.snapshot)
    climber.wait(lambda: any(c["level"] == "STOP" for c in climber.snapshot["concerns"]))
    climber.move(enable=False)
    time.sleep(0.3)
    climber.move(enable=True)
    climber.stands()
    # Nobody has to leave it there: reset and accepted once more, it goes on from where it is.
    climber.move(enable=False)
    plan, at = climber.offer()["plan"], climber.follow()["at"]
    climber.wait(lambda: climber.offer()["state"] == "offered")
    climber.say("reset")
    climber.wait(lambda: climber.state("left") == "Idle")
    climber.say("follow", do="accept", machine="left", plan=plan)
    climber.wait(lambda: not climber.ended())
    climber.hold(lambda: climber.follow()["at"] > at + 2.0)
    climber.move(enable=False)
    climber.stands()
    assert climber.pitch() > math.radians(4.0)


def test_without_data_it_stands_and_goes_on_only_when_pressed_anew(
    climber: Climber, machine: Any
) -> None:
    climber.accept()
    climber.hold(lambda: climber.phase() == "sequence 1" and climber.pitch() > math.radians(5.0))
    at = climber.follow()["at"]
    machine.send_signal(signal.SIGSTOP)
    try:
        climber.wait(lambda: climber.state("left") not in ("Enabled", "Active"), 10.0)
        climber.wait(
            lambda: any(c["level"] == "UNKNOWN" for c in climber.snapshot["concerns"]), 10.0
        )
    finally:
        machine.send_signal(signal.SIGCONT)
    climber.wait(lambda: climber.snapshot["machines"]["left"]["validity"] == "VALID", LONG)
    climber.stands()
    assert climber.state("left") not in ("Enabled", "Active"), "it armed itself"
    if not climber.ended():
        climber.hold(lambda: climber.follow()["at"] > at + 1.0)


def _plays_back(station: Backend) -> None:
    """Judged again, and as it was: the base's pitch and height, and what was concluded of them."""
    folder: Path = station.folder  # type: ignore[attr-defined]
    site = load_site(str(folder / "step.toml"))
    config = make_config(site, load_models(site), (), "LIVE")
    deadline = time.monotonic() + 30.0
    while True:
        (recorded,) = sorted((folder / "recorded" / "step").glob("2*"))
        session = open_session(recorded)
        shown = {}
        for message in session.messages(None, None, [SNAPSHOT]):
            document = json.loads(message.data)
            shown[document["cycle"]] = document
        heights = [d["machines"]["left"].get("position", [0, 0, 0])[2] for d in shown.values()]
        if heights and max(h or 0.0 for h in heights) > HEIGHT - 0.05:
            break
        assert time.monotonic() < deadline, max(heights)
        time.sleep(1.0)
    compared = climbing = 0
    pitches = []
    for _, again in evaluate(session, Topics.of(site, session), config):
        pitches.append(again.machines["left"].pose.pitch)
        once = shown.get(again.cycle)
        if once is None:
            continue
        compared += 1
        climbing += "surmounting" in once
        told = json.loads(dumps(snapshot_document(again, config)))
        for key in ("machines", "concerns", "stability", "surmounting"):
            assert told.get(key) == once.get(key), (again.cycle, key)
        as_it_was = recorded_snapshot(once, config)
        assert as_it_was.surmounting == again.surmounting
    assert compared > 100
    assert climbing > 50
    assert np.nanmax(pitches) > math.radians(10.0)
