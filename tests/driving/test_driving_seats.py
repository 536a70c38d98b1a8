"""Seats, leases, console and limiter together, in made-up time."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_leases import Radio

from backend.control.latency import Condition
from backend.control.patterns import Method
from backend.control.person import OPERATOR, SUPERVISOR, VIEWER, Person
from backend.machine.load import load_machine
from backend.planning.records import Thresholds
from backend.safety.limiter import Decision, Wish
from backend.safety.record import Concern, Level
from backend.shell.app.driving_models import SeatModel
from backend.shell.driving.driving import Driving
from backend.shell.driving.leases import Leases
from backend.shell.driving.methods import Told

MINI = load_machine("mini")
N = len(MINI.joints)
MIDDLE = 0.5 * (np.clip(MINI.lower, -1.0, None) + np.clip(MINI.upper, None, 1.0))
GOOD = Condition(0.1, "slow", "")
LEVERS = ("left_x", "left_y", "right_x", "right_y", "track_left", "track_right")


class Outlet:
    """Keeps what would be sent."""

    def __init__(self) -> None:
        self.sent: list[tuple[Decision, str, int]] = []
        self.link = GOOD

    def send(self, decision: Decision, holder: str, token: int) -> None:
        self.sent.append((decision, holder, token))

    def hear(self, status: Any) -> None: ...

    def condition(self, now: float) -> Condition:
        return self.link

    def close(self) -> None: ...


class Methods:
    """Leaves a share of the joints' wish, and notes what it was asked for."""

    def __init__(self) -> None:
        self.share = 0.5
        self.asked: list[tuple[Method, bool]] = []

    def shape(
        self, name: str, method: Method, wish: Wish, snapshot: Any, overridden: bool
    ) -> tuple[Wish, Told]:
        self.asked.append((method, overridden))
        if method is Method.BRAKING:
            return wish, Told(method, Thresholds())
        why = (f"stick of {name} to gauge:T1 0.31 m",)
        told = Told(method, Thresholds(0.9, 0.3), self.share, why, ("swing needs 3.55 m",))
        return replace(wish, joints=self.share * wish.joints), told


class Cockpit:
    """One cockpit and one machine, a cycle every 20 ms."""

    def __init__(self) -> None:
        self.radio = Radio()
        self.radio.now = 100.0
        self.outlet = Outlet()
        self.methods = Methods()
        self.events: list[tuple[str, str, dict[str, Any]]] = []
        leases = Leases(self.radio.ask, self.radio.clock)
        self.driving = Driving(
            {"left": MINI},
            {"left": self.outlet},  # type: ignore[dict-item]
            leases,
            dict,
            self.methods,  # type: ignore[arg-type]
            lambda *event: self.events.append(event),
            self.radio.clock,
        )
        self.level, self.allowed = Level.CLEAR, 1.0
        self.levers: dict[str, dict[str, Any]] = {}
        self.sequence = 0

    def sit(self, role: str = OPERATOR, who: str = "ann") -> str:
        seat = self.driving.open(Person(who, role))
        self.levers[seat] = {
            **dict.fromkeys(LEVERS, 0.0),
            "enable": False,
            "focus": True,
            "gamepad": True,
            "override": False,
        }
        return seat

    def say(self, seat: str, kind: str, **more: Any) -> bool:
        return self.driving.on_message(seat, {"type": kind, **more})

    def run(self, cycles: int = 5, period: float = 0.02) -> None:
        for _ in range(cycles):
            self.radio.run(period, self.driving)
            for seat, levers in self.levers.items():
                self.sequence += 1
                self.say(seat, "sticks", seq=self.sequence, **levers)
            allowed = np.full((N, 2), self.allowed)
            concern = Concern(
                "partner", "left", self.level, "why", allowed, np.ones(2) * self.allowed, None,
                self.radio.now,
            )  # fmt: skip
            snapshot = SimpleNamespace(
                time=self.radio.now,
                machines={"left": SimpleNamespace(pose=SimpleNamespace(joints=MIDDLE))},
                concerns=(concern,),
            )
            self.driving.cycle(snapshot)  # type: ignore[arg-type]

    def move(self, seat: str, **levers: Any) -> None:
        self.levers[seat] = {**self.levers[seat], **levers}

    def drive(self, seat: str) -> None:
        """Swing to the right, by the way that an operator takes."""
        self.say(seat, "lease", do="request", machine="left")
        self.run()
        self.move(seat, enable=True)
        self.run()
        self.move(seat, left_x=0.8)
        self.run()

    def swing(self) -> float:
        return float(self.outlet.sent[-1][0].joints[0])

    def console(self, seat: str) -> dict[str, Any]:
        found: dict[str, Any] = self.driving.document()["seats"][seat]["consoles"].get("left", {})
        return found


