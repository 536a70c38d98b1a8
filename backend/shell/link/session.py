"""Zenoh sessions: opening them, and publishing by the rows of the topic table."""

from __future__ import annotations

import json
import re
import socket
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import zenoh

from backend.errors import InputError
from backend.shell.link.link_config import check_partners, read_config, stated
from backend.shell.link.topics import Topic, key, topic

MODES = ("peer", "router", "client")
BURST = 16
PROTOCOLS = ("tcp", "tls", "quic", "ws", "udp")
_ENDPOINT = re.compile(rf"({'|'.join(PROTOCOLS)})/(\[[0-9a-fA-F:.]+\]|[^\s/:#?]+):(\d+)([?#]\S*)?")


def check_endpoint(endpoint: str, field: str = "endpoint") -> str:
    """`endpoint` if it reads like tcp/127.0.0.1:7447, else InputError."""
    found = _ENDPOINT.fullmatch(endpoint)
    if found is None or int(found[3]) > 65535:
        raise InputError(
            f"{field}: {endpoint!r} is not an endpoint; allowed is PROTOCOL/HOST:PORT, "
            f"such as tcp/127.0.0.1:7447, with a protocol of {', '.join(PROTOCOLS)}"
        )
    return endpoint


def with_port(endpoint: str) -> str:
    """`endpoint` with a free port in the place of port 0, so that others can be told of it."""
    found = _ENDPOINT.fullmatch(check_endpoint(endpoint))
    if found is None or int(found[3]) != 0:
        return endpoint
    family = socket.AF_INET6 if found[2].startswith("[") else socket.AF_INET
    with socket.socket(family) as probe:
        probe.bind((found[2].strip("[]"), 0))
        port = probe.getsockname()[1]
    return f"{found[1]}/{found[2]}:{port}{found[4] or ''}"


def open_session(
    listen: Iterable[str] = (),
    connect: Iterable[str] = (),
    mode: str = "peer",
    config_file: Path | None = None,
) -> Any:
    """An open zenoh.Session that listens on and connects to the given endpoints only.

    mode: "peer" talks to whom it is connected; "router" also passes on between its neighbours, as
    a backend does that shares its machines with others; "client" is passed on to by a router, which
    for peers it is not. Nothing is searched for by multicast.
    Endpoints in `connect` may be absent: they are tried again until they are there. config_file: a
    Zenoh configuration that holds where nothing is said here: keys, access control, and endpoints
    where none are given. Raises InputError for malformed endpoints, for addresses that cannot be
    listened on, and for a configuration or certificates that cannot be used.
    """
    if mode not in MODES:
        raise InputError(f"mode: {mode!r} is not a mode; allowed are {', '.join(MODES)}")
    wanted = [check_endpoint(endpoint, "listen") for endpoint in listen]
    others = [check_endpoint(endpoint, "connect") for endpoint in connect]
    settings: dict[str, object] = {
        "mode": mode,
        "listen/endpoints": wanted,
        "connect/endpoints": others,
        "connect/timeout_ms": -1,  # try for ever, in the background
        "connect/exit_on_failure": False,
        "connect/retry": {
            "period_init_ms": 200,
            "period_max_ms": 1000,
            "period_increase_factor": 2,
        },
        "scouting/multicast/enabled": False,
        "scouting/delay": 0,  # nothing to wait for: partners are named
        # Express messages take a batch each: room for a radio's burst (Sun's has 13) before any is
        # dropped, when this computer is too busy to send at once. 16 is the most Zenoh allows.
        "transport/link/tx/queue/size/real_time": BURST,
        "transport/link/tx/queue/size/interactive_high": BURST,
        "transport/link/tx/queue/size/interactive_low": BURST,
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 5_000,  # [us]
        "timestamping/enabled": False,  # the messages carry the machines' own stamps
    }
    config = zenoh.Config() if config_file is None else read_config(config_file)
    if config_file is not None:
        for side, given in (("listen", wanted), ("connect", others)):
            if not given:
                del settings[f"{side}/endpoints"]
                given += [check_endpoint(e, f"{config_file}: {side}") for e in stated(config, side)]
        check_partners(config_file, config, others)
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise InputError(_reason(str(error), wanted)) from None


def _reason(message: str, listen: list[str]) -> str:
    where = ", ".join(listen) or "no address"
    if "already in use" in message:
        return f"listen: {where} is taken by another program; choose another port, or 0 for any"
    if "lookup" in message or "not known" in message or "assign requested" in message:
        return f"listen: {where} is not an address of this computer"
    return f"listen: {where} cannot be opened: {message.split(' at /')[0]}"


def publisher(session: Any, name: str, machine: str = "", **fields: str) -> Any:
    """A zenoh publisher for the row `name` of the topic table. machine: its key prefix."""
    row = topic(name)
    if row.queryable:
        raise ValueError(f"{name} is asked for, not published")
    return session.declare_publisher(
        key(name, machine, **fields),
        priority=zenoh_priority(row),
        congestion_control=zenoh_congestion(row),
        express=row.express,
    )


def zenoh_priority(row: Topic) -> Any:
    return getattr(zenoh.Priority, row.priority.value)


def zenoh_congestion(row: Topic) -> Any:
    return getattr(zenoh.CongestionControl, row.congestion.value)
