"""Driving in one running cockpit: its seats, leases and outlets on an open session."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from backend.control.lease import TERM, Answer, Request
from backend.pipeline.config import Config
from backend.shell.driving.driving import Driving, Event
from backend.shell.driving.follows import Plans
from backend.shell.driving.leases import Leases
from backend.shell.driving.methods import Methods
from backend.shell.driving.outlet import Outlet
from backend.shell.link.asking import ask
from backend.shell.link.codec import DecodeError
from backend.shell.link.lease_codec import decode_answer, encode_request
from backend.shell.link.receiver import Receiver
from backend.site.site import Site


def make_driving(
    site: Site, config: Config, session: Any, receiver: Receiver, event: Event, plans: Plans
) -> Driving:
    """For the machines that this cockpit answers for. event, plans: see backend.shell.driving."""
    prefixes = {machine.name: machine.prefix for machine in site.machines}
    machines = {name: config.machines[name] for name in config.own}
    outlets = {
        name: Outlet(session, name, prefixes[name], machine, time.monotonic)
        for name, machine in machines.items()
    }

    def asking(name: str, request: Request, told: Callable[[Answer | None], None]) -> None:
        answers: list[Answer] = []

        def on_answer(payload: bytes) -> None:
            try:
                answers.append(decode_answer(payload))
            except DecodeError:
                return

        def on_end() -> None:
            told(answers[0] if answers else None)

        ask(session, "lease", prefixes[name], encode_request(request), on_answer, on_end, TERM)

    leases = Leases(asking, time.monotonic)
    methods = Methods(config)
    return Driving(machines, outlets, leases, receiver.statuses, methods, event, plans=plans)
