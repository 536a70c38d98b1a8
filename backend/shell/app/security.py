"""Headers of every answer that tell the browser what it must not do."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

PAGE_POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self'; script-src 'self'; "
    "connect-src 'self'{streams}; frame-src 'self'; frame-ancestors 'self'; base-uri 'none'; "
    "form-action 'self'"
)
ALWAYS = {
    "X-Content-Type-Options": "nosniff",
    # Not "no-referrer": with that, browsers hide the origin of a form's POST from us, too.
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "gamepad=(self), camera=(), geolocation=(), microphone=()",
    "Content-Security-Policy": "frame-ancestors 'self'; base-uri 'none'; object-src 'none'",
}
HSTS = "max-age=31536000"
PAGES = ("/", "/login")


class SecurityHeaders:
    """ASGI middleware; what a route set itself stays. https: whether pages come over HTTPS;
    streams: origins of other servers that the page may ask for a camera's stream.
    """

    def __init__(self, app: ASGIApp, https: bool, streams: tuple[str, ...] = ()) -> None:
        self._app, self._https = app, https
        self._policy = page_policy(streams)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        path = scope["path"]

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if path in PAGES or path.startswith("/static/"):
                    headers.setdefault("Content-Security-Policy", self._policy)
                    headers.setdefault("Cache-Control", "no-cache")
                for name, value in ALWAYS.items():
                    headers.setdefault(name, value)
                if self._https and not _localhost(scope):
                    headers.setdefault("Strict-Transport-Security", HSTS)
            await send(message)

        await self._app(scope, receive, with_headers)


def page_policy(streams: tuple[str, ...] = ()) -> str:
    """The Content-Security-Policy of pages. streams: see SecurityHeaders."""
    return PAGE_POLICY.format(streams="".join(f" {origin}" for origin in streams))


def _localhost(scope: Scope) -> bool:
    """The name "localhost" belongs to every program on a computer, not to this one alone."""
    host = next((value for name, value in scope["headers"] if name == b"host"), b"")
    return bool(host.partition(b":")[0].lower() == b"localhost")