@pytest.fixture
def cockpit() -> Cockpit:
    return Cockpit()


def test_sticks_become_commands_with_the_lease_s_token(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    decision, holder, token = cockpit.outlet.sent[-1]
    assert decision.joints[0] != 0.0
    assert (holder, token) == ("ann", cockpit.radio.lease.token)
    assert cockpit.driving.driven() == ("left",)
    assert cockpit.console(seat)["state"] == "Active"
    # Before the dead-man everything that was sent was zero.
    first = next(k for k, (d, _, _) in enumerate(cockpit.outlet.sent) if d.joints.any())
    assert first > 5


def test_leases_end_by_themselves_when_driving_has_failed(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    cockpit.radio.run(4.0, cockpit.driving)  # a stall: the machine stands, the lease is kept
    assert cockpit.driving.driven() == ("left",)
    cockpit.radio.run(3.0, cockpit.driving)
    assert cockpit.driving.driven() == ()
    assert not cockpit.radio.lease.held(cockpit.radio.now)


def test_without_a_lease_nothing_is_sent(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    cockpit.move(seat, enable=True, left_x=1.0)
    cockpit.run(20)
    assert cockpit.outlet.sent == []


def test_what_is_unknown_or_blocked_is_zero_with_its_cause(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    cockpit.level, cockpit.allowed = Level.UNKNOWN, 0.0
    cockpit.run(1)
    assert cockpit.swing() == 0.0
    document = cockpit.driving.document()["seats"][seat]["decision"]["left"]
    assert document["fraction"]["swing"] == [0.0, 0.0]
    assert document["causes"]["swing"][0]["reason"] == "why"
    # The stick must return to neutral before that direction goes again.
    cockpit.level, cockpit.allowed = Level.CLEAR, 1.0
    cockpit.run(5)
    assert cockpit.swing() == 0.0
    cockpit.move(seat, left_x=0.0)
    cockpit.run(2)
    cockpit.move(seat, left_x=0.8)
    cockpit.run(2)
    assert cockpit.swing() != 0.0


def test_a_late_cycle_pauses(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    cockpit.run(1, period=0.5)
    assert cockpit.swing() == 0.0
    assert cockpit.console(seat)["state"] == "Pause"


@pytest.mark.parametrize(
    "link",
    [
        Condition(float("inf"), "unknown", "no answer from the machine for 0.7 s"),
        Condition(0.43, "locked", "round trip 430 ms: locked"),
    ],
)
def test_a_link_that_is_lost_or_too_slow_locks(cockpit: Cockpit, link: Condition) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    cockpit.outlet.link = link
    cockpit.run(1)
    assert cockpit.swing() == 0.0
    document = cockpit.driving.document()
    assert document["machines"]["left"]["locked"] == link.locked
    assert document["seats"][seat]["decision"]["left"]["locked"] == link.locked


def test_stop_by_a_viewer_latches_for_every_later_seat(cockpit: Cockpit) -> None:
    seat, looking = cockpit.sit(), cockpit.sit(VIEWER, "vic")
    cockpit.drive(seat)
    cockpit.say(looking, "stop")
    cockpit.say(looking, "stop")
    cockpit.run(1)
    assert cockpit.swing() == 0.0
    assert cockpit.console(seat)["state"] == "Stop"
    stops = [event for event in cockpit.events if event[0] == "stop"]
    assert [(who, d["machines"]) for _, who, d in stops] == [("vic", ["left"])]
    # Loaded again, the page finds it stopped.
    cockpit.driving.close(seat)
    del cockpit.levers[seat]
    again = cockpit.sit()
    cockpit.say(again, "lease", do="request", machine="left")
    cockpit.run()
    assert cockpit.console(again)["state"] == "Stop"
    assert "vic" in cockpit.console(again)["why"]
    cockpit.say(again, "reset")
    cockpit.run()
    assert cockpit.console(again)["state"] == "Idle"


def test_stop_reaches_a_machine_that_another_cockpit_drives() -> None:
    here, there = Cockpit(), Cockpit()
    there.radio = here.radio
    there.driving = Driving(
        {"left": MINI},
        {"left": there.outlet},  # type: ignore[dict-item]
        Leases(here.radio.ask, here.radio.clock),
        dict,
        there.methods,
        clock=here.radio.clock,
    )
    status = SimpleNamespace(holder="ann")
    here.driving = Driving(
        {"left": MINI},
        {"left": here.outlet},  # type: ignore[dict-item]
        Leases(here.radio.ask, here.radio.clock),
        lambda: {"left": status},  # type: ignore[dict-item,return-value]
        here.methods,
        lambda *event: here.events.append(event),
        here.radio.clock,
    )
    driving = there.sit()
    there.drive(driving)
    assert there.swing() < 0.0
    here.say(here.sit(VIEWER, "vic"), "stop")
    sent = len(there.outlet.sent)
    there.run(30)
    assert not here.radio.lease.held(here.radio.now)
    assert there.console(driving)["refused"] == "vic pressed stop"
    assert not there.console(driving)["held"]
    assert all(not s[0].joints.any() for s in there.outlet.sent[sent + 30 :])
    assert [(who, d["machines"]) for kind, who, d in here.events if kind == "stop"] == [
        ("vic", ["left"])
    ]


def test_a_viewer_moves_nothing_and_fills_no_log(cockpit: Cockpit) -> None:
    looking = cockpit.sit(VIEWER, "vic")
    cockpit.drive(looking)
    cockpit.run(50)
    assert cockpit.outlet.sent == []
    assert [event[0] for event in cockpit.events] == ["refused"]
    assert cockpit.console(looking) == {}


def test_a_page_that_is_gone_sends_nothing_more(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    cockpit.driving.close(seat)
    del cockpit.levers[seat]
    sent = len(cockpit.outlet.sent)
    cockpit.run(20)
    assert len(cockpit.outlet.sent) == sent
    assert not cockpit.radio.lease.held(cockpit.radio.now)


@pytest.mark.parametrize(
    "message",
    [
        {"type": "sticks"},
        {"type": "sticks", "seq": -1},
        {"type": "lease", "do": "steal", "machine": "left"},
        {"type": "lease", "do": "request", "machine": "no such"},
        {"type": "drive", "machine": 7},
        {"type": "setting", "pattern": "XYZ", "fine": True},
        {"type": "setting", "pattern": "ISO", "fine": True, "method": "XYZ"},
        {"type": "override", "reason": "x" * 1000},
    ],
)
def test_what_makes_no_sense_changes_nothing(cockpit: Cockpit, message: dict[str, Any]) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    before = cockpit.driving.document()["seats"][seat]
    assert cockpit.driving.on_message(seat, message) is True
    assert cockpit.driving.document()["seats"][seat] == before
    assert cockpit.driving.on_message(seat, {"type": "camera"}) is False


def test_an_override_is_a_supervisors_and_noted_with_its_reason(cockpit: Cockpit) -> None:
    for role, moved in ((OPERATOR, False), (SUPERVISOR, True)):
        one = Cockpit()
        seat = one.sit(role, role)
        one.drive(seat)
        one.level, one.allowed = Level.STOP, 0.0
        one.say(seat, "override", reason="bucket is stuck")
        one.move(seat, override=True)
        one.run(3)
        assert bool(one.swing()) is moved
        noted = [d for kind, _, d in one.events if kind == "console" and d["to"] == "Override"]
        assert [d["reason"] for d in noted] == (["bucket is stuck"] if moved else [])


def choose(cockpit: Cockpit, seat: str, method: str) -> dict[str, Any]:
    cockpit.say(seat, "setting", pattern="ISO", fine=False, method=method)
    found: dict[str, Any] = cockpit.driving.document()["seats"][seat]
    return found


@pytest.mark.parametrize("method", ["scaling", "potential", "constrained"])
def test_a_method_shapes_the_wish_and_is_told(cockpit: Cockpit, method: str) -> None:
    seat = cockpit.sit()
    assert choose(cockpit, seat, method)["method"] == method
    cockpit.drive(seat)
    document = cockpit.driving.document()["seats"][seat]
    shaped, told = cockpit.swing(), document["decision"]["left"]["method"]
    assert told == {
        "name": method,
        "upper": 0.9,
        "lower": 0.3,
        "scale": 0.5,
        "why": ["stick of left to gauge:T1 0.31 m"],
        "warnings": ["swing needs 3.55 m"],
    }
    SeatModel.model_validate(document)
    plain = Cockpit()
    plain.drive(plain.sit())
    assert shaped == pytest.approx(0.5 * plain.swing())
    noted = [details for kind, _, details in cockpit.events if kind == "setting"]
    assert [details["method"].value for details in noted] == [method]


def test_the_limiter_comes_after_the_method(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    choose(cockpit, seat, "scaling")
    cockpit.drive(seat)
    cockpit.level, cockpit.allowed = Level.STOP, 0.0
    cockpit.run(1)
    assert cockpit.swing() == 0.0
    assert cockpit.outlet.sent[-1][0].fraction[0].tolist() == [0.0, 0.0]


def test_a_method_changes_in_neutral_only_and_stays_when_none_is_said(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    assert choose(cockpit, seat, "scaling")["method"] == "braking"
    cockpit.move(seat, enable=False, left_x=0.0)
    cockpit.run()
    assert choose(cockpit, seat, "scaling")["method"] == "scaling"
    cockpit.say(seat, "setting", pattern="SAE", fine=False)
    assert cockpit.driving.document()["seats"][seat]["method"] == "scaling"


def test_a_method_that_stops_a_joint_neither_latches_it_nor_lets_it_go(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    choose(cockpit, seat, "constrained")
    cockpit.drive(seat)
    cockpit.methods.share = 0.0
    cockpit.run(3)
    assert cockpit.swing() == 0.0
    cockpit.methods.share = 0.5
    cockpit.run(1)
    assert cockpit.swing() != 0.0  # no neutral was needed
    cockpit.level, cockpit.allowed = Level.STOP, 0.0  # the limiter's own stop
    cockpit.run(1)
    cockpit.level, cockpit.allowed = Level.CLEAR, 1.0
    cockpit.methods.share = 0.0
    cockpit.run(3)  # the stick is still held: this is no neutral
    cockpit.methods.share = 0.5
    cockpit.run(3)
    assert cockpit.swing() == 0.0
    cockpit.move(seat, left_x=0.0)
    cockpit.run(2)
    cockpit.move(seat, left_x=0.8)
    cockpit.run(2)
    assert cockpit.swing() != 0.0


def test_a_method_is_told_of_an_override() -> None:
    cockpit = Cockpit()
    seat = cockpit.sit(SUPERVISOR, "sue")
    cockpit.drive(seat)
    assert not any(overridden for _, overridden in cockpit.methods.asked)
    cockpit.say(seat, "override", reason="bucket is stuck")
    cockpit.move(seat, override=True)
    cockpit.run(3)
    assert cockpit.methods.asked[-1] == (Method.BRAKING, True)


def test_motion_is_noted_from_its_beginning_to_its_end(cockpit: Cockpit) -> None:
    seat = cockpit.sit()
    cockpit.drive(seat)
    cockpit.move(seat, enable=False, left_x=0.0)
    cockpit.run()
    told = [(d["from"], d["to"]) for kind, _, d in cockpit.events if kind == "console"]
    assert told == [("Reserved", "Idle"), ("Idle", "Enabled"), ("Active", "Pause")]
