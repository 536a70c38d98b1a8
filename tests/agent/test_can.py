"""The CAN driver on python-can's virtual bus, with a controller on the other end."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from pathlib import Path

import can
import cantools.database
import numpy as np
import pytest

from backend.errors import InputError
from backend.machine.load import load_machine
from backend.shell.agent.drivers.bus import DBC, CanDriver, open_bus
from backend.shell.agent.gate import Gate
from backend.shell.agent.process import BLIND, at_rest, decide

MACHINE = load_machine("mini")
ROLES = [joint.role for joint in MACHINE.joints]


class Controller:
    """The machine's own controller: hears commands, tells joint states."""

    def __init__(self, channel: str) -> None:
        self.bus = can.Bus(interface="virtual", channel=channel)
        self.database = cantools.database.load_file(str(DBC))

    def tell(self, q, qd=(0.0,) * 4) -> None:
        for name, values in (("JointPositions", q), ("JointRates", qd)):
            self.send(name, dict(zip(ROLES, values, strict=True)))

    def send(self, name: str, signals: dict[str, float]) -> None:
        message = self.database.get_message_by_name(name)
        self.raw(message.frame_id, message.encode(signals))

    def raw(self, frame_id: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=frame_id, data=data, is_extended_id=False))

    def heard(self) -> dict[str, dict[str, float]]:
        """The newest of each command frame."""
        newest = {}
        while (frame := self.bus.recv(timeout=0.0)) is not None:
            message = self.database.get_message_by_frame_id(frame.arbitration_id)
            newest[message.name] = message.decode(frame.data)
        return newest


@contextlib.contextmanager
def connected(name: str) -> Iterator[tuple[Controller, CanDriver, list[float]]]:
    now = [0.0]
    controller = Controller(name)
    driver = CanDriver(MACHINE, open_bus("virtual", name, 250_000), lambda: now[0])
    try:
        yield controller, driver, now
    finally:
        driver.close()
        controller.bus.shutdown()


def test_velocities_arrive_and_closing_stops() -> None:
    with connected("velocities") as (controller, driver, _):
        driver.write(np.array([0.5, -0.25, 0.1, -1.0]), np.array([0.3, -0.2]))
        heard = controller.heard()
        assert [heard["JointVelocities"][r] for r in ROLES] == pytest.approx([0.5, -0.25, 0.1, -1])
        speeds = heard["TrackSpeeds"]
        assert (speeds["left"], speeds["right"]) == pytest.approx((0.3, -0.2))
        assert speeds["enable"] == 1
        driver.stop()
        after = controller.heard()
        assert set(after["JointVelocities"].values()) == {0.0}
        assert after["TrackSpeeds"]["enable"] == 0
        assert after["TrackSpeeds"]["counter"] == speeds["counter"] + 1


def test_joint_states_are_read_in_pairs_and_the_swing_goes_round() -> None:
    with connected("states") as (controller, driver, now):
        assert driver.read() is None
        controller.send("JointPositions", dict.fromkeys(ROLES, 0.1))
        assert driver.read() is None  # rates are still missing
        controller.tell((3.1, 0.2, -1.0, 0.3), (0.5, 0.0, 0.0, 0.0))
        now[0] = 1.0
        reading = driver.read()
        assert reading is not None
        np.testing.assert_allclose(reading.q, [3.1, 0.2, -1.0, 0.3], atol=1e-4)
        assert reading.time == 1.0
        controller.tell((-3.1, 0.2, -1.0, 0.3))
        reading = driver.read()
        assert reading is not None
        assert reading.q[0] == pytest.approx(2 * math.pi - 3.1, abs=2e-4)


def test_strangers_frames_and_broken_ones_do_no_harm() -> None:
    with connected("strangers") as (controller, driver, _):
        controller.tell((0.0, 0.2, -1.0, 0.3))
        before = driver.read()
        for frame_id in (0x7FF, 385, 386):
            controller.raw(frame_id, b"\x01")
        after = driver.read()
        assert after is not None
        assert before is not None
        np.testing.assert_array_equal(after.q, before.q)
        assert driver.malformed == 2


def test_a_machine_that_tells_nothing_is_not_moved() -> None:
    with connected("silent") as (controller, driver, now):
        assert decide(Gate(), MACHINE, driver.read(), at_rest(MACHINE), 0.0, 0.01).mode == "hold"
        controller.tell((0.0, 0.2, -1.0, 0.3))
        reading = driver.read()
        now[0] = BLIND + 0.01
        stood = decide(Gate(), MACHINE, reading, at_rest(MACHINE), now[0], 0.01)
        assert stood.mode == "hold"
        assert not stood.joints.any()


@pytest.mark.parametrize("text", ["", "no DBC at all {"])
def test_a_file_that_does_not_fit_is_one_sentence(text: str, tmp_path: Path) -> None:
    file = tmp_path / "machine.dbc"
    file.write_text(text)
    bus = can.Bus(interface="virtual", channel="bad")
    with bus, pytest.raises(InputError, match=r"machine\.dbc"):
        CanDriver(MACHINE, bus, lambda: 0.0, file)


def test_an_interface_that_is_not_there_is_one_sentence() -> None:
    with pytest.raises(InputError, match="cannot be opened"):
        open_bus("no-such-interface", "can0", 250_000)
