"""Questions to machines: what the topic table calls queryable."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import zenoh

from backend.shell.link.session import zenoh_congestion, zenoh_priority
from backend.shell.link.topics import key, topic


def ask(
    session: Any,
    name: str,
    machine: str,
    payload: bytes | None,
    on_answer: Callable[[bytes], None],
    on_end: Callable[[], None] = lambda: None,
    timeout: float = 1.0,
    **fields: str,
) -> None:
    """Asks the row `name` of a machine (its key prefix). Returns at once.

    on_answer: called with each answer; on_end: called once, when no more answers can come; both in
    a thread of Zenoh's. timeout [s]; fields: the row's other one. Raises zenoh.ZError when the
    session is closed.
    """
    row = topic(name)

    def on_reply(reply: Any) -> None:
        if reply.ok is not None and len(reply.ok.payload) <= row.max_bytes:
            on_answer(reply.ok.payload.to_bytes())

    session.get(
        key(name, machine, **fields),
        zenoh.handlers.Callback(on_reply, on_end),
        payload=payload,
        timeout=timeout,
        priority=zenoh_priority(row),
        congestion_control=zenoh_congestion(row),
        express=row.express,
    )
