"""Driving through real processes: page's websocket, backend, Zenoh, simulated machine's agent."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator

import pytest
from live import Backend, all_valid, serve, simulated
from operators import PERIOD, Operator
from wiretap import Wiretap

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]
SITE = "demo"


@pytest.fixture(scope="module")
def station() -> Iterator[Backend]:
    with serve(SITE, "--no-record") as running, simulated(SITE, running.endpoint, "left", "right"):
        running.wait_for(all_valid)
        yield running


@pytest.fixture
def operator(station: Backend) -> Iterator[Operator]:
    opened = Operator(station)
    yield opened
    opened.close()


@pytest.fixture
def tap(station: Backend) -> Iterator[Wiretap]:
    with Wiretap(station.endpoint, "left") as listening:
        yield listening


def moving(operator: Operator, tap: Wiretap, **levers: float) -> None:
    """Until the machine does what the levers say, and not what its own program does."""

    def goes() -> bool:
        remote = bool(tap.statuses) and tap.statuses[-1].mode == "remote"
        return remote and tap.truths != [] and tap.speed() > 0.05

    # Up with the boom first, and away from the partner: free whatever the other machine does.
    going = levers or {"right_y": -0.5}
    operator.drive("left", goes, **going)


def test_sticks_move_the_machine_and_the_other_goes_on(operator: Operator, tap: Wiretap) -> None:
    moving(operator, tap)
    before = operator.joints("left")["boom"]
    operator.wait(lambda: abs(operator.joints("left")["boom"] - before) > 0.05)
    assert operator.state("left") == "Active"
    assert operator.machine("left")["mode"] == "remote"
    assert operator.machine("left")["holder"] == operator.you["who"]
    assert operator.machine("right")["mode"] in ("program", "rejoining")
    assert 0.0 < operator.machine("left")["round_trip"] < 5.0


@pytest.mark.parametrize("method", ["scaling", "potential", "constrained"])
def test_a_method_shapes_what_moves_the_machine(
    operator: Operator, tap: Wiretap, method: str
) -> None:
    operator.say("setting", pattern="ISO", fine=False, method=method)
    operator.wait(lambda: operator.seat.get("method") == method)
    moving(operator, tap)
    told = operator.seat["decision"]["left"]["method"]
    assert (told["name"], told["upper"], told["lower"]) == (method, 0.8, 0.2)
    assert 0.0 < told["scale"] <= 1.0
    assert not any("STOP" in line or "left out" in line for line in told["why"])


@pytest.mark.parametrize("lost", [{"enable": False}, {"focus": False}, {"gamepad": False}])
def test_what_is_let_go_sends_zero_and_stays_so(
    operator: Operator, tap: Wiretap, lost: dict[str, bool]
) -> None:
    moving(operator, tap)
    begun = time.monotonic()
    operator.move(**lost)
    operator.wait(lambda: tap.stood(begun) is not None)
    # Everything as before is not enough: it must be let go and pressed anew.
    operator.move(enable=True, focus=True, gamepad=True)
    time.sleep(10 * PERIOD)
    assert operator.state("left") == "Pause"
    assert tap.first_zero(begun) is not None
    assert operator.console("left")["why"]


def test_a_page_that_falls_silent_sends_zero(operator: Operator, tap: Wiretap) -> None:
    moving(operator, tap)
    begun = time.monotonic()
    operator.sending = False
    operator.wait(lambda: tap.stood(begun) is not None)
    assert operator.console("left")["why"] == "no input from the operator"


def test_a_page_that_is_gone_gives_the_machine_back(station: Backend, tap: Wiretap) -> None:
    gone, stays = Operator(station), Operator(station)
    moving(gone, tap)
    begun = time.monotonic()
    gone.close()
    stays.wait(lambda: tap.stood(begun) is not None)
    stays.wait(lambda: stays.machine("left")["holder"] == "")
    stays.close()


def test_stop_by_anyone_latches_until_reset(station: Backend, tap: Wiretap) -> None:
    driver, other = Operator(station), Operator(station)
    moving(driver, tap)
    begun = time.monotonic()
    other.say("stop")
    driver.wait(lambda: tap.stood(begun) is not None)
    driver.wait(lambda: driver.state("left") == "Stop")
    driver.levers = {**driver.levers, "enable": False, "right_y": 0.0}
    driver.move()
    time.sleep(5 * PERIOD)
    driver.move(enable=True)
    time.sleep(5 * PERIOD)
    assert driver.state("left") == "Stop"
    driver.move(enable=False)
    time.sleep(5 * PERIOD)
    driver.say("reset")
    driver.wait(lambda: driver.state("left") == "Idle")
    driver.enable("left")
    driver.close()
    other.close()


def test_one_operator_holds_both_and_switches(operator: Operator) -> None:
    operator.take("left")
    operator.take("right")
    assert operator.seat["driven"] == "left"
    operator.enable("left")
    operator.say("drive", machine="right")
    time.sleep(5 * PERIOD)
    assert operator.seat["driven"] == "left"  # not while it is enabled
    operator.move(enable=False)
    time.sleep(5 * PERIOD)
    operator.say("drive", machine="right")
    operator.wait(lambda: operator.seat["driven"] == "right")
    operator.enable("right")
    assert operator.state("left") in ("Idle", "Pause")


def test_a_replayed_command_moves_nothing(operator: Operator, tap: Wiretap) -> None:
    moving(operator, tap)
    old = [p for c, p in zip(tap.commands, tap.payloads, strict=True) if c.velocity.any()][-1]
    begun = time.monotonic()
    operator.move(enable=False)
    operator.wait(lambda: tap.stood(begun) is not None)
    refused, sent = tap.statuses[-1].refused, 30
    for _ in range(sent):
        tap.session.put("left/cmd", old)
        time.sleep(0.02)
    operator.wait(lambda: tap.statuses[-1].refused >= refused + sent)
    assert tap.speed() < 0.02


def test_a_killed_backend_stops_the_machine_and_gives_no_control_back() -> None:
    with serve(SITE, "--no-record") as first:
        endpoint = first.endpoint
        with simulated(SITE, endpoint, "left", "right"):
            first.wait_for(all_valid)
            operator = Operator(first)
            with Wiretap(endpoint, "left") as tap:
                moving(operator, tap)
            last = operator.snapshot["machines"]["left"]["joints"]["boom"]
            first.process.send_signal(signal.SIGKILL)
            first.process.wait()
            time.sleep(0.7)
            with serve(SITE, "--no-record", endpoint=endpoint) as second:
                second.wait_for(all_valid)
                stood = second.get("/api/snapshot")["machines"]["left"]["joints"]["boom"]
                assert abs(stood - last) < 0.5  # not on for all the time that it took to start
                watching = Operator(second)
                assert watching.machine("left")["holder"] == ""
                assert watching.seat["consoles"] == {}
                watching.close()
