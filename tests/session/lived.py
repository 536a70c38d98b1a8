"""A recorded session and what was concluded of it live."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.shell.session.cycles import Topics
from backend.shell.session.reader import open_session
from backend.shell.session.writer import SessionWriter
from backend.site.site import Site


@dataclass(frozen=True)
class Lived:
    """A recorded session and what the live pipeline concluded, cycle by cycle."""

    path: Path
    site: Site
    config: Config
    topics: Topics
    snapshots: list[Snapshot]


def without(path: Path, lived: Lived, *topics: str) -> Path:
    """The session without some topics, written to `path`."""
    session = open_session(lived.path)
    writer = SessionWriter(path, session.headers[0])
    for message in session.messages():
        if message.topic not in topics:
            writer.write(message)
    writer.close()
    return path
