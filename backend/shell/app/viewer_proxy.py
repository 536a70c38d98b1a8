"""The 3D scene under the page's own origin: its client page and its websocket, let through.

The scene's server listens on the loopback only and knows neither logins nor origins. Here every
request passes `allow` first, a websocket also needs an Origin of the same host, and what a browser
sends is filtered: whoever may only look sends where the camera is, whatever others may send.
A browser window that wants to be told apart uses /view/{page}/ with a token of its own; the client
then opens its websocket at /view/{page}.
"""

from __future__ import annotations

import asyncio
import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

import msgspec
from fastapi import APIRouter, HTTPException, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import RedirectResponse
from starlette.requests import HTTPConnection
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Subprotocol

from backend.control.person import Person

PAGE_TOKEN = re.compile(r"[A-Za-z0-9_-]{1,64}")
PROTOCOL = re.compile(r"viser-v[0-9A-Za-z.+-]{1,32}")
LONGEST = 64 * 1024  # [bytes] of a message from a browser
REFUSED, GONE = 1008, 1011  # websocket close codes
# What a window that only looks has to say: where its camera is, and a picture it was asked for.
VIEWING = frozenset({"ViewerCameraMessage"})
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' blob: data:; "
    "worker-src blob: data:; style-src 'unsafe-inline'; img-src 'self' data: blob:; "
    "font-src data:; connect-src 'self' data: blob:; frame-ancestors 'self'; base-uri 'none'; "
    "form-action 'none'"
)
STARTING = (
    '<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0.5">'
    "<style>body{background:#15181c;color:#9aa4ae;font:14px sans-serif;padding:1em}</style>"
    "<title>3D scene</title><p>The 3D scene is starting …"
)
STARTING_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
}


def only_looks(connection: HTTPConnection) -> bool:
    """Whether who is there is signed in as a viewer."""
    person = getattr(connection.state, "person", None)
    return isinstance(person, Person) and not person.may_drive


def views_only(message: bytes) -> bool:
    """True for the messages of a window that only looks; False for anything else or malformed."""
    try:
        kind = msgspec.msgpack.decode(message, type=_Kind).type
    except (msgspec.DecodeError, msgspec.ValidationError):
        return False
    return kind in VIEWING


class _Kind(msgspec.Struct):
    type: str


def _anyone(_: HTTPConnection) -> bool:
    return True


def _nothing(_page: str, _local_port: int) -> None:
    return None


@dataclass(frozen=True)
class Hooks:
    """What the proxy asks and tells.

    allow: may this request or websocket see the scene; may_send: may this message of a browser
    pass, a viewer's only if it is of `VIEWING`, too; opened, closed: page token and the local TCP
    port of its connection to the scene's server.
    """

    allow: Callable[[HTTPConnection], bool] = _anyone
    may_send: Callable[[bytes], bool] = views_only
    opened: Callable[[str, int], None] = _nothing
    closed: Callable[[str, int], None] = _nothing


