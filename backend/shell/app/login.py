"""Signing in and out, and who is signed in."""

from __future__ import annotations

import asyncio
import html
import json
import math
from pathlib import Path
from urllib.parse import parse_qsl

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse, JSONResponse, RedirectResponse
from pydantic import ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection

from backend.documents.access import EntranceDocument, LoginRequest, MeDocument
from backend.shell.access.access import Access, SignIn
from backend.shell.access.rules import LOGIN, LOGIN_PAGE

LONGEST = 8192  # of a request to sign in [bytes]
FORM = "application/x-www-form-urlencoded"
NO_STORE = {"Cache-Control": "no-store"}


def login_router(access: Access, page: Path) -> APIRouter:
    """Routes /login, /api/login, /api/logout, /api/me. page: the file of the login page."""
    router = APIRouter(tags=["access"])
    turn = asyncio.Semaphore(1)

    @router.get(LOGIN_PAGE, include_in_schema=False)
    def login_page(request: Request) -> Response:
        if access.everybody is not None:
            return RedirectResponse("/", 303, headers=NO_STORE)
        words = ""
        if "link" in request.query_params:
            words = "This link was used already, or is too old."
        return _page(access, page, request, words)

    @router.get(LOGIN, responses={200: {"model": EntranceDocument}})
    def entrance(request: Request) -> Response:
        """How one signs in here, and who is signed in already."""
        return JSONResponse(access.entrance(request).model_dump(), headers=NO_STORE)

    @router.post(
        LOGIN,
        status_code=200,
        responses={200: {"model": MeDocument}, 401: {}, 422: {}, 429: {}},
        openapi_extra={
            "requestBody": {
                "required": True,
                "content": {
                    kind: {"schema": LoginRequest.model_json_schema()}
                    for kind in ("application/json", FORM)
                },
            }
        },
    )
    async def login(request: Request) -> Response:
        """Sign in with name and password, as JSON or as a form; the answer sets a cookie."""
        kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        form = kind == FORM
        asked = _read(await _body(request), form)
        if asked is None:
            words = "name and password are needed, as JSON or as a form"
            return JSONResponse({"detail": words}, 422, headers=NO_STORE)
        address = address_of(request)
        async with turn:  # who waits here takes no thread from the other routes
            done = await run_in_threadpool(access.sign_in, asked.name, asked.password, address)
        if done.token is None:
            return _refused(access, page, request, done, form)
        # Whoever was signed in here before.
        await run_in_threadpool(access.sign_out, request, address)
        answer: Response = RedirectResponse("/", 303, headers=NO_STORE)
        if not form:
            answer = JSONResponse({"who": asked.name}, headers=NO_STORE)
        cookie_to(answer, access, done.token)
        return answer

    @router.post("/api/logout", status_code=204)
    def logout(request: Request) -> Response:
        """Sign out. A form's answer leads to the login page."""
        access.sign_out(request, address_of(request))
        answer = Response(status_code=204, headers=NO_STORE)
        if request.headers.get("content-type", "").startswith(FORM):
            answer = RedirectResponse(LOGIN_PAGE, 303, headers=NO_STORE)
        answer.delete_cookie(
            access.cookie, path="/", secure=access.https, httponly=True, samesite="strict"
        )
        return answer

    @router.get("/api/me", responses={200: {"model": MeDocument}})
    def me(request: Request) -> Response:
        """Who is signed in here, and what they may do."""
        found = access.me(request)
        if found is None:
            return JSONResponse({"detail": "not signed in: see /login"}, 401, headers=NO_STORE)
        return JSONResponse(found.model_dump(), headers=NO_STORE)

    return router


def cookie_to(answer: Response, access: Access, token: str) -> None:
    """Gives a browser its session. SameSite=Strict: no other site's page or link carries it."""
    answer.set_cookie(
        access.cookie,
        token,
        max_age=int(access.sessions.absolute),
        path="/",
        secure=access.https,
        httponly=True,
        samesite="strict",
    )


def address_of(connection: HTTPConnection) -> str:
    """The other end's address, as the socket has it. What headers say is not believed."""
    return "" if connection.client is None else connection.client.host


def _refused(access: Access, page: Path, request: Request, done: SignIn, form: bool) -> Response:
    status, headers = 401, dict(NO_STORE)
    if done.wait > 0.0:
        status, headers["Retry-After"] = 429, str(math.ceil(done.wait))
    if form:
        return _page(access, page, request, done.words, status, headers)
    return JSONResponse({"detail": done.words}, status, headers=headers)


def _page(
    access: Access,
    page: Path,
    request: Request,
    words: str,
    status: int = 200,
    headers: dict[str, str] = NO_STORE,
) -> Response:
    """The login page with what it has to say; it works without any script."""
    entrance = access.entrance(request)
    ways = [way for way in ("passwords", "link") if getattr(entrance, way)]
    if entrance.who is not None:
        ways = ["inside"]
    text = page.read_text(encoding="utf-8")
    text = text.replace('data-ways=""', f'data-ways="{" ".join(ways)}"')
    text = text.replace("<!-- who -->", html.escape(entrance.who or ""))
    return HTMLResponse(text.replace("<!-- words -->", html.escape(words)), status, headers)


async def _body(request: Request) -> bytes:
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > LONGEST:
            return b""
    return body


def _read(body: bytes, form: bool) -> LoginRequest | None:
    try:
        text = body.decode()
        fields = dict(parse_qsl(text, keep_blank_values=True)) if form else json.loads(text)
        return LoginRequest.model_validate(fields)
    except (ValueError, ValidationError, RecursionError):
        return None
