"""The document of a session, for its page and its report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from backend.pipeline.config import Config
from backend.shell.session.cycles import Topics, problems
from backend.shell.session.reader import Session


class SeenSession(Protocol):
    """A session as seen on a site."""

    @property
    def session(self) -> Session: ...

    @property
    def config(self) -> Config: ...

    @property
    def topics(self) -> Topics: ...


def session_document(
    seen: SeenSession, sources: Sequence[str], index: dict[str, Any], events: list[dict[str, Any]]
) -> dict[str, Any]:
    """What backend.documents.session.SessionDocument describes."""
    session = seen.session
    header = session.headers[0] if session.headers else None
    begin = session.begin
    return {
        "title": session.title,
        "begin": begin / 1e9,
        "duration": (session.end - begin) / 1e9,
        "machines": list(seen.config.machines),
        "origin": header.origin if header else "other",
        "note": header.note if header else "",
        "parts": [
            {
                "name": part.path.name,
                "begin": (part.begin - begin) / 1e9,
                "end": (part.end - begin) / 1e9,
            }
            for part in session.parts
        ],
        "topics": {
            topic: {"type": info.type, "count": info.count}
            for topic, info in session.topics.items()
        },
        "problems": list(dict.fromkeys([*session.notes, *problems(session, seen.topics)])),
        "sources": list(sources),
        "index": index,
        "events": events,
    }
