"""The gate before every route: nothing behind it answers to somebody who is not signed in.

It stands before the routes and knows none of them: a new route is closed until somebody opens it.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any
from urllib.parse import parse_qsl, urlencode

from fastapi.responses import JSONResponse, RedirectResponse
from starlette.requests import HTTPConnection, Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from backend.control.person import Person
from backend.shell.access.access import Access
from backend.shell.access.rules import (
    LOGIN_PAGE,
    METRICS,
    READS,
    needed_role,
    same_origin,
    suffices,
)
from backend.shell.app.login import address_of, cookie_to

REFUSED, SIGNED_OUT = 1008, 4401  # websocket close codes
LOOK_AGAIN = 1.0  # how often an open websocket's session is looked at [s]


class Gate:
    """ASGI middleware. What is let through has `state.person`, a Person, or None where open."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app, self._access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            await self._request(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _request(self, scope: Scope, receive: Receive, send: Send) -> None:
        request = Request(scope)
        person = self._access.identify(request)
        scope.setdefault("state", {})["person"] = person
        answer = self._link(request, person) or self._refusal(request, person)
        await (answer or self._app)(scope, receive, send)

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        connection = HTTPConnection(scope)
        person = self._access.identify(connection)
        if person is None or not from_here(connection):
            if person is not None:
                self._note(person, connection, "WEBSOCKET", "from another origin")
            await send({"type": "websocket.close", "code": REFUSED})  # the handshake fails: 403
            return
        scope.setdefault("state", {})["person"] = person
        watch = asyncio.create_task(self._watch(connection, person, send))
        try:
            await self._app(scope, receive, send)
        finally:
            watch.cancel()
            await asyncio.gather(watch, return_exceptions=True)

    async def _watch(self, connection: HTTPConnection, person: Person, send: Send) -> None:
        """An open page keeps its session; when that ends, or the role is another, so does it."""
        while self._access.identify(connection) == person:
            await asyncio.sleep(LOOK_AGAIN)
        closing: Message = {"type": "websocket.close", "code": SIGNED_OUT, "reason": "signed out"}
        with contextlib.suppress(RuntimeError, OSError):  # it has not begun yet, or is gone
            await send(closing)

    def _link(self, request: Request, person: Person | None) -> Response | None:
        """The answer to a one-time link: a session, and the same page without the token."""
        if request.method != "GET" or request.url.path != "/":
            return None
        query = parse_qsl(request.url.query, keep_blank_values=True)
        tokens = [value for name, value in query if name == "token"]
        if not tokens or self._access.everybody is not None:
            return None
        rest = urlencode([(name, value) for name, value in query if name != "token"])
        done = self._access.follow_link(tokens[0], address_of(request))
        if done.token is None and person is None:
            return _elsewhere(f"{LOGIN_PAGE}?link=used")
        answer = _elsewhere(f"/?{rest}" if rest else "/")
        if done.token is not None:
            cookie_to(answer, self._access, done.token)
        return answer

    def _refusal(self, request: Request, person: Person | None) -> Response | None:
        """Why a request ends here; None when it may pass."""
        method, path = request.method, request.url.path
        if method not in READS and not from_here(request):
            if person is not None:
                self._note(person, request, method, "from another origin")
            return _no(403, "this request comes from another site's page")
        needed = needed_role(method, path)
        if needed is None or self._metrics(request):
            return None
        if person is None:
            page = method == "GET" and "text/html" in request.headers.get("accept", "")
            return _elsewhere(LOGIN_PAGE) if page else _no(401, "not signed in: see /login")
        if not suffices(person.role, needed):
            self._note(person, request, method, f"needs the role {needed}")
            detail = f"this needs the role {needed}; {person.who} is signed in as {person.role}"
            return _no(403, detail)
        return None

    def _metrics(self, request: Request) -> bool:
        authorization = request.headers.get("authorization")
        return (
            request.url.path == METRICS
            and request.method in READS
            and self._access.reads_metrics(authorization)
        )

    def _note(self, person: Person, connection: HTTPConnection, method: str, why: str) -> None:
        details: dict[str, Any] = {"method": method, "path": connection.url.path[:200], "why": why}
        details |= {"role": person.role, "address": address_of(connection)}
        self._access.audit("refused", person.who, details)


def from_here(connection: HTTPConnection) -> bool:
    """Whether it comes from a page of this server, or from no page at all."""
    headers = connection.headers
    if headers.get("sec-fetch-site") in ("cross-site", "same-site"):
        return False
    secure = connection.scope["scheme"] in ("https", "wss")
    return same_origin(headers.get("origin"), headers.get("host", ""), secure)


def _no(status: int, detail: str) -> Response:
    return JSONResponse({"detail": detail}, status, headers={"Cache-Control": "no-store"})


def _elsewhere(path: str) -> Response:
    return RedirectResponse(path, 303, headers={"Cache-Control": "no-store"})
