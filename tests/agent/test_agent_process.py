"""The agent on a real session, with a simulated machine: leases, commands, silence, rivals."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from backend.control.lease import TERM, Answer, Kind, Request
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.shell.agent.drivers.simulation import SimDriver
from backend.shell.agent.gate import names_of
from backend.shell.agent.process import run, run_agent
from backend.shell.link.encode import encode_command, encode_limits
from backend.shell.link.lease_codec import decode_answer, encode_request
from backend.shell.link.messages import Command, MotionLimits
from backend.shell.link.receiver import Receiver
from backend.shell.link.session import open_session, publisher, with_port
from backend.site.site import load_site
from cockpit.run import run_agent as run_command

MACHINE = load_machine("mini")
ONES = np.ones(len(MACHINE.joints) + 2)
SITE = load_site("demo")


class Spy(SimDriver):
    """A simulated machine that notes when it was last asked to move, and when to stand."""

    def __init__(self, machine, clock) -> None:
        super().__init__(machine, clock)
        self.moved_at = self.stopped_at = clock()
        self.clock = clock

    def write(self, joints, tracks) -> None:
        super().write(joints, tracks)
        if joints.any() or tracks.any():
            self.moved_at = self.clock()

    def stop(self) -> None:
        super().stop()
        self.stopped_at = self.clock()


class Operator:
    """One console: a lease, and commands with limits while it holds the stick."""

    def __init__(self, session, who: str, name: str = "left") -> None:
        self.session, self.who, self.name = session, who, name
        self.cmd, self.limits = (publisher(session, row, name) for row in ("cmd", "limits"))
        self.token, self.sequence = 0, 0

    def ask(self, kind: Kind = Kind.REQUEST, **more) -> Answer:
        asked = encode_request(Request(kind, self.who, token=self.token, **more))
        for reply in self.session.get(f"{self.name}/lease", payload=asked, timeout=5.0):
            answer = decode_answer(reply.ok.payload.to_bytes())
            self.token = answer.token or self.token
            return answer
        raise AssertionError("no answer")

    def command(self, swing: float = 0.3, sequence: int = 0) -> None:
        self.sequence = sequence or self.sequence + 1
        stamp = self.name, time.time(), 0.0, self.sequence
        limits = MotionLimits(*stamp, 0.3, self.token, names_of(MACHINE), ONES, ONES)
        self.limits.put(encode_limits(limits))
        velocity = np.array([swing])
        command = Command(*stamp, 0.2, self.who, self.token, ("swing",), velocity, 0.0, 0.0)
        self.cmd.put(encode_command(command))


@contextlib.contextmanager
def agent() -> Iterator[tuple[Spy, object, Receiver]]:
    endpoint = with_port("tcp/127.0.0.1:0")
    session = open_session(listen=[endpoint], mode="router")
    own = open_session(connect=[endpoint])
    driver = Spy(MACHINE, time.monotonic)
    receiver = Receiver(session, {"left": "left"})
    until = threading.Event()
    thread = threading.Thread(
        target=run_agent, args=(MACHINE, "left", "left", driver, own, until), daemon=True
    )
    thread.start()
    try:
        wait(lambda: receiver.drain() and receiver.statuses())
        yield driver, session, receiver
    finally:
        until.set()
        thread.join(timeout=5.0)
        receiver.close()
        own.close()
        session.close()
    assert not thread.is_alive()


def wait(condition, seconds: float = 20.0, each=None) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing happened in time"
        if each:
            each()
        time.sleep(0.02)


def test_lease_commands_silence_and_rivals() -> None:
    with agent() as (driver, session, receiver):
        ann, bob = Operator(session, "ann"), Operator(session, "bob")
        bob.command()  # without any lease
        assert ann.ask().granted
        assert ann.ask(Kind.REFRESH).granted
        refused = bob.ask()
        assert not refused.granted
        assert refused.why == "ann is in control"

        def drive() -> None:
            ann.ask(Kind.REFRESH)
            ann.command()

        wait(lambda: driver.state.qd[0] > 0.25, each=drive)
        ann.command()
        silent_since = time.monotonic()
        wait(lambda: time.monotonic() > silent_since + 0.6)
        # Commands cease: nothing is asked of the machine after 200 ms, and a loop's period.
        assert driver.moved_at - silent_since < 0.25
        assert driver.stopped_at > silent_since + 0.3
        wait(lambda: abs(driver.state.qd[0]) < 0.01)

        # A replay, even of everything that was ever said, moves nothing.
        ann.ask(Kind.REFRESH)
        before = driver.moved_at
        for sequence in range(1, ann.sequence + 1):
            ann.command(sequence=sequence)
        time.sleep(0.3)
        assert driver.moved_at == before
        receiver.drain()
        status = receiver.statuses()["left"]
        assert status.refused >= ann.sequence
        assert (status.mode, status.holder) == ("stopped", "ann")

        # The holder is gone: its lease ends within a second, and its old token moves nothing.
        gone = time.monotonic()
        wait(lambda: bob.ask().granted, seconds=5.0)
        assert time.monotonic() - gone < TERM + 1.0
        ann.command()
        time.sleep(0.2)
        assert driver.moved_at == before
        wait(lambda: driver.moved_at > before, each=bob.command)


def test_broken_requests_are_not_answered_and_do_no_harm() -> None:
    with agent() as (_, session, _receiver):
        for payload in (b"", b"{", b'{"kind": "steal", "who": "x"}', b"\xff" * 100, b"x" * 10_000):
            assert not list(session.get("left/lease", payload=payload, timeout=0.5))
        assert Operator(session, "ann").ask().granted


@pytest.mark.processes
def test_own_process_says_what_it_does_and_ends_cleanly() -> None:
    endpoint = with_port("tcp/127.0.0.1:0")
    session = open_session(listen=[endpoint], mode="router")
    receiver = Receiver(session, {"left": "left"})
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "cockpit.cli", "agent", "--site", "demo"),
            *("--machine", "left", "--driver", "sim", "--connect", endpoint),
        ],
        stderr=subprocess.PIPE,
    )
    try:
        wait(lambda: receiver.drain() and receiver.statuses(), 60.0)
        assert receiver.statuses()["left"].mode == "hold"
        process.terminate()
        _, errors = process.communicate(timeout=10.0)
        assert process.returncode == 0
        assert errors == b""
    finally:
        process.kill()
        receiver.close()
        session.close()


def test_mistakes_are_one_sentence() -> None:
    until = threading.Event()
    with pytest.raises(InputError, match="allowed are left, right"):
        run(SITE, "middle", ("tcp/127.0.0.1:1",), until, SimDriver)
    with pytest.raises(InputError, match="allowed are sim, can"):
        run_command("demo", "left", "hand", ("virtual", "x", 1, None), (), until)
