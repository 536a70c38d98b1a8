"""Looking into a scene's server, for the views' tests."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable

import viser
from viser import _messages


def handle(server: viser.ViserServer, name: str) -> viser.SceneNodeHandle:
    found = server.scene.get_handle_by_name(name)
    assert found is not None, name
    return found


def counted(server: viser.ViserServer, act: Callable[[], object]) -> Counter[str]:
    """Messages queued for all browsers while `act` runs, by type."""
    sent: Counter[str] = Counter()
    plain = server._websock_server.queue_message

    def queue(message: _messages.Message) -> None:
        sent[type(message).__name__] += 1
        plain(message)

    server._websock_server.queue_message = queue  # type: ignore[method-assign]
    act()
    server._websock_server.queue_message = plain  # type: ignore[method-assign]
    return sent


def until(true: Callable[[], bool], seconds: float = 5.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end and not true():
        time.sleep(0.02)
    return true()