def viewer_router(port: Callable[[], int | None], hooks: Hooks, head: str = "") -> APIRouter:
    """Routes GET /view/, GET /view/{page}/ and websockets /view, /view/{page}.

    port: where the scene's server listens on 127.0.0.1, asked for each time; None while it starts,
    then a page that asks again by itself stands there;
    head: HTML put at the start of the client page's head.
    """
    router = APIRouter(include_in_schema=False)
    cached: dict[int, tuple[bytes, str]] = {}

    async def client_page(request: Request, page: str = "") -> Response:
        if not hooks.allow(request):
            raise HTTPException(403, "not allowed to see the scene")
        if page and not PAGE_TOKEN.fullmatch(page):
            raise HTTPException(404, "no such page")
        upstream = port()
        if upstream is None:
            return Response(STARTING, 202, media_type="text/html", headers=STARTING_HEADERS)
        if upstream not in cached:
            html = await _fetch(upstream, head)
            cached.clear()
            cached[upstream] = html, f'"{hashlib.sha256(html).hexdigest()[:32]}"'
        html, etag = cached[upstream]
        headers = {
            "ETag": etag,
            "Cache-Control": "private, no-cache",
            "Content-Security-Policy": POLICY,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "same-origin",
        }
        if request.headers.get("if-none-match") == etag:
            return Response(status_code=304, headers=headers)
        return Response(html, media_type="text/html; charset=utf-8", headers=headers)

    async def scene_socket(websocket: WebSocket, page: str = "") -> None:
        protocol = _protocol(websocket)
        known = not page or PAGE_TOKEN.fullmatch(page)
        if not (same_host(websocket) and known and protocol and hooks.allow(websocket)):
            await websocket.close(REFUSED)  # before accept: the handshake is answered with 403
            return
        upstream = port()
        if upstream is None:
            await websocket.close(GONE)
            return
        try:
            connection = await connect(
                f"ws://127.0.0.1:{upstream}",
                subprotocols=[Subprotocol(protocol)],
                compression=None,
                max_size=None,
                max_queue=2,  # a slow browser must slow the server, which then skips updates
                proxy=None,
            )
        except (OSError, InvalidHandshake, TimeoutError):
            await websocket.close(GONE)
            return
        local_port = connection.local_address[1]
        hooks.opened(page, local_port)
        try:
            await websocket.accept(subprotocol=protocol)
            await _relay(websocket, connection, _filter(websocket, hooks))
        finally:
            hooks.closed(page, local_port)
            await connection.close()

    def with_slash(request: Request) -> Response:
        return RedirectResponse(str(request.url.replace(path=request.url.path + "/")), 307)

    router.add_api_route("/view", with_slash, methods=["GET"])
    router.add_api_route("/view/", client_page, methods=["GET"])
    router.add_api_route("/view/{page}/", client_page, methods=["GET"])
    router.add_api_websocket_route("/view", scene_socket)
    router.add_api_websocket_route("/view/{page}", scene_socket)
    return router


def same_host(connection: HTTPConnection) -> bool:
    """True if the Origin header names the host and port that were asked for. No Origin: False."""
    origin = urlsplit(connection.headers.get("origin", ""))
    host = connection.headers.get("host", "")
    return origin.scheme in ("http", "https") and bool(host) and origin.netloc == host


def _protocol(websocket: WebSocket) -> str | None:
    """The scene client's subprotocol "viser-v<version>" among the offered ones."""
    offered = [str(name) for name in websocket.scope.get("subprotocols", [])]
    return next((name for name in offered if PROTOCOL.fullmatch(name)), None)


async def _fetch(port: int, head: str) -> bytes:
    """The client page (one file with everything in it), `head` added."""
    import httpx

    try:
        async with httpx.AsyncClient(trust_env=False, timeout=10.0) as client:
            answer = await client.get(f"http://127.0.0.1:{port}/")
            answer.raise_for_status()
    except httpx.HTTPError as error:
        raise HTTPException(503, "the 3D scene is not running") from error
    return answer.content.replace(b"<head>", b"<head>" + head.encode(), 1)


def _filter(websocket: WebSocket, hooks: Hooks) -> Callable[[bytes], bool]:
    if only_looks(websocket):
        return lambda message: views_only(message) and hooks.may_send(message)
    return hooks.may_send


async def _relay(
    websocket: WebSocket, connection: ClientConnection, may_send: Callable[[bytes], bool]
) -> None:
    """Both ways until one side ends."""
    ways = [
        asyncio.create_task(_to_browser(websocket, connection)),
        asyncio.create_task(_from_browser(websocket, connection, may_send)),
    ]
    try:
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, return_exceptions=True)
    try:
        await websocket.close(GONE if connection.close_code is not None else 1000)
    except (RuntimeError, WebSocketDisconnect):
        return  # the browser was the one that left


async def _to_browser(websocket: WebSocket, connection: ClientConnection) -> None:
    try:
        async for message in connection:
            await websocket.send_bytes(message if isinstance(message, bytes) else message.encode())
    except (ConnectionClosed, WebSocketDisconnect, RuntimeError):
        return


async def _from_browser(
    websocket: WebSocket, connection: ClientConnection, may_send: Callable[[bytes], bool]
) -> None:
    try:
        while True:
            message = await websocket.receive_bytes()
            if len(message) <= LONGEST and may_send(message):
                await connection.send(message)
    except (ConnectionClosed, WebSocketDisconnect, RuntimeError, KeyError):
        return
