"""What is climbed by plan is told the pipeline from acceptance to the end, moving or not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_driving_seats import MIDDLE
from test_follows import TIMES, Following, straight

from backend.control.climb import Climb, Phase
from backend.control.follow import Trajectory
from backend.fusion.pose import Validity
from backend.safety.record import Level

FAR = 0.3
S = 3 * (TIMES / TIMES[-1]) ** 2 - 2 * (TIMES / TIMES[-1]) ** 3
DS = np.gradient(S, TIMES)


def climb() -> Trajectory:
    """The swing of `straight`, and 0.3 m ahead, pitching by 6 degrees, on four points and two."""
    base = np.tile(np.eye(4), (len(TIMES), 1, 1))
    base[:, 0, 3] = FAR * S
    corners = np.array([[-1.0, -0.6, 0.0], [-1.0, 0.6, 0.0], [0.8, 0.6, 0.2], [0.8, -0.6, 0.2]])
    support = np.full((len(TIMES), 6, 3), np.nan)
    support[:, :4] = corners
    support[30:, 4:] = [[2.0, 0.2, 0.3], [2.0, -0.2, 0.3]]
    phases = (Phase("reach", 0.0, 1.5), Phase("sequence 1", 1.5, 3.0))
    path = straight()
    return Trajectory(
        path.times,
        path.joints,
        path.rates,
        np.tile(FAR * DS[:, None], (1, 2)),
        base,
        climb=Climb(("step",), phases, support, np.linspace(0.5, 0.2, len(TIMES)), clearance=0.1),
    )


class Climbing(Following):
    def __init__(self) -> None:
        super().__init__()
        self.path = climb()


def test_it_is_told_from_acceptance_to_the_end() -> None:
    there = Climbing()
    assert there.driving.surmounting() == {}
    seat = there.begin()
    told = there.driving.surmounting()["left"]
    assert (told.plan, told.obstacles, told.phase) == ("p1", ("step",), "reach")
    assert told.touching == ("tracks", "bucket")
    assert told.position == (0.0, 0.0, 0.0)
    assert told.time == there.radio.now
    assert len(told.support) == 4
    assert told.margin == pytest.approx(0.5)
    there.move(seat, enable=True)
    seen = []
    for _ in range(400):
        there.run(1)
        one = there.driving.surmounting().get("left")
        if one is None:
            break
        off = math.dist(one.position, there.base[:3, 3])
        assert off < 0.05, "where it should be seen is where it is"
        seen.append((one.phase, len(one.support)))
    assert there.follow(seat)["arrived"]
    assert {("reach", 4), ("sequence 1", 6)} <= set(seen)
    assert there.base[0, 3] == pytest.approx(FAR, abs=0.03)


def test_let_go_and_paused_it_is_still_told() -> None:
    there = Climbing()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(60)
    there.move(seat, enable=False)
    there.run(100)
    assert there.driving.surmounting()["left"].position[0] == pytest.approx(
        there.base[0, 3], abs=0.05
    )
    stood = there.base[0, 3]
    there.run(50)
    assert there.base[0, 3] == pytest.approx(stood, abs=1e-4)


@pytest.mark.parametrize("how", ["stop", "stick", "drop", "release", "void", "page"])
def test_it_is_told_no_more_when_it_is_over(how: str) -> None:
    there = Climbing()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(40)
    assert "left" in there.driving.surmounting()
    if how == "stop":
        there.say(seat, "stop")
    elif how == "stick":
        there.move(seat, left_x=-0.5)
    elif how == "drop":
        there.say(seat, "follow", do="drop", machine="left")
    elif how == "release":
        there.say(seat, "lease", do="release", machine="left")
    elif how == "void":
        there.void = "right is in its way now"
    else:
        there.driving.close(seat)
        there.levers.clear()
    there.run(10)
    assert there.driving.surmounting() == {}


def test_beside_its_way_it_ends() -> None:
    there = Climbing()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(50)
    there.base[1, 3] += 0.2
    there.run(5)
    assert there.follow(seat)["ended"] == "its base is 0.20 m off; plan again"
    there.run(60)
    assert not there.outlet.sent[-1][0].joints.any()
    assert not there.outlet.sent[-1][0].tracks.any()


def test_a_base_that_is_not_seen_stands() -> None:
    there = Climbing()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(50)
    there.seen = Validity.STALE
    there.run(60)
    stood, q = there.base[0, 3], there.q.copy()
    there.run(60)
    assert there.base[0, 3] == pytest.approx(stood, abs=1e-4)
    np.testing.assert_allclose(there.q, q, atol=1e-3)
    assert there.follow(seat)["ended"] == ""


def test_stopped_on_the_way_it_is_taken_up_from_there() -> None:
    there = Climbing()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(60)
    there.say(seat, "stop")
    there.run(60)
    at = there.follow(seat)["at"]
    assert there.follow(seat)["ended"] == "Stop"
    there.move(seat, enable=False)
    there.run(5)
    there.say(seat, "reset")
    there.run(5)
    there.say(seat, "follow", do="accept", machine="left", plan="p1")
    there.run(5)
    found = there.follow(seat)
    assert found["ended"] == ""
    assert found["at"] == pytest.approx(at, abs=0.5)
    assert "left" in there.driving.surmounting()
    there.move(seat, enable=True)
    there.run(400)
    assert there.follow(seat)["arrived"]
    assert there.base[0, 3] == pytest.approx(FAR, abs=0.03)
    # Arrived, it begins anew, which is somewhere else now.
    there.move(seat, enable=False)
    there.run(5)
    there.say(seat, "follow", do="accept", machine="left", plan="p1")
    there.run(5)
    assert "where the trajectory begins" in there.follow(seat)["ended"]


def test_a_limit_of_the_tracks_slows_the_arm() -> None:
    there = Climbing()
    seat = there.begin()
    there.move(seat, enable=True)
    there.run(30)
    there.level, there.allowed = Level.SLOW, 1.0
    full = there.driving._machines["left"].tracks.max_speed
    assert full > FAR * DS.max()
    at = there.follow(seat)["at"]
    there.travel = 0.05
    there.run(30)
    slow = there.follow(seat)["at"] - at
    assert slow < 0.4
    np.testing.assert_allclose(MIDDLE[1:], there.q[1:], atol=0.02)
