"""Small recordings for tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from backend.shell.link.encode import encode_fix, encode_joint_states, encode_status
from backend.shell.link.messages import AgentStatus
from backend.shell.session.format import CYCLE, MARKER, Header, Message, dumps, stamp

OFFSET = 1_790_000_000_123_456_789


def header(part: int = 0, **changes: object) -> Header:
    values = {
        "offset": OFFSET,
        "recording": "20261125T120000",
        "part": part,
        "site_file": "demo.toml",
        "site": "name = 'demo'",
        "own": "left,right",
        "origin": "demo",
        "software": "0.1.0",
        **changes,
    }
    return Header(**values)  # type: ignore[arg-type]


def messages(cycles: int, seed: int = 0) -> Iterator[Message]:
    """As live: joints, positions, a status and a cycle, every 20 ms."""
    rng = np.random.default_rng(seed)
    names = ["swing", "boom", "stick", "bucket"]
    for cycle in range(cycles):
        now = 1234.5 + 0.02 * cycle + float(rng.uniform(0, 1e-3))
        time = stamp(now, OFFSET)
        for machine in ("left", "right"):
            joints = encode_joint_states(now, names, rng.normal(size=4), np.zeros(4))
            yield Message(f"/{machine}/joint_states", time - 500, joints)
            fix = encode_fix(now, 37.3, 126.8, 31.0 + rng.normal(), np.eye(3) * 1e-4)
            yield Message(f"/{machine}/gnss/fix", time - 200, fix)
        if cycle % 5 == 0:
            status = AgentStatus("left", now, now, "program", "", 0, 0, -1.0, 1.0, 0, 0)
            yield Message("/left/status", time - 100, encode_status(status))
        if cycle % 50 == 7:
            yield Message(MARKER, time, dumps({"kind": "note", "text": f"größer {cycle}"}))
        yield Message(CYCLE, time, dumps({"cycle": cycle, "time": now, "lost": 0}))


def read(path: Path) -> list[Message]:
    """Through mcap's own reader, which needs a whole file with its summary."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        found = reader.iter_messages(log_time_order=False)
        return [Message(channel.topic, m.log_time, m.data) for _, channel, m in found]
