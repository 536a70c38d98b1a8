"""A simulated machine's camera on a real session: asked, answered, cut off, and idle."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from backend.machine.load import load_machine
from backend.shell.link.asking import ask
from backend.shell.link.codec import DecodeError, decode_picture
from backend.shell.link.encode import encode_clock, encode_picture, encode_truth
from backend.shell.link.messages import TrueState
from backend.shell.link.session import open_session, publisher, with_port
from backend.shell.sim import camera as module
from backend.shell.sim.camera import CabCamera
from backend.shell.sim.dynamics import SimState
from backend.site.moving import Person
from backend.site.site import load_site

SITE = load_site("demo")
MACHINE = load_machine("mini")
Q = np.radians([-50.0, 40.0, -60.0, -60.0])


class Wire:
    """LEFT's camera on a session of its own, and whoever asks it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        endpoint = with_port("tcp/127.0.0.1:0")
        self.cockpit = open_session(listen=[endpoint], mode="router")
        self.machine = open_session(connect=[endpoint])
        self.cut, self.drawn, self.stamp = False, 0, 1.7e9
        draw = module.cab_view

        def counted(*arguments: Any) -> Any:
            self.drawn += 1
            return draw(*arguments)

        monkeypatch.setattr(module, "cab_view", counted)
        self.camera = CabCamera(
            self.machine,
            SITE,
            "left",
            MACHINE,
            self.state,
            lambda: self.cut,
            lambda: open_session(connect=[endpoint], mode="client"),
        )

    def state(self) -> tuple[SimState, float]:
        start = SITE.frame.from_projected(np.array([308604.0, 4129954.0, 0.0]))
        return SimState(Q, 0.0 * Q, start, 0.0, 0.0, 0.0, np.zeros(2)), self.stamp

    def ask(self, timeout: float = 5.0) -> bytes | None:
        got: list[bytes] = []
        ended = threading.Event()
        ask(self.cockpit, "camera", "left", None, got.append, ended.set, timeout, camera="cab")
        assert ended.wait(timeout + 5.0)
        return got[0] if got else None

    def picture(self) -> np.ndarray:
        payload = self.ask()
        assert payload is not None
        return np.asarray(Image.open(io.BytesIO(decode_picture(payload)[1]))).astype(int)

    def close(self) -> None:
        self.camera.close()
        self.machine.close()
        self.cockpit.close()


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Iterator[Wire]:
    opened = Wire(monkeypatch)
    yield opened
    opened.close()


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 15.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_picture_is_drawn_when_asked_for_and_not_otherwise(wire: Wire) -> None:
    until(lambda: wire.ask() is not None)
    payload, drawn = wire.ask(), wire.drawn
    assert payload is not None
    stamp, jpeg = decode_picture(payload)
    assert stamp == wire.stamp
    assert Image.open(io.BytesIO(jpeg)).size == (480, 270)
    time.sleep(0.5)
    assert wire.drawn == drawn
    wire.cut = True
    assert wire.ask(0.5) is None
    assert wire.drawn == drawn


def test_the_partner_is_seen_where_it_truly_is(wire: Wire) -> None:
    until(lambda: wire.ask() is not None)
    alone = wire.picture()
    truth = publisher(wire.cockpit, "truth", "right")
    names = tuple(joint.name for joint in MACHINE.joints)
    base = np.array([308609.5, 4129949.5, 0.0])
    state = TrueState("right", 0.0, 0.0, names, Q, 0.0 * Q, base, np.pi, 0.0, 0.0, 0.0, 0.0)

    def seen() -> bool:
        truth.put(encode_truth(state))
        return bool((np.abs(wire.picture() - alone).max(axis=-1) > 40).mean() > 0.01)

    until(seen)
    # Silent for a second: nobody knows where it is, so it is not drawn.
    until(lambda: bool((np.abs(wire.picture() - alone).max(axis=-1) > 40).mean() < 0.002))


def test_pictures_survive_the_wire_and_nothing_else_passes_for_one() -> None:
    stamp, jpeg = decode_picture(encode_picture(12.5, "left", b"\xff\xd8\xff123"))
    assert (stamp, jpeg) == (12.5, b"\xff\xd8\xff123")
    for payload in (b"", b"\0\1\0\0junk", encode_clock(1.0), encode_picture(1.0, "x", b"GIF89a")):
        with pytest.raises(DecodeError):
            decode_picture(payload)


def test_who_walks_on_the_site_is_in_the_picture_at_that_time(wire: Wire) -> None:
    ahead = Person(name="ann", path=((308607.0, 4129954.0), (308607.0, 4129944.0)), speed=1.0)
    pictures = []
    for people in ((), (ahead,)):
        camera = CabCamera(
            *(wire.machine, replace(SITE, people=people), "left", MACHINE, wire.state),
            *(lambda: False, None, lambda stamp: stamp - wire.stamp + 3.0),
        )
        pictures.append(Image.open(io.BytesIO(camera._picture(*wire.state()))))
        camera.close()
    changed = (
        np.abs(np.asarray(pictures[0]).astype(int) - np.asarray(pictures[1])).max(axis=-1) > 40
    )
    assert 100 < changed.sum() < 8000
