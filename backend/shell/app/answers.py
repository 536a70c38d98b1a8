"""What several routers say alike: who asks, and why something was refused."""

from __future__ import annotations

from fastapi import Request, Response

from backend.errors import InputError
from backend.shell.app.wire import dumps


def refused(error: InputError, status: int) -> Response:
    """The reason in words, as FastAPI's own refusals have it."""
    return Response(dumps({"detail": str(error)}), status, media_type="application/json")


def who(request: Request) -> str:
    """Who is signed in; nobody is known where nobody is asked."""
    person = getattr(request.state, "person", None)
    return "" if person is None else str(person.who)
