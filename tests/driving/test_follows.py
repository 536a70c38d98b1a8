"""An accepted trajectory is followed while the dead-man is held, within the limiter."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from test_driving_seats import MIDDLE, MINI, Cockpit, N

from backend.control.follow import Trajectory
from backend.control.person import OPERATOR
from backend.fusion.pose import Validity
from backend.safety.record import Concern, Level
from backend.shell.app.driving_models import SeatModel
from backend.shell.driving.driving import Driving
from backend.shell.driving.leases import Leases

TIMES = np.linspace(0.0, 3.0, 61)


def straight() -> Trajectory:
    u = TIMES / TIMES[-1]
    way = np.zeros(N)
    way[0] = 0.6
    s, ds = 3 * u**2 - 2 * u**3, (6 * u - 6 * u**2) / TIMES[-1]
    return Trajectory(TIMES, MIDDLE + s[:, None] * way, ds[:, None] * way)


class Following(Cockpit):
    """A machine that does what it is told, 0.1 s later, a cycle every 20 ms."""

    def __init__(self) -> None:
        super().__init__()
        self.path = straight()
        self.driving = Driving(
            {"left": MINI},
            {"left": self.outlet},  # type: ignore[dict-item]
            Leases(self.radio.ask, self.radio.clock),
            dict,
            self.methods,  # type: ignore[arg-type]
            lambda *event: self.events.append(event),
            self.radio.clock,
            self,
        )
        self.q, self.rate = MIDDLE.copy(), np.zeros(N)
        self.least = 1.0  # of the limiter's fraction
        self.travel = 1.0
        self.base, self.speed, self.seen = np.eye(4), 0.0, Validity.VALID
        self.void = ""

    def offered(self, machine: str, plan: str) -> Trajectory | str:
        return self.path if plan == "p1" else "no trajectory is called so"

    def over(self, machine: str, plan: str) -> str:
        return self.void

    def run(self, cycles: int = 5, period: float = 0.02) -> None:
        for _ in range(cycles):
            self.radio.run(period, self.driving)
            for seat, levers in self.levers.items():
                self.sequence += 1
                self.say(seat, "sticks", seq=self.sequence, **levers)
            now = self.radio.now
            allowed = np.full((N, 2), self.allowed)
            concern = Concern(
                *("partner", "left", self.level, "why", allowed, np.full(2, self.travel)), None, now
            )
            pose = SimpleNamespace(
                joints=self.q.copy(),
                time=now,
                streams={"joints": SimpleNamespace(age=0.0)},
                validity=self.seen,
            )
            body = SimpleNamespace(link_poses=self.base.copy()[None])
            snapshot: Any = SimpleNamespace(
                time=now,
                machines={"left": SimpleNamespace(pose=pose, body=body)},
                concerns=(concern,),
            )
            self.driving.cycle(snapshot)
            if self.outlet.sent:
                wanted = self.outlet.sent[-1][0].joints
                self.rate = self.rate + (wanted - self.rate) * period / 0.1
                self.q = self.q + self.rate * period
                tracks = float(self.outlet.sent[-1][0].tracks.mean())
                self.speed = self.speed + (tracks - self.speed) * period / 0.22
                self.base[0, 3] += self.speed * period

    def begin(self, plan: str = "p1") -> str:
        seat = self.sit(OPERATOR)
        self.say(seat, "lease", do="request", machine="left")
        self.run()
        self.say(seat, "follow", do="accept", machine="left", plan=plan)
        self.run()
        return seat

    def follow(self, seat: str) -> dict[str, Any]:
        document = self.driving.document()["seats"][seat]
        SeatModel.model_validate(document)
        found: dict[str, Any] = document["follow"]["left"]
        return found


def test_nothing_moves_before_the_dead_man_is_held_and_then_it_arrives() -> None:
    there = Following()
    seat = there.begin()
    there.run(50)
    np.testing.assert_array_equal(there.q, MIDDLE)
    there.move(seat, enable=True)
    there.run(300)
    found = there.follow(seat)
    assert found["arrived"], found
    np.testing.assert_allclose(there.q, there.path.joints[-1], atol=np.radians(1.0))
    assert there.events.count(("console", "ann", {"machine": "left", "follow": "arrived"})) == 1
    there.run(50)
    assert not there.outlet.sent[-1][0].joints.any()


def test_released_it_stands_and_goes_on() -> None:
    there = Following()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(60)
    there.move(seat, enable=False)
    there.run(60)
    stood, at = there.q.copy(), there.follow(seat)["at"]
    there.run(100)
    np.testing.assert_allclose(there.q, stood, atol=1e-4)
    assert there.follow(seat)["at"] == at
    assert 0.1 < at < 2.0
    there.move(seat, enable=True)
    there.run(300)
    assert there.follow(seat)["arrived"]


def test_what_moves_in_stops_it_until_the_dead_man_is_pressed_anew() -> None:
    there = Following()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(60)
    there.level, there.allowed = Level.STOP, 0.0
    there.run(60)
    stood = there.q.copy()
    there.run(60)
    np.testing.assert_allclose(there.q, stood, atol=1e-3)
    there.level, there.allowed = Level.CLEAR, 1.0
    there.run(60)
    np.testing.assert_allclose(there.q, stood, atol=1e-3)
    there.move(seat, enable=False)
    there.run(10)
    there.move(seat, enable=True)
    there.run(300)
    assert there.follow(seat)["arrived"]


def test_a_stick_takes_over() -> None:
    there = Following()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(40)
    there.move(seat, left_x=-0.5)
    there.run(5)
    assert there.follow(seat)["ended"] == "a stick was moved"
    there.move(seat, left_x=0.0)
    there.run(60)
    stood = there.q.copy()
    there.run(60)
    np.testing.assert_allclose(there.q, stood, atol=1e-3)


def test_who_holds_no_lease_and_what_was_not_planned_is_refused() -> None:
    there = Following()
    seat = there.begin("p2")
    assert "follow" in [kind for kind, *_ in there.events]
    assert "no trajectory" in there.events[-1][2]["refused"]
    assert not there.driving.document()["seats"][seat]["follow"]
    other = there.sit(OPERATOR, "bob")
    there.say(other, "follow", do="accept", machine="left", plan="p1")
    assert "lease" in there.events[-1][2]["refused"]


def test_dropped_it_is_over() -> None:
    there = Following()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(40)
    there.say(seat, "follow", do="drop", machine="left")
    there.run(60)
    stood = there.q.copy()
    there.run(60)
    np.testing.assert_allclose(there.q, stood, atol=1e-3)
    assert there.console(seat)["state"] == "Enabled"
    there.run()
    assert "left" not in there.driving.document()["seats"][seat]["follow"]


def test_a_plan_that_holds_no_more_ends_it_and_says_why() -> None:
    there = Following()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(60)
    there.void = "right:stick/0 is in its way now"
    there.run(60)
    assert there.follow(seat)["ended"] == there.void
    stood = there.q.copy()
    there.run(60)
    np.testing.assert_allclose(there.q, stood, atol=1e-3)
    ends = [e for e in there.events if e[0] == "console" and e[2].get("follow")]
    assert ends == [("console", "ann", {"machine": "left", "follow": there.void})]


def test_why_a_plan_is_refused_is_told_until_another_is_accepted() -> None:
    there = Following()
    seat = there.begin("p2")
    told = there.driving.document()["seats"][seat]["follow_refused"]
    assert told == {"left": "no trajectory is called so"}
    assert there.driving.followed("left") is None
    there.say(seat, "follow", do="accept", machine="left", plan="p1")
    assert there.driving.document()["seats"][seat]["follow_refused"] == {}
    found = there.driving.followed("left")
    assert found is not None
    assert found.plan == "p1"
