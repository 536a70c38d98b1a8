"""How one backend is started."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Options:
    """host, port: of the page; listen, connect: Zenoh endpoints; own: machines answered for;
    recording: whether; record: in which folder, None for the site's own; link_config: a Zenoh
    configuration file; metrics_token: for GET /metrics, empty for none."""

    host: str
    port: int
    listen: tuple[str, ...]
    connect: tuple[str, ...]
    own: tuple[str, ...]
    mode: str
    record: Path | None = None
    recording: bool = True
    link_config: Path | None = None
    metrics_token: str = ""
