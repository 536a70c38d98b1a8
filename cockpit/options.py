"""How one backend is started."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cockpit.entry import Entry


@dataclass(frozen=True)
class Options:
    """host, port: of the page; listen, connect: Zenoh endpoints; own: machines answered for;
    recording: whether; record: in which folder, None for the site's own; entry: who gets in;
    link_config: a Zenoh configuration file."""

    entry: Entry
    port: int
    listen: tuple[str, ...]
    connect: tuple[str, ...]
    own: tuple[str, ...]
    mode: str
    record: Path | None = None
    recording: bool = True
    link_config: Path | None = None
